"""What the buttons refuse, and why; without the compiled module's help."""

import bpy
import pytest

from espalier.operators import reasons


@pytest.fixture
def native_there(monkeypatch):
    """The compiled module seems to be there, whether it is or not."""
    monkeypatch.setattr(reasons, "missing_native", lambda: None)


def add_camera(scene, kind="PERSP"):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type = kind
    scene.collection.objects.link(camera)
    scene.camera = camera


def add_object(scene, **properties):
    ob = bpy.data.objects.new("Thing", bpy.data.meshes.new("Thing"))
    for name, value in properties.items():
        setattr(ob, name, value)
    scene.collection.objects.link(ob)


def test_no_camera(scene, native_there):
    add_object(scene)
    assert "no camera" in reasons.no_trace(bpy.context)


def test_panoramic_camera(scene, native_there):
    add_object(scene)
    add_camera(scene, "PANO")
    assert "panoramic" in reasons.no_trace(bpy.context)


def test_no_geometry(scene, native_there):
    add_camera(scene)
    assert "no geometry" in reasons.no_trace(bpy.context)
    add_object(scene, hide_render=True)
    assert "no geometry" in reasons.no_trace(bpy.context)


def test_an_empty_that_instances_a_collection_is_geometry(scene, native_there):
    add_camera(scene)
    empty = bpy.data.objects.new("Instances", None)
    empty.instance_type = "COLLECTION"
    scene.collection.objects.link(empty)
    assert reasons.no_trace(bpy.context) is None


def test_no_method(scene, native_there):
    add_camera(scene)
    add_object(scene)
    assert reasons.no_trace(bpy.context) is None
    scene.espalier.methods = set()
    assert "No method" in reasons.no_trace(bpy.context)


def test_a_missing_native_module_is_named(scene, monkeypatch):
    add_camera(scene)
    add_object(scene)
    monkeypatch.setattr(reasons, "missing_native", lambda: "espalier_rt cannot be loaded")
    assert reasons.no_trace(bpy.context) == "espalier_rt cannot be loaded"


def test_the_buttons_do_not_run_where_they_are_greyed_out(scene):
    for operator in (bpy.ops.espalier.build_trace, bpy.ops.espalier.cancel, bpy.ops.espalier.clear_results):
        assert not operator.poll()
        with pytest.raises(RuntimeError, match="poll"):
            operator()


def test_every_class_follows_the_interface_guidelines():
    names = [name for name in dir(bpy.types) if name.startswith(("ESPALIER_OT_", "ESPALIER_PT_"))]
    assert len(names) > 5
    for name in names:
        cls = getattr(bpy.types, name)
        assert cls.bl_label == cls.bl_label.strip()
        assert cls.bl_label[0].isupper(), name
        if "_OT_" in name:
            tooltip = getattr(bpy.ops.espalier, name.partition("_OT_")[2]).get_rna_type().description
            assert tooltip, name
            assert not tooltip.endswith("."), name
            assert "\n" not in tooltip, name
            assert "UNDO" not in getattr(cls, "bl_options", ()), (
                "nothing of the file changes, so there is nothing to undo"
            )
