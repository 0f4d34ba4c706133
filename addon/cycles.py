"""Cycles' half of a comparison: a second Blender that renders a saved copy of the scene. No bpy.

The user's Blender stays alive and its scene untouched, and a cancel is a kill. The same second Blender develops the
pictures, so that ours and Cycles' get the scene's view transform from Blender itself.
"""

import json
import os
import subprocess
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .errors import EspalierAddonError
from .report import CyclesSummary

WORKER = Path(__file__).with_name("cycles_worker.py")
PROGRESS = "espalier-progress"
"""Begins the lines by which the worker tells progress."""
KEPT_LINES = 20
"""Last lines of the worker's output that an error may quote from."""


class CyclesError(EspalierAddonError):
    """The second Blender ended without a picture."""

    def __init__(self, status: int, lines: Sequence[str]) -> None:
        said = next((line for line in reversed(lines) if "Error" in line), lines[-1] if lines else "it said nothing")
        super().__init__(f"Cycles' half of the comparison ended with status {status}: {said.strip()}")


@dataclass(frozen=True)
class Job:
    """What the second Blender does: see `cycles_worker`.

    command: how to start it, up to the script's own arguments. blend: the copy of the scene. threads at least 1.
    """

    command: tuple[str, ...]
    blend: str
    scene: str
    view_layer: str
    resolution: tuple[int, int]
    samples: int
    threads: int
    use_scripts: bool = False


def command(binary: str, python: str) -> tuple[str, ...]:
    """How to start the worker: with Blender's binary, or where there is none (the bpy module) with Python."""
    if binary:
        return (binary, "--background", "--factory-startup", "--python", str(WORKER), "--")
    return (python, "-P", str(WORKER), "--")  # -P: beside the script lie modules whose names Blender's own have


class SecondBlender:
    """The process. Arrays to develop are written to `folder` before it starts, its own are read when it is done."""

    def __init__(self, job: Job, folder: Path, *, render: bool, develop: Sequence[str]) -> None:
        """Start it. develop: names of (h, w, 4) arrays in `folder`, and "cycles" for its own render."""
        values = asdict(job) | {"folder": str(folder), "render": render, "develop": list(develop)}
        path = folder / "job.json"
        path.write_text(json.dumps(values), encoding="utf-8")
        self.progress = 0.0
        self.status = "start"
        self._folder = folder
        self._lines: deque[str] = deque(maxlen=KEPT_LINES)
        self._process = subprocess.Popen(
            [*job.command, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            env=os.environ | {name: str(folder) for name in ("TMPDIR", "TEMP", "TMP")},  # a kill cleans nothing up
            start_new_session=os.name == "posix",  # Ctrl C is the parent's to answer
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._reader = threading.Thread(target=self._read, name="espalier-cycles", daemon=True)
        self._reader.start()

    def wait(self, timeout: float) -> bool:
        """Wait at most `timeout` seconds; True when the process has ended."""
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return False
        self._reader.join()
        return True

    def kill(self) -> None:
        """End the process now, if it still runs, and wait until it is gone."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def raise_error(self) -> None:
        """Raise CyclesError where the process ended badly."""
        if self._process.returncode != 0:
            raise CyclesError(self._process.returncode, list(self._lines))

    def timing(self) -> CyclesSummary:
        """Seconds of synchronisation and rendering."""
        return CyclesSummary(**json.loads((self._folder / "timing.json").read_text(encoding="utf-8")))

    def developed(self, name: str) -> NDArray[np.uint8]:
        """The (h, w, 3) picture of a developed array."""
        picture: NDArray[np.uint8] = np.load(self._folder / f"{name}.display.npy")
        return picture

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            is_progress = line.startswith(PROGRESS)
            if is_progress and line.endswith("\n"):  # a kill may have cut the last one short
                _, progress, self.status = line.rstrip().split(" ", 2)
                self.progress = float(progress)
            elif not is_progress and line.strip():
                self._lines.append(line)
