"""One measurement: build a method, trace a group's rays with it; and the evidence of why it took so long. No bpy.

Evidence is counted apart from the timed run: traversal steps and tests on a subset of the rays, and for every pixel
of a small picture, which is the heat map.
"""

import base64
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import native
from ..run import build_config
from .embree import CHUNK, Embree
from .plan import EMBREE, Plan
from .rays import Batch, Scene, block_order, primary

COUNTED_RAYS = 32768
"""Most rays of a batch whose steps and tests are counted."""

HEAT_SIDE = 144
"""Longer side of a heat map, pixels."""

MOST_CELLS = 4_000_000
"""Most leaves and cells whose triangles are counted for a histogram."""

HOLDERS = (1, 3, 4, 5)
"""Kinds of boxes in `espalier_rt.Cells` that hold triangles: leaves, cells, tetrahedra, lazy cells not yet reached."""


@dataclass(frozen=True)
class Run:
    """One timed measurement. Seconds of wall time; phases in milliseconds by name, empty where none are known."""

    build_s: float
    trace_s: float
    phases: dict[str, float] = field(default_factory=dict)

    @property
    def total_s(self) -> float:
        """Time to image: build and trace."""
        return self.build_s + self.trace_s


@dataclass(frozen=True)
class Evidence:
    """What is counted of a case, once. For Embree only rays and hits are known; the rest is empty.

    steps, tests: mean by ray, counted as closest-hit queries on a subset. heat: `packed` counts of steps of the small
    picture's pixels, rows bottom-up. occupancy: leaves and occupied cells of 1, 2, 3 to 4, 5 to 8, ... triangles.
    """

    rays: int
    hits: tuple[int, ...]
    steps: float | None = None
    tests: float | None = None
    census: dict[str, Any] = field(default_factory=dict)
    occupancy: tuple[int, ...] = ()
    heat: str = ""
    heat_size: tuple[int, int] = (0, 0)


class Work(NamedTuple):
    """What a group's methods are measured on."""

    scene: Scene
    batches: tuple[Batch, ...]
    small: Batch
    """The rays of the heat map, in blocks."""
    small_size: tuple[int, int]


def prepare(scene: Scene, batches: tuple[Batch, ...], width: int, height: int) -> Work:
    """The work of a group, with the rays of its heat map."""
    scale = HEAT_SIDE / max(width, height, HEAT_SIDE)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return Work(scene, batches, primary(scene.source, *size), size)


class Tracer:
    """A method built over a scene, with its time."""

    def __init__(self, method: str, work: Work, plan: Plan, job: Any) -> None:
        """Build. Raises the core's errors; Cancelled when `job` is."""
        self._plan, self._job = plan, job
        self._embree: Embree | None = None
        if method == EMBREE:
            self._embree = Embree(work.scene.source.vertices, work.scene.source.triangles)
            self.build_s = self._embree.build_ms / 1000
            return
        expected = float(sum(map(len, work.batches)))
        config = build_config(method, plan.seed, expected)
        begin = time.perf_counter()
        self.accelerator = native.module().Accelerator.build(
            work.scene.mesh, method, config, threads=plan.threads, job=job
        )
        self.build_s = time.perf_counter() - begin

    def trace(self, batch: Batch) -> Any:
        """Hits, or which rays are occluded. Raises Cancelled."""
        if self._embree is not None:
            return self._trace_embree(self._embree, batch)
        query = getattr(self.accelerator, batch.query)
        return query(batch.origins, batch.directions, tmax=batch.tmax, threads=self._plan.threads, job=self._job)

    def _trace_embree(self, embree: Embree, batch: Batch) -> NDArray[np.bool_]:
        query = "INTERSECT" if batch.query == "closest" else "OCCLUDED"
        found = np.empty(len(batch), bool)
        for start in range(0, len(batch), CHUNK):
            if self._job.cancelled:
                raise native.module().Cancelled
            part = slice(start, start + CHUNK)
            arrays = (batch.origins[part], batch.directions[part], batch.tmax[part])
            found[part] = embree.primitives(query, *arrays) >= 0
        return found

    def counted(self, batch: Batch) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        """Steps and tests of each ray, of an accelerator. Raises Cancelled."""
        rays = (batch.origins, batch.directions)
        steps, tests = self.accelerator.counted(*rays, tmax=batch.tmax, threads=self._plan.threads, job=self._job)
        return steps, tests

    @property
    def census(self) -> dict[str, Any]:
        """The accelerator's; empty for Embree."""
        return {} if self._embree is not None else self.accelerator.census()


