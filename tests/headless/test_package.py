"""The zip of `make package`, installed in Blender as a Python module, by each interpreter that BPY_PYTHONS names."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PYTHONS = os.environ.get("BPY_PYTHONS", sys.executable).split()


@pytest.mark.parametrize("python", PYTHONS)
def test_zip_installs_renders_and_goes(python: str, tmp_path: Path) -> None:
    """In a process of its own, as an extension is installed into a user's folder that is read at the start."""
    archives = list((ROOT / "dist").glob("espalier-*.zip"))
    assert len(archives) == 1, f"one zip in dist/ is wanted, found {len(archives)}: run `make package`"
    done = subprocess.run(
        [python, Path(__file__).with_name("install_zip.py"), archives[0]],
        env=os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "installed, rendered, disabled" in done.stdout
