"""The paper's claims, and this project's, put to the figures of a study. No bpy."""

from collections.abc import Callable
from typing import NamedTuple

from .paper import Paper
from .plan import FALLBACK_REFERENCE, PAPER_RAYS, Group, family
from .report.svg import count, digits, seconds
from .rows import Results, Row
from .statistics import geometric_mean, slope

BVH, GRID, HYBRID = FALLBACK_REFERENCE, "grid", "hybrid-sampled"
"""What the paper compares, by our names."""

PAPER_FACTOR = 40.0
"""How many times less than the paper's a total at one megapixel should be, on every row."""

FEWER_STEPS = 0.15
"""By how much spatial splits and reinsertion should lower the steps a ray."""

FEW_GAINS = (
    "Why not everywhere: spatial splits gain where large or slanted triangles make boxes overlap, as in buildings and "
    "hair, and next to nothing on evenly tessellated scans, where there is little to cut. Reinsertion cannot shrink "
    "the boxes of leaves: where those overlap, as in hair, only cutting helps; and it ends where no move of one "
    "subtree gains."
)
"""Said where FEWER_STEPS is missed. Stich, Friedrich, Dietrich, "Spatial Splits in Bounding Volume Hierarchies", 2009,
find the same of scans; the figures of Sponza, Sibenik and hair stand in the core's sbvh.rs and reinsert.rs."""


class Claim(NamedTuple):
    """A question, a short answer, and the figures behind it, a line each."""

    question: str
    answer: str
    figures: tuple[str, ...]


def claims(results: Results, paper: Paper) -> list[Claim]:
    """Every claim that the study has figures for."""
    made = (_slowest, _best_places, _overhead, _policy, _against_paper, _steps)
    return [claim for make in made if (claim := make(results, paper)) is not None]


def _trios(results: Results) -> dict[Group, tuple[Row, Row, Row]]:
    """BVH, grid and hybrid of the groups on which all three were measured."""
    found = {}
    for group in results.groups():
        rows = [results.find(group, name) for name in (BVH, GRID, HYBRID)]
        if all(rows):
            found[group] = (rows[0], rows[1], rows[2])
    return found  # type: ignore[return-value]  # none of them is None, which `all` does not tell


def _slowest(results: Results, _paper: Paper) -> Claim | None:
    """The paper's main point: the hybrid is never the slowest of the three."""
    trios = _trios(results)
    if not trios:
        return None
    figures, slow = [], {"trace": 0, "total": 0}
    for group, rows in trios.items():
        parts = []
        for what, time in (("trace", _trace), ("total", _total)):
            bvh, grid, hybrid = map(time, rows)
            is_slowest = hybrid > max(bvh, grid)
            slow[what] += is_slowest
            place = "slowest" if is_slowest else "fastest" if hybrid < min(bvh, grid) else "between the two"
            parts.append(f"{what} {seconds(hybrid)} against {seconds(bvh)} (BVH) and {seconds(grid)} (grid): {place}")
        figures.append(f"{_name(results, group)}: {'; '.join(parts)}")
    answer = "Never" if not any(slow.values()) else "Yes"
    return Claim(
        f"Is the hybrid ({HYBRID}) ever the slowest of the paper's three?",
        f"{answer}: in trace on {slow['trace']}, in total on {slow['total']} of {len(trios)} scenes",
        tuple(figures),
    )


def _best_places(results: Results, _paper: Paper) -> Claim | None:
    """Where hybrids do best, against the better of BVH and grid."""
    figures, wins = [], []
    for group, (bvh, grid, _) in _trios(results).items():
        hybrids = [row for row in results.of(group) if family(row.method) == "hybrid"]
        best = min(hybrids, key=_total)
        better = min((bvh, grid), key=_total)
        ratio = better.total_s / best.total_s
        if ratio > 1.0:
            wins.append((ratio, _name(results, group)))
        figures.append(
            f"{_name(results, group)}: {best.method} {seconds(best.total_s)}, {better.method} "
            f"{seconds(better.total_s)}: {digits(ratio)} times as fast"
        )
    if not figures:
        return None
    ratio, where = max(wins, default=(0.0, ""))
    answer = f"On {len(wins)} of {len(figures)} scenes" + (f", most on {where}, {digits(ratio)} times" if wins else "")
    return Claim(
        f"Where is a hybrid better than the better of {BVH} and {GRID}, build and trace?", answer, tuple(figures)
    )


