"""The paper's table: its rows, and its times where they are known. No bpy.

`paper.json` has the rows, and null for every time: they are not ours to guess. Whoever has the paper puts its seconds
into a copy, and gives it to the study with `--paper`.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .plan import StudyError

FILE = Path(__file__).with_name("paper.json")


@dataclass(frozen=True)
class PaperRow:
    """A row of the paper's table. seconds: of one picture, by what the paper compares; None where not known."""

    model: str
    scene: str
    triangles: int
    triangles_per_vertex: float | None
    substitute: bool
    seconds: dict[str, float | None]


@dataclass(frozen=True)
class Paper:
    """The table, and our native name of each thing that the paper compares."""

    source: str
    methods: dict[str, str]
    rows: tuple[PaperRow, ...]

    @property
    def has_times(self) -> bool:
        """Whether any of its times is known."""
        return any(value is not None for row in self.rows for value in row.seconds.values())


def read(path: Path = FILE) -> Paper:
    """The table in a file like `paper.json`. Raises StudyError where it is none."""
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        paper = Paper(content["source"], content["methods"], tuple(PaperRow(**row) for row in content["rows"]))
        for row in paper.rows:
            _check(row, paper.methods)
    except OSError as error:
        raise StudyError(f"{path} cannot be read ({error.strerror}): give a copy of {FILE}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise StudyError(f"{path} is not the paper's table ({error}): give a copy of {FILE}") from error
    return paper


def _check(row: PaperRow, methods: dict[str, str]) -> None:
    if row.seconds.keys() != methods.keys():
        raise ValueError(f"{row.model} has times of {', '.join(row.seconds)}, not of {', '.join(methods)}")
    if any(value is not None and not value > 0 for value in row.seconds.values()):
        raise ValueError(f"{row.model} has a time that is not above 0")
