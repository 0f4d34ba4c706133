"""What got slower since an older study, beyond the noise: by ratio to the reference in the same run. No bpy.

Times of two days are not comparable, ratios to another program on the same rays, in turns with it, are. A case got
slower where the whole interval of its ratio lies above the whole interval of the old one, and its median is more than
a margin above the old. Seven runs lie above seven others by chance once in 3432 times, so that a study of some hundred
times seldom cries wolf; three above three do once in 20 times, which the wider margin for few runs makes up for.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from .measure import Run
from .plan import EMBREE, FALLBACK_REFERENCE, Case, Group, Plan, StudyError
from .rows import SCHEMA_VERSION, TIMES, Results, ratios
from .statistics import Interval, interval

MARGIN = 0.05
"""Least change that counts: the layout of memory alone changes times by some hundredths."""

FEW, FEW_MARGIN = 5, 0.25
"""Of fewer runs than this on either side, the least change that counts."""

CHECKED = ("build_s", "trace_s")
assert set(CHECKED) <= set(TIMES)


class Change(NamedTuple):
    """One time of a case, by the reference's: old and new."""

    case: Case
    name: str
    old: Interval
    new: Interval

    @property
    def ratio(self) -> float:
        """New by old: above 1 is slower."""
        return self.new.median / self.old.median

    @property
    def margin(self) -> float:
        """The least change that counts here."""
        return FEW_MARGIN if min(self.old.number, self.new.number) < FEW else MARGIN

    @property
    def slower(self) -> bool:
        """Whether it got slower beyond the noise."""
        return self.new.low > self.old.high and self.ratio > 1.0 + self.margin

    @property
    def faster(self) -> bool:
        """Whether it got faster beyond the noise."""
        return self.new.high < self.old.low and self.ratio < 1.0 / (1.0 + self.margin)


class Check(NamedTuple):
    """All that could be compared, and what could not: cases of the old study that the new one has no times of."""

    reference: str
    changes: tuple[Change, ...]
    missing: tuple[Case, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing got slower or went missing."""
        return not self.missing and not any(change.slower for change in self.changes)

    def lines(self) -> Iterator[str]:
        """What to tell, the worst first."""
        for case in self.missing:
            yield f"MISSING  {case.group.label}, {case.method}: measured then, not now"
        told = sorted((change for change in self.changes if change.slower or change.faster), key=lambda c: -c.ratio)
        for change in told:
            what = f"{change.case.group.label}, {change.case.method}, {change.name.removesuffix('_s')}"
            yield (
                f"{'SLOWER ' if change.slower else 'faster '}  {what}: "
                f"{change.old.median:.3f} then, {change.new.median:.3f} now (x{change.ratio:.2f})"
            )
        slower = sum(change.slower for change in self.changes)
        yield (
            f"{slower} of {len(self.changes)} times got slower beyond the noise, each by ratio to {self.reference} "
            "in the same run"
        )


def read(path: Path) -> dict[str, Any]:
    """The content of an older study.json. Raises StudyError where it is none."""
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if content["schema_version"] != SCHEMA_VERSION:
            raise ValueError(f"its schema is {content['schema_version']}, this Espalier's {SCHEMA_VERSION}")
        Plan.of(content["plan"])
        _runs(content)
    except OSError as error:
        raise StudyError(f"{path} cannot be read ({error.strerror}): give the study.json of an older study") from error
    except (ValueError, KeyError, TypeError) as error:
        raise StudyError(f"{path} is no study.json ({error}): give that of an older study") from error
    return content


def check(old: dict[str, Any], new: Results) -> Check:
    """Compare a study with an older one's content. Raises StudyError where they share no reference."""
    before = _runs(old)
    after = {row.case: row.runs for row in new.rows if row.times}
    reference = _shared_reference(before, after)
    changes = []
    for case, runs in before.items():
        if case.method == reference or case not in after:
            continue
        then, now = before.get(Case(case.group, reference)), after.get(Case(case.group, reference))
        if then and now:
            changes += [_change(case, name, (runs, then), (after[case], now)) for name in CHECKED]
    missing = tuple(case for case in before if case not in after and case.method != EMBREE)
    return Check(reference, tuple(changes), missing)


def _change(case: Case, name: str, old: tuple[Any, Any], new: tuple[Any, Any]) -> Change:
    return Change(case, name, interval(ratios(*old, name)), interval(ratios(*new, name)))


def _shared_reference(before: dict[Case, Any], after: dict[Case, Any]) -> str:
    for name in (EMBREE, FALLBACK_REFERENCE):
        if {case for case in before if case.method == name} & {case for case in after if case.method == name}:
            return name
    raise StudyError(
        f"The two studies have no scene, rays and resolution in common with {EMBREE} or {FALLBACK_REFERENCE} in both: "
        "measure what the older one did"
    )


def _runs(content: dict[str, Any]) -> dict[Case, tuple[Run, ...]]:
    """The runs of a study.json."""
    return {
        Case(Group(*(row[name] for name in Group._fields)), row["method"]): tuple(Run(**run) for run in row["runs"])
        for row in content["rows"]
        if row["runs"]
    }
