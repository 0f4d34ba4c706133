"""When a grid beats a hierarchy: the benchmark's arithmetic, figure and tables, without timing anything."""

import dataclasses
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "bench"))

import definitions  # noqa: E402
import grids  # noqa: E402
import harness  # noqa: E402
import markdown  # noqa: E402
import paper  # noqa: E402
import ratio_figure  # noqa: E402
import verdict  # noqa: E402
from verdict import Case  # noqa: E402

SCENES = ("soup", "scan", "hall")
REACHES = (0.002, 0.01, None)
BATCHES = (1, 64, 100_000)


def _cases() -> list[Case]:
    """Scenes whose times are exact lines in steps and tests; in "soup" a grid wins one at a time."""
    cases = []
    for index, (scene, occupied, steps) in enumerate(zip(SCENES, (1.0, 0.2, 0.3), (2.0, 30.0, 20.0), strict=True)):
        for place, reach in enumerate(REACHES):
            for batch in BATCHES:
                counts = {"grid": (steps + place, 4.0 + index), "bvh-sah": (10.0 + 3 * place, 3.0 + index)}
                times = {name: 1e-9 * (20 * own[0] + 5 * own[1] + 7) for name, own in counts.items()}
                rates = {name: 1 / times[name] for name in times}
                hierarchies = {"bvh-sah": rates["bvh-sah"] * (1 if batch == 1 else 100)}
                cases.append(Case(scene, occupied, reach, batch, {"grid": rates["grid"]}, hierarchies, counts))
    return cases


def test_a_recorded_case_is_read_as_it_was() -> None:
    for case in _cases():
        found = verdict.read(case.row(), ["grid"])
        assert dataclasses.replace(found, grids=case.grids, hierarchies=case.hierarchies) == case
        assert found.ratio == pytest.approx(case.ratio, rel=1e-6)
        assert case.row()["winner"] == ("grid" if case.ratio > 1 else "bvh-sah")


def test_methods_follow_each_other_where_their_lines_cross() -> None:
    builds = {"grid": 1.0, "lbvh": 2.0, "sbvh": 102.0, "late": 500.0, "never": 3.0}
    ray_seconds = {"grid": 0.3, "lbvh": 0.2, "sbvh": 0.1, "late": 0.09, "never": 0.25}
    found = verdict.envelope(builds, ray_seconds, 1.0, 1e4)
    assert [(part["method"], part["from_rays"]) for part in found] == [
        ("grid", 1.0),
        ("lbvh", pytest.approx(10.0)),
        ("sbvh", pytest.approx(1000.0)),
    ]
    rays = np.geomspace(1, 1e4, 50)
    least = np.min([builds[name] + rays * ray_seconds[name] for name in builds], axis=0)
    places = np.searchsorted([part["from_rays"] for part in found], rays, side="right") - 1
    chosen = [
        builds[found[i]["method"]] + n * ray_seconds[found[i]["method"]] for i, n in zip(places, rays, strict=True)
    ]
    assert chosen == pytest.approx(list(least))


def test_a_method_that_is_fastest_from_the_start_stays() -> None:
    assert verdict.envelope({"a": 1.0, "b": 2.0}, {"a": 0.1, "b": 0.1}, 1e3, 1e8) == [{"method": "a", "from_rays": 1e3}]


def test_times_that_are_lines_in_steps_and_tests_are_foretold() -> None:
    cases = [case for case in _cases() if case.batch == 1]
    assert [case.ratio > 1 for case in cases] == verdict.by_counts(cases) == verdict.by_occupancy(cases, 0.8)
    scores = verdict.scores(cases, 0.8)
    assert scores["occupancy"] == scores["sampled cost"] == verdict.Score(1.0, 1.0)
    assert scores["always a grid"].right == pytest.approx(1 / 3) == 1 - scores["never a grid"].right
    assert scores["always a grid"].cost > 1 < scores["never a grid"].cost


def test_figure_is_well_formed_and_has_every_series() -> None:
    root = ET.fromstring(ratio_figure.draw(_cases()))
    name = "{http://www.w3.org/2000/svg}"
    assert root.tag == f"{name}svg"
    lines = list(root.iter(f"{name}path"))
    assert len(lines) == len(BATCHES) * (3 + 1)  # of three panels, and of the legend
    assert len(list(root.iter(f"{name}circle"))) == 3 * len(BATCHES) * len(REACHES)
    texts = ["".join(text.itertext()) for text in root.iter(f"{name}text")]
    assert {"soup", "scan", "hall", "∞", "0.2%", "one ray a call", "100 000 rays a call"} <= set(texts)
    assert len([line for line in root.iter(f"{name}line") if line.get("class") == "one"]) == 3 + 1


