"""Fixtures of the tests in a real Blender: `BLENDER=/path/to/blender pytest tests/blender`, after `make package`."""

import os
from pathlib import Path

import pytest

from .blender import Blender

ROOT = Path(__file__).resolve().parents[2]


def pytest_configure() -> None:
    if not os.environ.get("BLENDER"):
        raise pytest.UsageError("these tests run a real Blender: set BLENDER=/path/to/blender")


@pytest.fixture(scope="session")
def archive() -> Path:
    """The extension's zip."""
    archives = list((ROOT / "dist").glob("espalier-*.zip"))
    assert len(archives) == 1, f"one zip in dist/ is wanted, found {len(archives)}: run `make package`"
    return archives[0]


@pytest.fixture(scope="session")
def blender(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> Blender:
    """Blender with the extension installed from the zip and enabled, as a user's preferences then say."""
    installed = Blender.from_environment(tmp_path_factory.mktemp("user"))
    installed.run("--command", "extension", "install-file", "--repo", "user_default", "--enable", archive)
    installed.script("hide_splash.py")
    return installed


@pytest.fixture(scope="session")
def blend(blender: Blender, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene with modifiers, instances and lights, rendered by Espalier at 160x120."""
    path = tmp_path_factory.mktemp("scene") / "garden.blend"
    blender.script("make_scene.py", path)
    return path
