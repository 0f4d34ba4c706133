"""A study under way, in a daemon thread: measures what its journal does not hold yet. No bpy.

Methods take turns on a group's rays, round by round and each round from another one on, so that whatever the machine
does besides falls on all of them. What fails becomes a row that says why; only a cancel or a bug ends the study.
"""

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Self

from .. import catalogue, methods, native
from ..background import Background
from ..errors import CancelledError
from . import measure, rays
from .embree import version as embree_version
from .journal import Journal
from .measure import Work
from .plan import EMBREE, Case, Group, Plan, StudyError
from .rows import Results
from .sources import Source

Loader = Callable[[Group, Callable[[float], None]], Source]
"""Gives a group's scene; progress goes over 0..1 while a model is downloaded."""

GUESSED_TRIANGLES = 100_000
"""Size of a scene that was not opened yet, for the estimate of the time left."""


LEAST_RUNS = 3
"""A case of which one run is within the plan's seconds is measured as often as this, so that it has an interval."""


class Study(Background):
    """Start it, watch it, cancel it from any other thread. Results are in `journal` as they come."""

    def __init__(
        self,
        plan: Plan,
        journal: Journal,
        load: Loader,
        finish: Callable[[Journal], Results],
        sizes: Mapping[str, int] | None = None,
    ) -> None:
        """finish: called by the thread when all is measured. sizes: triangles of scenes, where known, to estimate the
        time left. Raises NativeModuleMissingError."""
        super().__init__("espalier-study")
        self.plan, self.journal = plan, journal
        self.results: Results | None = None
        self._native = native.module()
        self._load, self._finish = load, finish
        self._sizes = dict(sizes or {})
        self._cancel = threading.Event()
        self._job: Any = self._native.Job()
        self._began = time.monotonic()
        self._scene_name, self._doing = "", "prepare"
        self._weights = {case: self._weight(case) for case in plan.cases()}
        self._share: dict[Case, float] = {case: self._kept_share(case) for case in self._weights}
        self._resumed = self._done_weight()
        self._opened: tuple[tuple[str, float], Source, Any] | None = None

    def start(self) -> Self:
        """Start the thread and return at once."""
        self._began = time.monotonic()
        return super().start()

    def cancel(self) -> None:
        """Ask the thread to stop; it does within 0.2 s, or at the end of what Embree builds."""
        self._cancel.set()
        self._job.cancel()

    @property
    def cancelled(self) -> bool:
        """True when it was cancelled before it was finished."""
        return isinstance(self.error, CancelledError)

    @property
    def progress(self) -> float:
        """0..1 of the expected time of the whole study, what was measured before a stop counted in."""
        return min(self._done_weight() / sum(self._weights.values()), 1.0)

    @property
    def seconds_left(self) -> float | None:
        """An estimate, from what this run has done so far; None until it has done something."""
        done = self._done_weight() - self._resumed
        if done <= 0.0:
            return None
        left = sum(self._weights.values()) - self._resumed - done
        return (time.monotonic() - self._began) * left / done

    @property
    def scene(self) -> str:
        """The scene that is measured; empty before the first, and when done."""
        return "" if self.done else self._scene_name

    @property
    def detail(self) -> str:
        """What is done with the scene, and how long the study will still take."""
        left = self.seconds_left
        return self._doing if left is None else f"{self._doing}, {duration(left)} left"

    @property
    def status(self) -> str:
        """Scene and detail in one line; empty when done."""
        return f"{self.scene}: {self.detail}" if self.scene else ""

    def _work(self) -> None:
        try:
            for group in self.plan.groups():
                self._measure_group(group)
            self._doing = "report"
            self.results = self._finish(self.journal)
        except BaseException as error:
            if self._cancel.is_set():
                raise CancelledError from error
            raise
        finally:
            self._opened = None
            self.journal.close()

    def _measure_group(self, group: Group) -> None:
        cases = [Case(group, method) for method in self.plan.methods]
        if not any(self._wants(case, 0) or self._wants(case, self.plan.repeats - 1) for case in cases):
            return
        try:
            work = self._prepare(group)
        except StudyError:
            raise
        except Exception as error:  # noqa: BLE001 - a scene that cannot be had is a failure of each of its cases
            self._look()
            for case in cases:
                self._fail(case, error)
            return
        for number in range(self.plan.repeats):
            for case in _from(cases, number):
                if self._wants(case, number):
                    self._measure(case, work)
                self._share[case] = self._kept_share(case) if self._wants(case, number + 1) else 1.0

    def _prepare(self, group: Group) -> Work:
        self._scene_name, self._doing = group.scene, "open"
        self._new_job()
        scene = self._scene(group)
        self.journal.add_source(
            group,
            {
                "name": scene.source.name,
                "triangles": scene.mesh.triangle_count,
                "vertices": scene.mesh.vertex_count,
                "digest": scene.source.digest,
            },
        )
        self._set_size(group.scene, scene.mesh.triangle_count)
        self._doing = "rays"
        batches = rays.batches(group, scene, self.plan.seed, self._look)
        return measure.prepare(scene, batches, group.width, group.height)

    def _scene(self, group: Group) -> rays.Scene:
        """The group's scene in the core, kept for the groups that follow."""
        key = (group.scene, group.width / group.height)
        if self._opened is None or self._opened[0] != key:
            self._opened = None
            source = self._load(group, lambda _progress: self._look())
            self._opened = (key, source, self._native.Mesh(source.vertices, source.triangles))
        _, source, mesh = self._opened

        def build(method: str) -> Any:
            return self._native.Accelerator.build(mesh, method, threads=self.plan.threads, job=self._job)

        return rays.Scene(source, mesh, build)

    def _measure(self, case: Case, work: Work) -> None:
        """One round of a case, and its evidence with the first one."""
        self._doing = label(case.method)
        began = time.monotonic()
        try:
            with _Watch(self, self.plan.limit_seconds):
                run, tracer, hits = measure.timed(case.method, work, self.plan, self._job)
            self.journal.add_run(case, run)
            if case not in self.journal.evidence:
                self.journal.add_evidence(case, measure.evidence(tracer, hits, work, self._look))
        except self._native.Cancelled:
            self._look()
            taken = time.monotonic() - began
            self._fail(case, StudyError(f"Given up after {taken:.0f} s, more than the limit of a run"))
        except Exception as error:  # noqa: BLE001 - one case that fails is a row, not the end of the study
            self._look()
            self._fail(case, error)

    def _wants(self, case: Case, number: int) -> bool:
        """Whether round `number` of a case is still to be measured."""
        if case in self.journal.failures:
            return False
        taken = [run.total_s for run in self.journal.runs.get(case, ())]
        if not taken or case not in self.journal.evidence:
            return True
        mean = sum(taken) / len(taken)
        within = mean * (len(taken) + 1) <= self.plan.seconds or (len(taken) < LEAST_RUNS and mean <= self.plan.seconds)
        return len(taken) <= number < self.plan.repeats and within

    def _fail(self, case: Case, error: Exception) -> None:
        catalogued = catalogue.module("errors").SceneCatalogueError
        expected = isinstance(error, (*native.expected_errors(), catalogued, OSError, MemoryError))
        text = str(error) if expected else f"{type(error).__name__}: {error}"
        self.journal.add_failure(case, " ".join(text.split()) or type(error).__name__)
        self._share[case] = 1.0

    def _look(self) -> None:
        """Raise where the study was cancelled."""
        if self._cancel.is_set():
            raise CancelledError

    def _new_job(self) -> None:
        """A job that has no cancel from before."""
        self._job = self._native.Job()
        self._look()

    def _weight(self, case: Case) -> float:
        """What a case is expected to take, in no unit: rays and triangles."""
        triangles = self._sizes.get(case.group.scene, GUESSED_TRIANGLES)
        pixels = case.group.width * case.group.height
        return 1.0 + pixels / 1e6 * (0.5 + math.log2(1 + triangles) / 20) + triangles / 1e5

    def _set_size(self, scene: str, triangles: int) -> None:
        self._sizes[scene] = triangles
        self._weights = {case: self._weight(case) for case in self._weights}

    def _kept_share(self, case: Case) -> float:
        """How much of a case the journal holds."""
        if case in self.journal.failures:
            return 1.0
        return min(len(self.journal.runs.get(case, ())) / self.plan.repeats, 1.0)

    def _done_weight(self) -> float:
        return sum(self._weights[case] * share for case, share in list(self._share.items()))


class _Watch:
    """Cancels the study's job where a run takes longer than it may; as a context around the run."""

    def __init__(self, study: Study, seconds: float) -> None:
        study._new_job()
        self._timer = threading.Timer(seconds, study._job.cancel)
        self._timer.daemon = True

    def __enter__(self) -> None:
        self._timer.start()

    def __exit__(self, *_error: object) -> None:
        self._timer.cancel()


def label(method: str) -> str:
    """A method's name for people, Embree's too."""
    return f"Embree {embree_version() or ''}".strip() if method == EMBREE else methods.label(method)


def duration(seconds: float) -> str:
    """Such as '42 s' or '3:07'."""
    whole = math.ceil(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60}:{whole % 60:02}"


def _from(cases: list[Case], number: int) -> Iterator[Case]:
    """The cases, begun further on with every round."""
    start = number % len(cases)
    yield from cases[start:]
    yield from cases[:start]
