"""The figure of `make bench-grids`: a panel a scene, the best grid over the best hierarchy by length of rays."""

from __future__ import annotations

from collections.abc import Sequence

from verdict import Case

from espalier.study.report import svg
from espalier.study.report.svg import Scale, tag

COLUMNS = 4
WIDTH, HEIGHT = 236.0, 176.0
"""Of a panel, pixels."""
LEFT, RIGHT, TOP, BOTTOM = 36.0, 10.0, 26.0, 24.0
"""Of a panel's edges, what is no chart."""
HEAD, FOOT = 34.0, 30.0
TICKS = (0.1, 0.2, 0.5, 1.0, 2.0)
RANGE = (0.08, 2.6)
"""Ratios; those outside are drawn at the edge."""

STYLE = """
svg { --page: #ffffff; --ink: #1b1e23; --soft: #59606b; --rule: #e2e5e9; --one: #1b1e23;
  --first: #b84a00; --second: #00785a; --third: #0067a3; }
@media (prefers-color-scheme: dark) { svg { --page: #14171b; --ink: #e6e9ed; --soft: #a4adb8; --rule: #2a2f36;
  --one: #e6e9ed; --first: #f2a33c; --second: #35c99b; --third: #5ab8ee; } }
text { font: 11.5px system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; fill: var(--ink); }
.page { fill: var(--page); } .tick { fill: var(--soft); } .name { font-weight: 600; }
.rule { stroke: var(--rule); } .one { stroke: var(--one); stroke-width: 1.4; }
.line { fill: none; stroke-width: 2; } .dot { stroke: var(--page); stroke-width: 0.8; }
.first { stroke: var(--first); } .second { stroke: var(--second); } .third { stroke: var(--third); }
.dot.first { fill: var(--first); } .dot.second { fill: var(--second); } .dot.third { fill: var(--third); }
"""
"""Colours of Okabe and Ito, which keep apart with any colour vision, as in the study's report. The page has a colour of
its own, so that lines are legible on whatever it lies."""

SERIES = ("first", "second", "third")
DASHES = (None, "6 3", "2 3")


def length(reach: float | None) -> str:
    """A reach for people: a share of the diagonal."""
    return "∞" if reach is None else f"{reach * 100:g}%"


def series(cases: Sequence[Case]) -> list[int]:
    """The sizes of batches that are drawn: the least, one between, the greatest."""
    batches = sorted({case.batch for case in cases})
    return list(dict.fromkeys([batches[0], batches[len(batches) // 2], batches[-1]]))


def draw(cases: Sequence[Case]) -> str:
    """The figure as an SVG file."""
    scenes = list(dict.fromkeys(case.scene for case in cases))
    rows = -(-len(scenes) // COLUMNS)
    width, height = COLUMNS * WIDTH + 8, HEAD + rows * HEIGHT + FOOT
    panels = [
        _panel([case for case in cases if case.scene == scene], series(cases), index % COLUMNS * WIDTH,
               HEAD + index // COLUMNS * HEIGHT)
        for index, scene in enumerate(scenes)
    ]  # fmt: skip
    foot = (
        "across: length of the rays, as a share of the diagonal of the scene's box; up: rays per second of the fastest"
    )
    foot += " grid over those of the fastest hierarchy"
    return tag(
        "svg",
        tag("style", STYLE),
        tag("rect", width="100%", height="100%", class_="page"),
        _legend(series(cases)),
        *panels,
        svg.text(foot, LEFT, height - 10, "tick"),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {width:g} {height:g}",
        width=width,
        height=height,
        role="img",
        aria_label="The fastest grid over the fastest hierarchy, by content, length of rays, and rays of a call",
    ) + "\n"  # fmt: skip


def _legend(batches: list[int]) -> str:
    """Which line is which, above the panels."""
    parts, x = [], LEFT
    for index, batch in enumerate(batches):
        told = "one ray a call" if batch == 1 else f"{batch:,} rays a call".replace(",", " ")
        parts += [_line([(x, 16.0), (x + 30, 16.0)], index), svg.text(told, x + 38, 20.0)]
        x += 168
    parts += [tag("line", x1=x, x2=x + 30, y1=16, y2=16, class_="one"), svg.text("above it a grid wins", x + 38, 20.0)]
    return tag("g", *parts)


def _panel(cases: Sequence[Case], batches: list[int], x: float, y: float) -> str:
    """One scene, its corner at (x, y)."""
    reaches = sorted({case.reach for case in cases}, key=lambda reach: reach or float("inf"))
    across = Scale(0.0, max(len(reaches) - 1.0, 1.0), x + LEFT + 12, x + WIDTH - RIGHT - 12)
    up = Scale(*RANGE, y + HEIGHT - BOTTOM, y + TOP, log=True)
    left, right = x + LEFT, x + WIDTH - RIGHT
    parts = [svg.text(cases[0].scene, left, y + 16, "name")]
    parts.append(svg.text(f"occupied {cases[0].occupancy:.0%}", right, y + 16, "tick", "end"))
    for value in TICKS:
        kind = "one" if value == 1 else "rule"
        parts.append(tag("line", x1=left, x2=right, y1=up(value), y2=up(value), class_=kind))
        parts.append(svg.text(f"{value:g}", left - 6, up(value) + 4, "tick", "end"))
    for place, reach in enumerate(reaches):
        parts.append(svg.text(length(reach), across(place), y + HEIGHT - BOTTOM + 15, "tick", "middle"))
    for index, batch in enumerate(batches):
        ratios = {case.reach: case.ratio for case in cases if case.batch == batch}
        points = [(across(place), up(ratios[reach])) for place, reach in enumerate(reaches)]
        told = ", ".join(f"{ratios[reach]:.2f} at {length(reach)}" for reach in reaches)
        dots = [tag("circle", cx=px, cy=py, r=3, class_=f"dot {SERIES[index]}") for px, py in points]
        parts.append(tag("g", svg.title(f"{batch} a call: {told}"), _line(points, index), *dots))
    return tag("g", *parts)


def _line(points: list[tuple[float, float]], index: int) -> str:
    return svg.path(points, class_=f"line {SERIES[index]}", stroke_dasharray=DASHES[index])
