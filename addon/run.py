"""A run: build and trace one frame with each of several methods, in a daemon thread. No bpy.

The thread never touches Blender's data: everything it needs is in SceneData, which the main thread exported.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from . import calibration, methods, native
from .background import Background
from .errors import EspalierAddonError
from .scene_data import SceneData


@dataclass(frozen=True)
class Options:
    """How to trace. threads 0: all cores. expected_rays 0: the rays of one frame, pixels times samples.

    cost: also count the traversal steps of every pixel. transparent: leave the world out of the picture.
    """

    samples: int = 1
    threads: int = 0
    expected_rays: float = 0.0
    seed: int = 0
    max_bounces: int = 4
    cost: bool = False
    transparent: bool = False

    @classmethod
    def of(cls, settings: Any, *, cost: bool = False, transparent: bool = False) -> "Options":
        """Options from the property group `scene.espalier`, whose expected rays are in millions."""
        return cls(
            samples=settings.samples,
            threads=settings.threads,
            expected_rays=settings.expected_rays * 1e6,
            seed=settings.seed,
            max_bounces=settings.max_bounces,
            cost=cost,
            transparent=transparent,
        )


@dataclass(frozen=True, eq=False)
class MethodResult:
    """One method's accelerator, census and image of one frame."""

    method: str
    accelerator: Any
    census: dict[str, Any]
    render: Any

    @property
    def build_ms(self) -> float:
        """Wall time of the build, milliseconds."""
        return float(self.census["build_ms"])

    @property
    def trace_s(self) -> float:
        """Wall time of intersection work, seconds."""
        return float(self.render.trace_s)

    @property
    def rays(self) -> int:
        """All rays traced: primary, shadow and bounce."""
        return int(self.render.rays)

    @property
    def mrays_per_s(self) -> float:
        """Million rays a second of intersection work; 0 where the clock saw no time pass."""
        return self.rays / self.trace_s / 1e6 if self.trace_s > 0.0 else 0.0


class Run(Background):
    """Builds and traces `data` with each method in turn; start it, watch it, cancel it, from any other thread."""

    def __init__(self, data: SceneData, method_names: Sequence[str], options: Options) -> None:
        """Raises NativeModuleMissingError. `method_names` are native names and must not be empty."""
        if not method_names:
            raise EspalierAddonError("No method is chosen: enable at least one method")
        super().__init__("espalier-run")
        self.data = data
        self.method_names = tuple(method_names)
        self.options = options
        self._native = native.module()
        self._job = self._native.Job()
        self._results: list[MethodResult] = []

    def cancel(self) -> None:
        """Ask the thread to stop; it does within 0.2 s. What is finished by then stays in `results`."""
        self._job.cancel()

    @property
    def cancelled(self) -> bool:
        """True when the run was cancelled before its last method was finished."""
        return isinstance(self.error, self._native.Cancelled)

    @property
    def results(self) -> tuple[MethodResult, ...]:
        """The methods finished so far, in order."""
        return tuple(self._results)

    @property
    def progress(self) -> float:
        """0..1 over all methods, build and trace counting half each."""
        finished = len(self._results)
        if finished == len(self.method_names):
            return 1.0
        phase = {"build": 0.0, "trace": 0.5}.get(self._job.phase)
        here = 0.0 if phase is None else phase + 0.5 * self._job.progress
        return (finished + here) / len(self.method_names)

    @property
    def status(self) -> str:
        """What is going on, such as 'Uniform Grid: build'; empty when done."""
        finished = len(self._results)
        if self.done or finished == len(self.method_names):
            return ""
        return f"{methods.label(self.method_names[finished])}: {self._job.phase or 'prepare'}"

    def _work(self) -> None:
        handles = native.handles(self.data)
        for name in self.method_names:
            self._results.append(self._build_and_trace(name, handles))

    def _build_and_trace(self, name: str, handles: native.Handles) -> MethodResult:
        options = self.options
        accelerator = self._native.Accelerator.build(
            handles.mesh, name, self._config(name), threads=options.threads, job=self._job
        )
        render = self._native.render(
            accelerator,
            handles.scene,
            handles.camera,
            samples=options.samples,
            seed=options.seed,
            max_bounces=options.max_bounces,
            threads=options.threads,
            cost=options.cost,
            transparent=options.transparent,
            job=self._job,
        )
        return MethodResult(name, accelerator, accelerator.census(), render)

    def _config(self, name: str) -> dict[str, Any]:
        width, height = self.data.camera.resolution
        expected_rays = self.options.expected_rays or float(width * height * self.options.samples)
        return build_config(name, self.options.seed, expected_rays)


def build_config(name: str, seed: int, expected_rays: float) -> dict[str, Any]:
    """Seed, expected rays and this machine's costs, for the methods that know them."""
    wanted: dict[str, Any] = {"seed": seed, "expected_rays": expected_rays}
    known = native.module().default_config(name)
    if "node_ns" in known:
        wanted |= calibration.cost_constants()
    return {key: value for key, value in wanted.items() if key in known}