def test_tables_have_a_line_a_scene() -> None:
    assert grids.table(_cases()).row_count == 3 * len(REACHES)
    result = grids.summary(_cases(), {name: {"grid": 1e-3, "bvh-sah": 1e-2} for name in SCENES}, 0.8)
    single = {part["scene"]: part["fastest"] for part in result["number_of_rays"] if part["batch"] == 1}
    assert [part["method"] for part in single["soup"]] == ["grid"]
    assert [part["method"] for part in single["scan"]] == ["grid", "bvh-sah"]
    assert set(result["foretold"]) == {"all", "one at a time", "endless, one at a time"}


def test_ratios_of_the_paper_s_setting_are_to_the_first_method() -> None:
    turn = {"scene": "fish", "mismatches": 0}
    times = {"bvh-median": (1.0, 4.0, 5.0), "grid": (0.5, 6.0, 6.5)}
    turns = [
        turn | {"method": method, "class": part, "seconds": seconds}
        for method, of in times.items()
        for part, seconds in zip(paper.PARTS, of, strict=True)
    ]
    rows = paper.gathered(turns)
    assert [row["method"] for row in rows] == ["bvh-median", "grid"]
    assert rows[1]["ratios"] == {"build_s": 0.5, "trace_s": 1.5, "total_s": 1.3}
    assert markdown.paper(rows)[2] == "| fish | 1000 / 4000 / 5000 | 0.50 / 1.50 / 1.30 |"
    assert paper.table(rows).row_count == 1


def test_soups_fill_the_share_that_they_say() -> None:
    soups = definitions.load().soups
    assert set(definitions.load().grids["soups"]) == set(soups)
    for name in ("soup_half", "soup_tenth"):
        vertices, triangles = soups[name].mesh()
        centers = vertices[triangles].mean(axis=1)
        blocks = np.clip(np.floor((centers + 1) / 2 * definitions.BLOCKS), 0, definitions.BLOCKS - 1)
        filled = len(np.unique(blocks, axis=0)) / definitions.BLOCKS**3
        assert filled == pytest.approx(soups[name].filled, abs=2e-3)
        assert len(triangles) == soups[name].triangles


def test_methods_agree_on_rays_of_every_reach_and_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The harness itself, over a small soup and few rays."""
    monkeypatch.setattr(grids, "OUT", tmp_path)
    defined = definitions.load()
    settings = defined.grids | {"rays": 300, "batches": [1, 8, 300], "rounds": 1, "seconds": 0.0, "build_seconds": 0.0}
    defined = dataclasses.replace(defined, grids=settings)
    soup = dataclasses.replace(defined.soups["soup_20k"], triangles=2_000)
    rows = list(grids.measured(defined, soup, harness.build_as_tested()))
    assert [row for row in rows if row["mismatches"]] == []
    traced = [row for row in rows if row["class"] != "build"]
    hits = {row["class"]: row["hits"] for row in traced}
    assert hits["inf 1"] == hits["inf 8"] == hits["inf 300"] > hits["0.01 1"]
    cases = list(grids.gathered(settings, rows, grids.occupancy(soup, settings["density"])))
    assert len(cases) == len(settings["reaches"]) * 3
    assert cases[0].occupancy > 0.9
    assert all(steps > 0 for case in cases for steps, _ in case.counts.values())


def test_readme_says_what_is_recorded() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = text.splitlines()
    said = markdown.ratios(markdown.recorded_cases()) + markdown.paper(markdown.recorded("paper")["rows"])
    assert [line for line in said if line not in lines] == []
    assert [name for name in ("grids", "paper") if markdown.recorded(name)["about"]["commit"] not in text] == []


def test_recorded_figure_is_that_of_the_recorded_cases() -> None:
    kept = ET.parse(ROOT / "tests" / "bench" / "record" / "grids.svg").getroot()
    name = "{http://www.w3.org/2000/svg}"
    scenes = list(dict.fromkeys(case.scene for case in markdown.recorded_cases()))
    titles = [text.text for text in kept.iter(f"{name}text") if text.get("class") == "name"]
    assert titles == scenes
