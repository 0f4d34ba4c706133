"""Export of what renders and nothing else, and of nothing changed by it."""

import contextlib

import bpy
import building
import pytest

from espalier import capture, export
from espalier.errors import CaptureError, UnsupportedCameraError


@pytest.fixture(autouse=True)
def _empty(scene):
    """Every test here starts from a scene without objects."""


def names(data) -> set[str]:
    """Materials of what was exported, which the tests name after their objects."""
    return {data.materials[index].name for index in data.geometry.material_index}


def named(name: str, collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    """A square whose material has its name."""
    data = building.mesh(name)
    data.materials.append(building.material(name))
    return building.add(name, data, collection)


def collection(name: str) -> bpy.types.Collection:
    """A collection of the scene with one square of its name."""
    new = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(new)
    named(name, new)
    return new


def test_render_visibility_counts_and_viewport_visibility_does_not():
    named("Shown")
    named("Not in renders").hide_render = True
    named("Not in viewports").hide_viewport = True
    named("Hidden with H").hide_set(True)
    assert names(building.export()) == {"Shown", "Not in viewports", "Hidden with H"}


def test_collections_that_are_disabled_in_renders_or_excluded_are_left_out():
    collection("Shown")
    collection("Disabled").hide_render = True
    collection("Excluded")
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    collection("Not in viewports").hide_viewport = True
    assert names(building.export()) == {"Shown", "Not in viewports"}


def test_render_visibility_counts_inside_of_an_instanced_collection():
    inside = bpy.data.collections.new("Instanced")
    named("Shown", inside)
    named("Not in renders", inside).hide_render = True
    named("Not in viewports", inside).hide_viewport = True
    empty = building.add("Empty")
    empty.instance_type, empty.instance_collection = "COLLECTION", inside
    assert names(building.export()) == {"Shown", "Not in viewports"}


def test_an_instancer_hidden_in_renders_shows_only_its_instances():
    instancer = named("Instancer")
    instancer.instance_type, instancer.show_instancer_for_render = "VERTS", False
    named("Child").parent = instancer
    data = building.export()
    assert names(data) == {"Child"}
    assert data.instance_count == 4


def test_the_view_layer_decides(scene):
    collection("Here")
    collection("There")
    bpy.context.view_layer.layer_collection.children["There"].exclude = True
    second = scene.view_layers.new("Second")
    second.layer_collection.children["Here"].exclude = True
    assert names(building.export()) == {"Here"}
    data = building.export(view_layer=second)
    assert (names(data), data.view_layer) == ({"There"}, "Second")


def test_a_view_layer_that_is_off_for_renders_can_be_exported(scene):
    named("Shown")
    second = scene.view_layers.new("Second")
    second.use = False
    assert building.export(view_layer=second).view_layer == "Second"
    assert not second.use


@pytest.mark.parametrize("what", ["holdout", "indirect_only"])
def test_holdout_and_indirect_collections_are_traced_with_a_warning(what):
    collection("Special")
    setattr(bpy.context.view_layer.layer_collection.children["Special"], what, True)
    data = building.export()
    assert names(data) == {"Special"}
    assert [line for line in data.warnings if "'Special'" in line and "holdout and indirect only" in line]


def test_holdout_objects_and_ray_visibility_warn():
    named("Held").is_holdout = True
    named("Unseen").visible_camera = False
    warnings = building.export().warnings
    assert len(warnings) == 2
    assert "'Held': holdout" in warnings[0]
    assert "'Unseen': ray visibility" in warnings[1]


def test_what_cannot_be_traced_warns_once():
    named("Shown")
    cloud = building.add("Volume", bpy.data.volumes.new("Volume"))
    assert cloud.type == "VOLUME"
    assert building.export().warnings == ("Object 'Volume' is a volume and is left out",)


def test_a_viewport_depsgraph_is_refused():
    named("Shown")
    building.camera()
    with pytest.raises(ValueError, match="export_scene needs a render depsgraph"):
        export.export_scene(bpy.context.evaluated_depsgraph_get())


def _state(scene: bpy.types.Scene) -> dict[str, object]:
    """All that a user could see changed."""
    render = {prop.identifier: getattr(scene.render, prop.identifier) for prop in scene.render.bl_rna.properties}
    plain = (bool, int, float, str)
    return {
        "render": {name: value for name, value in render.items() if isinstance(value, plain)},
        "data": {
            name: [item.name for item in getattr(bpy.data, name)]
            for name in ("scenes", "objects", "meshes", "images", "materials", "cameras", "collections", "node_groups")
        },
        # Blender 4.2 itself miscounts users of a scene copied and removed.
        "users": bpy.app.version >= (4, 3)
        and [(thing.name, thing.users) for thing in (*bpy.data.objects, *bpy.data.meshes, *bpy.data.materials)],
        "selection": [thing.name for thing in bpy.context.selected_objects],
        "active": bpy.context.view_layer.objects.active.name,
        "current": (bpy.context.scene.name, bpy.context.view_layer.name, scene.frame_current, scene.camera.name),
        "loaded": [image.has_data for image in bpy.data.images],
        "handlers": {name: list(getattr(bpy.app.handlers, name)) for name in capture.RENDER_HANDLERS},
    }


def _scene_with_all_sorts(tmp_path) -> None:
    painted = building.image("Painted", [[(1, 0, 0, 1)]])
    painted.filepath_raw, painted.file_format = str(tmp_path / "painted.png"), "PNG"
    painted.save()
    bpy.data.images.remove(painted)
    from_file = bpy.data.images.load(str(tmp_path / "painted.png"))
    holder = building.square()
    holder.data.materials.append(building.textured("Textured", from_file))
    holder.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    bpy.context.view_layer.objects.active = holder
    holder.select_set(True)
    building.camera()


@pytest.mark.parametrize("fails", [False, True])
def test_an_export_changes_nothing_also_when_it_fails(scene, tmp_path, fails):
    _scene_with_all_sorts(tmp_path)
    scene.frame_set(5)
    scene.render.resolution_percentage = 50
    if fails:
        scene.camera.data.type = "PANO"
    calls = []
    bpy.app.handlers.render_complete.append(calls.append)
    try:
        before = _state(scene)
        with pytest.raises(UnsupportedCameraError) if fails else contextlib.nullcontext():
            building.export(resolution=(10, 10), border=False)
        assert _state(scene) == before
        assert calls == []
    finally:
        bpy.app.handlers.render_complete.clear()


def test_the_users_render_result_survives(scene, tmp_path):
    named("Shown")
    building.camera()
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", 16, 16
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    bpy.ops.render.render()
    images = []
    for name in ("before.png", "after.png"):
        bpy.data.images["Render Result"].save_render(str(tmp_path / name))
        images.append((tmp_path / name).read_bytes())
        building.export()
    assert images[0] == images[1]


def test_a_capture_that_blender_refuses_is_a_named_error(scene, monkeypatch):
    named("Shown")
    building.camera()
    monkeypatch.setattr(capture, "_prepare", lambda copy, *_: setattr(copy.render, "engine", "BLENDER_WORKBENCH"))
    for layer in scene.view_layers:
        layer.use = False
    with pytest.raises(CaptureError, match="wait until no render or bake is under way"):
        capture.export_frame(scene)
