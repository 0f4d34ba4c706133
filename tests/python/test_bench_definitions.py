"""The benchmarks' definitions: they parse, name what exists, and their answers are those of brute force."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).resolve().parents[1] / "bench"
sys.path.insert(0, str(BENCH))

import definitions  # noqa: E402
import harness  # noqa: E402

import espalier_scenes  # noqa: E402

PAPER = ["bunny1", "bunny2", "horse1_sub", "horse2", "goldfish1_sub", "goldfish2_sub", "dragon"]
CLASSES = [
    "primary", "ao_short", "ao_infinite", "diffuse", "single", "build_fast", "build_quality", "time_to_image", "memory",
]  # fmt: skip


@pytest.fixture(scope="module")
def defined() -> definitions.Definitions:
    return definitions.load()


def test_the_paper_s_scenes_come_first_and_every_class_is_there(defined: definitions.Definitions) -> None:
    assert list(defined.scenes)[:7] == PAPER
    assert list(defined.classes) == CLASSES


def test_every_generated_scene_is_in_the_catalogue(defined: definitions.Definitions) -> None:
    wanted = {scene.catalogue for scene in defined.scenes.values() if scene.catalogue}
    assert wanted
    assert wanted <= set(espalier_scenes.names())


def test_every_scene_has_an_answer_to_every_traced_class(defined: definitions.Definitions) -> None:
    traced = {name for name, entry in defined.classes.items() if entry["kind"] in {"batch", "single"}}
    assert {name: set(scene.hits) for name, scene in defined.scenes.items()} == dict.fromkeys(defined.scenes, traced)


def test_bounces_start_where_primary_rays_hit(defined: definitions.Definitions) -> None:
    for scene in defined.scenes.values():
        assert scene.hits["single"] == scene.hits["primary"] <= defined.resolution**2
        assert scene.hits["ao_short"] <= scene.hits["ao_infinite"] == scene.hits["diffuse"] <= scene.hits["primary"]


@pytest.mark.parametrize("choose", ["choose_scenes", "choose_classes"])
def test_an_unknown_name_is_told_with_the_known_ones(defined: definitions.Definitions, choose: str) -> None:
    with pytest.raises(definitions.DefinitionError, match=r"'nothing'.*(bunny1|primary)"):
        getattr(defined, choose)(["nothing"])


def test_a_folder_without_models_is_refused(defined: definitions.Definitions, tmp_path: Path) -> None:
    with pytest.raises(definitions.DefinitionError, match=r"no \.ply"):
        defined.choose_scenes([], tmp_path)


@pytest.fixture(scope="module")
def binary() -> Path:
    return harness.build_as_tested()


def _quad(directory: Path) -> dict:
    """A unit square in the plane z = 0, seen from above so that it fills 1 / 1.05^2 of the image."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    vertices.tofile(directory / "quad.vertices")
    np.array([[0, 1, 2], [0, 2, 3]], np.uint32).tofile(directory / "quad.triangles")
    camera = {"slope": 0.4, "up": [0, 1, 0], "place": {"outside": [0, 0, 1]}}
    files = {"vertices": str(directory / "quad.vertices"), "triangles": str(directory / "quad.triangles")}
    return {"name": "quad", "seed": 1, "camera": camera} | files


def _plan(defined: definitions.Definitions, directory: Path, **settings: object) -> dict:
    classes = defined.choose_classes(["primary", "ao_infinite", "single"])
    common = {"library": None, "isa": None, "threads": 1, "rounds": 1, "seconds": 1.0, "resolution": 256}
    return common | {"scene": _quad(directory), "classes": classes} | settings


def test_the_harness_counts_the_hits_of_a_square(
    defined: definitions.Definitions, binary: Path, tmp_path: Path
) -> None:
    rows = {row["class"]: row for row in harness.run(binary, "hits", _plan(defined, tmp_path), tmp_path / "plan.json")}
    share = rows["primary"]["hits"] / rows["primary"]["rays"]
    assert rows["primary"]["rays"] == 256 * 256
    assert share == pytest.approx(1 / 1.05**2, abs=2e-3)
    assert rows["single"]["hits"] == rows["primary"]["hits"] == rows["ao_infinite"]["rays"]
    assert rows["ao_infinite"]["hits"] == 0


def test_the_race_agrees_with_embree(defined: definitions.Definitions, binary: Path, tmp_path: Path) -> None:
    plan = _plan(defined, tmp_path, library=str(harness.embree()))
    rows = list(harness.run(binary, "race", plan, tmp_path / "plan.json"))
    of = [(row["class"], row["method"]) for row in rows]
    methods = ("bvh-sah", "sbvh+reinsert")
    assert of == [(name, method) for name in ("primary", "ao_infinite", "single") for method in methods]
    for row in rows:
        assert row["mismatches"] <= 2, json.dumps(row)  # rays along the square's outline
        assert row["ours_wrong"] == 0
        assert row["ratio"] == pytest.approx(row["ours"] / row["embree"])


def test_a_missing_embree_is_told_with_how_to_get_it(
    defined: definitions.Definitions, binary: Path, tmp_path: Path
) -> None:
    plan = _plan(defined, tmp_path, library=str(tmp_path / "none.so"))
    with pytest.raises(harness.NativeError, match="pip install embreex"):
        list(harness.run(binary, "race", plan, tmp_path / "plan.json"))


def test_a_missing_embreex_is_told_with_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(harness.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(harness.NativeError, match="pip install embreex"):
        harness.embree()
