"""Fetching a file over HTTP into a folder, whole or not at all. No bpy."""

import contextlib
import os
import tempfile
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

from .errors import DownloadError

CHUNK = 1 << 18
TIMEOUT_SECONDS = 30
LIMIT = 1 << 28
"""Most bytes of a download; the largest model is a tenth of it."""


@contextlib.contextmanager
def atomic(target: Path) -> Iterator[Path]:
    """A path beside `target` to write to; it becomes `target` when the block ends well, and else is deleted."""
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    os.close(handle)
    part = Path(name)
    try:
        yield part
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def download(url: str, target: Path, progress: Callable[[float], None] = lambda _: None) -> None:
    """Stream `url` into `target`, which appears only when it is whole. What it holds is the caller's to check.

    progress is called with 0..1 where the server says how long the file is. Raises DownloadError.
    """
    with atomic(target) as part:
        try:
            _stream(url, part, progress)
        except (OSError, ValueError) as error:
            raise DownloadError(url, _reason(error)) from error


def _stream(url: str, part: Path, progress: Callable[[float], None]) -> None:
    with urllib.request.urlopen(url, timeout=TIMEOUT_SECONDS) as response, part.open("wb") as stream:
        length = int(response.headers.get("Content-Length") or 0)
        received = 0
        while chunk := response.read(CHUNK):
            stream.write(chunk)
            received += len(chunk)
            if received > LIMIT:
                raise ValueError(f"it is larger than {LIMIT >> 20} MiB")
            if length:
                progress(received / length)
        if received < length:
            raise ValueError(f"it ended after {received} of {length} bytes")


def _reason(error: Exception) -> str:
    return str(error.reason) if isinstance(error, urllib.error.URLError) else str(error) or type(error).__name__
