"""What measurements say of grids against hierarchies: who wins which case, from how many rays on, what foretells it.

Arithmetic alone; a time is in seconds, a reach a share of the box's diagonal, None where rays are endless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from typing import Any

import numpy as np

Row = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """Rays of one reach through one scene, so many a call, by grids and by hierarchies."""

    scene: str
    occupancy: float
    """Share of the cells of a coarse grid that hold a triangle."""
    reach: float | None
    batch: int
    grids: dict[str, float]
    """Rays per second by method."""
    hierarchies: dict[str, float]
    counts: dict[str, tuple[float, float]]
    """Steps and tests a ray by method, of a sample of the rays."""

    @property
    def ratio(self) -> float:
        """How many times as fast the fastest grid is as the fastest hierarchy."""
        return max(self.grids.values()) / max(self.hierarchies.values())

    def row(self) -> Row:
        """The case as it is recorded."""
        rates = {name: round(rate) for name, rate in (self.grids | self.hierarchies).items()}
        grid, hierarchy = (max(rates, key=rates.__getitem__) for rates in (self.grids, self.hierarchies))
        return {
            "scene": self.scene,
            "occupancy": self.occupancy,
            "length": self.reach,
            "batch": self.batch,
            "rays_per_second": rates,
            "ratio": round(self.ratio, 4),
            "winner": grid if self.ratio > 1 else hierarchy,
            "counts": {name: [round(count, 2) for count in counts] for name, counts in self.counts.items()},
        }


def read(row: Row, grids: Sequence[str]) -> Case:
    """The case of a recorded row; `grids` names the methods that are grids."""
    rates = row["rays_per_second"]
    return Case(
        row["scene"],
        row["occupancy"],
        row["length"],
        row["batch"],
        {name: rate for name, rate in rates.items() if name in grids},
        {name: rate for name, rate in rates.items() if name not in grids},
        {name: (steps, tests) for name, (steps, tests) in row["counts"].items()},
    )


def envelope(builds: dict[str, float], ray_seconds: dict[str, float], least: float, most: float) -> list[Row]:
    """Which method has the least build + rays x time a ray, from `least` to `most` rays: each with where it begins."""
    at, found = least, []
    now = min(builds, key=lambda name: (builds[name] + at * ray_seconds[name], ray_seconds[name]))
    while True:
        found.append({"method": now, "from_rays": at})
        later = [
            (meeting(builds, ray_seconds, now, name), name) for name in builds if ray_seconds[name] < ray_seconds[now]
        ]
        later = [(rays, name) for rays, name in later if rays <= most]
        if not later:
            return found
        at, now = min(later, key=lambda pair: (pair[0], ray_seconds[pair[1]]))


def meeting(builds: dict[str, float], ray_seconds: dict[str, float], first: str, second: str) -> float:
    """The number of rays at which `second`, which traces faster, has made good its longer build."""
    return max((builds[second] - builds[first]) / (ray_seconds[first] - ray_seconds[second]), 0.0)


def by_occupancy(cases: Iterable[Case], occupied: float) -> list[bool]:
    """Whether a grid is foretold: where the coarse grid's cells are occupied by more than that share."""
    return [case.occupancy > occupied for case in cases]


def by_counts(cases: Sequence[Case]) -> list[bool]:
    """Whether a grid is foretold by the steps and tests of the sample.

    A method's time a ray is a line in both, fitted to the cases of all other scenes, so that no case foretells itself.
    """
    foretold = []
    for judged in cases:
        others = [case for case in cases if case.scene != judged.scene]
        costs = [_foretold(judged, others, rates) for rates in (lambda c: c.grids, lambda c: c.hierarchies)]
        foretold.append(costs[0] < costs[1])
    return foretold


def _foretold(judged: Case, others: Sequence[Case], rates: Callable[[Case], dict[str, float]]) -> float:
    """The least time a ray that a family is expected to take; errors count as shares of what was measured."""
    expected = []
    for name in rates(judged):
        table = np.array([(*case.counts[name], 1.0) for case in others])
        measured = np.array([rates(case)[name] for case in others])
        constants = np.linalg.lstsq(table * measured[:, None], np.ones(len(table)), rcond=None)[0]
        expected.append(float(np.dot(constants, (*judged.counts[name], 1.0))))
    return min(expected)


@dataclass(frozen=True)
class Score:
    """How well a way to choose between the families does."""

    right: float
    """Share of the cases in which it names the faster one."""
    cost: float
    """Geometric mean of the time of its choice over the time of the better."""


def score(cases: Sequence[Case], foretold: Sequence[bool]) -> Score:
    """How well choosing a grid in the cases that are foretold does."""
    losses = []
    for case, grid in zip(cases, foretold, strict=True):
        losses.append(max(1 / case.ratio if grid else case.ratio, 1.0))
    right = sum((case.ratio > 1) == grid for case, grid in zip(cases, foretold, strict=True))
    return Score(right / len(cases), exp(sum(map(log, losses)) / len(losses)))


def scores(cases: Sequence[Case], occupied: float) -> dict[str, Score]:
    """Every way to choose, over these cases."""
    ways = {
        "always a grid": [True] * len(cases),
        "never a grid": [False] * len(cases),
        "occupancy": by_occupancy(cases, occupied),
        "sampled cost": by_counts(cases),
    }
    return {way: score(cases, foretold) for way, foretold in ways.items()}
