"""The results table as texts: what each cell says, and which is the best of its column. No bpy."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from .methods import label
from .results import CYCLES, Row

LESS, MORE = -1, 1

SHORT_LABELS = {
    "bvh-median": "Median",
    "bvh-median+reinsert": "Median+R",
    "bvh-sah": "SAH",
    "bvh-sah+reinsert": "SAH+R",
    "sbvh": "Spatial",
    "sbvh+reinsert": "Spatial+R",
    "ploc": "Ordered",
    "ploc+reinsert": "Ordered+R",
    "bvh-clusters": "Clusters",
    "lbvh": "Linear",
    "grid": "Grid",
    "grid-two-level": "2-Level",
    "grid-irregular": "Irregular",
    "grid-tetrahedral": "Tetra",
    "hapala": "Tested",
    "fellner": "Nested",
    "hybrid-sampled": "Sampled",
    "hybrid-sequential": "Sequential",
    "hybrid": "Hybrid",
}
"""What the methods are called where there is little room."""


class Column(NamedTuple):
    """One column. `better` says which end of it is best: LESS, MORE, or 0 for a count that is neither."""

    field: str
    title: str
    better: int


class Cell(NamedTuple):
    """What one place of the table says."""

    text: str
    best: bool


TIMES = (
    Column("build_ms", "Build ms", LESS),
    Column("trace_s", "Trace s", LESS),
    Column("mrays_per_s", "Mrays/s", MORE),
)
SIZES = (
    Column("bytes", "Memory", LESS),
    Column("nodes", "Nodes", 0),
    Column("grids", "Grids", 0),
    Column("cells", "Cells", 0),
)


def cells(rows: Sequence[Row], column: Column) -> list[Cell]:
    """The column's cells from top to bottom. Nothing is best where there is nothing to compare it with."""
    values = [getattr(row, column.field) for row in rows]
    known = [value for value in values if value is not None]
    best = (max if column.better == MORE else min)(known) if column.better and len(known) > 1 else None
    form = byte_text if column.field == "bytes" else number_text
    return [Cell(form(value), best is not None and value == best) for value in values]


def rows_for(rows: Sequence[Row], columns: Sequence[Column]) -> list[Row]:
    """The rows that these columns have: Cycles has times, but no size."""
    return [row for row in rows if row.method != CYCLES or any(column in TIMES[:2] for column in columns)]


def method_text(method: str, *, short: bool = False) -> str:
    """A method's name, Cycles among them."""
    if method == CYCLES:
        return "Cycles"
    return SHORT_LABELS.get(method, method) if short else label(method)


def number_text(value: float | None) -> str:
    """Three significant digits, with k, M, G or T beyond 9999: 0.0123, 4.56, 871k. A dash for None."""
    if value is None:
        return "\N{EN DASH}"
    if value < 9999.5:
        return _three_digits(value)
    for suffix in "kMG":
        value /= 1000
        if value < 999.5:
            return _three_digits(value) + suffix
    return _three_digits(value / 1000) + "T"


def byte_text(value: float | None) -> str:
    """Bytes in binary units, as Blender's render statistics have them: 512, 1.50K, 38.2M, 1.20G. A dash for None."""
    if value is None:
        return "\N{EN DASH}"
    for suffix in ("", "K", "M"):
        if value < 999.5:
            return _three_digits(value) + suffix
        value /= 1024
    return _three_digits(value) + "G"


def _three_digits(value: float) -> str:
    if value == int(value) or value >= 99.95:
        return f"{value:.0f}"
    if value < 0.0005:
        return f"{value:.1e}"
    rounded = float(f"{value:.2e}")
    return f"{rounded:.{2 - math.floor(math.log10(rounded))}f}"
