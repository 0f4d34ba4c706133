"""The journal of a study: every measurement, kept in `runs.jsonl` as soon as it is there. No bpy.

Its first line says what is measured, and where; each later line is one scene, one timed run, one case's evidence, or
why a case failed. A last line cut short by a kill is left out, and written over.
"""

import json
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..outputs import OutputError
from .measure import Evidence, Run
from .plan import Case, Group, Plan, StudyError

NAME = "runs.jsonl"
REPORT = "report.html"
OUTPUTS = ("study.json", "study.csv", REPORT)
"""What is written beside the journal when a study is finished."""

VERSION = 1


class Journal:
    """What is measured so far, by case and by scene, in memory and on disk."""

    def __init__(self, folder: Path, plan: Plan, fingerprint: dict[str, Any]) -> None:
        """Open the journal in `folder`, which is made, or begin it.

        Raises StudyError where the one that is there is of another study, and OutputError.
        """
        self.plan, self.fingerprint = plan, fingerprint
        self.runs: dict[Case, list[Run]] = defaultdict(list)
        self.evidence: dict[Case, Evidence] = {}
        self.failures: dict[Case, str] = {}
        self.sources: dict[Group, dict[str, Any]] = {}
        self._path = folder / NAME
        try:
            folder.mkdir(parents=True, exist_ok=True)
            kept = self._resume()
            self._stream = self._path.open("r+b" if kept else "wb")
            self._stream.truncate(kept)
            self._stream.seek(kept)
        except OSError as error:
            raise OutputError(folder, error.strerror or str(error)) from error
        if not kept:
            self._append({"version": VERSION, "plan": plan.as_dict(), "fingerprint": fingerprint})

    @property
    def empty(self) -> bool:
        """True while nothing is measured."""
        return not self.runs and not self.failures

    def add_run(self, case: Case, run: Run) -> None:
        """Keep a timed run."""
        self.runs[case].append(run)
        self._append({"run": asdict(run), **_names(case)})

    def add_evidence(self, case: Case, evidence: Evidence) -> None:
        """Keep what was counted."""
        self.evidence[case] = evidence
        self._append({"evidence": asdict(evidence), **_names(case)})

    def add_failure(self, case: Case, reason: str) -> None:
        """Keep why a case cannot be measured; it is not tried again."""
        self.failures[case] = reason
        self._append({"failure": reason, **_names(case)})

    def add_source(self, group: Group, source: dict[str, Any]) -> None:
        """Keep what a group's rays are traced through. Raises StudyError where it is not what was measured before."""
        known = self.sources.get(group)
        if known is None:
            self.sources[group] = source
            self._append({"source": source, "group": list(group)})
        elif known["digest"] != source["digest"]:
            raise StudyError(
                f"Scene '{group.scene}' is not as it was when the study in {self._path.parent} began: "
                "take another folder, or begin anew with --restart"
            )

    def close(self) -> None:
        """Nothing more comes."""
        self._stream.close()

    def _append(self, entry: dict[str, Any]) -> None:
        try:
            self._stream.write(json.dumps(entry, ensure_ascii=False).encode() + b"\n")
            self._stream.flush()
        except OSError as error:
            raise OutputError(self._path.parent, error.strerror or str(error)) from error

    def _resume(self) -> int:
        """Take over what is there; bytes of it that are whole."""
        if not self._path.exists():
            return 0
        content = self._path.read_bytes()
        content = content[: content.rfind(b"\n") + 1]
        if not content:
            return 0
        try:
            head, *entries = map(json.loads, content.splitlines())
            self._check(head)
            for entry in entries:
                self._take(entry)
        except (ValueError, KeyError, TypeError) as error:
            raise StudyError(f"{self._path} is no journal of a study ({error}): take another folder") from error
        return len(content)

    def _check(self, head: dict[str, Any]) -> None:
        differs = [name for name, value in self.plan.as_dict().items() if head["plan"].get(name) != value]
        differs += [name for name, value in self.fingerprint.items() if head["fingerprint"].get(name) != value]
        if head["version"] != VERSION or differs:
            raise StudyError(
                f"{self._path.parent} holds a study with other {', '.join(differs) or 'version'}: "
                "take another folder, or begin anew with --restart"
            )

    def _take(self, entry: dict[str, Any]) -> None:
        if "source" in entry:
            self.sources[Group(*entry["group"])] = entry["source"]
            return
        case = Case(Group(*entry["group"]), entry["method"])
        if "run" in entry:
            self.runs[case].append(Run(**entry["run"]))
        elif "evidence" in entry:
            values = entry["evidence"]
            lists = {name: tuple(values[name]) for name in ("hits", "occupancy", "heat_size")}
            self.evidence[case] = Evidence(**values | lists)
        else:
            self.failures[case] = entry["failure"]


def forget(folder: Path) -> None:
    """Remove a study from its folder, if there is one. Raises OutputError."""
    try:
        for name in (NAME, *OUTPUTS):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(folder, error.strerror or str(error)) from error


def is_interrupted(folder: Path, plan: Plan, fingerprint: dict[str, Any], digest: str) -> bool:
    """Whether the folder holds an unfinished study of this plan and machine, whose every scene has this digest."""
    if not (folder / NAME).exists() or (folder / REPORT).exists():
        return False
    try:
        journal = Journal(folder, plan, fingerprint)
    except StudyError:
        return False
    journal.close()
    return all(source["digest"] == digest for source in journal.sources.values())


def _names(case: Case) -> dict[str, Any]:
    return {"group": list(case.group), "method": case.method}
