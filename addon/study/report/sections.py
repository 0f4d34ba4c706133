"""The sections of the report, each as markup; empty where a study has nothing for it. No bpy."""

from collections.abc import Sequence
from html import escape

from .. import claims as claimed
from .. import fingerprint
from ..measure import Evidence
from ..paper import Paper
from ..plan import EMBREE, FAMILIES, RAY_CLASSES, Group, family
from ..rows import Results, Row
from ..statistics import WANTED
from ..task import LEAST_RUNS
from . import charts, marks, small, svg
from .svg import tag


def head(results: Results) -> str:
    """What was measured, and where."""
    plan = results.plan
    sizes = ", ".join(f"{width} x {height}" for width, height in plan.resolutions)
    measured = (
        f"{_many(len(plan.scenes), 'scene')}, {_many(len(plan.methods), 'method')}, {sizes} pixels, "
        f"{_many(plan.threads, 'thread')}; rays: {', '.join(plan.classes)}"
    )
    machine = fingerprint.line(results.fingerprint)
    return tag("p", escape(measured)) + tag("p", escape(machine), class_="soft")


def summary(results: Results) -> str:
    """The first in the geometric mean, and how it compares."""
    ranked = marks.ranking(results)
    groups = results.groups()
    if not ranked or not groups:
        return tag("p", "Nothing was measured on every scene.")
    wins = {name: [group for group in groups if _winner(results, group) == name] for name in ranked}
    lines = [
        f"{ranked[0]} gives the image first in the geometric mean over all scenes, build and trace together"
        + (f"; then {', '.join(ranked[1:4])}." if ranked[1:] else ".")
    ]
    told = [
        f"{name} on {', '.join(marks.scene_label(results, group) for group in won)}"
        for name, won in wins.items()
        if won
    ]
    lines.append(f"The least time to the image: {'; '.join(told)}.")
    if results.reference == EMBREE:
        best = [results.find(group, ranked[0]) for group in groups]
        ratios = [1 / found.relative["total_s"].median for found in best if found and "total_s" in found.relative]
        lines.append(
            f"{ranked[0]} is {svg.digits(min(ratios))} to {svg.digits(max(ratios))} times as fast as Embree through "
            "embreex, which traces ray by ray on one thread: it is there to compare runs with, not as a rival."
        )
    if results.failures:
        lines.append(f"{_many(len(results.failures), 'case')} could not be measured: the reasons are at the end.")
    return "".join(tag("p", escape(line)) for line in lines)


def claims(results: Results, paper: Paper) -> str:
    """Questions, answers, and the figures they rest on."""
    parts = []
    for claim in claimed.claims(results, paper):
        figures = tag("ul", *(tag("li", escape(line)) for line in claim.figures))
        parts += [tag("dt", escape(claim.question)), tag("dd", tag("strong", escape(claim.answer)), figures)]
    return tag("dl", *parts, class_="claims") if parts else ""


def times(results: Results) -> str:
    """Bars of build and trace."""
    figures = [_figure(marks.scene_label(results, group), charts.bars(results, group)) for group in results.groups()]
    legend = [tag("span", escape(name), class_=f"f-{kind}") for kind, name in FAMILIES.items()]
    legend += [tag("span", "build", class_="half"), tag("span", "trace", class_="full")]
    note = (
        "Medians of wall time; whiskers are intervals of build and trace together. A bar longer than "
        f"{charts.CLIP:g} times the median of all is cut."
    )
    return tag("p", note) + tag("div", *legend, class_="legend") + tag("div", *figures, class_="charts")


def rays(results: Results) -> str:
    """Time to image by number of rays, and in words who is first from where on."""
    figures = []
    for group in results.groups():
        chart = charts.time_to_image(results, group)
        if chart:
            label = marks.scene_label(results, group)
            figures.append(_figure(label, chart, _crossing_text(results, group)))
    note = (
        "Build, and then so many rays at the measured time a ray: straight lines, bent by the logarithmic axes. A "
        "circle marks where another method becomes the fastest. Methods that refine as rays come do part of their "
        "build while they trace, so their lines lie a little high at many rays. Thin lines are the other methods."
    )
    return tag("p", note) + tag("div", *figures, class_="charts") if figures else ""


def _crossing_text(results: Results, group: Group) -> str:
    """Who gives the image first, by number of rays; and where a grid does."""
    ours = [row for row in results.of(group) if family(row.method) != "reference" and row.ray_s > 0.0]
    found = [crossing for crossing in charts.crossings(ours) if crossing.rays <= charts.RAYS[1]]
    if not found:
        return (
            f"Fastest for any number of rays: {min(ours, key=lambda row: row.build_s).method}. {_grid_text(ours, [])}"
        )
    told = [f"{crossing.before} up to {svg.count(crossing.rays)} rays" for crossing in found]
    grids = [text for text, crossing in zip(told, found, strict=True) if family(crossing.before) == "grid"]
    if family(found[-1].after) == "grid":
        grids.append(f"{found[-1].after} beyond {svg.count(found[-1].rays)} rays")
    return f"Fastest: {', '.join(told)}, then {found[-1].after}. {_grid_text(ours, grids)}"


