"""The results table of every scene, as the panels show it. No bpy.

Tables are held beside the file, not in it: in scene properties, the user's next undo would take them away.
"""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from .report import CyclesSummary
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


class Table(NamedTuple):
    """The rows of a scene's last run, and what there is to say of it, one line each."""

    rows: tuple[Row, ...] = ()
    notes: tuple[str, ...] = ()


_tables: dict[int, Table] = {}
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


def cycles_row(cycles: CyclesSummary) -> Row:
    """The numbers of Cycles, which has fewer."""
    return Row(CYCLES, build_ms=cycles.sync_s * 1000, trace_s=cycles.render_s)


def rows(run: Run) -> Iterator[Row]:
    """The numbers of a run's finished methods, then a row for each that is to come unless the run has ended."""
    finished = run.results
    yield from map(row, finished)
    if not run.done:
        yield from map(Row, run.method_names[len(finished) :])


def store(scene_uid: int, table: Iterable[Row], notes: Iterable[str]) -> None:
    """Make these rows and notes the table of a scene."""
    _tables[scene_uid] = Table(tuple(table), tuple(notes))


def of(scene_uid: int) -> Table:
    """The table of a scene; empty where nothing was run."""
    return _tables.get(scene_uid, Table())


def drop(scene_uid: int) -> None:
    """Forget the table of a scene."""
    _tables.pop(scene_uid, None)


def clear() -> None:
    """Forget all tables."""
    _tables.clear()
