"""The results table of every scene, as the panels show it. No bpy.

Tables are held beside the file, not in it: in scene properties, the user's next undo would take them away.
"""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from .run import MethodResult, Run

CYCLES = "cycles"
"""The method's name in the row of Cycles."""


class Row(NamedTuple):
    """One method's numbers; None where there is none, or not yet. For Cycles, build is its synchronisation."""

    method: str
    build_ms: float | None = None
    trace_s: float | None = None
    mrays_per_s: float | None = None
    bytes: int | None = None
    nodes: int | None = None
    grids: int | None = None
    cells: int | None = None


_tables: dict[int, tuple[Row, ...]] = {}
"""By the scene's session_uid."""


def row(result: MethodResult) -> Row:
    """The numbers of a finished method."""
    census: dict[str, Any] = result.census
    return Row(
        result.method,
        result.build_ms,
        result.trace_s,
        result.mrays_per_s,
        census["bytes"],
        census["nodes"],
        census["grids"],
        census["cells"],
    )


def rows(run: Run) -> Iterator[Row]:
    """The numbers of a run's finished methods, then a row for each that is to come unless the run has ended."""
    finished = run.results
    yield from map(row, finished)
    if not run.done:
        yield from map(Row, run.method_names[len(finished) :])


def store(scene_uid: int, table: Iterable[Row]) -> None:
    """Make these rows the table of a scene."""
    _tables[scene_uid] = tuple(table)


def of(scene_uid: int) -> tuple[Row, ...]:
    """The table of a scene; empty where nothing was run."""
    return _tables.get(scene_uid, ())


def drop(scene_uid: int) -> None:
    """Forget the table of a scene."""
    _tables.pop(scene_uid, None)


def clear() -> None:
    """Forget all tables."""
    _tables.clear()
