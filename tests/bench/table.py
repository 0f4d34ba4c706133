"""Results as text."""

from __future__ import annotations

from collections import defaultdict
from math import exp, log
from typing import Any

from rich.table import Table

Row = dict[str, Any]


def line(row: Row) -> str:
    """One result, as soon as it is there."""
    return (
        f"{row['scene']:<20} {row['class']:<14} {row['method']:<15} "
        f"{number(row['ours']):>10} {number(row['embree']):>10} "
        f"{row['unit']:<8} x{row['ratio']:<6.2f} ({row['embree_call']})"
    )


def render(rows: list[Row]) -> Table:
    """Every result. Beside Embree's default: its other builds; mismatches, and of these, by double precision, our
    and Embree's wrong answers."""
    shown = Table(title="Espalier against Embree; a ratio above 1: Espalier is better")
    for heading in ("scene", "class", "method", "isa", "unit"):
        shown.add_column(heading, no_wrap=True)
    for heading in ("ours", "Embree", "ratio", "robust", "high", "rays", "mismatches", "ours, its wrong"):
        shown.add_column(heading, justify="right", no_wrap=True)
    shown.add_column("Embree's call", no_wrap=True)
    for row in rows:
        names = (row["scene"], row["class"], row["method"], row["isa"], row["unit"])
        beside = (number(row["beside"].get(build)) for build in ("robust", "high"))
        wrong = f"{row['ours_wrong']}, {row['embree_wrong']}"
        checked = (str(row["rays"]), str(row["mismatches"]), wrong) if row["rays"] else ("", "", "")
        ratio = f"{row['ratio']:.2f}"
        shown.add_row(*names, number(row["ours"]), number(row["embree"]), ratio, *beside, *checked, row["embree_call"])
    return shown


def summary(rows: list[Row], classes: dict[str, dict[str, Any]]) -> Table:
    """Per class and method: the least ratio and the geometric mean over the scenes, and the figures to reach."""
    shown = Table(title="Ratios over the scenes")
    shown.add_column("class")
    shown.add_column("method")
    for heading in ("scenes", "least", "of at least", "mean", "of at least", "aim"):
        shown.add_column(heading, justify="right")
    ratios = defaultdict(list)
    for row in rows:
        ratios[row["class"], row["method"]].append(row["ratio"])
    for (name, method), values in ratios.items():
        figure = classes[name]["figure"]
        least, mean = min(values), exp(sum(map(log, values)) / len(values))
        cells = (
            _judged(least, figure["each"]),
            f"{figure['each']}",
            _judged(mean, figure["mean"]),
            f"{figure['mean']}",
        )
        shown.add_row(name, method, str(len(values)), *cells, f"{figure['aim']}")
    return shown


def number(value: float | None) -> str:
    """Four digits that matter, grouped; nothing for None."""
    if value is None:
        return ""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.4g}"


def _judged(value: float, needed: float) -> str:
    return f"[{'green' if value >= needed else 'red'}]{value:.2f}[/]"
