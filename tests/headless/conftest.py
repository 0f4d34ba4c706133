"""Fixtures of the tests that need bpy: the add-on registered once, and a factory-empty scene for each test."""

import os
import tempfile
from collections.abc import Iterator

import pytest

os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="espalier-test-"))
bpy = pytest.importorskip("bpy")


@pytest.fixture(scope="session", autouse=True)
def addon() -> Iterator[None]:
    """The add-on, registered for the session; bpy 4.5 hangs at exit while a render engine is registered."""
    import espalier

    espalier.register()
    yield
    espalier.unregister()


@pytest.fixture
def scene() -> "bpy.types.Scene":
    """A scene with no object, from factory settings; the add-on stays registered."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene
