"""The charts with axes: bars, time to image by number of rays, cost by triangles. No bpy."""

from collections.abc import Callable, Iterator
from itertools import cycle, groupby
from statistics import median
from typing import NamedTuple

from ..plan import Group, family
from ..rows import Results, Row
from . import marks, svg
from .svg import Scale, tag

BAR, BAR_GAP = 13, 5
CLIP = 4.0
"""Bars longer than this many medians are cut, with their number beside them, so that the others can be read."""

RAYS = (1e3, 1e8)
"""Numbers of rays of the time-to-image charts."""

MOST_MULTIPLE = 5.0
"""Lines are followed up to this many times the fastest."""


def bars(results: Results, group: Group) -> str:
    """Build and trace of every method on a group, the fastest on top, with the interval of their sum."""
    rows = sorted(results.of(group), key=lambda row: row.total_s)
    left, right, top = 150, 430, 8
    bottom = top + len(rows) * (BAR + BAR_GAP)
    most = min(max(row.times["total_s"].high for row in rows), CLIP * median(row.total_s for row in rows))
    scale = Scale(0.0, most, left, right)
    parts = [svg.x_axis(scale, top, bottom, "build and trace", _seconds_or_zero)]
    for index, row in enumerate(rows):
        parts.append(_bar(row, scale, top + index * (BAR + BAR_GAP), most))
    return svg.picture(520, bottom + 36, f"Build and trace times, {group.label}", *parts)


def _seconds_or_zero(value: float) -> str:
    return svg.seconds(value) if value else "0"


def _bar(row: Row, scale: Scale, y: float, most: float) -> str:
    begin, middle, end = scale(0.0), scale(row.build_s), scale(row.total_s)
    total = row.times["total_s"]
    centre = y + BAR / 2
    parts = [
        svg.title(f"{row.method}: build {svg.seconds(row.build_s)}, trace {svg.seconds(row.trace_s)}"),
        svg.text(row.method, begin - 8, centre + 4, "label", "end"),
        tag("rect", x=begin, y=y, width=max(middle - begin, 0.0), height=BAR, class_="bar build"),
        tag("rect", x=middle, y=y, width=max(end - middle, 0.0), height=BAR, class_="bar trace"),
    ]
    if total.low < total.high and row.total_s <= most:
        low, high = scale(total.low), scale(total.high)
        ends = f"M{low:.1f} {y + 3}v7M{high:.1f} {y + 3}v7"
        parts.append(tag("path", d=f"M{low:.1f} {centre}H{high:.1f}{ends}", class_="whisker"))
    if row.total_s > most:
        parts.append(tag("path", d=f"M{end - 9:.1f} {y - 1}l4 {BAR + 2}m4 {-BAR - 2}l4 {BAR + 2}", class_="cut"))
    after = max(end, scale(min(total.high, most)))
    parts.append(svg.text(svg.seconds(row.total_s), after + 6, centre + 4, "number"))
    return tag("g", *parts, class_=f"mark f-{family(row.method)}", data_method=row.method)


class Crossing(NamedTuple):
    """Where two methods take equally long to the image; from there on `after` is faster than `before`."""

    rays: float
    seconds: float
    before: str
    after: str


def crossings(rows: list[Row]) -> list[Crossing]:
    """Where the fastest method changes as rays become more: build and a constant time a ray. Empty of no rays."""
    found: list[Crossing] = []
    now = min(rows, key=lambda row: (row.build_s, row.ray_s), default=None)
    at = 0.0
    while now is not None:
        later = [(_meeting(now, row), row) for row in rows if row.ray_s < now.ray_s]
        later = [(rays, row) for rays, row in later if rays >= at]
        if not later:
            return found
        at, following = min(later, key=lambda pair: (pair[0], pair[1].ray_s))
        found.append(Crossing(at, now.build_s + at * now.ray_s, now.method, following.method))
        now = following
    return found


def _meeting(first: Row, second: Row) -> float:
    """The number of rays at which a steeper line meets a flatter one."""
    return (second.build_s - first.build_s) / (first.ray_s - second.ray_s)


def time_to_image(results: Results, group: Group) -> str:
    """Build plus rays times the time a ray, on logarithmic axes, and below as multiples of the fastest; where the
    fastest changes is marked."""
    rows = [row for row in results.of(group) if row.ray_s > 0.0]
    ours = [row for row in rows if family(row.method) != "reference"]
    if not ours:
        return ""
    found = [crossing for crossing in crossings(ours) if RAYS[0] <= crossing.rays <= RAYS[1]]
    named = marks.shown(results)
    others = dict.fromkeys(name for crossing in found for name in (crossing.before, crossing.after))
    named |= dict(zip((name for name in others if name not in named), cycle(marks.OTHER_DASHES[1:]), strict=False))
    rows.sort(key=lambda row: row.method in named)
    left, right, top, bottom = 52, 400, 28, 240
    across = Scale(*RAYS, left, right, log=True)
    up = svg.log_scale([_cost(row, rays) for row in rows for rays in RAYS], bottom, top)
    parts = [
        svg.x_axis(across, top, bottom, "", svg.count),
        svg.y_axis(up, left, right, "time to image", svg.seconds),
        *(_cost_line(row, across, up, named) for row in rows),
    ]
    ends = [(row.method, up(_cost(row, RAYS[1]))) for row in rows if row.method in named]
    parts += _end_labels(ends, right, top, bottom)
    for crossing in found:
        told = f"from {svg.count(crossing.rays)} rays on, {crossing.after} is faster than {crossing.before}"
        parts.append(_dot(across(crossing.rays), up(crossing.seconds), told))
    parts.append(_multiples(rows, ours, found, across, named))
    return svg.picture(520, 450, f"Time to image by number of rays, {group.label}", *parts)


