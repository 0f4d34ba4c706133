"""The README's tables of recorded results: run it to print them; a test holds the README to them."""

from __future__ import annotations

import json
import sys
from typing import Any

import definitions
import record
from ratio_figure import length
from verdict import Case, read

Row = dict[str, Any]

SHOWN = [(1, 0.002), (1, 0.01), (1, None), (512, 0.002), (512, None), (100_000, 0.002), (100_000, None)]
"""Batch and reach of the columns."""


def recorded(name: str) -> Row:
    """A record: `about`, `rows`, and what else it has."""
    return json.loads((record.FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def recorded_cases() -> list[Case]:
    """The cases of the record."""
    grids = definitions.load().grids["grids"]
    return [read(row, grids) for row in recorded("grids")["rows"]]


def ratios(cases: list[Case]) -> list[str]:
    """A line a scene: the fastest grid over the fastest hierarchy in the shown cases, bold where a grid wins."""
    found = {(case.scene, case.batch, case.reach): case.ratio for case in cases}
    head = ["scene", "occupied", *(_column(batch, reach) for batch, reach in SHOWN)]
    lines = [_line(head), _line(["---", *["---:"] * (len(head) - 1)])]
    for scene, occupied in dict.fromkeys((case.scene, case.occupancy) for case in cases):
        values = [found[scene, batch, reach] for batch, reach in SHOWN]
        cells = [f"**{value:.2f}**" if value > 1 else f"{value:.2f}" for value in values]
        lines.append(_line([f"`{scene}`", f"{occupied:.2f}", *cells]))
    return lines


def paper(rows: list[Row]) -> list[str]:
    """A line a scene: milliseconds of the first method, and the others' ratios to it, build / trace / total."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    head = ["scene", f"`{methods[0]}`, ms", *(f"`{method}`" for method in methods[1:])]
    lines = [_line(head), _line(["---", *["---:"] * (len(head) - 1)])]
    for scene in dict.fromkeys(row["scene"] for row in rows):
        first, *others = (row for row in rows if row["scene"] == scene)
        times = " / ".join(_milliseconds(first[part]) for part in first["ratios"])
        parts = [" / ".join(f"{value:.2f}" for value in row["ratios"].values()) for row in others]
        lines.append(_line([scene, times, *parts]))
    return lines


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.0f}" if seconds >= 0.01 else f"{seconds * 1e3:.1f}"


def _column(batch: int, reach: float | None) -> str:
    calls = "one ray" if batch == 1 else f"{batch:,} rays".replace(",", " ")
    return f"{calls}, {length(reach)}"


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print both tables and how well winners are foretold."""
    print(*ratios(recorded_cases()), "", *paper(recorded("paper")["rows"]), sep="\n")
    print(json.dumps(recorded("grids")["summary"]["foretold"]))


if __name__ == "__main__":
    sys.exit(main())
