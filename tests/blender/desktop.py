"""A virtual display with Blender's window on it: real mouse, real keys, screenshots, and Python in that Blender.

Needs Xvfb, xdotool and ImageMagick's `import` and `convert`.
"""

import json
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blender import SCRIPTS, Blender

SIZE = (1600, 1000)
REST = (SIZE[0] // 2, SIZE[1] - 6)
"""Where no button is: the empty part of the status bar."""
SETTLE_SECONDS = 20.0
"""Longest that software OpenGL may take to draw what is asked for, on a busy machine."""


def wait_until(condition: Callable[[], Any], seconds: float, what: str, interval: float = 0.1) -> Any:
    """The first true value of `condition`; AssertionError naming `what` after `seconds`."""
    deadline = time.monotonic() + seconds
    while True:
        if value := condition():
            return value
        assert time.monotonic() < deadline, f"not within {seconds} s: {what}"
        time.sleep(interval)


class Desktop:
    """Blender's window of SIZE pixels on a display of its own; a context manager that ends both."""

    def __init__(self, blender: Blender, blend: Path, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._start_display()
        self._start_blender(blender, blend)

    def _start_display(self) -> None:
        read, write = os.pipe()
        screen = f"{SIZE[0]}x{SIZE[1]}x24"
        self.display = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", screen, "+extension", "GLX", "-nolisten", "tcp"],
            pass_fds=[write],
            stderr=subprocess.DEVNULL,
        )
        os.close(write)
        with os.fdopen(read) as pipe:
            self.environment = os.environ | {"DISPLAY": ":" + pipe.readline().strip()}

    def _start_blender(self, blender: Blender, blend: Path) -> None:
        self.log = (self.folder / "blender.log").open("w+", encoding="utf-8")
        window = ["--window-geometry", "0", "0", *map(str, SIZE)]
        remote = ["--python", str(SCRIPTS / "remote.py"), "--", str(self.folder)]
        self.process = subprocess.Popen(
            [*blender.command, *window, str(blend), *remote],
            env=self.environment | blender.environment | {"DISPLAY": self.environment["DISPLAY"]},
            stdout=self.log,
            stderr=subprocess.STDOUT,
        )
        try:
            self.python("value = True", timeout=60)
            time.sleep(1.0)  # the first redraws of all areas
        except AssertionError:
            self.close()
            raise

    def __enter__(self) -> "Desktop":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End Blender and the display."""
        for process in (self.process, self.display):
            process.kill()
            process.wait()
        self.log.close()

    def output(self) -> str:
        """All that Blender printed so far."""
        return (self.folder / "blender.log").read_text(encoding="utf-8")

    def python(self, source: str, timeout: float = 20) -> Any:
        """Run `source` on Blender's main thread; the value of its variable `value`. Its error is an AssertionError."""
        reply = self.folder / "reply.json"
        reply.unlink(missing_ok=True)
        request = self.folder / "request.part"
        request.write_text(source, encoding="utf-8")
        request.rename(self.folder / "request.py")
        wait_until(lambda: reply.exists() or self.process.poll() is not None, timeout, "an answer of Blender", 0.02)
        assert reply.exists(), f"Blender ended with {self.process.poll()}\n{self.output()}"
        answer = json.loads(reply.read_text(encoding="utf-8"))
        assert "error" not in answer, answer["error"]
        return answer["value"]

    def _xdotool(self, *arguments: object) -> None:
        subprocess.run(["xdotool", *map(str, arguments)], env=self.environment, check=True)

    def move(self, x: int, y: int) -> None:
        """Move the mouse to a pixel, counted from the upper left."""
        self._xdotool("mousemove", x, y)

    def click(self, x: int, y: int) -> None:
        """Press and release the left button at a pixel, and take the mouse away, so that no tooltip hides a thing."""
        self.move(x, y)
        time.sleep(0.3)  # Blender makes the button under the mouse active on its next redraw
        self._xdotool("click", 1)
        time.sleep(0.1)
        self.move(*REST)

    def key(self, name: str) -> None:
        """Press and release a key, by its X name."""
        self._xdotool("key", name)

    def answer_seconds(self) -> float:
        """The slowest of some answers: what the interface and this harness take now, without any work."""
        slowest = 0.0
        for _ in range(5):
            asked = time.monotonic()
            self.python("value = True")
            slowest = max(slowest, time.monotonic() - asked)
        return slowest

    def screenshot(self, name: str) -> NDArray[np.uint8]:
        """The whole screen as it is now, (height, width, 3), also kept as NAME.png in the folder."""
        path = self.folder / f"{name}.png"
        subprocess.run(["import", "-window", "root", path], env=self.environment, check=True)
        raw = subprocess.run(["convert", path, "-depth", "8", "rgb:-"], capture_output=True, check=True).stdout
        return np.frombuffer(raw, np.uint8).reshape(SIZE[1], SIZE[0], 3)

    def settled(self, name: str) -> NDArray[np.uint8]:
        """The screen once everything is drawn anew and two screenshots in a row are the same."""
        self.python("for area in window.screen.areas:\n    area.tag_redraw()")
        last = self.screenshot(name)
        deadline = time.monotonic() + SETTLE_SECONDS
        while time.monotonic() < deadline:
            time.sleep(0.4)
            last, before = self.screenshot(name), last
            if np.array_equal(last, before):
                return last
        raise AssertionError(f"the screen does not come to rest: {name}")
