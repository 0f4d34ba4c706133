"""`study --check` tells what got slower, and nothing that is noise."""

import json
from pathlib import Path

import pytest
from studies import PLAN, finished

from espalier.study import check
from espalier.study.plan import StudyError


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory):
    """A finished study, and the content of its study.json with steady times: build 1 s, trace 2 s, 1 % of noise."""
    folder = tmp_path_factory.mktemp("study")
    found = finished(folder).results
    content = json.loads((folder / "study.json").read_text())
    for row in content["rows"]:
        row["runs"] = [
            {"build_s": 1 + noise, "trace_s": 2 + 2 * noise} for noise in (0, 0.01, 0.02, 0.005, 0.015, 0.003)
        ]
    return found, content


def changed(content: dict, factor: float, method: str = "grid") -> dict:
    """The same with one method's traces longer."""
    copy = json.loads(json.dumps(content))
    for row in copy["rows"]:
        if row["method"] == method:
            row["runs"] = [run | {"trace_s": run["trace_s"] * factor} for run in row["runs"]]
    return copy


def compared(old: dict, new: dict, found) -> check.Check:
    """Check content against content: the results' rows take the new runs."""
    runs = check._runs(new)
    rows = tuple(row.__class__(**{**vars(row), "runs": runs[row.case]}) for row in found.rows if row.case in runs)
    return check.check(old, found.__class__(**{**vars(found), "rows": rows}))


def test_the_same_passes(study) -> None:
    found, content = study
    same = compared(content, content, found)
    assert same.passed
    assert same.reference == "bvh-median"
    assert len(same.changes) == 2 * 4 * 3, "build and trace of three methods, beside the reference, in four groups"
    assert list(same.lines()) == [
        "0 of 24 times got slower beyond the noise, each by ratio to bvh-median in the same run"
    ]


def test_what_got_slower_is_told_and_fails(study) -> None:
    found, content = study
    slower = compared(content, changed(content, 1.5), found)
    assert not slower.passed
    lines = list(slower.lines())
    assert len([line for line in lines if line.startswith("SLOWER")]) == 4
    assert "grid, trace: 1.000 then, 1.500 now (x1.50)" in lines[0]


def test_what_got_faster_is_told_and_passes(study) -> None:
    found, content = study
    faster = compared(changed(content, 1.5), content, found)
    assert faster.passed
    assert sum(line.startswith("faster") for line in faster.lines()) == 4


def test_a_change_within_the_noise_is_none(study) -> None:
    found, content = study
    noisy = changed(content, 1.5)
    for row in noisy["rows"]:
        if row["method"] == "grid":
            row["runs"][0]["trace_s"] = 2.0
    assert compared(content, noisy, found).passed
    assert compared(content, changed(content, 1.04), found).passed, "less than the margin"


def test_few_runs_need_a_larger_change(study) -> None:
    found, content = study
    few = json.loads(json.dumps(content))
    for row in few["rows"]:
        row["runs"] = row["runs"][:3]
    assert compared(few, changed(few, 1.2), found).passed
    assert not compared(few, changed(few, 1.5), found).passed


def test_what_is_missing_now_fails(study) -> None:
    found, content = study
    fewer = changed(content, 1.0)
    fewer["rows"] = [row for row in fewer["rows"] if row["method"] != "hybrid-sampled"]
    missing = compared(content, fewer, found)
    assert not missing.passed
    assert sum(line.startswith("MISSING") for line in missing.lines()) == 4


def test_studies_without_a_common_reference_are_refused(study) -> None:
    found, content = study
    alone = changed(content, 1.0)
    alone["rows"] = [row for row in alone["rows"] if row["method"] == "grid"]
    with pytest.raises(StudyError, match="in common"):
        compared(alone, content, found)


def test_what_is_no_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="cannot be read"):
        check.read(tmp_path / "none.json")
    for text in ("{", "[]", '{"schema_version": 1}', '{"schema_version": 99}'):
        (tmp_path / "old.json").write_text(text)
        with pytest.raises(StudyError, match=r"no study\.json"):
            check.read(tmp_path / "old.json")
    assert PLAN.repeats == 2
