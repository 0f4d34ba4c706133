"""Runs: build and trace in a thread, with progress, cancel and errors, without Blender."""

import dataclasses
import threading
import time

import numpy as np
import pytest

from espalier import methods
from espalier.errors import EspalierAddonError
from espalier.run import Options, Run
from espalier.scene_data import CameraData, GeometryData, MaterialData, SceneData

native = pytest.importorskip("espalier_rt")


def plane(cells: int = 20, resolution: tuple[int, int] = (8, 6)) -> SceneData:
    """A glowing, wavy plane of cells * cells squares under an orthographic camera."""
    x, y = np.meshgrid(*[np.linspace(-10.0, 10.0, cells + 1)] * 2, indexing="ij")
    vertices = np.stack([x, y, np.sin(3.0 * x) * np.cos(2.0 * y)], axis=2).reshape(-1, 3)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1)
    near, far = [corner, corner + cells + 1, corner + cells + 2], [corner, corner + cells + 2, corner + 1]
    triangles = np.concatenate([np.stack(near, axis=1), np.stack(far, axis=1)]).astype(np.uint32)
    matrix = np.eye(4, dtype=np.float32)
    matrix[2, 3] = 10.0
    return SceneData(
        name="Plane",
        view_layer="ViewLayer",
        frame=1,
        geometry=GeometryData(
            vertices=vertices.astype(np.float32),
            triangles=triangles,
            material_index=np.zeros(len(triangles), np.uint32),
            corner_normals=np.broadcast_to(np.float32((0, 0, 1)), (len(triangles), 3, 3)).copy(),
            corner_uvs=None,
            mesh_count=1,
            instance_count=1,
        ),
        camera=CameraData("Camera", "orthographic", matrix, resolution, ortho_scale=4.0),
        materials=(MaterialData("Glow", base_color=(0, 0, 0), emission=(3, 2, 1)),),
    )


def finished(run: Run) -> Run:
    """The run, started and waited for."""
    assert run.start().wait(60)
    return run


def test_every_method_gives_its_accelerator_census_and_picture():
    run = finished(Run(plane(), methods.METHOD_NAMES, Options(cost=True)))
    run.raise_error()
    assert [result.method for result in run.results] == list(methods.METHOD_NAMES)
    for result in run.results:
        assert result.accelerator.method == result.census["method"] == result.method
        np.testing.assert_allclose(result.render.combined, np.broadcast_to((3, 2, 1, 1), (6, 8, 4)), rtol=1e-6)
        assert result.render.cost.min() >= 1.0
        assert result.rays >= 48
        assert result.build_ms >= 0.0
        assert result.mrays_per_s >= 0.0
    assert (run.progress, run.status, run.done, run.cancelled) == (1.0, "", True, False)


def test_the_methods_of_the_add_on_are_the_cores():
    assert list(methods.METHOD_NAMES) == native.methods()


def test_progress_never_falls_within_a_method_and_status_names_it():
    run = Run(plane(300, (512, 512)), ["bvh-sah"], Options(samples=4)).start()
    seen, statuses = [], set()
    while not run.wait(0.001):
        seen.append(run.progress)
        statuses.add(run.status)
    run.raise_error()
    assert seen == sorted(seen)
    assert all(0.0 <= value <= 1.0 for value in seen)
    assert "BVH (SAH): trace" in statuses


@pytest.mark.parametrize("delay", [0.0, 0.05, 0.5])
def test_cancel_ends_the_thread_in_time_and_keeps_what_is_finished(delay):
    data = plane(300, (64, 64))
    # A machine that is busy with other things may delay one end, not each of three.
    assert min(_seconds_to_cancel(data, delay) for _ in range(3)) < 0.2
    assert not [thread for thread in threading.enumerate() if thread.name == "espalier-run"]


def _seconds_to_cancel(data: SceneData, delay: float) -> float:
    """How long a run that would take minutes goes on after it was cancelled."""
    run = Run(data, ["grid", "bvh-sah"], Options(samples=1 << 20)).start()
    time.sleep(delay)
    start = time.perf_counter()
    run.cancel()
    assert run.wait(10.0)
    assert run.cancelled
    assert run.results == ()
    run.raise_error()
    return time.perf_counter() - start


def test_an_error_of_the_core_is_raised_where_it_is_waited_for():
    data = plane()
    broken = dataclasses.replace(data.geometry, material_index=np.full(800, 7, np.uint32))
    run = finished(Run(dataclasses.replace(data, geometry=broken), ["grid"], Options()))
    assert not run.cancelled
    with pytest.raises(native.SceneError):
        run.raise_error()


def test_no_method_is_a_named_error():
    with pytest.raises(EspalierAddonError, match="enable at least one method"):
        Run(plane(), [], Options())


def test_the_rays_expected_are_those_of_the_frame_unless_said(monkeypatch):
    run = Run(plane(resolution=(10, 20)), ["hybrid"], Options(samples=3))
    assert run._config("hybrid")["expected_rays"] == 600.0
    run = Run(plane(), ["hybrid"], Options(expected_rays=5e6))
    assert run._config("hybrid")["expected_rays"] == 5e6


def test_two_runs_and_any_number_of_threads_give_the_same_picture():
    data = plane(20, (64, 48))
    pictures = [
        finished(Run(data, ["hybrid-sampled"], Options(samples=3, threads=threads))).results[0].render.combined
        for threads in (1, 2, 1)
    ]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])
