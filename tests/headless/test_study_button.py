"""Run Study without a window: a report of the open scene, Esc, and a scene that is as it was."""

import json
import threading
import time
from pathlib import Path

import bpy
import pytest
import snapshot
from building import add, camera, mesh, square

from espalier.operators import study as study_operator
from espalier.operators import task
from espalier_scenes.geometry import icosphere


@pytest.fixture
def ready(scene):
    """A ball under a camera, at 24x16, and a second object that is selected and being edited."""
    vertices, triangles = icosphere(3)
    add("Ball", mesh("Ball", vertices.tolist(), triangles.tolist()))
    camera()
    scene.espalier.methods = {"grid", "bvh-median"}
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    other = square("Edited")
    other.location.x = 30.0
    bpy.context.view_layer.objects.active = other
    other.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    return scene


def test_the_report_is_there_and_the_scene_as_it_was(ready, tmp_path: Path):
    before = snapshot.take(ready)
    assert bpy.ops.espalier.study(directory=str(tmp_path)) == {"FINISHED"}
    assert snapshot.take(ready) == before
    assert task.current() is None
    content = json.loads((tmp_path / "study.json").read_text())
    assert content["plan"]["resolutions"] == [[24, 16]]
    assert {row["method"] for row in content["rows"]} == {"grid", "bvh-median"}
    assert {row["rays"] for row in content["rows"]} == set(study_operator.RAYS)
    assert not any(row["failure"] for row in content["rows"])
    assert ready.name in (tmp_path / "report.html").read_text()


def test_a_second_press_measures_anew(ready, tmp_path: Path):
    for _ in range(2):
        assert bpy.ops.espalier.study(directory=str(tmp_path)) == {"FINISHED"}
    runs = (tmp_path / "runs.jsonl").read_text().splitlines()
    assert sum('"run"' in line for line in runs) == 7 * 2 * len(study_operator.RAYS)


def test_a_cancel_is_obeyed_at_once_and_the_next_press_goes_on(ready, tmp_path: Path):
    ready.render.resolution_x = ready.render.resolution_y = 400
    before = snapshot.take(ready)
    cancelled_at = []

    def cancel():
        while task.current() is None or not (tmp_path / "runs.jsonl").exists() or _runs(tmp_path) < 3:
            time.sleep(0.005)
        cancelled_at.append(time.monotonic())
        task.current().cancel()

    canceller = threading.Thread(target=cancel)
    canceller.start()
    assert bpy.ops.espalier.study(directory=str(tmp_path)) == {"CANCELLED"}
    canceller.join()
    assert time.monotonic() - cancelled_at[0] < 0.5
    assert snapshot.take(ready) == before
    assert not (tmp_path / "report.html").exists()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("espalier")]
    kept = (tmp_path / "runs.jsonl").read_bytes()
    assert bpy.ops.espalier.study(directory=str(tmp_path)) == {"FINISHED"}
    assert (tmp_path / "runs.jsonl").read_bytes().startswith(kept)


def test_a_folder_that_cannot_be_made_is_reported(ready, tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RuntimeError, match="Cannot write to"):
        bpy.ops.espalier.study(directory=str(tmp_path / "file" / "below"))
    assert task.current() is None


def test_the_folder_is_beside_a_saved_file(ready, tmp_path: Path):
    assert study_operator.default_folder(ready).name == f"espalier-{bpy.path.clean_name(ready.name)}-study"
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "house.blend"))
    assert study_operator.default_folder(ready) == tmp_path / f"house-{bpy.path.clean_name(ready.name)}-study"


def _runs(folder: Path) -> int:
    return sum('"run"' in line for line in (folder / "runs.jsonl").read_text().splitlines())
