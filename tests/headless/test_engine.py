"""The render engine, from the scene to the file that Blender writes."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
import building
import exr
import numpy as np
import pytest

from espalier import borrowed_panels, engine, native
from espalier.errors import NativeModuleMissingError

pytest.importorskip("espalier_rt")


@pytest.fixture(autouse=True)
def _renders_with_espalier(scene, tmp_path):
    """An empty scene that renders 8 by 6 pixels with Espalier into a multilayer EXR without compression."""
    render = scene.render
    render.engine = "ESPALIER"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 8, 6, 100
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    if hasattr(settings, "use_exr_interleave"):  # one part for all passes, as before 5.0
        settings.use_exr_interleave = True
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    render.filepath = str(tmp_path / "frame")
    building.camera(type="ORTHO", ortho_scale=4.0)


def glowing(name: str = "Glowing", color=(1, 0.5, 0.25, 1), strength: float = 2.0) -> bpy.types.Object:
    """A square that only emits; from above its radiance is colour times strength exactly."""
    new = building.square(name)
    new.data.materials.append(building.material(name, "ShaderNodeEmission", Color=color, Strength=strength))
    return new


def rendered(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """The channels of a frame rendered to a file."""
    bpy.ops.render.render(write_still=True)
    return exr.read(next(_folder(scene).iterdir()))


def _folder(scene: bpy.types.Scene) -> Path:
    return Path(scene.render.filepath).parent


def test_combined_is_the_radiance(scene):
    glowing().scale = (10, 10, 1)
    combined = exr.layer_pass(rendered(scene), "ViewLayer", "Combined")
    assert combined.shape == (6, 8, 4)
    np.testing.assert_allclose(combined, np.broadcast_to((2, 1, 0.5, 1), combined.shape), rtol=1e-6)


def test_depth_normal_and_cost_and_where_nothing_is_hit(scene):
    """The square covers -1..1 of a frame 4 wide and 3 high: four by four pixels in the middle."""
    holder = glowing()
    holder.location.z = 1.0
    division = holder.modifiers.new("Subdivision", "SUBSURF")
    division.subdivision_type, division.render_levels = "SIMPLE", 6
    images = rendered(scene)
    hit = np.zeros((6, 8), bool)
    hit[1:5, 2:6] = True
    depth = exr.layer_pass(images, "ViewLayer", "Depth")[..., 0]
    np.testing.assert_allclose(depth, np.where(hit, 9.0, 1e10), rtol=1e-6)
    normal = exr.layer_pass(images, "ViewLayer", "Normal")
    np.testing.assert_allclose(normal, np.where(hit[..., None], (0, 0, 1), 0), atol=1e-6)
    cost = exr.layer_pass(images, "ViewLayer", "Cost")[..., 0]
    assert cost[hit].min() >= 1.0
    assert cost[~hit].max() <= cost[hit].max()


def test_the_cost_pass_can_be_left_out(scene):
    glowing()
    scene.espalier.cost_pass = False
    images = rendered(scene)
    assert not [name for name in images if "Cost" in name]
    assert [name for name in images if "Depth" in name]


def test_blenders_own_switches_of_passes_do_not_double_them(scene):
    glowing()
    scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
    images = rendered(scene)
    assert exr.layer_pass(images, "ViewLayer", "Depth").shape == (6, 8, 1)
    assert exr.layer_pass(images, "ViewLayer", "Normal").shape == (6, 8, 3)


@pytest.mark.parametrize("transparent", [False, True])
def test_the_film_is_transparent_only_where_asked(scene, transparent):
    glowing()
    world = bpy.data.worlds.new("World")
    scene.world = world
    building.use_nodes(world)
    node = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    node.inputs["Color"].default_value = (0.25, 0.5, 1, 1)
    node.inputs["Strength"].default_value = 1.0
    scene.render.film_transparent = transparent
    combined = exr.layer_pass(rendered(scene), "ViewLayer", "Combined")
    np.testing.assert_allclose(combined[0, 0], (0, 0, 0, 0) if transparent else (0.25, 0.5, 1, 1), rtol=1e-6)
    np.testing.assert_allclose(combined[3, 4], (2, 1, 0.5, 1), rtol=1e-6)


def test_every_method_renders_the_same_picture(scene):
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.light_add(type="SUN")
    scene.espalier.samples = 4
    pictures = []
    for method in native.module().methods():
        scene.espalier.method = method
        pictures.append(exr.layer_pass(rendered(scene), "ViewLayer", "Combined"))
    assert np.ptp(pictures[0]) > 0.1
    for picture in pictures[1:]:
        np.testing.assert_array_equal(picture, pictures[0])


def test_the_resolution_percentage_counts(scene):
    glowing()
    scene.render.resolution_percentage = 50
    assert exr.layer_pass(rendered(scene), "ViewLayer", "Combined").shape == (3, 4, 4)


@pytest.mark.parametrize("border", [(0.0, 0.0, 0.5, 0.5), (0.3, 0.21, 0.9, 0.77), (0.13, 0.5, 1.0, 1.0)])
def test_a_render_region_is_rendered_in_its_place(scene, border):
    scene.render.resolution_x, scene.render.resolution_y = 80, 60
    glowing(color=(1, 1, 1, 1), strength=1.0)
    whole = exr.layer_pass(rendered(scene), "ViewLayer", "Combined")
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y = border
    part = exr.layer_pass(rendered(scene), "ViewLayer", "Combined")
    assert part.shape == whole.shape
    left, right = (int(np.float32(border[i]) * np.float32(80)) for i in (0, 2))
    low, high = (int(np.float32(border[i]) * np.float32(60)) for i in (1, 3))
    expected = np.zeros_like(whole)
    expected[low:high, left:right] = whole[low:high, left:right]
    np.testing.assert_allclose(part, expected, atol=1e-6)
    render.use_crop_to_border = True
    cropped = exr.layer_pass(rendered(scene), "ViewLayer", "Combined")
    np.testing.assert_allclose(cropped, whole[low:high, left:right], atol=1e-6)


def test_every_view_layer_is_rendered(scene):
    for name in ("Left", "Right"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        holder = glowing(name, strength=1.0 if name == "Left" else 3.0)
        scene.collection.objects.unlink(holder)
        collection.objects.link(holder)
    second = scene.view_layers.new("Second")
    scene.view_layers[0].layer_collection.children["Right"].exclude = True
    second.layer_collection.children["Left"].exclude = True
    images = rendered(scene)
    for layer, strength in (("ViewLayer", 1.0), ("Second", 3.0)):
        middle = exr.layer_pass(images, layer, "Combined")[3, 4]
        np.testing.assert_allclose(middle, (strength, 0.5 * strength, 0.25 * strength, 1), rtol=1e-6)


def test_animation_renders_every_frame_as_it_is(scene):
    holder = glowing()
    holder.data.materials[0].node_tree.nodes[0].inputs["Strength"].default_value = 1.0
    for frame, z in ((1, 0.0), (3, 2.0)):
        holder.location.z = z
        holder.keyframe_insert("location", index=2, frame=frame)
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.render.render(animation=True)
    files = sorted(_folder(scene).iterdir())
    assert len(files) == 3
    depths = [exr.layer_pass(exr.read(file), "ViewLayer", "Depth")[3, 4, 0] for file in files]
    np.testing.assert_allclose([depths[0], depths[2]], [10.0, 8.0], rtol=1e-5)
    assert depths[0] > depths[1] > depths[2]


def test_esc_ends_a_render_in_time(scene, monkeypatch):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=500, y_subdivisions=500)
    bpy.ops.object.light_add(type="SUN")
    scene.render.resolution_x = scene.render.resolution_y = 1024
    scene.espalier.samples = 10_000
    monkeypatch.setattr(engine.ESPALIER_RenderEngine, "_stopped", lambda self: next(answers))
    delays = []
    watch = engine.ESPALIER_RenderEngine._watch

    def timed_watch(self, run) -> None:
        watch(self, run)
        delays.append(time.perf_counter() - pressed[0])

    monkeypatch.setattr(engine.ESPALIER_RenderEngine, "_watch", timed_watch)
    # A machine that is busy with other things may delay one end, not each of three.
    for _ in range(3):
        pressed: list[float] = []
        answers = _esc_at_the_fifth_look(pressed)
        bpy.ops.render.render()
        assert pressed, "the render was over before it could be cancelled"
    assert min(delays) < 0.2
    assert not [thread for thread in threading.enumerate() if thread.name == "espalier-run"]


def _esc_at_the_fifth_look(pressed: list[float]) -> Iterator[bool]:
    """What a render learns when it asks for Esc; `pressed` gets the time at which it is first told."""
    yield from [False] * 4
    pressed.append(time.perf_counter())
    while True:
        yield True


def test_an_error_is_reported_and_writes_no_file(scene):
    glowing()
    scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match="set Lens > Type to Perspective or Orthographic"):
        bpy.ops.render.render(write_still=True)
    assert list(_folder(scene).iterdir()) == []


def test_without_the_compiled_module_the_error_says_what_to_do(scene, monkeypatch):
    glowing()

    def missing():
        raise NativeModuleMissingError("no module")

    monkeypatch.setattr(native, "module", missing)
    with pytest.raises(RuntimeError, match="reinstall the extension"):
        bpy.ops.render.render()


def test_an_error_that_nobody_foresaw_ends_the_render_too(scene, monkeypatch, capsys):
    glowing()
    monkeypatch.setattr(engine, "export_scene", lambda depsgraph: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.render.render()
    assert "Traceback" in capsys.readouterr().err


def test_panels_of_blender_show_for_espalier_until_it_is_unregistered():
    from bl_ui import properties_data_camera, properties_data_light, properties_freestyle, properties_material

    lens, light = properties_data_camera.DATA_PT_lens, properties_data_light.DATA_PT_EEVEE_light
    surface = properties_material.EEVEE_MATERIAL_PT_surface
    freestyle = properties_freestyle.RENDER_PT_freestyle
    shown = (lens, light, surface)
    assert all("ESPALIER" in panel.COMPAT_ENGINES for panel in shown)
    assert "ESPALIER" not in freestyle.COMPAT_ENGINES
    borrowed_panels.unregister()
    try:
        assert not any("ESPALIER" in panel.COMPAT_ENGINES for panel in shown)
    finally:
        borrowed_panels.register()
    assert all("ESPALIER" in panel.COMPAT_ENGINES for panel in shown)
