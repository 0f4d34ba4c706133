"""Pictures beside Cycles' own: textures, mappings, mirrored objects, normals and lights land where Blender has them."""

from pathlib import Path

import bpy
import building
import exr
import numpy as np
import pytest

pytest.importorskip("espalier_rt")

MAPPINGS = (None, "POINT", "TEXTURE", "VECTOR")


@pytest.fixture(autouse=True)
def _scene(scene, tmp_path):
    """A scene of direct light alone, both engines with the same box filter, written as raw numbers."""
    render = scene.render
    render.resolution_x, render.resolution_y = 96, 72
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    if hasattr(settings, "use_exr_interleave"):
        settings.use_exr_interleave = True
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
    cycles = scene.cycles
    cycles.use_denoising, cycles.max_bounces, cycles.diffuse_bounces = False, 0, 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    scene.espalier.samples = cycles.samples = 256
    building.camera(lens=35.0)


def _both(scene: bpy.types.Scene, folder: Path) -> list[dict[str, np.ndarray]]:
    """The frame by Espalier and by Cycles."""
    pictures = []
    for engine in ("ESPALIER", "CYCLES"):
        scene.render.engine, scene.render.filepath = engine, str(folder / engine)
        bpy.ops.render.render(write_still=True)
        pictures.append(exr.read(folder / f"{engine}.exr"))
    return pictures


def _painted(name: str, mapping: str | None) -> bpy.types.Material:
    """A diffuse material with a small image. Pixels are sharp: Cycles filters sRGB before it makes colours linear."""
    new = building.material(name, "ShaderNodeBsdfDiffuse")
    tree = new.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    pixels = np.ones((7, 5, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(7).random((7, 5, 3))
    texture.image, texture.interpolation = building.image(name, pixels), "Closest"
    tree.links.new(texture.outputs[0], building.shader(new).inputs["Color"])
    if mapping is not None:
        node, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
        node.vector_type = mapping
        node.inputs["Rotation"].default_value, node.inputs["Scale"].default_value = (0.2, 0.1, 0.5), (2, 3, 1)
        if mapping != "VECTOR":
            node.inputs["Location"].default_value = (0.3, 0.1, 0.0)
        tree.links.new(coordinates.outputs["UV"], node.inputs["Vector"])
        tree.links.new(node.outputs[0], texture.inputs["Vector"])
    return new


def _light(kind: str, **settings: object) -> bpy.types.Object:
    data = bpy.data.lights.new(kind, kind)
    for name, value in settings.items():
        setattr(data, name, value)
    return building.add(kind, data)


def _build_scene() -> None:
    for index, mapping in enumerate(MAPPINGS):
        holder = building.square(f"Square {index}", location=(index % 2 * 2.2 - 1.1, index // 2 * 2.2 - 1.1, 0))
        holder.scale.x, holder.rotation_euler = (-1.0) ** index, (0.2, 0.1, 0.1 * index)
        uvs = np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32)
        holder.data.uv_layers.new(name="Map").uv.foreach_set("vector", uvs)
        holder.data.materials.append(_painted(f"Painted {index}", mapping))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 1))
    bpy.ops.object.shade_smooth()
    bpy.context.object.scale = (1.0, -0.5, 1.5)
    bpy.context.object.data.materials.append(
        building.material("Red", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.3, 0.2, 1))
    )
    _light("SUN", energy=3.0, angle=0.0).rotation_euler = (0.5, 0.3, 0.0)
    _light("POINT", energy=300.0, shadow_soft_size=0.0).location = (3, -3, 4)


def test_a_scene_of_everything_looks_as_in_cycles(scene, tmp_path):
    _build_scene()
    ours, theirs = _both(scene, tmp_path)
    images = [exr.layer_pass(picture, "ViewLayer", "Combined")[..., :3] for picture in (ours, theirs)]
    difference = np.abs(images[0] - images[1])
    # Only pixels on edges differ, whose samples fall elsewhere.
    assert images[1].mean() > 0.05
    assert np.median(difference) < 1e-6
    assert difference.mean() < 0.02 * images[1].mean()
    for name in ("Depth", "Normal"):
        passes = [exr.layer_pass(picture, "ViewLayer", name) for picture in (ours, theirs)]
        np.testing.assert_allclose(np.median(np.abs(passes[0] - passes[1])), 0.0, atol=1e-6)
