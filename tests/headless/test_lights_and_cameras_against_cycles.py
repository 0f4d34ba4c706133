"""Pictures beside those that the Cycles at hand renders of the same scene: cameras, lights, world, textures, mirrors.

Cycles renders what the core does: direct light and mirrors, a box filter of one pixel, no clamping and no denoising.
"""

import math
from collections.abc import Callable
from pathlib import Path

import bpy
import building
import numpy as np
import pytest
from mathutils import Matrix

from espalier import native

SAMPLES = 64


@pytest.fixture
def pictures(scene, tmp_path) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """Renders the scene both ways: our (h, w, 3) colours and those of Cycles."""
    _set_up_cycles(scene)
    return lambda: (_ours(), _of_cycles(scene, tmp_path / "cycles.exr"))


def _set_up_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    settings = {
        "device": "CPU",
        "samples": SAMPLES,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "max_bounces": 4,
        "diffuse_bounces": 0,
        "glossy_bounces": 4,
        "pixel_filter_type": "BOX",
        "light_sampling_threshold": 0.0,
        "sample_clamp_direct": 0.0,
        "sample_clamp_indirect": 0.0,
        "blur_glossy": 0.0,
    }
    for name, value in settings.items():
        setattr(scene.cycles, name, value)


def _ours() -> np.ndarray:
    data = building.export()
    handles = native.handles(data)
    module = native.module()
    accelerator = module.Accelerator.build(handles.mesh, "bvh-sah")
    return module.render(accelerator, handles.scene, handles.camera, samples=SAMPLES).combined[..., :3]


def _of_cycles(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    output = scene.render.image_settings
    if bpy.app.version >= (5, 0):
        output.media_type = "IMAGE"
    output.file_format, output.color_depth, output.exr_codec = "OPEN_EXR", "32", "NONE"
    scene.render.filepath = str(path)
    scene.render.use_crop_to_border = True
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, -1)[..., :3]


def _sky(color: tuple[float, float, float]) -> None:
    world = bpy.data.worlds.new("World")
    building.use_nodes(world)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1)
    bpy.context.scene.world = world


def _floor(of: bpy.types.Material, size: float = 10.0) -> bpy.types.Object:
    floor = building.square("Floor")
    floor.data.transform(Matrix.Scale(size, 4))
    floor.data.materials.append(of)
    return floor


def _white() -> bpy.types.Material:
    return building.material("White", "ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1))


UP = Matrix.Translation((0, 0, 2))
TILT = Matrix.Rotation(0.5, 4, "X")
BULB = {"energy": 100.0, "shadow_soft_size": 0.5}
SPOT = {**BULB, "spot_size": 1.2, "spot_blend": 0.7}
AREA = {"energy": 100.0, "size": 1.0}
LIGHTS = {
    "point": ("POINT", UP, {"energy": 100.0, "shadow_soft_size": 0.0, "color": (1.0, 0.5, 0.2)}),
    "point that is a disk": ("POINT", UP, BULB),
    "point that is a sphere": ("POINT", UP, {**BULB, "use_soft_falloff": False}),
    "sun": ("SUN", TILT, {"energy": 3.0, "angle": 0.0}),
    "wide sun": ("SUN", TILT, {"energy": 3.0, "angle": 1.0}),
    "spot": ("SPOT", UP, {**SPOT, "shadow_soft_size": 0.0}),
    "spot that is a disk": ("SPOT", UP, SPOT),
    "spot with an oblong cone": ("SPOT", UP @ Matrix.Diagonal((1.2, 1, 1, 1)), {**SPOT, "shadow_soft_size": 0.0}),
    "square": ("AREA", UP, {**AREA, "shape": "SQUARE"}),
    "scaled rectangle": ("AREA", UP @ Matrix.Diagonal((2, 3, 1, 1)), {**AREA, "shape": "RECTANGLE", "size_y": 0.5}),
    "disk": ("AREA", UP @ TILT, {**AREA, "shape": "DISK"}),
    "ellipse": ("AREA", UP, {**AREA, "shape": "ELLIPSE", "size_y": 2.0}),
    "square with a spread": ("AREA", UP, {**AREA, "shape": "SQUARE", "spread": 1.5}),
    "disk with a narrow spread": ("AREA", UP, {**AREA, "shape": "DISK", "size": 4.0, "spread": 0.3}),
}


def _lamp(kind: str, matrix: Matrix, settings: dict[str, object]) -> None:
    data = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(data, name, value)
    building.add("Light", data).matrix_world = matrix


@pytest.mark.parametrize("name", LIGHTS)
def test_lights_are_as_bright(pictures, name):
    _floor(_white())
    _lamp(*LIGHTS[name])
    building.camera(type="ORTHO", ortho_scale=0.2).location = (1, 0, 5)
    ours, cycles = pictures()
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), cycles.mean(axis=(0, 1)), rtol=0.01)
    assert cycles.mean() > 0.01


