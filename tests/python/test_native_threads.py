"""Threads: the same results for any number, other Python threads run meanwhile, a cancel ends work at once, and nothing
stays behind: no memory, and no thread but those that built last, for the next build."""

import functools
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import METHODS, rays_through, soup

from espalier_scenes.soups import triangle_soup

TASKS = Path("/proc/self/task")
needs_tasks = pytest.mark.skipif(not TASKS.is_dir(), reason="this system does not list a process's threads")

LARGE = rt.Mesh(*triangle_soup(5, 600_000, 0.01))
"""Takes seconds to build and to trace."""
QUICK = {"bvh-clusters", "lbvh", "hybrid"}
"""Builders that are done with it before they can be stopped."""


def task_count() -> int:
    """Threads of this process, native ones included."""
    return len(list(TASKS.iterdir()))


def idle_count() -> int:
    """Threads while nothing goes on, those of other libraries: the count once it has rested for a while."""
    seen = [task_count()]
    while len(seen) < 5 or len(set(seen[-5:])) > 1:
        time.sleep(0.02)
        seen.append(task_count())
    return seen[-1]


def falls_to(count: int) -> bool:
    """Whether there are soon no more threads than that; one that was joined takes a moment to leave the system."""
    deadline = time.perf_counter() + 2
    while task_count() > count and time.perf_counter() < deadline:
        time.sleep(0.01)
    return task_count() <= count


def cancelled_job() -> rt.Job:
    """A job that was cancelled before it began."""
    job = rt.Job()
    job.cancel()
    return job


def same_cells(a: rt.Accelerator, b: rt.Accelerator) -> bool:
    """Whether two structures are the same to the bit."""
    first, second = a.cells(), b.cells()
    return all(
        np.array_equal(getattr(first, field), getattr(second, field))
        for field in ("lower", "upper", "kind", "depth", "count")
    )


@pytest.mark.parametrize("method", METHODS)
def test_structures_and_hits_are_the_same_for_any_number_of_threads(method: str) -> None:
    mesh = soup(count=20_000)
    one, two, three = (rt.Accelerator.build(mesh, method, threads=threads) for threads in (1, 2, 3))
    assert same_cells(one, two)
    assert same_cells(one, three)
    rays = rays_through(mesh, 10_000)
    first, second = one.closest(*rays, threads=1), two.closest(*rays, threads=2)
    for column in ("t", "primitive", "u", "v", "normal"):
        np.testing.assert_array_equal(getattr(first, column), getattr(second, column))
    np.testing.assert_array_equal(one.occluded(*rays, threads=1), two.occluded(*rays, threads=2))
    for a, b in zip(one.counted(*rays, threads=1), two.counted(*rays, threads=2), strict=True):
        np.testing.assert_array_equal(a, b)


