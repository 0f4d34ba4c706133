"""Registration: every class comes and goes, and a failing module leaves nothing behind."""

import sys
import types

import bpy
import pytest

import espalier


def test_settings_are_on_the_scene(scene):
    assert scene.espalier.method == "hybrid"
    assert scene.espalier.methods == {"bvh-median", "bvh-sah", "grid", "hybrid-sampled", "hybrid"}


def test_every_setting_has_a_tooltip(scene):
    for group in (scene.espalier, scene.espalier.overlay):
        for name, prop in group.bl_rna.properties.items():
            if name not in {"rna_type", "name"}:
                assert prop.description, f"{name} has no description"


def test_unregister_takes_everything_away_and_register_brings_it_back():
    espalier.unregister()
    try:
        assert not hasattr(bpy.types.Scene, "espalier")
        assert not [name for name in dir(bpy.types) if name.startswith("ESPALIER")]
    finally:
        espalier.register()
    assert hasattr(bpy.types.Scene, "espalier")


def test_a_failing_module_raises_and_unregisters_the_ones_before(monkeypatch):
    espalier.unregister()
    broken = types.ModuleType("espalier.broken")

    def fail() -> None:
        raise RuntimeError("broken on purpose")

    broken.register = fail
    monkeypatch.setitem(sys.modules, "espalier.broken", broken)
    monkeypatch.setattr(espalier, "MODULES", ("properties", "broken"))
    try:
        with pytest.raises(RuntimeError, match="broken on purpose"):
            espalier.register()
        assert not hasattr(bpy.types.Scene, "espalier")
    finally:
        monkeypatch.undo()
        espalier.register()
