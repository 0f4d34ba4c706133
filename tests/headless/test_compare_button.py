"""Compare with Cycles without a window: one picture, a row for Cycles, and a scene that is as it was."""

import threading
import time

import bpy
import pytest
import snapshot
from building import camera, square

from espalier import results, session
from espalier.operators import task


@pytest.fixture
def ready(scene):
    """A square under a camera and a white world, at 24x16, and a second object that is selected and being edited."""
    square()
    camera()
    scene.world = bpy.data.worlds.new("World")
    scene.espalier.methods = {"grid", "bvh-sah"}
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    other = square("Edited")
    other.location.x = 30.0
    bpy.context.view_layer.objects.active = other
    other.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    return scene


def test_the_picture_the_rows_and_the_scene(ready):
    before = snapshot.take(ready)
    assert bpy.ops.espalier.compare() == {"FINISHED"}
    assert snapshot.take(ready) == before
    assert [row.method for row in results.of(ready.session_uid).rows] == ["bvh-sah", "grid", results.CYCLES]
    cycles = results.of(ready.session_uid).rows[-1]
    assert cycles.build_ms > 0
    assert cycles.trace_s > 0
    image = bpy.data.images["Espalier Compare"]
    width, height = image.size
    assert width >= 2 * 24, "ours left, Cycles right"
    assert height >= 2 * 16, "the difference below"
    assert not image.use_view_as_render, "the view transform is in the picture already"
    assert session.of(ready).result("grid") is not None, "the overlay can draw what was compared"
    assert task.current() is None


def test_a_cancel_kills_the_second_blender_and_keeps_the_methods(ready):
    ready.espalier.methods = {"grid"}
    ready.render.resolution_x = ready.render.resolution_y = 400
    before = snapshot.take(ready)
    cancelled_at = []

    def cancel():
        while task.current() is None or not task.current().status.startswith("Cycles"):
            time.sleep(0.01)
        cancelled_at.append(time.monotonic())
        task.current().cancel()

    canceller = threading.Thread(target=cancel)
    canceller.start()
    assert bpy.ops.espalier.compare() == {"CANCELLED"}
    canceller.join()
    assert time.monotonic() - cancelled_at[0] < 0.5
    assert [row.method for row in results.of(ready.session_uid).rows] == ["grid"]
    assert "Espalier Compare" not in bpy.data.images
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("espalier")]
    assert snapshot.take(ready) == before