@pytest.mark.parametrize("settings", [{"normalize": False}, {"exposure": 1.5}], ids=["not normalized", "exposed"])
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
@pytest.mark.skipif(bpy.app.version < (4, 5), reason="new in 4.5")
def test_lights_with_new_settings_are_as_bright(pictures, kind, settings):
    _floor(_white())
    size = {"POINT": BULB, "SPOT": BULB, "SUN": {"energy": 2.0, "angle": 0.5}, "AREA": {**AREA, "size": 0.5}}[kind]
    _lamp(kind, UP, {**size, **settings})
    building.camera(type="ORTHO", ortho_scale=0.2).location = (0.3, 0, 5)
    ours, cycles = pictures()
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.01)


def test_shadows_fall_in_the_same_place(pictures):
    _floor(_white())
    building.square("Blocker").data.materials.append(_white())
    blocker = bpy.data.objects["Blocker"]
    blocker.location, blocker.scale = (0.2, 0.1, 1.0), (0.3, 0.2, 1)
    _lamp("POINT", UP, {"energy": 100.0, "shadow_soft_size": 0.0})
    building.camera(type="ORTHO", ortho_scale=4.0)
    ours, cycles = pictures()
    assert np.abs(ours - cycles).max() < 0.35
    assert np.abs(ours - cycles).mean() < 0.01
    assert cycles.min() < 0.02


def test_a_sky_lights_as_much(pictures):
    _floor(_white())
    wall = building.square("Wall")
    wall.data.materials.append(_white())
    wall.matrix_world = Matrix.Translation((0.5, 0, 0)) @ Matrix.Rotation(math.pi / 2, 4, "Y")
    _sky((0.2, 0.4, 0.8))
    building.camera(type="ORTHO", ortho_scale=0.5)
    ours, cycles = pictures()
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), cycles.mean(axis=(0, 1)), rtol=0.01)


def _gradient(width: int = 64, height: int = 64) -> bpy.types.Image:
    """Red rises to the right, green upwards."""
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., 0] = (np.arange(width) + 0.5) / width
    pixels[..., 1] = (np.arange(height)[:, None] + 0.5) / height
    return building.image("Gradient", pixels, float_buffer=True, space="Non-Color")


def _textured(image: bpy.types.Image, **settings: object) -> bpy.types.Material:
    material = building.material("Textured", "ShaderNodeBsdfDiffuse")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    for name, value in settings.items():
        setattr(node, name, value)
    material.node_tree.links.new(node.outputs["Color"], building.shader(material).inputs["Color"])
    return material


def _mapped_floor(material: bpy.types.Material, scale: float = 1.0) -> None:
    """A floor of side 20 whose texture coordinates run from 0 to `scale`."""
    uvs = _floor(material).data.uv_layers.new(name="UVMap").data
    for corner, uv in zip(uvs, [(0, 0), (1, 0), (1, 1), (0, 1)], strict=True):
        corner.uv = (uv[0] * scale, uv[1] * scale)


