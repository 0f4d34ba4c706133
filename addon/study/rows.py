"""What a study found: a row a case, made of its journal; as JSON and as CSV. No bpy."""

import csv
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from .journal import Journal
from .measure import Evidence, Run
from .plan import EMBREE, FALLBACK_REFERENCE, Case, Group, Plan
from .statistics import Interval, interval

SCHEMA_VERSION = 1
TIMES = ("build_s", "trace_s", "total_s")
"""What is timed, by its name in rows and runs."""


@dataclass(frozen=True)
class Row:
    """One case. A case that failed has `failure`, and no times. Intervals are of seconds, `mrays_per_s` of the median.

    relative: by the names in TIMES, this method's time by the reference's in the same round; 1 for the reference,
    empty where it was not measured. runs: the timed runs as they came.
    """

    case: Case
    failure: str | None = None
    times: dict[str, Interval] = field(default_factory=dict)
    relative: dict[str, Interval] = field(default_factory=dict)
    phases: dict[str, float] = field(default_factory=dict)
    evidence: Evidence | None = None
    runs: tuple[Run, ...] = ()

    @property
    def method(self) -> str:
        """Its native name, or EMBREE."""
        return self.case.method

    @property
    def build_s(self) -> float:
        """Median seconds of the build."""
        return self.times["build_s"].median

    @property
    def trace_s(self) -> float:
        """Median seconds of the rays."""
        return self.times["trace_s"].median

    @property
    def total_s(self) -> float:
        """Median seconds of build and rays together."""
        return self.times["total_s"].median

    @property
    def mrays_per_s(self) -> float:
        """Million rays a second; 0 where no time passed or there are no rays."""
        rays = 0 if self.evidence is None else self.evidence.rays
        return rays / self.trace_s / 1e6 if self.trace_s > 0.0 else 0.0

    @property
    def ray_s(self) -> float:
        """Seconds of a ray; 0 where there are none."""
        rays = 0 if self.evidence is None else self.evidence.rays
        return self.trace_s / rays if rays else 0.0