def _multiples(
    rows: list[Row], ours: list[Row], found: list[Crossing], across: Scale, named: dict[str, str | None]
) -> str:
    """The same lines as multiples of the fastest of ours, which has the base line; what is far above is left out."""
    top, bottom = 290, 414
    up = Scale(1.0, MOST_MULTIPLE, bottom, top, log=True)
    parts = [
        svg.x_axis(across, top, bottom, "rays", svg.count),
        svg.y_axis(up, across.start, across.end, "times the fastest", svg.digits),
    ]
    for row in (row for row in rows if row.method in named):
        points = []
        for rays in _ray_counts():
            multiple = _cost(row, rays) / min(_cost(other, rays) for other in ours)
            points.append((across(rays), up(multiple), 0.99 <= multiple <= MOST_MULTIPLE))
        for part in _runs_inside(points):
            parts.append(_line(row.method, part, row.method, named))
    parts += [_dot(across(crossing.rays), up(1.0), crossing.after) for crossing in found]
    return "".join(parts)


def _runs_inside(points: list[tuple[float, float, bool]]) -> Iterator[list[tuple[float, float]]]:
    """The pieces of a line whose points are inside, each of at least two."""
    for inside, run in groupby(points, key=lambda point: point[2]):
        part = [(x, y) for x, y, _ in run]
        if inside and len(part) > 1:
            yield part


def _cost(row: Row, rays: float) -> float:
    return row.build_s + rays * row.ray_s


def _ray_counts() -> list[float]:
    """Numbers of rays at which lines have points."""
    steps = 100
    return [RAYS[0] * (RAYS[1] / RAYS[0]) ** (index / steps) for index in range(steps + 1)]


def _cost_line(row: Row, across: Scale, up: Scale, named: dict[str, str | None]) -> str:
    points = [(across(rays), up(_cost(row, rays))) for rays in _ray_counts()]
    told = f"{row.method}: {svg.seconds(row.build_s)} build, then {svg.seconds(row.ray_s)} a ray"
    return _line(row.method, points, told, named)


def _line(method: str, points: list[tuple[float, float]], told: str, named: dict[str, str | None]) -> str:
    known = method in named
    line = svg.path(points, class_="line" if known else "line faint", stroke_dasharray=named.get(method))
    return tag("g", svg.title(told), line, class_=f"mark f-{family(method)}", data_method=method)


def _dot(x: float, y: float, told: str) -> str:
    return tag("g", svg.title(told), tag("circle", cx=x, cy=y, r=5, class_="crossing"))


def _end_labels(ends: list[tuple[str, float]], right: float, top: float, bottom: float) -> list[str]:
    """The methods' names beside the right ends of their lines, which are at the given heights."""
    labels = []
    moved = svg.apart([own for _, own in ends], 13, top, bottom)
    for (method, own), place in zip(ends, moved, strict=True):
        lead = svg.path([(right + 1, own), (right + 9, place)], class_="lead")
        name = svg.text(method, right + 12, place + 4, "name")
        labels.append(tag("g", lead, name, class_=f"mark f-{family(method)}", data_method=method))
    return labels


class Quantity(NamedTuple):
    """What a chart shows of a row: None where it is not known."""

    name: str
    value: Callable[[Row], float | None]
    label: Callable[[float], str]


def by_triangles(results: Results, groups: list[Group], quantity: Quantity) -> str:
    """A number of every method against the size of the scene, on logarithmic axes."""
    named = marks.shown(results)
    lines = _points(results, groups, quantity)
    left, right, top, bottom = 60, 400, 28, 280
    every = [point for points in lines.values() for point in points]
    across = Scale(min(every)[0] / 1.2, max(every)[0] * 1.001, left, right, log=True)
    up = svg.log_scale([found for _, found in every], bottom, top)
    parts = [
        svg.x_axis(across, top, bottom, "triangles", svg.count),
        svg.y_axis(up, left, right, quantity.name, quantity.label),
    ]
    for method, points in sorted(lines.items(), key=lambda item: item[0] in named):
        told = f"{method}: " + ", ".join(f"{quantity.label(found)} at {svg.count(size)}" for size, found in points)
        places = [(across(size), up(found)) for size, found in points]
        parts.append(_line(method, places, told, named))
        if method in named:
            dots = [tag("circle", cx=x, cy=y, r=2.5, class_="dot") for x, y in places]
            parts.append(tag("g", *dots, class_=f"mark f-{family(method)}", data_method=method))
    ends = [(method, up(points[-1][1])) for method, points in lines.items() if method in named]
    parts += _end_labels(ends, right, top, bottom)
    return svg.picture(520, bottom + 36, f"{quantity.name} by triangles", *parts)


def _points(results: Results, groups: list[Group], quantity: Quantity) -> dict[str, list[tuple[int, float]]]:
    """Size and number by method, the smallest scene first."""
    lines = {}
    for method in results.plan.methods:
        rows = [(results.triangles(group), row) for group in groups if (row := results.find(group, method))]
        points = sorted((size, found) for size, row in rows if (found := quantity.value(row)))
        if points:
            lines[method] = points
    return lines
