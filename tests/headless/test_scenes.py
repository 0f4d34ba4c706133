"""Every generated scene builds in Blender, with what its purpose promises."""

import bpy
import numpy as np
import pytest

from espalier_scenes import catalogue, framing
from espalier_scenes.blender import box_uvs
from espalier_scenes.geometry import box

GENERATED = [entry.name for entry in catalogue.ENTRIES[:8]]


def triangles(depsgraph: bpy.types.Depsgraph) -> int:
    """Triangles of all shown instances."""
    count = 0
    for instance in depsgraph.object_instances:
        if instance.object.type == "MESH":
            count += len(instance.object.data.loop_triangles)
    return count


@pytest.mark.parametrize("name", GENERATED)
def test_a_scene_builds_with_camera_light_and_all_its_triangles(scene: bpy.types.Scene, name: str) -> None:
    entry = catalogue.find(name)
    entry.build(scene)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert scene.camera is not None
    assert any(thing.type == "LIGHT" for thing in scene.objects)
    assert scene.world is not None
    if entry.finish is None:
        assert triangles(depsgraph) == len(entry.mesh()[1])
    else:
        assert triangles(depsgraph) > 1900


@pytest.mark.parametrize("name", GENERATED)
def test_its_parts_are_in_front_of_the_camera(scene: bpy.types.Scene, name: str) -> None:
    catalogue.find(name).build(scene)
    bpy.context.view_layer.update()
    view = np.linalg.inv(np.array(scene.camera.matrix_world))
    corners = [np.array(thing.matrix_world) @ (*corner, 1) for thing in scene.objects for corner in thing.bound_box]
    depth = -(view @ np.array(corners).T)[2]
    assert (depth > scene.camera.data.clip_start).any()
    assert depth[depth > 0].min() < scene.camera.data.clip_end


def test_suzanne_has_a_modifier_that_renders_finer_than_it_shows(scene: bpy.types.Scene) -> None:
    catalogue.find("suzanne").build(scene)
    modifier = scene.objects["Suzanne"].modifiers[0]
    assert (modifier.type, modifier.render_levels) == ("SUBSURF", 4)


def test_the_forest_is_made_of_collection_and_geometry_nodes_instances(scene: bpy.types.Scene) -> None:
    catalogue.find("forest").build(scene)
    stage = catalogue.find("forest").stage()
    empties = [thing for thing in scene.objects if thing.instance_type == "COLLECTION"]
    trees = sum(len(part.placements) for part in stage.parts if part.name.endswith("Trunk"))
    grass = next(part for part in stage.parts if part.name == "Grass")
    assert len(empties) == trees
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = [
        np.array(instance.matrix_world)
        for instance in depsgraph.object_instances
        if instance.is_instance and instance.object.name == "Grass"
    ]
    assert np.allclose(np.array(found), grass.placements, atol=1e-4)


@pytest.mark.parametrize("name", GENERATED)
def test_building_twice_gives_the_same_geometry(scene: bpy.types.Scene, name: str) -> None:
    catalogue.find(name).build(scene)
    first = {data.name: len(data.polygons) for data in bpy.data.meshes}
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    catalogue.find(name).build(bpy.context.scene)
    assert {data.name: len(data.polygons) for data in bpy.data.meshes} == first


def test_a_lamp_shines_at_its_target(scene: bpy.types.Scene) -> None:
    catalogue.find("cornell_box").build(scene)
    lamp = next(thing for thing in scene.objects if thing.type == "LIGHT")
    assert np.allclose(np.array(lamp.matrix_world)[:3, 2], [0, 0, 1], atol=1e-6)
    assert np.allclose(framing.camera_to_world((0, 0, 5), (0, 0, 0))[:3, 2], [0, 0, 1])


def test_box_uvs_measure_metres_on_every_side() -> None:
    corners = box_uvs(box((0, 0, 0), (2, 3, 4)), 0.5)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert sorted({round(float(edge), 3) for edge in edges.flat} & {4.0, 6.0, 8.0}) == [4.0, 6.0, 8.0]
