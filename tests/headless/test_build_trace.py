"""Build & Trace without a window: numbers, image, and a scene that is as it was."""

import threading
import time

import bpy
import numpy as np
import pytest
import snapshot
from building import camera, square

from espalier import areas, overlay, results, session, shown_images
from espalier.methods import METHOD_NAMES
from espalier.operators import task


@pytest.fixture
def ready(scene):
    """A scene with a square, a camera over it and a sun, at 32x24."""
    square()
    camera()
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(sun)
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.resolution_percentage = 100
    return scene


def rows(scene):
    return results.of(scene.session_uid).rows


def pixels(image):
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)


def test_every_chosen_method_has_its_row(ready):
    ready.espalier.methods = {"grid", "bvh-sah", "hybrid-sampled"}
    assert bpy.ops.espalier.build_trace() == {"FINISHED"}
    assert [row.method for row in rows(ready)] == ["bvh-sah", "grid", "hybrid-sampled"]
    for row in rows(ready):
        assert row.build_ms > 0
        assert row.trace_s > 0
        assert row.mrays_per_s > 0
        assert row.bytes > 0
    assert rows(ready)[1].grids == 1
    assert task.current() is None


def test_the_image_is_the_trace(ready):
    bpy.ops.espalier.build_trace()
    image = bpy.data.images["Espalier"]
    assert image.is_float
    assert image.use_view_as_render
    shown = pixels(image)
    assert shown.shape == (24, 32, 4)
    assert shown[..., :3].max() > 0.1, "the sun lights the square"
    traced = session.of(ready).result(ready.espalier.method).render.combined
    np.testing.assert_array_equal(shown, traced)


def test_the_scene_is_as_it_was(ready):
    before = snapshot.take(ready)
    bpy.ops.espalier.build_trace()
    assert snapshot.take(ready) == before


def test_the_next_run_takes_the_same_image(ready):
    bpy.ops.espalier.build_trace()
    ready.render.resolution_x = 40
    bpy.ops.espalier.build_trace()
    assert [image.name for image in bpy.data.images if image.name.startswith("Espalier")] == ["Espalier"]
    assert pixels(bpy.data.images["Espalier"]).shape == (24, 40, 4)


def test_an_image_of_the_users_is_left_alone(ready):
    own = bpy.data.images.new("Espalier", 4, 4)
    own.pixels.foreach_set(np.full(64, 0.5, np.float32))
    for _ in range(2):
        bpy.ops.espalier.build_trace()
    assert tuple(own.size) == (4, 4)
    assert len([image for image in bpy.data.images if image.name.startswith("Espalier")]) == 2


def test_clear_results_leaves_nothing(ready):
    bpy.ops.espalier.build_trace()
    assert bpy.ops.espalier.clear_results() == {"FINISHED"}
    assert rows(ready) == ()
    assert session.of(ready) is None
    assert not bpy.ops.espalier.clear_results.poll()


def test_another_file_forgets_everything(ready):
    uid = ready.session_uid
    bpy.ops.espalier.build_trace()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert results.of(uid) == results.Table()
    assert session.of(bpy.context.scene) is None


def test_broken_geometry_is_reported_by_its_object(ready):
    bpy.data.objects["Square"].data.vertices[0].co.x = float("nan")
    before = snapshot.take(ready)
    with pytest.raises(RuntimeError, match="'Square'"):
        bpy.ops.espalier.build_trace()
    assert task.current() is None
    assert rows(ready) == ()
    assert snapshot.take(ready) == before


def test_a_cancel_ends_the_work_and_keeps_the_last_results(ready):
    ready.espalier.samples = 1 << 20
    before = snapshot.take(ready)
    cancelled_at = []

    def cancel():
        while task.current() is None or session.of(ready) is None:
            time.sleep(0.01)
        time.sleep(0.3)
        cancelled_at.append(time.monotonic())
        task.current().cancel()

    canceller = threading.Thread(target=cancel)
    canceller.start()
    assert bpy.ops.espalier.build_trace() == {"CANCELLED"}
    canceller.join()
    assert time.monotonic() - cancelled_at[0] < 0.5
    assert task.current() is None
    assert "Espalier" not in bpy.data.images
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("espalier")]
    assert snapshot.take(ready) == before


def test_pending_methods_have_rows_without_numbers():
    class Pending:
        method_names = METHOD_NAMES
        results = ()
        done = False

    table = list(results.rows(Pending()))
    assert [row.method for row in table] == list(METHOD_NAMES)
    assert {row.build_ms for row in table} == {None}
    Pending.done = True
    assert list(results.rows(Pending())) == []


def test_without_a_window_nothing_is_drawn_or_shown(ready):
    bpy.ops.espalier.build_trace()
    assert overlay.drawing(ready) is None
    areas.redraw(task.VIEWS)
    shown_images.show(bpy.data.images["Espalier"])
