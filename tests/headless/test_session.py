"""Sessions: one a scene, busy until done, gone with the file."""

import bpy
import building
import pytest

from espalier import session
from espalier.errors import BusyError

pytest.importorskip("espalier_rt")


@pytest.fixture
def data(scene):
    """A small exported frame."""
    building.square()
    scene.render.resolution_x, scene.render.resolution_y = 16, 16
    yield building.export()
    session.clear()


def test_a_session_holds_the_results_of_every_method(scene, data):
    assert session.of(scene) is None
    started = session.start(scene, data, ["grid", "bvh-sah"], session.Options())
    assert session.of(scene) is started
    assert started.run.wait(30)
    assert not started.busy
    assert started.result("grid").census["method"] == "grid"
    assert started.result("bvh-median") is None


def test_a_scene_is_busy_while_its_run_works(scene, data):
    heavy = session.Options(samples=1_000_000)
    first = session.start(scene, data, ["bvh-sah"], heavy)
    with pytest.raises(BusyError, match="still being traced"):
        session.start(scene, data, ["bvh-sah"], heavy)
    first.run.cancel()
    assert first.run.wait(1.0)
    second = session.start(scene, data, ["bvh-sah"], session.Options())
    assert second.revision != first.revision
    assert session.of(scene) is second


def test_a_session_follows_a_renamed_scene(scene, data):
    started = session.start(scene, data, ["bvh-sah"], session.Options())
    scene.name = "Renamed"
    assert session.of(scene) is started


def test_loading_a_file_cancels_and_frees(scene, data):
    started = session.start(scene, data, ["bvh-sah"], session.Options(samples=1_000_000))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert started.run.done
    assert started.run.cancelled
    assert session.of(bpy.context.scene) is None