def timed(method: str, work: Work, plan: Plan, job: Any) -> tuple[Run, Tracer, tuple[int, ...]]:
    """Build and trace once. The run, what was built, and the number of hits of each batch."""
    tracer = Tracer(method, work, plan, job)
    hits, trace_s = [], 0.0
    for batch in work.batches:
        begin = time.perf_counter()
        answer = tracer.trace(batch)
        trace_s += time.perf_counter() - begin
        hits.append(_hit_count(answer))
        del answer
    return Run(tracer.build_s, trace_s, dict(tracer.census.get("phases", {}))), tracer, tuple(hits)


def evidence(tracer: Tracer, hits: tuple[int, ...], work: Work, look: Callable[[], None]) -> Evidence:
    """What there is to count of a method that has traced. `look` is called between the parts, and may raise."""
    rays = sum(map(len, work.batches))
    if not tracer.census:
        return Evidence(rays, hits)
    accelerator = tracer.accelerator
    counts = []
    for batch in (*(batch.some(COUNTED_RAYS) for batch in work.batches), work.small):
        look()
        counts.append(tracer.counted(batch))
    look()
    *of_rays, (heat, _) = counts
    weights = [len(batch) for batch in work.batches]
    census = dict(accelerator.census())
    census.pop("phases")
    return Evidence(
        rays,
        hits,
        _mean([steps for steps, _ in of_rays], weights),
        _mean([tests for _, tests in of_rays], weights),
        census,
        _occupancy(accelerator),
        packed(_by_rows(heat, work.small_size)),
        work.small_size,
    )


def packed(counts: NDArray[np.uint16]) -> str:
    """Counts as text, for JSON."""
    return base64.b64encode(zlib.compress(counts.astype("<u2").tobytes(), 9)).decode()


def unpacked(text: str, size: tuple[int, int]) -> NDArray[np.uint16]:
    """(height, width) counts that `packed` made text of."""
    width, height = size
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), "<u2").reshape(height, width)


def _hit_count(answer: Any) -> int:
    if isinstance(answer, np.ndarray):
        return int(np.count_nonzero(answer))
    return int(np.count_nonzero(answer.primitive != native.module().MISS))


def _mean(counts: list[NDArray[np.uint32]], weights: list[int]) -> float | None:
    """Mean over batches of different sizes of which as many rays were counted; None of no ray."""
    totals = [float(count.mean()) * weight for count, weight in zip(counts, weights, strict=True) if weight]
    return sum(totals) / sum(weights) if totals else None


def _by_rows(counts: NDArray[np.uint32], size: tuple[int, int]) -> NDArray[np.uint16]:
    """Counts in the order of blocks as a picture; more than 65535 steps are shown as 65535."""
    width, height = size
    picture = np.empty(width * height, np.uint16)
    picture[block_order(width, height)] = np.minimum(counts, 65535)
    return picture.reshape(height, width)


def _occupancy(accelerator: Any) -> tuple[int, ...]:
    """Leaves and occupied cells by the power of two that their triangles stay within."""
    cells = accelerator.cells(occupied_only=True, max_count=MOST_CELLS)
    holds = cells.count[np.isin(cells.kind, HOLDERS) & (cells.count > 0)]
    if not len(holds):
        return ()
    return tuple(int(count) for count in np.bincount(np.ceil(np.log2(holds)).astype(int)))
