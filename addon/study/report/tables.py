"""The tables of the report, each as markup; empty where a study has nothing for it. No bpy."""

from collections.abc import Callable, Sequence
from html import escape

from ...report import memory
from ..paper import Paper, PaperRow
from ..plan import EMBREE, PAPER_RAYS, RAY_CLASSES, Group, family
from ..rows import Results, Row
from . import marks, small, svg
from .svg import tag


def paper_table(results: Results, paper: Paper) -> str:
    """The paper's rows: its sizes beside ours, its times beside ours as ratios."""
    groups = {group.scene: group for group in reversed(results.groups()) if group.rays == PAPER_RAYS}
    rows = [row for row in paper.rows if row.scene in groups]
    if not rows:
        return ""
    methods = {what: name for what, name in paper.methods.items() if name in results.plan.methods}
    best = next((name for name in marks.ranking(results) if family(name) == "hybrid"), None)
    beside = [best] if best and best not in methods.values() else []
    columns = [what if what == name else f"{what} ({name})" for what, name in methods.items()]
    first = tag(
        "tr",
        tag("th", rowspan=2),
        _wide("Triangles", 2),
        _wide("Triangles a vertex", 2),
        *(_wide(name, 3) for name in columns),
        *(tag("th", "best hybrid") for _ in beside),
    )
    second = tag(
        "tr",
        *(tag("th", name) for name in ("paper", "ours") * 2 + ("paper s", "ours s", "ratio") * len(columns)),
        *(tag("th", f"{name} s") for name in beside),
    )
    body = [_paper_row(results, groups[row.scene], row, methods, beside) for row in rows]
    table = small.scrolled(tag("table", tag("thead", first, second), tag("tbody", *body)))
    return tag("p", escape(_paper_note(paper, rows))) + table


def _paper_note(paper: Paper, rows: Sequence[PaperRow]) -> str:
    note = (
        f"{paper.source}. Seconds of build and trace together; ratio: the paper's by ours; {RAY_CLASSES[PAPER_RAYS]}."
    )
    if any(row.substitute for row in rows):
        note += " A star marks a model that stands in for the paper's, which could not be had."
    if not paper.has_times:
        note += (
            " The paper's times are not in this project, so its columns are empty: put its seconds into a copy of "
            "addon/study/paper.json and give that with --paper, and the ratios appear."
        )
    return note


def _paper_row(results: Results, group: Group, row: PaperRow, methods: dict[str, str], beside: Sequence[str]) -> str:
    scene = results.scenes[group]
    ratio = scene["triangles"] / scene["vertices"]
    theirs = row.triangles_per_vertex
    cells = [
        tag("th", row.model + (" *" if row.substitute else ""), scope="row"),
        *(tag("td", f"{size:,}") for size in (row.triangles, scene["triangles"])),
        tag("td", f"{theirs:.4f}" if theirs else "-"),
        tag("td", f"{ratio:.4f}"),
    ]
    for what, method in methods.items():
        found, seconds = results.find(group, method), row.seconds[what]
        ours = found.total_s if found else None
        cells.append(tag("td", f"{seconds:g}" if seconds else "-"))
        cells.append(tag("td", f"{ours:.4f}" if ours else "-"))
        cells.append(tag("td", svg.digits(seconds / ours) if seconds and ours else "-"))
    for method in beside:
        found = results.find(group, method)
        cells.append(tag("td", f"{found.total_s:.4f}" if found else "-"))
    return tag("tr", *cells)


def winners(results: Results) -> str:
    """Matrices of methods and scenes: the least of a column is framed, the others are told as its multiples."""
    parts = [
        tag(
            "p",
            "Every number is a multiple of the least in its column, which is framed; stronger colour is slower. "
            "Embree stands apart.",
        )
    ]
    for name, value in (
        ("Build and trace", lambda row: row.total_s),
        ("Trace alone", lambda row: row.trace_s),
        ("Build alone", lambda row: row.build_s),
        ("Memory", lambda row: marks.census(row, "bytes")),
        ("Steps a ray", lambda row: row.evidence.steps if row.evidence else None),
    ):
        parts.append(tag("div", tag("h3", name), _matrix(results, value), class_="matrix"))
    return parts[0] + tag("div", *parts[1:], class_="matrices")


def _matrix(results: Results, value: Callable[[Row], float | None]) -> str:
    groups = results.groups()
    labels = (escape(marks.scene_label(results, group)).replace("_", "_<wbr>") for group in groups)
    head_row = tag("tr", tag("th"), *(tag("th", label) for label in labels))
    methods = marks.by_family(list(results.plan.methods))
    least = {}
    for group in groups:
        known = [found for row in results.of(group) if row.method != EMBREE and (found := value(row))]
        least[group] = min(known, default=None)
    body = []
    for method in methods:
        rows = [results.find(group, method) for group in groups]
        numbers = [value(row) if row else None for row in rows]
        if any(numbers):
            cells = [_multiple(number, least[group], method) for number, group in zip(numbers, groups, strict=True)]
            body.append(tag("tr", _method_name(method), *cells, data_method=method))
    return small.scrolled(tag("table", tag("thead", head_row), tag("tbody", *body)))