def _overhead(results: Results, _paper: Paper) -> Claim | None:
    """How build times, and the hybrid's beyond the BVH's, grow with triangles."""
    trios = _trios(results)
    if not trios:
        return None
    sizes = {group: results.triangles(group) for group in trios}
    ordered = sorted(trios, key=sizes.__getitem__)
    figures = []
    for group in ordered:
        bvh, _, hybrid = trios[group]
        more = hybrid.build_s - bvh.build_s
        figures.append(
            f"{_name(results, group)}, {count(sizes[group])} triangles: {seconds(hybrid.build_s)} against "
            f"{seconds(bvh.build_s)}, {digits(hybrid.build_s / bvh.build_s)} times; "
            f"{digits(max(more, 0.0) / sizes[group] * 1e9)} ns a triangle beyond the BVH's"
        )
    exponents = {
        name: slope([(sizes[group], trios[group][index].build_s) for group in ordered])
        for index, name in enumerate((BVH, GRID, HYBRID))
    }
    grown = [f"{name} with the power {power:.2f}" for name, power in exponents.items() if power is not None]
    ratio = geometric_mean([hybrid.build_s / bvh.build_s for bvh, _, hybrid in trios.values()])
    answer = f"The hybrid's build takes {digits(ratio)} times the BVH's in the geometric mean"
    if grown:
        answer += f"; builds grow with triangles: {', '.join(grown)}"
    return Claim("How does the hybrid's overhead grow?", answer, tuple(figures))


def _policy(results: Results, _paper: Paper) -> Claim | None:
    """The best policy of all hybrids traces at or under the better of BVH and grid, on every scene."""
    figures, held = [], 0
    trios = _trios(results)
    for group, (bvh, grid, _) in trios.items():
        best = min((row for row in results.of(group) if family(row.method) == "hybrid"), key=_trace)
        better = min((bvh, grid), key=_trace)
        noise = best.times["trace_s"].low <= better.times["trace_s"].high
        ratio = best.trace_s / better.trace_s
        held += ratio <= 1.0
        said = "at or under" if ratio <= 1.0 else "above, within the noise" if noise else "above"
        figures.append(
            f"{_name(results, group)}: {best.method} {seconds(best.trace_s)}, {better.method} "
            f"{seconds(better.trace_s)}: {digits(ratio)} times, {said}"
        )
    if not figures:
        return None
    question = f"Does the best hybrid trace at or under the better of {BVH} and {GRID}?"
    return Claim(question, f"On {held} of {len(trios)} scenes", tuple(figures))


def _against_paper(results: Results, paper: Paper) -> Claim | None:
    """Totals of each row against the paper's: a remark, not a race, for its machine is unknown."""
    question = f"Are totals at least {PAPER_FACTOR:.0f} times below the paper's on every row?"
    if not any(row.scene in results.plan.scenes for row in paper.rows):
        return None
    if not paper.has_times:
        return Claim(
            question,
            "Not known: the paper's times are not in this project",
            ("Put its seconds into a copy of addon/study/paper.json, and give that with --paper",),
        )
    factors = []
    for group in results.groups():
        for row in (row for row in paper.rows if row.scene == group.scene and group.rays == PAPER_RAYS):
            for what, method in paper.methods.items():
                ours, theirs = results.find(group, method), row.seconds[what]
                if ours is not None and theirs is not None:
                    factors.append(
                        (theirs / ours.total_s, f"{row.model}, {what}: {digits(theirs / ours.total_s)} times")
                    )
    if not factors:
        return None
    held = sum(factor >= PAPER_FACTOR for factor, _ in factors)
    return Claim(question, f"In {held} of {len(factors)} times", tuple(text for _, text in factors))


def _steps(results: Results, _paper: Paper) -> Claim | None:
    """Spatial splits and reinsertion against the plain SAH hierarchy, by steps a ray."""
    better = [name for name in results.plan.methods if name == "sbvh" or name.endswith("+reinsert")]
    figures, held, cases = [], 0, 0
    for name in better:
        told = []
        for group in results.groups():
            fewer = _fewer_steps(results.find(group, name), results.find(group, "bvh-sah"))
            if fewer is not None:
                cases += 1
                held += fewer >= FEWER_STEPS
                told.append(f"{_name(results, group)} {abs(fewer):.0%} {'fewer' if fewer >= 0 else 'more'}")
        if told:
            figures.append(f"{name}: {', '.join(told)}")
    if not figures:
        return None
    if held < cases:
        figures.append(FEW_GAINS)
    question = f"Do spatial splits and reinsertion lower the steps a ray by {FEWER_STEPS:.0%} over bvh-sah?"
    return Claim(question, f"In {held} of {cases} cases", tuple(figures))


def _fewer_steps(row: Row | None, base: Row | None) -> float | None:
    """By which share a method makes fewer steps a ray than another; None where either is not known."""
    if row is None or base is None or not _steps_of(base) or not _steps_of(row):
        return None
    return 1.0 - _steps_of(row) / _steps_of(base)


def _steps_of(row: Row) -> float:
    return (row.evidence.steps if row.evidence else None) or 0.0


def _name(results: Results, group: Group) -> str:
    plan = results.plan
    single = len(plan.classes) == len(plan.resolutions) == 1
    return results.name(group) if single else f"{results.name(group)}, {group.rays}, {group.width} x {group.height}"


_Time = Callable[[Row], float]


def _trace(row: Row) -> float:
    return row.trace_s


def _total(row: Row) -> float:
    return row.total_s