CAMERAS = {
    "perspective": ({}, {}),
    "wide": ({}, {"resolution_x": 24, "resolution_y": 12}),
    "tall": ({}, {"resolution_x": 12, "resolution_y": 24}),
    "vertical fit": ({"sensor_fit": "VERTICAL"}, {"resolution_x": 24, "resolution_y": 12}),
    "horizontal fit": ({"sensor_fit": "HORIZONTAL", "lens": 35.0}, {"resolution_x": 12, "resolution_y": 24}),
    "shifted": ({"shift_x": 0.3, "shift_y": -0.2}, {"resolution_x": 24, "resolution_y": 12}),
    "shifted tall": ({"shift_x": 0.3, "shift_y": -0.2}, {"resolution_x": 12, "resolution_y": 24}),
    "oblong pixels": ({}, {"pixel_aspect_x": 2.0}),
    "tall pixels": ({"shift_y": 0.1}, {"pixel_aspect_y": 1.5, "resolution_x": 24}),
    "orthographic": ({"type": "ORTHO", "ortho_scale": 8.0}, {"resolution_x": 24, "resolution_y": 12}),
    "orthographic, shifted": ({"type": "ORTHO", "ortho_scale": 8.0, "shift_x": 0.2}, {"resolution_y": 24}),
    "half resolution": ({}, {"resolution_x": 33, "resolution_y": 21, "resolution_percentage": 50}),
    "border": (
        {},
        {
            "resolution_x": 33,
            "resolution_y": 21,
            "use_border": True,
            "border_min_x": 0.21,
            "border_max_x": 0.77,
            "border_min_y": 0.4,
            "border_max_y": 0.93,
        },
    ),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras_see_the_same(pictures, scene, name):
    _mapped_floor(_textured(_gradient()))
    _sky((1, 1, 1))
    camera_settings, render_settings = CAMERAS[name]
    camera = building.camera(**camera_settings)
    camera.matrix_world = Matrix.Translation((1, -2, 8)) @ Matrix.Rotation(0.2, 4, "X") @ Matrix.Rotation(0.3, 4, "Z")
    for setting, value in render_settings.items():
        setattr(scene.render, setting, value)
    ours, cycles = pictures()
    assert ours.shape == cycles.shape
    difference = np.abs(ours - cycles)
    assert np.quantile(difference, 0.95) < 2e-3
    assert difference.max() < 0.05, "more than noise at the edge of the floor"
    assert np.ptp(cycles[..., 0]) > 0.1
    assert np.ptp(cycles[..., 1]) > 0.1


def test_clip_distances_cut_the_same(pictures):
    _mapped_floor(_textured(_gradient()))
    _sky((1, 1, 1))
    camera = building.camera(clip_start=9.0, clip_end=11.0)
    camera.matrix_world = Matrix.Translation((0, 0, 10)) @ Matrix.Rotation(0.5, 4, "X")
    ours, cycles = pictures()
    assert np.abs(ours - cycles).mean() < 2e-3
    assert (cycles[..., 2] == 1).any()


@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP"])
def test_textures_are_looked_up_alike(pictures, interpolation, extension):
    image = building.image("Noise", np.random.default_rng(1).random((3, 5, 4)), float_buffer=True, space="Non-Color")
    image.alpha_mode = "NONE"
    _mapped_floor(_textured(image, interpolation=interpolation, extension=extension), scale=2.3)
    _sky((1, 1, 1))
    building.camera(type="ORTHO", ortho_scale=19.9)
    ours, cycles = pictures()
    assert np.abs(ours - cycles).mean() < 4e-3


def test_mirrors_reflect_alike(pictures, scene):
    metal = building.material("Metal", Base_Color=(0.9, 0.6, 0.3, 1), Metallic=1.0, Roughness=0.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(0, 0, 1))
    ball = bpy.context.object
    ball.data.materials.append(metal)
    ball.data.shade_smooth()
    _mapped_floor(_textured(_gradient()))
    _sky((0.5, 0.7, 1.0))
    building.camera().location = (0, 0, 6)
    scene.render.resolution_x = scene.render.resolution_y = 24
    ours, cycles = pictures()
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), cycles.mean(axis=(0, 1)), rtol=0.01)
    assert np.abs(ours - cycles).mean() < 0.01


def test_emission_is_seen_alike(pictures):
    _floor(building.material("Lamp", "ShaderNodeEmission", Color=(1, 0.5, 0.25, 1), Strength=3.0))
    building.camera()
    ours, cycles = pictures()
    np.testing.assert_allclose(ours, cycles, rtol=1e-5)
