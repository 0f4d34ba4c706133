"""What the steps of a traversal take on this machine: measured once, kept in the user's folder for caches. No bpy.

Kept, because the hybrid that decides by cost must build the same tree today and tomorrow.
"""

import json
import os
import platform
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from . import native


@cache
def cost_constants() -> dict[str, float]:
    """Nanoseconds by setting, as `espalier_rt.calibrate` measures them, for "hybrid".

    Measured anew where the machine, the instruction set or Espalier's version is another than in the file. Where the
    file cannot be written, they hold until Blender ends.
    """
    rt = native.module()
    path = cache_file()
    machine = [platform.node(), platform.machine(), rt.instruction_set(), rt.__version__]
    kept = _read(path)
    if kept.get("machine") == machine and set(kept.get("costs", ())) == set(_names(rt)):
        return {name: float(value) for name, value in kept["costs"].items()}
    costs: dict[str, float] = rt.calibrate()
    _write(path, {"machine": machine, "costs": costs})
    return costs


def cache_file() -> Path:
    """Where the constants are kept."""
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "espalier" / "calibration.json"


def _names(rt: ModuleType) -> list[str]:
    return [name for name in rt.default_config("hybrid") if name.endswith("_ns")]


def _read(path: Path) -> dict[str, Any]:
    """What the file holds; nothing where it is missing or broken, so that it is written anew."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) else {}


def _write(path: Path, content: dict[str, Any]) -> None:
    """Replace the file whole, or leave it be where its folder cannot be written to."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
            json.dump(content, file, indent=2)
        Path(file.name).replace(path)
    except OSError:
        return
