"""Export of lights, world and camera in Blender's units."""

import math

import bpy
import building
import numpy as np
import pytest

from espalier.errors import UnsupportedCameraError


@pytest.fixture(autouse=True)
def _square(scene):
    """Every test here starts from a scene with one square."""
    building.square()


def light(kind: str, **settings: object):
    """The export of one light."""
    data = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(data, name, value)
    holder = building.add("Light", data)
    holder.location = (1, 2, 3)
    (only,) = building.export().lights
    return only


def test_point():
    point = light("POINT", energy=100.0, color=(1, 0.5, 0.25), shadow_soft_size=0.5, use_shadow=False)
    assert (point.kind, point.power, point.color, point.radius) == ("point", 100.0, (1.0, 0.5, 0.25), 0.5)
    assert not point.shadow
    np.testing.assert_allclose(point.matrix[:3, 3], (1, 2, 3))


def test_sun_has_an_angle_and_watts_per_square_metre():
    sun = light("SUN", energy=3.0, angle=math.radians(2))
    assert (sun.kind, sun.power) == ("sun", 3.0)
    assert sun.angle == pytest.approx(math.radians(2))


def test_spot():
    spot = light("SPOT", spot_size=1.0, spot_blend=0.5, shadow_soft_size=0.25)
    assert (spot.kind, spot.spot_size, spot.spot_blend, spot.radius) == ("spot", 1.0, 0.5, 0.25)


@pytest.mark.parametrize(("shape", "size_y"), [("SQUARE", 2.0), ("DISK", 2.0), ("RECTANGLE", 0.5), ("ELLIPSE", 0.5)])
def test_area(shape, size_y):
    area = light("AREA", shape=shape, size=2.0, size_y=0.5)
    assert (area.kind, area.shape, area.size, area.size_y) == ("area", shape.lower(), 2.0, size_y)
    assert area.spread == pytest.approx(math.pi)


@pytest.mark.skipif(not hasattr(bpy.types.Light, "exposure") and bpy.app.version < (4, 5), reason="new in 4.5")
def test_exposure_normalize_and_temperature():
    bright = light("POINT", energy=10.0, exposure=2.0, normalize=False)
    assert bright.power == pytest.approx(40.0)
    assert not bright.normalize
    bpy.data.lights["Light"].use_temperature = True
    bpy.data.lights["Light"].temperature = 3000.0
    (warm,) = building.export().lights
    red, green, blue = warm.color
    assert red > green > blue


def test_an_emission_node_tints_a_light_and_other_nodes_warn():
    data = bpy.data.lights.new("Light", "POINT")
    data.energy = 10.0
    building.use_nodes(data)
    emission = next(node for node in data.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Color"].default_value = (0.5, 1, 1, 1)
    emission.inputs["Strength"].default_value = 3.0
    building.add("Light", data)
    (tinted,) = building.export().lights
    assert (tinted.power, tinted.color) == (30.0, (0.5, 1.0, 1.0))
    falloff = data.node_tree.nodes.new("ShaderNodeLightFalloff")
    data.node_tree.links.new(falloff.outputs[0], emission.inputs["Strength"])
    exported = building.export()
    assert exported.lights[0].power == 10.0
    assert [line for line in exported.warnings if "'Light': its nodes are ignored" in line]


def test_hidden_lights_are_left_out_and_instanced_ones_are_not(scene):
    data = bpy.data.lights.new("Light", "POINT")
    building.add("Hidden", data).hide_render = True
    inside = bpy.data.collections.new("Instanced")
    building.add("Inside", data, inside)
    empty = building.add("Empty")
    empty.instance_type, empty.instance_collection, empty.location.z = "COLLECTION", inside, 5.0
    (only,) = building.export().lights
    assert only.matrix[2, 3] == pytest.approx(5.0)


def world() -> bpy.types.World:
    """A new world with a Background node, set on the scene."""
    new = bpy.data.worlds.new("World")
    building.use_nodes(new)
    bpy.context.scene.world = new
    if not new.node_tree.nodes:
        background, output = (new.node_tree.nodes.new(f"ShaderNode{name}") for name in ("Background", "OutputWorld"))
        new.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    return new


def background(of: bpy.types.World) -> bpy.types.Node:
    """The Background node of a world."""
    return next(node for node in of.node_tree.nodes if node.type == "BACKGROUND")


def test_the_world_is_color_times_strength(scene):
    scene.world = None
    assert building.export().world == (0.0, 0.0, 0.0)
    node = background(world())
    node.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    node.inputs["Strength"].default_value = 2.0
    data = building.export()
    assert data.world == (1.0, 0.5, 0.25)
    assert data.warnings == ()


def test_a_world_image_is_its_mean_with_a_warning():
    new = world()
    texture = new.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = building.image("Sky", [[(1, 0, 0, 1), (3, 0, 0, 1)]], float_buffer=True, space="Linear Rec.709")
    new.node_tree.links.new(texture.outputs[0], background(new).inputs["Color"])
    data = building.export()
    np.testing.assert_allclose(data.world, (2, 0, 0), atol=1e-6)
    assert data.warnings == ("World 'World': its image is traced as the image's mean color",)


def test_a_varying_world_is_its_viewport_color_with_a_warning():
    new = world()
    new.color = (0.5, 0.25, 0.125)
    sky = new.node_tree.nodes.new("ShaderNodeTexNoise")
    new.node_tree.links.new(sky.outputs[0], background(new).inputs["Color"])
    data = building.export()
    assert data.world == (0.5, 0.25, 0.125)
    assert data.warnings == ("World 'World': a varying color is traced as the world's viewport color",)


def test_a_perspective_camera(scene):
    building.camera(
        lens=35.0, sensor_width=30.0, sensor_height=20.0, sensor_fit="VERTICAL", shift_x=0.25, clip_end=50.0
    )
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 333, 111, 50
    scene.render.pixel_aspect_x = 2.0
    camera = building.export().camera
    assert (camera.kind, camera.lens, camera.sensor_width, camera.sensor_height) == ("perspective", 35.0, 30.0, 20.0)
    assert (camera.sensor_fit, camera.shift, camera.resolution) == ("vertical", (0.25, 0.0), (166, 55))
    assert (camera.pixel_aspect, camera.border) == ((2.0, 1.0), None)
    assert camera.clip == pytest.approx((0.1, 50.0))


def test_an_orthographic_camera_without_its_scale(scene):
    building.camera(type="ORTHO", ortho_scale=3.0).scale = (2, 2, 2)
    camera = building.export().camera
    assert (camera.kind, camera.ortho_scale) == ("orthographic", 3.0)
    np.testing.assert_allclose(camera.matrix[:3, :3], np.eye(3), atol=1e-6)


def test_a_panoramic_camera_is_a_named_error():
    building.camera(type="PANO")
    with pytest.raises(
        UnsupportedCameraError, match=r"'Camera' is panoramic, .*set Lens > Type to Perspective or Orthographic"
    ):
        building.export()


def test_the_render_region(scene):
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    assert building.export().camera.border == (0.25, 0.5, 0.75, 1.0)
    assert building.export(border=False).camera.border is None


def test_depth_of_field_and_motion_blur_warn(scene):
    building.camera().data.dof.use_dof = True
    scene.render.use_motion_blur = True
    assert building.export().warnings == ("Camera 'Camera': depth of field is ignored", "Motion blur is ignored")


def test_a_resolution_replaces_the_scenes(scene):
    scene.render.resolution_percentage = 25
    assert building.export(resolution=(64, 48)).camera.resolution == (64, 48)
