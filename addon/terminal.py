"""Progress in a terminal, or in a log. No bpy.

One way of drawing serves the shell and Blender's own Python, which has no package for it.
"""

import contextlib
import ctypes
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import TextIO

BAR_WIDTH = 28
REDRAW_SECONDS = 0.1


class ProgressLine:
    """A bar on stderr that redraws itself in place; where that is no terminal, a line on stdout for each new status."""

    def __init__(self, stdout: TextIO, stderr: TextIO) -> None:
        self._live = stderr.isatty()
        self._stream = stderr if self._live else stdout
        self._start = time.monotonic()
        self._drawn = 0.0
        self._last = ""

    def update(self, progress: float, status: str, detail: str = "") -> None:
        """Show 0..1 and what is going on; cheap to call often. `detail`, which changes often, is for no log."""
        if not self._live:
            self._log(status)
            return
        now = time.monotonic()
        if now - self._drawn < REDRAW_SECONDS and progress < 1.0:
            return
        self._drawn = now
        filled = round(progress * BAR_WIDTH)
        bar = "#" * filled + "." * (BAR_WIDTH - filled)
        told = f"{status}: {detail}" if detail else status
        self._stream.write(f"\r\x1b[K[{bar}] {progress:4.0%}  {now - self._start:5.1f} s  {told}")
        self._stream.flush()

    def close(self) -> None:
        """Take the bar away."""
        if self._live and self._drawn:
            self._stream.write("\r\x1b[K")
            self._stream.flush()

    def _log(self, status: str) -> None:
        phase = "Cycles" if status.startswith("Cycles:") else status
        if phase and phase != self._last:
            self._stream.write(f"{phase}\n")
            self._stream.flush()
            self._last = phase


@contextlib.contextmanager
def own_streams() -> Iterator[tuple[TextIO, TextIO]]:
    """Our stdout and stderr, while what Blender's own code prints to file descriptors 1 and 2 goes to a scratch file.

    Blender tells of every file it reads and writes, and of every step of Cycles; none of it is for our user.
    """
    _flush()
    kept = [os.dup(descriptor) for descriptor in (1, 2)]
    streams = [os.fdopen(os.dup(descriptor), "w", encoding="utf-8", errors="replace") for descriptor in kept]
    with tempfile.TemporaryFile() as scratch:
        for descriptor in (1, 2):
            os.dup2(scratch.fileno(), descriptor)
        try:
            yield streams[0], streams[1]
        finally:
            _flush()
            for descriptor, original in zip((1, 2), kept, strict=True):
                os.dup2(original, descriptor)
                os.close(original)
            for stream in streams:
                stream.close()


def _flush() -> None:
    """Write out what Python and C hold back of their standard streams, as both do where they are no terminal.

    Blender prints its operators' reports through Python, everything else through C.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    c = ctypes.CDLL("ucrtbase" if os.name == "nt" else None)
    c.fflush(None)


@contextlib.contextmanager
def heeding_ctrl_c() -> Iterator[None]:
    """Ctrl C as Python knows it, also within Blender and in a process that was started to ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        if before is not None:  # None: Blender's own handler, in C, which Python cannot put back; Blender ends now
            signal.signal(signal.SIGINT, before)
