"""Comparison of acceleration methods, and Cycles, on one frame: the one engine behind button, command and benchmark.

`begin` reads the scene on the main thread; all else happens in a daemon thread and in a second Blender, so that the
interface stays alive and the user's scene stays as it is. `run` does both and waits.
"""

import contextlib
import os
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from . import images, machine, native
from .background import Background
from .capture import export_frame
from .cycles import Job, SecondBlender, command
from .difference import flip, rmse
from .errors import CancelledError, ComparisonSaveError
from .images import Picture
from .methods import COMPARED_METHODS
from .report import DifferenceSummary, ImageSummary, MethodSummary, Report, SceneSummary
from .run import MethodResult, Options, Run
from .scene_data import Float32, SceneData

POLL_SECONDS = 0.03
"""How often the thread looks for a cancel while the second Blender works."""

CENSUS_COUNTS = ("bytes", "nodes", "leaves", "grids", "cells", "empty_cells", "references")


@dataclass(frozen=True)
class Settings:
    """What is compared. options.threads 0: all cores. resolution (width, height) in pixels, None: the scene's."""

    methods: Sequence[str] = COMPARED_METHODS
    options: Options = field(default_factory=Options)
    resolution: tuple[int, int] | None = None
    cycles: bool = True


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished comparison. `picture` is the composite, or ours where Cycles was left out; notes are one line each."""

    report: Report
    espalier: Picture
    cycles: Picture | None
    difference: Picture | None
    picture: Picture
    notes: tuple[str, ...]


class Comparison(Background):
    """A comparison under way, with the members that a task of the interface has. It owns its temporary folder."""

    def __init__(
        self, data: SceneData, job: Job, settings: Settings, folder: "tempfile.TemporaryDirectory[str]"
    ) -> None:
        """Raises as Run does. `job.threads` is what `settings.options.threads` came to."""
        super().__init__("espalier-compare")
        self.run = Run(data, settings.methods, replace(settings.options, threads=job.threads))
        self.outcome: Outcome | None = None
        self._data = data
        self._job = job
        self._with_cycles = settings.cycles
        self._folder = folder
        self._second: SecondBlender | None = None
        self._difference = 0.0
        self._cancel = threading.Event()

    def cancel(self) -> None:
        """Ask the thread to stop; it does within 0.2 s, and kills the second Blender."""
        self._cancel.set()
        self.run.cancel()

    @property
    def cancelled(self) -> bool:
        """True when it was cancelled before it was finished."""
        return isinstance(self.error, CancelledError)

    @property
    def progress(self) -> float:
        """0..1: methods, Cycles and the difference as 6 : 3 : 1, or without Cycles 9 : 1."""
        second = 0.0 if self._second is None else self._second.progress
        shares = (0.6, 0.3, 0.1) if self._with_cycles else (0.9, 0.1, 0.0)
        return float(np.dot(shares, (self.run.progress, second, self._difference)))

    @property
    def status(self) -> str:
        """What is going on, such as 'Cycles: sample 3 of 16'; empty when done."""
        if self.done:
            return ""
        if self._difference > 0.0:
            return "Difference"
        if self._second is None and self.run.status:
            return self.run.status
        second = "start" if self._second is None else self._second.status
        return f"{'Cycles' if self._with_cycles else 'Pictures'}: {second}"

    def _work(self) -> None:
        try:
            self.outcome = self._compare()
        finally:
            self._folder.cleanup()

    def _compare(self) -> Outcome:
        self._trace()
        results = self.run.results
        with_cycles = self._with_cycles
        second = self._render_and_develop(results[-1].render.combined)
        espalier = second.developed("espalier")
        report = _report(self._data, results, self._job)
        if not with_cycles:
            return Outcome(report, espalier, None, None, espalier, _notes(self._data, results))
        cycles = second.developed("cycles")
        ours, theirs = (picture.astype(np.float32) / 255 for picture in (espalier, cycles))
        errors = flip(theirs, ours, progress=self._on_difference)
        difference = images.difference_colors(errors)
        return Outcome(
            report=replace(
                report,
                cycles=second.timing(),
                difference=DifferenceSummary(float(errors.mean(dtype=np.float64)), rmse(theirs, ours)),
            ),
            espalier=espalier,
            cycles=cycles,
            difference=difference,
            picture=images.composite(espalier, cycles, difference),
            notes=_notes(self._data, results),
        )

    def _trace(self) -> None:
        self.run.start().wait()  # a cancel ends it, and its thread is not to outlive this one
        self._stop_if_cancelled()
        self.run.raise_error()

    def _render_and_develop(self, combined: Float32) -> SecondBlender:
        """Cycles' render, and the pictures as the scene's view transform shows them."""
        folder = Path(self._folder.name)
        np.save(folder / "espalier.npy", combined)
        develop = ["espalier", "cycles"] if self._with_cycles else ["espalier"]
        second = self._second = SecondBlender(self._job, folder, render=self._with_cycles, develop=develop)
        try:
            while not second.wait(POLL_SECONDS):
                self._stop_if_cancelled()
            second.raise_error()
        finally:
            second.kill()
        return second

    def _on_difference(self, progress: float) -> None:
        self._difference = progress
        self._stop_if_cancelled()

    def _stop_if_cancelled(self) -> None:
        if self._cancel.is_set():
            raise CancelledError


def begin(scene: bpy.types.Scene, settings: Settings, view_layer: bpy.types.ViewLayer | None = None) -> Comparison:
    """Read the scene's current frame, save a copy of the file aside, and start. On the main thread.

    view_layer None: the first that renders. Raises what `capture.export_frame` raises, NativeModuleMissingError, and
    ComparisonSaveError where the copy cannot be written.
    """
    data = export_frame(scene, view_layer, resolution=settings.resolution, border=False)
    folder = tempfile.TemporaryDirectory(prefix="espalier-")
    try:
        job = Job(
            command=command(bpy.app.binary_path, sys.executable),
            blend=_save_copy(Path(folder.name) / "scene.blend"),
            scene=scene.name,
            view_layer=data.view_layer,
            resolution=data.camera.resolution,
            samples=settings.options.samples,
            threads=settings.options.threads or machine.available_threads(),
            use_scripts=bpy.context.preferences.filepaths.use_scripts_auto_execute and not bpy.app.autoexec_fail,
        )
        return Comparison(data, job, settings, folder).start()
    except BaseException:
        folder.cleanup()
        raise


def run(
    scene: bpy.types.Scene,
    settings: Settings,
    *,
    progress: Callable[[float, str], None] = lambda _progress, _status: None,
    cancelled: Callable[[], bool] = lambda: False,
    view_layer: bpy.types.ViewLayer | None = None,
) -> Outcome:
    """Compare and wait. progress gets 0..1 and what is going on, some times a second; `cancelled` is asked as often.

    Raises as `begin` does, CyclesError, and CancelledError; a KeyboardInterrupt cancels too.
    """
    progress(0.0, "Export")
    comparison = begin(scene, settings, view_layer)
    try:
        while not comparison.wait(POLL_SECONDS):
            progress(comparison.progress, comparison.status)
            if cancelled():
                comparison.cancel()
    finally:
        comparison.cancel()
        comparison.wait()
    if comparison.error is not None:
        raise comparison.error
    assert comparison.outcome is not None
    progress(1.0, "")
    return comparison.outcome


def machine_line() -> str:
    """Processor, its cores and instruction set, system and Blender, for people."""
    parts = (
        machine.processor(),
        f"{os.cpu_count()} cores",
        native.module().instruction_set(),
        f"{platform.system()} {platform.machine()}",
        f"Blender {bpy.app.version_string}",
    )
    return ", ".join(parts)


def _save_copy(path: Path) -> str:
    """Write the open file as it is now to `path`; the open file keeps its own name and state."""
    try:
        with _no_file_preview():
            bpy.ops.wm.save_as_mainfile(
                "EXEC_DEFAULT", filepath=str(path), copy=True, compress=False, check_existing=False
            )
    except RuntimeError as error:
        raise ComparisonSaveError(str(error).strip()) from error
    return str(path)


@contextlib.contextmanager
def _no_file_preview() -> Iterator[None]:
    """Save without a thumbnail, whose render took 8 s with 871,414 triangles and no GPU; the rest took 50 ms."""
    preferences = bpy.context.preferences
    before, was_dirty = preferences.filepaths.file_preview_type, preferences.is_dirty
    preferences.filepaths.file_preview_type = "NONE"
    try:
        yield
    finally:
        preferences.filepaths.file_preview_type = before
        preferences.is_dirty = was_dirty


def _report(data: SceneData, results: Sequence[MethodResult], job: Job) -> Report:
    width, height = job.resolution
    return Report(
        scene=SceneSummary(data.name, data.triangle_count, data.vertex_count, data.instance_count),
        image=ImageSummary(width, height, job.samples),
        threads=job.threads,
        machine=machine_line(),
        export_ms=data.export_ms,
        methods=tuple(method_summary(result) for result in results),
    )


def method_summary(result: MethodResult) -> MethodSummary:
    """The report's numbers of one method."""
    counts = {name: int(result.census[name]) for name in CENSUS_COUNTS}
    return MethodSummary(result.method, result.build_ms, result.trace_s, result.rays, result.mrays_per_s, **counts)


def _notes(data: SceneData, results: Sequence[MethodResult]) -> tuple[str, ...]:
    """The export's warnings, and where methods did not agree on the image."""
    first = results[0]
    different = [
        f"{other.method} and {first.method} differ in {count} pixels: rays that meet two triangles at one distance"
        for other in results[1:]
        if (count := int((other.render.combined != first.render.combined).any(axis=-1).sum()))
    ]
    return (*data.warnings, *different)
