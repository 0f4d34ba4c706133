"""A whole comparison, small: pictures, report, cancel, and the user's scene as it was."""

import json
import threading
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from PIL import Image

from espalier import compare, cycles
from espalier.errors import CancelledError, NoCameraError
from espalier.methods import COMPARED_METHODS
from espalier.run import Options
from espalier_scenes import catalogue

SMALL = compare.Settings(options=Options(samples=4, threads=1), resolution=(48, 64))


def settings_of(scene: bpy.types.Scene) -> dict[str, object]:
    """Every plain setting of the scene's render, Cycles, image and view settings, and the selection."""
    groups = (scene.render, scene.cycles, scene.render.image_settings, scene.view_settings, scene.espalier)
    found: dict[str, object] = {
        f"{group.bl_rna.identifier}.{name}": getattr(group, name)
        for group in groups
        for name, kind in group.bl_rna.properties.items()
        if kind.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"} and not getattr(kind, "is_array", False)
    }
    data = {name: len(getattr(bpy.data, name)) for name in ("scenes", "images", "objects", "meshes", "texts")}
    selected = {thing.name for thing in bpy.context.view_layer.objects if thing.select_get()}
    return found | data | {"selected": selected, "frame": scene.frame_current, "file": bpy.data.filepath}


def test_a_comparison_has_all_methods_cycles_and_pictures_that_look_alike(scene: bpy.types.Scene) -> None:
    catalogue.find("cornell_box").build(scene)
    told: list[tuple[float, str]] = []
    outcome = compare.run(scene, SMALL, progress=lambda *now: told.append(now))
    report = outcome.report
    assert [method.name for method in report.methods] == list(COMPARED_METHODS)
    assert (report.scene.triangles, report.scene.instances) == (len(catalogue.find("cornell_box").mesh()[1]), 11 - 3)
    assert (report.image.width, report.image.height, report.image.samples, report.threads) == (48, 64, 4, 1)
    assert all(method.rays >= 48 * 64 * 4 for method in report.methods)
    assert report.cycles.total_s == pytest.approx(report.cycles.sync_s + report.cycles.render_s)
    assert report.cycles.sync_s > 0
    assert outcome.espalier.shape == outcome.cycles.shape == outcome.difference.shape == (64, 48, 3)
    # Left is red and right is green in both, which a mirrored or turned picture has not.
    for picture in (outcome.espalier, outcome.cycles):
        left, right = (picture[10:50, columns].mean(axis=(0, 1)) for columns in (slice(0, 8), slice(40, 48)))
        assert left[0] > 1.5 * left[1]
        assert right[1] > 1.2 * right[0]
    assert 0 < report.difference.flip_mean < 0.6
    assert [now[0] for now in told] == sorted(now[0] for now in told)
    assert told[-1][0] == 1.0
    json.loads(report.json())


def test_the_scene_is_as_it_was(scene: bpy.types.Scene) -> None:
    catalogue.find("cornell_box").build(scene)
    scene.render.engine, scene.render.use_border = "BLENDER_WORKBENCH", True
    scene.objects["Floor"].select_set(True)
    before = settings_of(scene)
    compare.run(scene, SMALL)
    assert settings_of(scene) == before


def test_without_cycles_there_is_our_picture_alone(scene: bpy.types.Scene) -> None:
    catalogue.find("cornell_box").build(scene)
    outcome = compare.run(scene, compare.Settings(("grid",), Options(threads=1), (32, 32), cycles=False))
    assert outcome.cycles is outcome.difference is outcome.report.cycles is outcome.report.difference is None
    assert outcome.picture is outcome.espalier
    assert outcome.espalier.std() > 10


def test_pictures_are_developed_as_blender_saves_a_render(scene: bpy.types.Scene, tmp_path: Path) -> None:
    """The linear image of a plain Cycles render, developed, equals the PNG Blender writes of that render itself."""
    catalogue.find("cornell_box").build(scene)
    scene.view_settings.view_transform, scene.view_settings.exposure = "Filmic", 0.7
    outcome = compare.run(scene, SMALL)
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.dither_intensity = 48, 64, 0.0
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGB"
    scene.render.filepath = str(tmp_path / "own.png")
    bpy.ops.render.render(write_still=True)
    with Image.open(tmp_path / "own.png") as own:
        assert np.abs(np.asarray(own)[::-1].astype(int) - outcome.cycles).max() <= 1


@pytest.mark.parametrize("when", ["", "load", "sample"])
def test_a_cancel_ends_within_a_fifth_of_a_second_and_leaves_nothing(
    scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    catalogue.find("cornell_box").build(scene)
    # A machine that is busy with other things may delay one end, not each of three.
    assert any(_seconds_to_cancel(scene, monkeypatch, when) < 0.2 for _ in range(3))


def _seconds_to_cancel(scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, when: str) -> float:
    """What a cancel takes at the moment that Cycles says `when`, or "": at once; and see that nothing is left."""
    reached = threading.Event()

    class Watched(cycles.SecondBlender):
        """One that tells of `when` as it is read, however short that phase."""

        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, value)
            if name == "status" and str(value).startswith(when):
                reached.set()

    monkeypatch.setattr(compare, "SecondBlender", Watched)
    threads = set(threading.enumerate())
    large = compare.Settings(("grid",), Options(samples=8 if when else 4096, threads=1), (256, 256))
    comparison = compare.begin(scene, large)
    folder = Path(comparison._folder.name)
    assert not when or reached.wait(60)
    comparison.cancel()
    start = time.monotonic()
    comparison.wait()
    seconds = time.monotonic() - start
    assert comparison.cancelled
    assert comparison.outcome is None
    assert not folder.exists()
    assert set(threading.enumerate()) == threads
    if comparison._second is not None:
        assert comparison._second._process.returncode is not None
    return seconds


def test_run_asks_whether_it_is_cancelled(scene: bpy.types.Scene) -> None:
    catalogue.find("cornell_box").build(scene)
    with pytest.raises(CancelledError):
        compare.run(scene, SMALL, cancelled=lambda: True)


def test_a_second_blender_that_fails_is_named(scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    catalogue.find("cornell_box").build(scene)
    monkeypatch.setattr(compare, "_save_copy", lambda path: str(path))
    with pytest.raises(
        cycles.CyclesError, match=r"Cycles' half of the comparison ended with status \d+: .*scene\.blend"
    ):
        compare.run(scene, SMALL)


def test_a_scene_without_a_camera_is_named(scene: bpy.types.Scene) -> None:
    with pytest.raises(NoCameraError):
        compare.begin(scene, SMALL)
