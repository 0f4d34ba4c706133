"""A study measures every case once, goes on where it stopped, and makes rows of what fails."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from studies import FINGERPRINT, PLAN, finished, load, make, squashed

from espalier import native
from espalier.study import measure
from espalier.study.journal import NAME, Journal, forget, is_interrupted
from espalier.study.plan import Case, Plan, StudyError
from espalier.study.rows import COLUMNS, results


def test_every_case_has_times_evidence_and_the_same_hits(tmp_path: Path) -> None:
    study = finished(tmp_path)
    assert study.progress == 1.0
    found = study.results
    assert [row.case for row in found.rows] == list(PLAN.cases())
    assert not found.failures
    for row in found.rows:
        assert len(row.runs) == PLAN.repeats
        assert row.total_s == pytest.approx(row.build_s + row.trace_s, rel=0.5)
        assert row.evidence.steps > 0
        assert row.evidence.tests > 0
        assert row.evidence.census["bytes"] > 0
        assert sum(row.evidence.occupancy) > 0
        assert measure.unpacked(row.evidence.heat, row.evidence.heat_size).max() > 0
        assert row.phases
    for group in PLAN.groups():
        assert len({row.evidence.hits for row in found.of(group)}) == 1
    assert found.reference == "bvh-median"
    reference = found.find(next(PLAN.groups()), "bvh-median")
    assert reference.relative["total_s"].median == 1.0


def test_every_method_tells_where_its_triangles_and_its_steps_are(tmp_path: Path) -> None:
    plan = replace(PLAN, scenes=("large",), methods=tuple(native.module().methods()), classes=("primary",), repeats=1)
    found = finished(tmp_path, plan).results
    assert [row.method for row in found.rows] == list(plan.methods)
    for row in found.rows:
        assert sum(row.evidence.occupancy) > 0, row.method
        assert sum(row.evidence.census["depth_histogram"]) > 0, row.method
        assert row.evidence.heat, row.method


def test_json_and_csv_say_the_same(tmp_path: Path) -> None:
    finished(tmp_path)
    content = json.loads((tmp_path / "study.json").read_text())
    assert content["schema_version"] == 1
    assert Plan.of(content["plan"]) == PLAN
    assert content["fingerprint"] == FINGERPRINT
    lines = list(csv.DictReader(io.StringIO((tmp_path / "study.csv").read_text())))
    assert list(lines[0]) == list(COLUMNS)
    assert len(lines) == len(content["rows"]) == len(list(PLAN.cases()))
    for line, row in zip(lines, content["rows"], strict=True):
        assert [line[name] for name in ("scene", "rays", "method")] == [row["scene"], row["rays"], row["method"]]
        assert float(line["total_s"]) == row["total_s"]["median"]
        assert float(line["steps"]) == row["steps"]
        assert int(line["ray_count"]) == row["ray_count"] > 0
        assert int(line["bytes"]) == row["census"]["bytes"]


def test_a_stopped_study_goes_on_where_it_stopped(tmp_path: Path) -> None:
    finished(tmp_path / "whole")
    lines = (tmp_path / "whole" / NAME).read_bytes().splitlines(keepends=True)
    stopped = tmp_path / "stopped"
    stopped.mkdir()
    (stopped / NAME).write_bytes(b"".join(lines[:12]) + lines[12][:20])
    assert is_interrupted(stopped, PLAN, FINGERPRINT, "") is False, "the scenes are others"
    finished(stopped)
    again = (stopped / NAME).read_bytes().splitlines(keepends=True)
    assert again[:12] == lines[:12]
    kinds = [[next(iter(json.loads(line))) for line in log] for log in (lines, again)]
    assert sorted(kinds[0]) == sorted(kinds[1]), "nothing is measured twice, nothing is left out"


def test_a_finished_study_measures_nothing_more(tmp_path: Path) -> None:
    finished(tmp_path)
    before = (tmp_path / NAME).read_bytes()
    finished(tmp_path)
    assert (tmp_path / NAME).read_bytes() == before
    assert not is_interrupted(tmp_path, PLAN, FINGERPRINT, "")
    forget(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_run_whose_evidence_was_cut_off_is_counted_again(tmp_path: Path) -> None:
    finished(tmp_path)
    path = tmp_path / NAME
    lines = path.read_text().splitlines(keepends=True)
    cut = next(index for index, line in enumerate(lines) if line.startswith('{"evidence"'))
    path.write_text("".join(lines[:cut]))
    assert not finished(tmp_path).results.failures


@pytest.mark.parametrize(
    ("name", "plan", "fingerprint"),
    [
        ("methods", Plan(**{**vars(PLAN), "methods": ("grid",)}), FINGERPRINT),
        ("processor", PLAN, FINGERPRINT | {"processor": "Another"}),
    ],
)
def test_another_study_in_the_folder_is_refused(tmp_path: Path, name: str, plan: Plan, fingerprint: dict) -> None:
    finished(tmp_path)
    with pytest.raises(StudyError, match=f"with other {name}: .*--restart"):
        Journal(tmp_path, plan, fingerprint)


def test_a_scene_that_changed_since_is_refused(tmp_path: Path) -> None:
    plan = Plan(**{**vars(PLAN), "repeats": 3})
    finished(tmp_path, plan)
    path = tmp_path / NAME
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    study = make(tmp_path, plan, squashed).start()
    study.wait(60)
    with pytest.raises(StudyError, match="not as it was"):
        study.raise_error()


def test_what_is_no_journal_is_refused(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text("Dear diary\n")
    with pytest.raises(StudyError, match="no journal"):
        Journal(tmp_path, PLAN, FINGERPRINT)


def test_a_scene_that_cannot_be_opened_is_a_row_that_says_why(tmp_path: Path) -> None:
    def loader(group, progress):
        if group.scene == "small":
            raise OSError("the disk is gone")
        return load(group, progress)

    found = finished(tmp_path, loader=loader).results
    assert {row.failure for row in found.rows if row.case.group.scene == "small"} == {"the disk is gone"}
    assert not any(row.failure for row in found.rows if row.case.group.scene == "large")
    assert "the disk is gone" in (tmp_path / "study.csv").read_text()
    assert "the disk is gone" in (tmp_path / "report.html").read_text()


def test_a_method_that_fails_is_a_row_that_says_why(tmp_path: Path) -> None:
    plan = Plan(**{**vars(PLAN), "methods": ("grid", "octree")})
    found = finished(tmp_path, plan).results
    assert all("no method 'octree'" in row.failure for row in found.rows if row.method == "octree")
    assert not any(row.failure for row in found.rows if row.method == "grid")


def test_a_build_beyond_the_limit_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(method, work, plan, job):
        while not job.cancelled:
            pass
        measure.native.module().Accelerator.build(work.scene.mesh, method, job=job)

    monkeypatch.setattr(measure, "timed", slow)
    plan = Plan(**{**vars(PLAN), "methods": ("grid",), "scenes": ("small",), "limit_seconds": 0.01})
    found = finished(tmp_path, plan).results
    assert all("more than the limit" in row.failure for row in found.rows)


def test_a_cancel_stops_and_keeps_what_was_measured(tmp_path: Path) -> None:
    plan = Plan(**{**vars(PLAN), "repeats": 1000, "seconds": 600.0})
    study = make(tmp_path, plan).start()
    while len(study.journal.runs) < 3:
        assert not study.done
    study.cancel()
    assert study.wait(1.0)
    assert study.cancelled
    study.raise_error()
    assert not (tmp_path / "report.html").exists()
    kept = Journal(tmp_path, plan, FINGERPRINT)
    assert len(kept.runs) >= 3
    digest = kept.sources[next(plan.groups())]["digest"]
    kept.close()
    assert is_interrupted(tmp_path, plan, FINGERPRINT, digest)


def test_slow_cases_are_measured_less_often(tmp_path: Path) -> None:
    plan = Plan(**{**vars(PLAN), "repeats": 5, "seconds": 0.0, "methods": ("grid",)})
    found = finished(tmp_path, plan).results
    assert {len(row.runs) for row in found.rows} == {1}
    assert results(found and _journal(tmp_path, plan)).rows[0].times["total_s"].confidence == 0.0


def _journal(folder: Path, plan: Plan) -> Journal:
    journal = Journal(folder, plan, FINGERPRINT)
    journal.close()
    return journal


def test_methods_take_turns(tmp_path: Path) -> None:
    finished(tmp_path)
    entries = [json.loads(line) for line in (tmp_path / NAME).read_text().splitlines()]
    order = [entry["method"] for entry in entries if "run" in entry][: 2 * len(PLAN.methods)]
    first, second = order[: len(PLAN.methods)], order[len(PLAN.methods) :]
    assert first == list(PLAN.methods)
    assert second == [*PLAN.methods[1:], PLAN.methods[0]]
    assert Case(next(PLAN.groups()), "grid") in list(PLAN.cases())
