"""The command line where it needs no Blender: options, inputs that are none, lists, progress."""

import io
import json
import subprocess
import sys
from pathlib import Path

import espalier_rt
import pytest

from espalier import command_line, terminal
from espalier.methods import COMPARED_METHODS
from espalier.study import command
from espalier.study.plan import PAPER_SCENES

CONFTEST = Path(__file__).resolve().parents[1] / "conftest.py"


def in_own_process(script: str) -> "subprocess.CompletedProcess[str]":
    """Run a script that imports from this checkout as the tests do."""
    prelude = f"import runpy; runpy.run_path({str(CONFTEST)!r})"
    return subprocess.run([sys.executable, "-c", f"{prelude}\n{script}"], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["trace"],
        ["compare"],
        ["compare", "no-such-scene"],
        ["compare", "nowhere/scene.blend"],
        ["compare", "suzanne", "--methods", "grid,octree"],
        ["compare", "suzanne", "--methods", ","],
        ["compare", "suzanne", "--resolution", "640"],
        ["compare", "suzanne", "--resolution", "0x480"],
        ["compare", "suzanne", "--resolution", "640x99999"],
        ["compare", "suzanne", "--samples", "0"],
        ["compare", "suzanne", "--samples", "many"],
        ["compare", "suzanne", "--threads", "-1"],
        ["compare", "suzanne", "--frame", "1.5"],
        ["compare", "suzanne", "--denoise"],
        ["study", "no-such-scene"],
        ["study", "--methods", "octree"],
        ["study", "--rays", "primary,secondary"],
        ["study", "--resolutions", "640x480,640"],
        ["study", "--repeats", "0"],
        ["study", "--check", "nowhere/study.json"],
        ["study", "--paper", "nowhere/paper.json"],
    ],
    ids=" ".join,
)
def test_what_cannot_be_used_is_one_line_and_status_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("espalier: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["picture.png", "folder.ply", "noend"])
def test_a_file_of_another_kind_is_named(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    path.mkdir() if name.startswith("folder") else path.write_text("")
    assert command_line.main(["compare", str(path)]) == 2
    assert f"{path} is no file that can be traced: give one of .blend .ply" in capsys.readouterr().err


def test_an_unknown_name_lists_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["compare", "bunny"]) == 2
    assert "no scene 'bunny': scenes are suzanne, teapot_stadium," in capsys.readouterr().err


def test_options_are_read_as_they_are_meant() -> None:
    parse = command_line._parser().parse_args
    plain = parse(["compare", "city"])
    assert (plain.methods, plain.resolution, plain.samples, plain.threads) == (COMPARED_METHODS, None, 1, 0)
    assert (plain.cycles, plain.frame, plain.out) == (True, None, None)
    full = parse(
        ["compare", "a.blend", "--methods=grid,bvh-sah,grid", "--resolution=640X480", "--no-cycles", "--frame=-3"]
    )
    assert (full.methods, full.resolution, full.cycles, full.frame) == (("grid", "bvh-sah"), (640, 480), False, -3)


def test_a_study_is_as_the_paper_did_unless_options_say_other() -> None:
    parse = command_line._parser().parse_args
    plain = command.plan_of(parse(["study", "--no-embree"]), None)
    assert plain.scenes == PAPER_SCENES
    assert plain.methods == tuple(espalier_rt.methods())
    assert (plain.classes, plain.resolutions) == (("primary-shadow",), ((1000, 1000),))
    options = [
        "study",
        "city",
        "dragon",
        "--methods=grid",
        "--rays=ao,primary",
        "--resolutions=64x48,9x9",
        "--threads=1",
    ]
    full = command.plan_of(parse([*options, "--repeats=3", "--seconds=0", "--no-embree"]), None)
    assert (full.scenes, full.methods, full.classes) == (("city", "dragon"), ("grid",), ("ao", "primary"))
    assert (full.resolutions, full.threads, full.repeats, full.seconds) == (((64, 48), (9, 9)), 1, 3, 0.0)
    again = command.plan_of(parse(["study", "--no-embree"]), {"plan": full.as_dict()})
    assert again == full, "a check measures what the older study did"


def test_a_study_of_a_mesh_needs_no_bpy_and_a_check_gives_the_status(tmp_path: Path) -> None:
    script = f"""
import sys
sys.modules["bpy"] = None
from espalier.command_line import main
sys.exit(main([*{["study", "cornell_box", "--methods=grid,bvh-median", "--resolutions=32x24", "--repeats=6"]!r},
    "--no-embree", "--out", {str(tmp_path / "out")!r}, *sys.argv[1:]]))
"""
    done = in_own_process(script)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == f"Report: {tmp_path / 'out' / 'report.html'}"
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "report.html",
        "study.json",
        "study.csv",
        "runs.jsonl",
    }
    old = json.loads((tmp_path / "out" / "study.json").read_text())
    # A build of so few triangles takes microseconds, and a busy machine can make a thousand times that of one.
    for row in old["rows"]:
        if row["method"] == "grid":
            row["runs"] = [{"build_s": run["build_s"] / 1e9, "trace_s": run["trace_s"]} for run in row["runs"]]
    (tmp_path / "old.json").write_text(json.dumps(old))
    script = script.replace("*sys.argv[1:]", f"'--check', {str(tmp_path / 'old.json')!r}")
    done = in_own_process(script)
    assert done.returncode == 1
    assert "SLOWER" in done.stdout


def test_scenes_lists_every_scene_with_its_purpose(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["scenes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[0] == "suzanne"
    assert any(line.startswith("dragon ") and "Stanford Dragon" in line for line in lines)


def test_help_ends_with_status_0(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["compare", "--help"]) == 0
    assert "--resolution" in capsys.readouterr().out


def test_without_bpy_it_says_how_to_get_it(tmp_path: Path) -> None:
    script = f"""
import sys
sys.modules["bpy"] = None
from espalier.command_line import main
sys.exit(main(["compare", "suzanne", "--out", {str(tmp_path / "out")!r}]))
"""
    done = in_own_process(script)
    assert (done.returncode, done.stdout) == (2, "")
    assert "pip install bpy" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_draws_over_itself_and_goes_away() -> None:
    stream = Terminal()
    line = terminal.ProgressLine(io.StringIO(), stream)
    line.update(0.5, "Uniform Grid: build")
    line.update(1.0, "Uniform Grid: trace")
    line.close()
    assert "\n" not in stream.getvalue()
    assert "50%" in stream.getvalue()
    assert stream.getvalue().endswith("\r\x1b[K")


def test_a_log_gets_one_line_for_each_phase() -> None:
    stream = io.StringIO()
    line = terminal.ProgressLine(stream, io.StringIO())
    for status in ("Export", "Uniform Grid: build", "Uniform Grid: build", "Cycles: load", "Cycles: sample 1 of 2", ""):
        line.update(0.3, status)
    line.close()
    assert stream.getvalue().splitlines() == ["Export", "Uniform Grid: build", "Cycles"]


def test_what_others_print_does_not_reach_our_streams() -> None:
    """In a process of its own: the streams are file descriptors."""
    script = """
import os
from espalier.terminal import own_streams
with own_streams() as (out, err):
    os.write(1, b"chatter"); os.write(2, b"chatter")
    os.system("echo chatter")
    out.write("ours out"); err.write("ours err")
os.write(1, b", and after")
"""
    done = in_own_process(script)
    assert done.stdout == "ours out, and after"
    assert done.stderr == "ours err"
