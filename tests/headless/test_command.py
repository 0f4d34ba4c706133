"""The command in a process of its own, as a shell starts it."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PRELUDE = f"""
import runpy, sys
runpy.run_path({str(ROOT / "tests" / "conftest.py")!r})
from espalier.command_line import console
console()
"""
CUBE = """o Cube
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-c", PRELUDE, *map(str, arguments)]


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(command(*arguments), capture_output=True, text=True, check=False, timeout=120)


def test_compare_writes_pictures_and_report_and_prints_the_table(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("compare", "cornell_box", "--resolution", "64x48", "--threads", 1, "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in out.iterdir()} == {
        "compare.png",
        "espalier.png",
        "cycles.png",
        "difference.png",
        "report.json",
    }
    report = json.loads((out / "report.json").read_text())
    assert report["image"] == {"width": 64, "height": 48, "samples": 1}
    for name in ("espalier", "cycles", "difference"):
        with Image.open(out / f"{name}.png") as picture:
            assert picture.size == (64, 48)
    lines = done.stdout.splitlines()
    assert all(any(f"({method['name']})" in line for line in lines) for method in report["methods"])
    assert lines[-1] == f"Pictures and report: {out}"
    assert "Info:" not in done.stdout


def test_a_bare_mesh_gets_camera_and_light_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "cube.obj").write_text(CUBE)
    out = tmp_path / "out"
    done = run(
        "compare", tmp_path / "cube.obj", "--methods", "grid", "--no-cycles", "--resolution", "40x40", "--out", out
    )
    assert done.returncode == 0, done.stderr
    assert "Note: There is no camera: one was framed on everything that renders" in done.stdout
    assert "Note: There is no light: two suns and a grey world were added" in done.stdout
    assert {path.name for path in out.iterdir()} == {"espalier.png", "report.json"}
    report = json.loads((out / "report.json").read_text())
    assert (report["scene"]["name"], report["scene"]["triangles"]) == ("cube", 12)
    with Image.open(out / "espalier.png") as picture:
        shades = {picture.getpixel((20, 20)), picture.getpixel((1, 1))}
    assert len(shades) == 2


def test_a_blend_is_traced_at_its_own_size_and_the_frame_asked_for(tmp_path: Path, scene: bpy.types.Scene) -> None:
    data = bpy.data.meshes.new("Quad")
    data.from_pydata([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [], [(0, 1, 2, 3)])
    quad = bpy.data.objects.new("Quad", data)
    scene.collection.objects.link(quad)
    quad.location.x = 0
    quad.keyframe_insert("location", frame=1)
    quad.location.x = 100
    quad.keyframe_insert("location", frame=10)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -5, 0), (1.5707963, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 80, 60, 50
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (1.2, 0, 0)
    scene.collection.objects.link(sun)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "moving.blend"), copy=True)
    middles = []
    for frame in (1, 10):
        out = tmp_path / str(frame)
        options = ("--methods", "bvh-sah", "--no-cycles", "--frame", frame, "--out", out)
        done = run("compare", tmp_path / "moving.blend", *options)
        assert done.returncode == 0, done.stderr
        with Image.open(out / "espalier.png") as picture:
            assert picture.size == (40, 30)
            middles.append(picture.getpixel((20, 15)))
    assert middles[0] != middles[1]


@pytest.mark.parametrize(
    "name", ["junk.blend", "junk.ply", "junk.obj", "junk.stl", "junk.glb", "empty.obj", "empty.ply"]
)
def test_a_broken_file_is_one_line_and_status_2(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("" if name.startswith("empty") else "garbage\n")
    out = tmp_path / "a" / "out"
    done = run("compare", tmp_path / name, "--out", out)
    assert done.returncode == 2
    assert done.stderr.startswith("espalier: ")
    assert done.stderr.count("\n") == 1
    assert name in done.stderr
    assert not out.parent.exists()


def test_a_folder_that_cannot_be_written_is_one_line_and_status_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run("compare", "cornell_box", "--out", tmp_path / "file" / "out")
    assert done.returncode == 2
    assert done.stderr.startswith(f"espalier: Cannot write to {tmp_path / 'file' / 'out'}")
    assert done.stderr.count("\n") == 1


def workers(parent: int) -> list[int]:
    """The second Blenders that have this parent."""
    command = ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(parent)]
    lines = subprocess.run(command, capture_output=True, text=True, check=False).stdout.splitlines()
    return [int(line.split()[0]) for line in lines if "cycles_worker" in line]


