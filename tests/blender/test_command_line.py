"""`blender --command espalier compare`: the pictures and the report, and one clear line where something is wrong."""

import json
from pathlib import Path

import pytest

from . import images
from .blender import Blender

PICTURES = ("compare.png", "espalier.png", "cycles.png", "difference.png")


def test_compare_writes_pictures_and_report(blender: Blender, blend: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    compare = ("--command", "espalier", "compare", blend, "--resolution", "80x60", "--out", out)
    done = blender.run(*compare, timeout=240)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert [method["name"] for method in report["methods"]] == [
        "bvh-median",
        "bvh-sah",
        "grid",
        "hybrid-sampled",
        "hybrid",
    ]
    assert report["scene"]["instances"] >= 3
    assert report["cycles"]["total_s"] > 0
    assert report["image"] | {"width": 80, "height": 60} == report["image"]
    assert images.read(out / "espalier.png").shape == (60, 80, 3)
    assert all((out / name).is_file() for name in PICTURES)
    assert "hybrid-sampled" in done.stdout


def test_study_writes_its_report(blender: Blender, blend: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ("--resolutions", "80x60", "--methods", "grid,hybrid-sampled", "--repeats", "2", "--out", out)
    done = blender.run("--command", "espalier", "study", blend, "cornell_box", *options, timeout=240)
    rows = json.loads((out / "study.json").read_text(encoding="utf-8"))["rows"]
    assert {row["scene"] for row in rows} == {str(blend), "cornell_box"}
    assert not any(row["failure"] for row in rows)
    assert f"Report: {out / 'report.html'}" in done.stdout


@pytest.mark.parametrize("bad", ["nowhere.blend", "no-such-scene"])
def test_unknown_input_is_one_line_and_status_2(blender: Blender, tmp_path: Path, bad: str) -> None:
    out = tmp_path / "out"
    done = blender.run("--command", "espalier", "compare", bad, "--out", out, status=2)
    assert [bad in line for line in done.stderr.splitlines() if "espalier" in line.lower()] == [True]
    assert not out.exists()
