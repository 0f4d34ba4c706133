"""The small pictures: histograms of depth and occupancy, heat maps of steps. No bpy."""

import base64
import html
from collections.abc import Callable, Sequence

import numpy as np

from ...images import Picture, difference_colors, png
from ..measure import Evidence, unpacked
from ..plan import Group, family
from ..rows import Results
from . import marks, svg
from .svg import tag

WIDTH, HEIGHT = 104, 34

SHADES = 32
"""Shades of a heat map: as many as can be told apart, and few enough to keep the page small."""

HEAT_QUANTILE = 0.995
"""This share of all pixels of a scene stays below the brightest shade, so that one ray does not darken the rest."""


def histograms(
    results: Results,
    groups: Sequence[Group],
    values: Callable[[Evidence], Sequence[int]],
    note: Callable[[Evidence], str],
) -> str:
    """A table of histograms, a method a row, a group a column. All of a column have one horizontal axis."""
    methods = [name for name in results.plan.methods if family(name) != "reference"]
    widest = {
        group: max((len(values(row.evidence)) for row in results.of(group) if row.evidence), default=0)
        for group in groups
    }
    head = tag("tr", tag("th"), *(tag("th", html.escape(results.name(group))) for group in groups))
    body = []
    for method in marks.by_family(methods):
        cells = [tag("th", html.escape(method), scope="row", class_=f"f-{family(method)}")]
        for group in groups:
            row = results.find(group, method)
            evidence = None if row is None else row.evidence
            if evidence is None or not values(evidence):
                cells.append(tag("td"))
                continue
            chart = histogram(values(evidence), widest[group], f"{method} on {group.scene}", family(method))
            cells.append(tag("td", chart, tag("div", html.escape(note(evidence)), class_="note")))
        body.append(tag("tr", *cells, data_method=method))
    return scrolled(tag("table", tag("thead", head), tag("tbody", *body), class_="small"))


def histogram(counts: Sequence[int], width: int, label: str, kind: str) -> str:
    """Bars side by side, the highest as high as the picture, on a line that is `width` bars long."""
    step = WIDTH / max(width, 1)
    most = max(counts)
    bars = []
    for index, count in enumerate(counts):
        if not count:
            continue
        high = max(count / most * (HEIGHT - 3), 1.0)
        shape = tag(
            "rect", x=index * step, y=HEIGHT - 1 - high, width=max(step - 0.8, 0.6), height=high, class_="column"
        )
        bars.append(tag("g", svg.title(f"{svg.count(count)}"), shape))
    base = tag("line", x1=0, x2=WIDTH, y1=HEIGHT - 0.5, y2=HEIGHT - 0.5, class_="base")
    return svg.picture(WIDTH, HEIGHT, label, tag("g", *bars, base, class_=f"f-{kind}"))


def heat_maps(results: Results, group: Group) -> str:
    """A picture for each method, with one scale of colours for all of them beside it."""
    rows = [row for row in results.of(group) if row.evidence is not None and row.evidence.heat]
    maps = {row.method: unpacked(row.evidence.heat, row.evidence.heat_size) for row in rows if row.evidence}
    if not maps:
        return ""
    brightest = max(float(np.quantile(np.concatenate([m.ravel() for m in maps.values()]), HEAT_QUANTILE)), 1.0)
    figures = []
    for method in marks.by_family(list(maps)):
        counts = maps[method]
        shades = np.round(np.sqrt(np.clip(counts / brightest, 0, 1)) * (SHADES - 1)) / (SHADES - 1)
        mean = svg.digits(float(counts.mean()))
        caption = tag("figcaption", html.escape(method).replace("+", "<wbr>+"), tag("span", f"{mean} steps"))
        image = embedded(difference_colors(shades.astype(np.float32)), f"Steps per pixel, {method}")
        figures.append(tag("figure", image, caption, class_="heat", data_method=method))
    ramp = np.broadcast_to(np.linspace(0, 1, SHADES, dtype=np.float32), (4, SHADES))
    scale = tag(
        "div",
        "0 ",
        embedded(difference_colors(ramp), "Scale of colours"),
        f" {brightest:.0f} steps and more",
        class_="ramp",
    )
    return tag("div", *figures, class_="heats") + scale


def embedded(picture: Picture, label: str) -> str:
    """A picture inside the page."""
    data = base64.b64encode(png(picture)).decode()
    height, width = picture.shape[:2]
    return f'<img src="data:image/png;base64,{data}" width="{width}" height="{height}" alt="{html.escape(label)}">'


def scrolled(table: str) -> str:
    """A table that scrolls in its own frame where the page is narrow."""
    return tag("div", table, class_="scroll")