@dataclass(frozen=True)
class Results:
    """A study's rows, by groups in the plan's order. `scenes` say what each group's scene is, where it was opened."""

    plan: Plan
    fingerprint: dict[str, Any]
    reference: str | None
    scenes: dict[Group, dict[str, Any]]
    rows: tuple[Row, ...]

    def of(self, group: Group) -> list[Row]:
        """The rows of a group that were measured."""
        return [row for row in self.rows if row.case.group == group and row.times]

    def groups(self) -> list[Group]:
        """The groups of which anything was measured."""
        return [group for group in self.plan.groups() if self.of(group)]

    def find(self, group: Group, method: str) -> Row | None:
        """A measured row, or None."""
        return next((row for row in self.of(group) if row.method == method), None)

    def name(self, group: Group) -> str:
        """A measured group's scene, for people."""
        return str(self.scenes[group]["name"])

    def triangles(self, group: Group) -> int:
        """Size of a measured group's scene."""
        return int(self.scenes[group]["triangles"])

    @property
    def failures(self) -> list[Row]:
        """The rows that say why there is nothing."""
        return [row for row in self.rows if row.failure is not None]

    def as_dict(self) -> dict[str, Any]:
        """In plain types, all but the heat maps."""
        return {
            "schema_version": SCHEMA_VERSION,
            "plan": self.plan.as_dict(),
            "fingerprint": self.fingerprint,
            "reference": self.reference,
            "scenes": [{**group._asdict(), **values} for group, values in self.scenes.items()],
            "rows": [_plain(row) for row in self.rows],
        }

    def json(self) -> str:
        """Indented JSON, ending in a line feed. Raises ValueError for a number that is not finite."""
        return json.dumps(self.as_dict(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    def csv(self) -> str:
        """A line a case; empty cells where a number is not known."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([column(self, row) for column in COLUMNS.values()] for row in self.rows)
        return stream.getvalue()


def results(journal: Journal) -> Results:
    """The rows of what the journal holds."""
    plan = journal.plan
    has_embree = any(case.method == EMBREE for case in journal.runs)
    reference = EMBREE if has_embree else FALLBACK_REFERENCE if FALLBACK_REFERENCE in plan.methods else None
    rows = tuple(_row(journal, case, reference) for case in plan.cases())
    return Results(plan, journal.fingerprint, reference, dict(journal.sources), rows)


def ratios(runs: Sequence[Run], others: Sequence[Run], name: str) -> list[float]:
    """One time of the runs by the others', round by round, as far as both were measured."""
    pairs = zip(runs, others, strict=False)
    return [getattr(run, name) / getattr(other, name) for run, other in pairs if getattr(other, name) > 0.0]


def _row(journal: Journal, case: Case, reference: str | None) -> Row:
    runs = tuple(journal.runs.get(case, ()))
    failure = journal.failures.get(case)
    if failure is not None or not runs:
        return Row(case, failure or "Not measured")
    others = () if reference is None else journal.runs.get(Case(case.group, reference), ())
    relative = {name: interval(found) for name in TIMES if (found := ratios(runs, others, name))}
    return Row(
        case,
        times={name: interval([getattr(run, name) for run in runs]) for name in TIMES},
        relative=relative,
        phases={name: median(run.phases.get(name, 0.0) for run in runs) for name in runs[0].phases},
        evidence=journal.evidence.get(case),
        runs=runs,
    )


def _plain(row: Row) -> dict[str, Any]:
    evidence = row.evidence
    counted: dict[str, Any] = {}
    if evidence is not None:
        counted = {name: getattr(evidence, name) for name in ("hits", "steps", "tests", "occupancy", "census")}
        counted["ray_count"] = evidence.rays
    return {
        **row.case.group._asdict(),
        "method": row.method,
        "failure": row.failure,
        **{name: value._asdict() for name, value in row.times.items()},
        "mrays_per_s": row.mrays_per_s if row.times else None,
        "relative": {name: value._asdict() for name, value in row.relative.items()},
        "phases_ms": row.phases,
        **counted,
        "runs": [{"build_s": run.build_s, "trace_s": run.trace_s} for run in row.runs],
    }


def _of_group(name: str) -> Callable[[Results, Row], Any]:
    return lambda _results, row: getattr(row.case.group, name)


def _of_time(name: str, part: str) -> Callable[[Results, Row], Any]:
    return lambda _results, row: getattr(row.times[name], part) if row.times else None


def _of_relative(name: str) -> Callable[[Results, Row], Any]:
    return lambda _results, row: row.relative[name].median if name in row.relative else None


def _of_evidence(name: str) -> Callable[[Results, Row], Any]:
    return lambda _results, row: getattr(row.evidence, name, None)


def _of_census(name: str) -> Callable[[Results, Row], Any]:
    return lambda _results, row: None if row.evidence is None else row.evidence.census.get(name)


CENSUS = ("bytes", "nodes", "leaves", "grids", "cells", "empty_cells", "references", "max_depth", "sah_cost")

COLUMNS: dict[str, Callable[[Results, Row], Any]] = {
    **{name: _of_group(name) for name in Group._fields},
    "method": lambda _results, row: row.method,
    "triangles": lambda results, row: results.scenes.get(row.case.group, {}).get("triangles"),
    "count": _of_time("total_s", "number"),
    **{
        f"{name}{'' if part == 'median' else '_' + part}": _of_time(name, part)
        for name in TIMES
        for part in ("median", "low", "high")
    },
    "mrays_per_s": lambda _results, row: row.mrays_per_s if row.times else None,
    **{f"relative_{name.removesuffix('_s')}": _of_relative(name) for name in TIMES},
    "ray_count": _of_evidence("rays"),
    **{name: _of_evidence(name) for name in ("steps", "tests")},
    **{name: _of_census(name) for name in CENSUS},
    "failure": lambda _results, row: row.failure,
}
"""The columns of the CSV, each with what gives its cells."""
