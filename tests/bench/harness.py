"""The native harness: building it, finding Embree for it, and running it."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

WORKSPACE = Path(__file__).resolve().parents[2] / "native"


LEAVES, MAKER = "grid-of-leaves", "fellner"
"""The grid whose cells are leaves instead of lists has no method, so nobody has sped up its build; the harness makes it
with this one's builder where a plan has `grid_of_leaves`, and the rows of `turns` say so."""


class NativeError(Exception):
    """The harness could not be built or failed; the message says why."""


def build(profile: str = "release") -> Path:
    """Compile the harness with one of cargo's profiles and return its binary. Raises NativeError."""
    return _compiled("build", "--profile", profile, "-p", "espalier-bench")


def build_as_tested() -> Path:
    """The binary that `cargo test` made; compiled again on its own, the core would not share its units."""
    return _compiled("test", "--workspace", "--no-run")


def _compiled(*arguments: str) -> Path:
    command = ["cargo", *arguments, "--quiet", "--message-format=json-render-diagnostics"]
    done = subprocess.run(command, cwd=WORKSPACE, stdout=subprocess.PIPE, text=True, check=False)
    messages = (json.loads(line) for line in done.stdout.splitlines())
    binaries = [message["executable"] for message in messages if _is_harness(message)]
    if done.returncode or not binaries:
        raise NativeError("the benchmark harness does not compile, see above")
    return Path(binaries[-1])


def _is_harness(message: dict[str, Any]) -> bool:
    """Whether a message of cargo's is of the harness itself, not of its tests."""
    if not message.get("executable"):
        return False
    return message["target"]["name"] == "espalier-bench" and not message["profile"]["test"]


def embree() -> Path:
    """The shared library of Embree in the installed embreex. Raises NativeError where there is none."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        raise NativeError("the rival is missing: pip install embreex (see .ci/requirements.txt)")
    package = Path(spec.origin).parent
    folders = [package.parent / "embreex.libs", package / ".dylibs", package]
    found = [path for folder in folders for path in sorted(folder.glob("*embree4*")) if _is_library(path)]
    if not found:
        raise NativeError(f"embreex is installed, but no library of Embree 4 is beside '{package}'")
    return found[0]


def _is_library(path: Path) -> bool:
    return ".so" in path.name or path.suffix in {".dylib", ".dll"}


def pin(threads: int) -> None:
    """Keep this process and its children on as many cores as there are threads, the last ones, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, cores[-threads:])


def run(binary: Path, command: str, plan: dict[str, Any], file: Path, *more: str | Path) -> Iterator[dict[str, Any]]:
    """Write the plan to `file`, run the harness over it with `more` arguments, and yield its rows as it prints them.

    Raises NativeError with the harness's message.
    """
    file.write_text(json.dumps(plan, indent=1), encoding="utf-8")
    arguments = [binary, command, file, *more]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield from (json.loads(line) for line in process.stdout)
        finally:
            process.stdout.close()
            message = process.stderr.read().strip()
    if process.returncode:
        raise NativeError(f"{plan['scene']['name']}: {message or f'exit status {process.returncode}'}")


def turns(binary: Path, plan: dict[str, Any], file: Path) -> Iterator[dict[str, Any]]:
    """`run` a race of our methods alone; `LEAVES` may be one of them.

    Raises NativeError with the harness's message.
    """
    classes = [
        entry | {"methods": [MAKER if name == LEAVES else name for name in entry["methods"]]}
        for entry in plan["classes"]
    ]
    for row in run(binary, "turns", plan | {"classes": classes}, file):
        yield row | {"method": LEAVES if row["method"] == MAKER and "grid_of_leaves" in plan else row["method"]}
