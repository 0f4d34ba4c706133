"""What is written in several files, because several tools read it, agrees."""

import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def read(path: str) -> dict[str, Any]:
    return tomllib.loads((ROOT / path).read_text(encoding="utf-8"))


def test_versions_agree() -> None:
    project = read("pyproject.toml")["project"]
    version = project["version"]
    assert read("blender_manifest.toml")["version"] == version
    assert read("native/Cargo.toml")["workspace"]["package"]["version"] == version
    assert f"espalier-rt=={version}" in project["dependencies"]
    (wheel,) = read("blender_manifest.toml")["wheels"]
    assert wheel.startswith(f"./wheels/espalier_rt-{version}-cp311-abi3-")


def test_every_package_is_installed() -> None:
    """setuptools cannot find packages in a folder of another name, so pyproject.toml lists them."""
    rooms = {"addon": "espalier", "scenes": "espalier_scenes"}
    found = {
        ".".join([name, *path.parent.relative_to(ROOT / folder).parts])
        for folder, name in rooms.items()
        for path in (ROOT / folder).rglob("*.py")
    }
    assert set(read("pyproject.toml")["tool"]["setuptools"]["packages"]) == found


def test_requirements_are_pinned() -> None:
    lines = (ROOT / ".ci" / "requirements.txt").read_text(encoding="utf-8").splitlines()
    wanted = [line for line in lines if line and not line.startswith("#")]
    assert [line for line in wanted if "==" not in line] == []
    assert "bpy==4.5.15" in wanted