def is_alive(process: int) -> bool:
    """True while the process runs; one that waits to be buried does not."""
    command = ["ps", "-o", "stat=", "-p", str(process)]
    state = subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    return bool(state) and not state.startswith("Z")


def wait_for(condition: Callable[[], object], seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.05)


@pytest.mark.skipif(os.name != "posix", reason="Ctrl C is a POSIX signal here")
@pytest.mark.parametrize("when", ["Uniform Grid: trace", "Cycles"])
def test_ctrl_c_ends_with_130_and_leaves_nothing(tmp_path: Path, when: str) -> None:
    out = tmp_path / "out"
    samples = 30_000 if when.startswith("Uniform") else 6
    arguments = ("compare", "cornell_box", "--methods", "grid", "--samples", samples, "--resolution", "256x256")
    process = subprocess.Popen(
        command(*arguments, "--out", out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    for line in process.stdout:
        if line.strip() == when:
            break
    if when == "Cycles":
        wait_for(lambda: workers(process.pid))
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err == "espalier: interrupted\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="ps is POSIX")
def test_the_second_blender_does_not_outlive_a_killed_first(tmp_path: Path) -> None:
    arguments = ("compare", "cornell_box", "--methods", "bvh-sah", "--samples", 40, "--resolution", "300x300")
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        command(*arguments, "--out", tmp_path / "out"), stdout=subprocess.DEVNULL, env=environment
    ) as process:
        wait_for(lambda: workers(process.pid))
        (worker,) = workers(process.pid)
        process.kill()
    wait_for(lambda: not is_alive(worker), seconds=10.0)


def test_a_study_takes_scenes_that_only_blender_opens(tmp_path: Path, scene: bpy.types.Scene) -> None:
    data = bpy.data.meshes.new("Quad")
    data.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("Quad", data))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "quad.blend"), copy=True)
    out = tmp_path / "out"
    options = ("--methods", "grid,bvh-sah", "--resolutions", "32x24", "--repeats", 2, "--no-embree", "--out", out)
    done = run("study", tmp_path / "quad.blend", "cornell_box", *options)
    assert (done.returncode, done.stderr) == (0, "")
    content = json.loads((out / "study.json").read_text())
    assert [entry["name"] for entry in content["scenes"]] == ["quad", "cornell_box"]
    assert not any(row["failure"] for row in content["rows"])


@pytest.mark.skipif(os.name != "posix", reason="Ctrl C is a POSIX signal here")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_study_goes_on_with_the_same_command(tmp_path: Path, sent: signal.Signals) -> None:
    out = tmp_path / "out"
    options = ("cornell_box", "city", "--methods", "grid,bvh-sah", "--resolutions", "1000x1000", "--no-embree")
    arguments = ("study", *options, "--repeats", 20, "--seconds", 2, "--out", out)
    with subprocess.Popen(command(*arguments), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        journal = out / "runs.jsonl"
        wait_for(lambda: journal.exists() and journal.read_text().count('"run"') > 2)
        process.send_signal(sent)
        _, err = process.communicate(timeout=20)
    assert process.returncode == (130 if sent == signal.SIGINT else -signal.SIGKILL)
    assert ("goes on from here" in err) == (sent == signal.SIGINT)
    assert [path.name for path in out.iterdir()] == ["runs.jsonl"]
    kept = journal.read_text().rpartition("\n")[0]
    done = run(*arguments)
    assert (done.returncode, done.stderr) == (0, "")
    assert journal.read_text().startswith(kept)
    assert (out / "report.html").exists()