def _grid_text(rows: Sequence[Row], pays: Sequence[str]) -> str:
    """Where a grid pays; and where none does, how long the plain one beats a good hierarchy."""
    if pays:
        return f"A grid pays: {', '.join(pays)}."
    grid = next((row for row in rows if row.method == "grid"), None)
    bvh = next((row for row in rows if row.method == "bvh-sah"), None)
    if grid is not None and bvh is not None and grid.build_s < bvh.build_s and grid.ray_s > bvh.ray_s:
        until = (bvh.build_s - grid.build_s) / (grid.ray_s - bvh.ray_s)
        return f"No grid is ever fastest; the plain one beats bvh-sah up to {svg.count(until)} rays."
    return "No grid is ever fastest."


def growth(results: Results) -> str:
    """Cost against the number of triangles, where scenes of several sizes were measured on the same rays."""
    groups = [group for group in results.groups() if group[1:] == results.groups()[0][1:]]
    if len({results.triangles(group) for group in groups}) < 2:
        return ""
    quantities = (
        charts.Quantity("build", lambda row: row.build_s, svg.seconds),
        charts.Quantity("time a ray", lambda row: row.ray_s, svg.seconds),
        charts.Quantity("build and trace", lambda row: row.total_s, svg.seconds),
        charts.Quantity("memory", lambda row: marks.census(row, "bytes"), lambda value: f"{svg.count(value)}B"),
    )
    figures = [
        _figure(quantity.name.capitalize(), charts.by_triangles(results, groups, quantity)) for quantity in quantities
    ]
    note = "Scenes differ in shape as well as in size, so the lines are not smooth. Thin lines are the other methods."
    return tag("p", note) + tag("div", *figures, class_="charts")


def heat(results: Results) -> str:
    """Heat maps of steps a pixel."""
    parts = []
    for group in _once_a_scene(results):
        maps = small.heat_maps(results, group)
        if maps:
            parts += [tag("h3", escape(results.name(group))), maps]
    note = (
        "Traversal steps (nodes and cells visited) of each pixel's ray, counted apart from the timed runs; colours by "
        "the square root."
    )
    return tag("p", note) + "".join(parts) if parts else ""


def depth(results: Results) -> str:
    """Histograms of depth."""

    def levels(evidence: Evidence) -> Sequence[int]:
        return evidence.census.get("depth_histogram", ())

    def note(evidence: Evidence) -> str:
        return f"deepest {evidence.census['max_depth']}"

    said = "Branches, leaves and grids at every depth, the root's at the left; each picture has its own height."
    return tag("p", said) + small.histograms(results, _once_a_scene(results), levels, note)


def occupancy(results: Results) -> str:
    """Histograms of triangles in leaves and occupied cells."""

    def note(evidence: Evidence) -> str:
        census = evidence.census
        empty = f", {census['empty_cells'] / census['cells']:.0%} of cells empty" if census["cells"] else ""
        return f"{svg.count(sum(evidence.occupancy))}{empty}"

    said = (
        "Leaves and occupied cells that hold 1, 2, 3 to 4, 5 to 8, 9 to 16, ... triangles, from left to right; below, "
        "how many there are."
    )
    groups = _once_a_scene(results)
    return tag("p", said) + small.histograms(results, groups, lambda evidence: evidence.occupancy, note)


def method(results: Results) -> str:
    """What a reader must know to trust the numbers, or to doubt them."""
    plan = results.plan
    classes = "; ".join(f"{name}: {RAY_CLASSES[name]}" for name in plan.classes)
    counts = sorted({len(row.runs) for row in results.rows if row.runs})
    runs = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else str(counts[0]) if counts else "0"
    lines = [
        f"Rays: {classes}. They come in blocks of pixels, and are the same for every method.",
        f"Methods take turns on a scene's rays, round by round. A case is measured up to {plan.repeats} times "
        f"while all of its runs stay within {plan.seconds:g} s, and {LEAST_RUNS} times where one does; so slow methods "
        f"have fewer runs ({runs} here). A run that takes longer than {plan.limit_seconds:g} s is given up.",
        "Times are medians of wall time. Intervals are of order statistics: they enclose the true median with at "
        f"least {WANTED:.0%} confidence from six runs on, whatever the noise is like; with fewer runs they are the "
        "whole range.",
        "Steps (nodes and cells visited) and tests (rays against triangles) are counted as closest-hit queries on a "
        "part of the rays, never in timed runs.",
        _agreement(results),
    ]
    if results.reference:
        lines.append(
            f"Ratios to {results.reference} are taken in each round, and are what runs of two days can be compared by."
        )
    return "".join(tag("p", escape(line)) for line in lines)


def _agreement(results: Results) -> str:
    """Whether all methods hit as often."""
    different = []
    for group in results.groups():
        hits = {row.evidence.hits for row in results.of(group) if row.evidence and row.method != EMBREE}
        if len(hits) > 1:
            different.append(group.label)
    if different:
        return f"Methods disagree in the number of hits on {'; '.join(different)}: one of them is wrong."
    return "All methods found the same number of hits on every scene."


def _winner(results: Results, group: Group) -> str:
    ours = [row for row in results.of(group) if row.method != EMBREE]
    return min(ours, key=lambda row: row.total_s).method if ours else ""


def _once_a_scene(results: Results) -> list[Group]:
    """The first group of every scene: the structure is hardly another for other rays."""
    return list({group.scene: group for group in reversed(results.groups())}.values())[::-1]


def _figure(name: str, chart: str, after: str = "") -> str:
    below = tag("figcaption", escape(after), class_="after") if after else ""
    return tag("figure", tag("figcaption", escape(name)), chart, below)


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
