"""The folder that results are written to: all of their files, or none. No bpy."""

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from .errors import EspalierAddonError

FILES = ("compare.png", "espalier.png", "cycles.png", "difference.png", "report.json")
"""Everything a comparison may write."""


class OutputError(EspalierAddonError):
    """The folder cannot be written to."""

    def __init__(self, folder: Path, reason: str) -> None:
        super().__init__(f"Cannot write to {folder} ({reason}): choose another folder with --out")


class OutputFolder:
    """A folder to come. Use it as a context: without `publish`, nothing stays of it, nor of folders made for it."""

    def __init__(self, folder: Path, files: Sequence[str] = FILES) -> None:
        """files: everything that may be written to it."""
        self.folder = folder
        self._files = files
        self._made: list[Path] = []
        self._scratch: Path | None = None

    def __enter__(self) -> "OutputFolder":
        """Make what is needed now, so that a long comparison does not fail at its end. Raises OutputError."""
        missing = [path for path in (self.folder, *self.folder.parents) if not path.exists()]
        try:
            for path in reversed(missing):
                path.mkdir()
                self._made.append(path)
            self._scratch = Path(tempfile.mkdtemp(prefix=".espalier-", dir=self.folder))
        except OSError as error:
            self.__exit__()
            raise OutputError(self.folder, error.strerror or str(error)) from error
        return self

    def publish(self, writers: Mapping[str, Callable[[Path], object]]) -> None:
        """Write every file aside, then move all of them in place; files of an earlier time go.

        writers: by name in `files`, what writes the file to a given path. Raises OutputError.
        """
        assert self._scratch is not None
        assert writers.keys() <= set(self._files)
        try:
            for name, write in writers.items():
                write(self._scratch / name)
            for name in self._files:
                if name in writers:
                    (self._scratch / name).replace(self.folder / name)
                else:
                    (self.folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(self.folder, error.strerror or str(error)) from error
        self._made.clear()

    def __exit__(self, *_error: object) -> None:
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
        for path in reversed(self._made):
            path.rmdir()
