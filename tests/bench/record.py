"""Results that are kept: with the machine, instruction set, compiler and commit they come from."""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).with_name("record")


def keep(rows: list[dict[str, Any]], arguments: argparse.Namespace) -> Path:
    """Write the rows under a name made of commit, instruction set and threads, and return the file."""
    about = header(arguments)
    commit, isa = about["commit"].replace("*", "-changed"), arguments.isa or "best"
    file = FOLDER / f"{about['date'][:10]}-{commit}-{isa}-{arguments.threads}.json"
    FOLDER.mkdir(exist_ok=True)
    text = ",\n".join(json.dumps(row) for row in rows)
    file.write_text(f'{{"about": {json.dumps(about, indent=1)},\n"rows": [\n{text}\n]}}\n', encoding="utf-8")
    return file


def header(arguments: argparse.Namespace) -> dict[str, Any]:
    """Where and with what the rows were measured."""
    changed = "*" if _said("git", "status", "--porcelain", "--untracked-files=no") else ""
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": _said("git", "rev-parse", "--short=10", "HEAD") + changed,
        "machine": _processor(),
        "system": platform.platform(terse=True),
        "instruction_set": arguments.isa or "the best of each side",
        "threads": arguments.threads,
        "compiler": _said("rustc", "--version"),
        "python": platform.python_version(),
        "embree": f"embreex {metadata.version('embreex')}",
    }


def _processor() -> str:
    """The processor's name, cores and caches, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    fields = dict(line.split(":", 1) for line in lines if ":" in line)
    fields = {key.strip(): value.strip() for key, value in fields.items()}
    parts = [fields.get("model name", platform.machine())]
    parts += [
        f"{label} {fields[key]}" for key, label in (("cpu family", "family"), ("model", "model")) if key in fields
    ]
    cores = sum(line.startswith("processor") for line in lines)
    return ", ".join([*parts, f"{cores} logical cores", f"cache {fields.get('cache size', 'unknown')}"])


def _said(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