MOST_SHADED = 8.0
"""Multiples from here on have the darkest shade."""


def _multiple(number: float | None, least: float | None, method: str) -> str:
    if not number or not least:
        return tag("td", "-")
    ratio = number / least
    if method == EMBREE:
        return tag("td", svg.digits(ratio), class_="soft")
    shade = min(max(ratio - 1.0, 0.0) / (MOST_SHADED - 1.0), 1.0) ** 0.5
    best = " best" if ratio == 1.0 else ""
    return tag("td", "1" if ratio == 1.0 else svg.digits(ratio), class_=f"shade{best}", style=f"--t:{shade:.2f}")


NUMBERS: dict[str, Callable[[Row], str]] = {
    "runs": lambda row: str(len(row.runs)),
    "build ms": lambda row: svg.digits(row.build_s * 1000),
    "trace ms": lambda row: svg.digits(row.trace_s * 1000),
    "total ms": lambda row: svg.digits(row.total_s * 1000),
    "interval": lambda row: _interval(row),
    "Mrays/s": lambda row: svg.digits(row.mrays_per_s),
    "by ref.": lambda row: f"{row.relative['total_s'].median:.3f}" if row.relative else "-",
    "steps": lambda row: _known(row.evidence.steps if row.evidence else None),
    "tests": lambda row: _known(row.evidence.tests if row.evidence else None),
    "memory": lambda row: memory(int(marks.census(row, "bytes") or 0)) if marks.census(row, "bytes") else "-",
    "nodes": lambda row: _known(marks.census(row, "nodes")),
    "leaves": lambda row: _known(marks.census(row, "leaves")),
    "grids": lambda row: _known(marks.census(row, "grids")),
    "cells": lambda row: _known(marks.census(row, "cells")),
    "references": lambda row: _known(marks.census(row, "references")),
}
"""The columns of the table of all numbers."""


def numbers(results: Results) -> str:
    """A table a group with everything that was measured, and below it builds by their phases."""
    parts = []
    for group in results.groups():
        rows = {row.method: row for row in results.of(group)}
        ordered = [rows[method] for method in marks.by_family(list(rows))]
        label = f"{marks.scene_label(results, group)}: {results.triangles(group):,} triangles"
        parts += [tag("h3", escape(label)), _numbers_table(ordered), _phases(ordered)]
    return "".join(parts)


def _numbers_table(rows: Sequence[Row]) -> str:
    head = tag("tr", tag("th"), *(tag("th", name) for name in NUMBERS))
    body = [
        tag("tr", _method_name(row.method), *(tag("td", escape(write(row))) for write in NUMBERS.values()))
        for row in rows
    ]
    return small.scrolled(tag("table", tag("thead", head), tag("tbody", *body)))


def _phases(rows: Sequence[Row]) -> str:
    """Builds by phases, folded on a screen."""
    body = []
    for row in rows:
        told = ", ".join(f"{name} {svg.digits(ms)}" for name, ms in row.phases.items())
        if told:
            body.append(tag("tr", _method_name(row.method), tag("td", escape(told), class_="left")))
    table = small.scrolled(tag("table", tag("tbody", *body)))
    return tag("details", tag("summary", "Builds by phase, milliseconds"), table) if body else ""


def _method_name(method: str) -> str:
    return tag("th", escape(method), scope="row", class_=f"f-{family(method)}")


def failures(results: Results) -> str:
    """The cases that failed, with the reasons."""
    body = [
        tag(
            "tr",
            tag("td", escape(row.case.group.label), class_="left"),
            tag("td", escape(row.method), class_="left"),
            tag("td", escape(row.failure or ""), class_="left"),
        )
        for row in results.failures
    ]
    head_row = tag("tr", *(tag("th", name, class_="left") for name in ("Scene and rays", "Method", "Reason")))
    return small.scrolled(tag("table", tag("thead", head_row), tag("tbody", *body))) if body else ""


def _wide(name: str, columns: int) -> str:
    return tag("th", escape(name), colspan=columns)


def _interval(row: Row) -> str:
    total = row.times["total_s"]
    if total.number < 2:
        return "-"
    return f"{svg.digits(total.low * 1000)} to {svg.digits(total.high * 1000)}"


def _known(value: float | None) -> str:
    return "-" if value is None else svg.digits(value)
