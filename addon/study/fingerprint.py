"""What a study was measured with: machine, system, Python, Espalier. No bpy."""

import os
import platform
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from .. import machine, native
from . import embree


def fingerprint() -> dict[str, Any]:
    """By name; None where something is not known. Times of two fingerprints are not comparable, but for ratios."""
    rt = native.module()
    return {
        "processor": machine.processor(),
        "cores": os.cpu_count() or 1,
        "cores_available": machine.available_threads(),
        "instruction_set": rt.instruction_set(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
        "espalier": rt.__version__,
        "commit": _commit(),
        "embree": embree.version(),
        "numpy": np.__version__,
    }


def line(values: dict[str, Any]) -> str:
    """The fingerprint in one line, for people."""
    commit = f" at {values['commit']}" if values["commit"] else ""
    parts = [
        f"{values['processor']}, {values['cores_available']} of {values['cores']} cores, {values['instruction_set']}",
        values["system"],
        f"Python {values['python']}",
        f"Espalier {values['espalier']}{commit}",
    ]
    return "; ".join([*parts, f"embreex {values['embree']}"] if values["embree"] else parts)


def _commit() -> str | None:
    """The commit of the checkout this file is in, with a star where it was changed since; None outside of one."""
    folder = Path(__file__).resolve().parents[2]
    if not (folder / ".git").exists():
        return None
    commit = _said("git", "-C", str(folder), "rev-parse", "--short=10", "HEAD")
    changed = _said("git", "-C", str(folder), "status", "--porcelain", "--untracked-files=no")
    return commit and commit + ("*" if changed else "")


def _said(*command: str) -> str | None:
    """What a command printed; None where it failed or is not there."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
