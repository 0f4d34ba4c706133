"""Which methods charts show, and how they tell them apart: family by colour, method by dash and its own label.

The colours are those of Okabe and Ito, which keep apart with any colour vision; the page's style has them. No bpy.
"""

import math

from ..plan import Group, family
from ..rows import Results, Row
from ..statistics import geometric_mean

DASHES = {
    "bvh-median": "7 3",
    "bvh-sah": None,
    "grid": None,
    "hybrid-sampled": "7 3",
    "embree": "2 3",
}
"""Dashes of the methods that charts always show."""

OTHER_DASHES = ("9 3 2 3", "3 2", "12 3", "9 3 2 3 2 3")
"""Dashes of methods that are shown because they do best somewhere; the best hybrid's line is whole."""


def shown(results: Results) -> dict[str, str | None]:
    """The methods that line charts name, with their dashes: the paper's, the best hybrid, the best of all, Embree."""
    ranked = ranking(results)
    names = {name: dash for name, dash in DASHES.items() if name in results.plan.methods}
    hybrid = next((name for name in ranked if family(name) == "hybrid"), None)
    if hybrid is not None and hybrid not in names:
        names[hybrid] = None
    for name in ranked[:1]:
        names.setdefault(name, OTHER_DASHES[0])
    return names


def ranking(results: Results) -> list[str]:
    """Methods measured on all groups, the least geometric mean of total time by the best first; Embree left out."""
    groups = results.groups()
    scores = {}
    for method in results.plan.methods:
        rows = [results.find(group, method) for group in groups]
        if family(method) != "reference" and rows and all(rows):
            totals = [
                (row.total_s / best_total(results, group)) for row, group in zip(rows, groups, strict=True) if row
            ]
            scores[method] = geometric_mean(totals)
    return sorted(scores, key=lambda name: scores[name])


def best_total(results: Results, group: Group) -> float:
    """The least total of a group among Espalier's methods."""
    return min((row.total_s for row in results.of(group) if family(row.method) != "reference"), default=math.inf)


def by_family(methods: list[str]) -> list[str]:
    """Methods with those of a family together, in their own order."""
    order = ["bvh", "grid", "hybrid", "reference"]
    return sorted(methods, key=lambda name: (order.index(family(name)), methods.index(name)))


def scene_label(results: Results, group: Group) -> str:
    """A group for the head of a chart: the scene, and what else tells it from the study's other groups."""
    plan = results.plan
    parts = [results.name(group)]
    if len(plan.classes) > 1:
        parts.append(group.rays)
    if len(plan.resolutions) > 1:
        parts.append(f"{group.width} x {group.height}")
    return ", ".join(parts)


def census(row: Row, name: str) -> float | None:
    """A number of the census; None where there is none, as for Embree."""
    return None if row.evidence is None else row.evidence.census.get(name)