def test_one_accelerator_serves_many_python_threads() -> None:
    mesh = soup()
    accelerator = rt.Accelerator.build(mesh)
    batches = [rays_through(mesh, 3000, seed) for seed in range(8)]
    expected = [accelerator.closest(*rays, threads=1).t for rays in batches]
    found: list[np.ndarray | None] = [None] * len(batches)

    def trace(index: int) -> None:
        for _ in range(5):
            hits = accelerator.closest(*batches[index], threads=1 + index % 2)
            assert hits.normal.shape == (3000, 3)
            found[index] = hits.t

    threads = [threading.Thread(target=trace, args=(index,)) for index in range(len(batches))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_array_equal(a, b)


@functools.cache
def huge() -> rt.Mesh:
    """So many triangles that the quick builders, too, take some tenths of a second."""
    return rt.Mesh(*triangle_soup(5, 4_000_000, 0.01))


def long_work(name: str) -> Callable[[rt.Job], object]:
    """A piece of work that goes on for long after a cancel that is not heard."""
    if name in METHODS:
        mesh = huge() if name in QUICK else LARGE
        return lambda job: rt.Accelerator.build(mesh, name, job=job)
    accelerator = rt.Accelerator.build(LARGE, "bvh-sah")
    if name == "render":
        camera = rt.Camera(kind="perspective", matrix=np.diag([1, 1, 1, 1.0]), resolution=(512, 512))
        scene = rt.Scene(LARGE, materials=[{}])
        return lambda job: rt.render(accelerator, scene, camera, samples=1000, job=job)
    rays = rays_through(LARGE, 2_000_000)
    return lambda job: getattr(accelerator, name)(*rays, job=job)


def seconds_to_cancel(work: Callable[[rt.Job], object], phase: str) -> float:
    """How long work goes on in another thread after it was cancelled."""
    job, ended = rt.Job(), []

    def run() -> None:
        try:
            work(job)
        except rt.Cancelled as error:
            ended.append((time.perf_counter(), str(error)))

    thread = threading.Thread(target=run)
    thread.start()
    while job.phase == "":
        time.sleep(0.001)
    time.sleep(0.05)
    assert job.phase == phase
    assert not job.cancelled
    cancelled = time.perf_counter()
    job.cancel()
    thread.join()
    assert job.cancelled
    ((end, message),) = ended
    assert message == "cancelled"
    return end - cancelled


@needs_tasks
@pytest.mark.parametrize("name", [*METHODS, "closest", "occluded", "counted", "render"])
def test_a_cancel_ends_work_within_a_fifth_of_a_second_and_leaves_no_thread(name: str) -> None:
    work = long_work(name)
    idle = idle_count()
    phase = "build" if name in METHODS else "trace"
    # A machine that is busy with other things may delay one end, not each of three.
    assert min(seconds_to_cancel(work, phase) for _ in range(3)) < 0.2
    assert falls_to(idle)


def test_a_cancelled_job_stops_all_that_is_given_it() -> None:
    job = rt.Job()
    job.cancel()
    mesh = soup()
    with pytest.raises(rt.Cancelled):
        rt.Accelerator.build(mesh, job=job)
    with pytest.raises(rt.Cancelled):
        rt.Accelerator.build(mesh).closest(*rays_through(mesh, 10), job=job)


@pytest.mark.parametrize("method", METHODS)
def test_progress_of_a_build_rises_to_one(method: str) -> None:
    mesh, job, seen = soup(count=200_000), rt.Job(), []
    thread = threading.Thread(target=lambda: rt.Accelerator.build(mesh, method, job=job))
    assert (job.phase, job.progress) == ("", 0)
    thread.start()
    while thread.is_alive():
        seen.append(job.progress)
        time.sleep(0.001)
    assert seen == sorted(seen)
    assert all(0 <= value <= 1 for value in seen)
    assert job.progress == pytest.approx(1)


def test_other_python_threads_run_during_a_query() -> None:
    accelerator = rt.Accelerator.build(LARGE, "bvh-median")
    rays = rays_through(LARGE, 200_000)
    thread = threading.Thread(target=lambda: accelerator.closest(*rays, threads=1))
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
        time.sleep(0.001)
    assert turns > 10


@needs_tasks
def test_no_thread_outlives_a_query_and_small_batches_start_none() -> None:
    mesh = soup()
    accelerator = rt.Accelerator.build(mesh, threads=2)
    idle = idle_count()
    small, large = rays_through(mesh, 1000), rays_through(mesh, 50_000)
    most, done = [0], threading.Event()

    def watch() -> None:
        while not done.is_set():
            most[0] = max(most[0], task_count())

    watcher = threading.Thread(target=watch)
    watcher.start()
    for _ in range(300):
        accelerator.closest(*small)
    done.set()
    watcher.join()
    assert most[0] == idle + 1
    accelerator.closest(*large, threads=4)
    rt.Mesh(*triangle_soup(0, 100_000, 0.1))
    assert falls_to(idle)


@needs_tasks
def test_builds_keep_the_threads_of_the_last_one_and_a_cancelled_one_keeps_none() -> None:
    mesh = soup()
    with pytest.raises(rt.Cancelled):
        rt.Accelerator.build(mesh, threads=2, job=cancelled_job())
    none = idle_count()
    for threads in (4, 2, 3, 3):
        rt.Accelerator.build(mesh, threads=threads)
        assert falls_to(none + threads)
    with pytest.raises(rt.Cancelled):
        rt.Accelerator.build(mesh, threads=3, job=cancelled_job())
    assert falls_to(none)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_builds_with_threads_of_its_own() -> None:
    mesh = soup()
    cells = rt.Accelerator.build(mesh, threads=2).cells()
    child = os.fork()
    if child == 0:
        again = rt.Accelerator.build(mesh, threads=2).cells()
        os._exit(0 if np.array_equal(again.lower, cells.lower) else 1)
    deadline = time.perf_counter() + 20
    while (status := os.waitpid(child, os.WNOHANG)) == (0, 0) and time.perf_counter() < deadline:
        time.sleep(0.01)
    if status == (0, 0):
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    assert status == (child, 0)


@pytest.mark.skipif(sys.platform != "linux", reason="reads the resident size that Linux reports")
@pytest.mark.parametrize("method", METHODS)
def test_memory_does_not_grow_over_repeated_work(method: str) -> None:
    vertices, triangles = triangle_soup(0, 10_000, 0.05)
    rays = rays_through(soup(), 5000)

    def work() -> None:
        mesh = rt.Mesh(vertices, triangles)
        accelerator = rt.Accelerator.build(mesh, method, threads=2)
        hits = accelerator.closest(*rays)
        assert hits.normal.shape == (5000, 3)
        accelerator.cells(max_count=1000)
        accelerator.decisions()
        with pytest.raises(rt.RayError):
            accelerator.closest(np.full((5, 3), np.nan), np.ones((5, 3)))

    def resident() -> int:
        gc.collect()
        return int(Path("/proc/self/statm").read_text().split()[1])

    for _ in range(5):
        work()
    before = resident()
    for _ in range(25):
        work()
    per_round = (resident() - before) * 4096 / 25
    assert per_round < 100_000, "a structure alone holds a megabyte"
