"""A study of two small spheres, real and made in a moment, for the tests."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from espalier.study import paper, writing
from espalier.study.journal import Journal
from espalier.study.plan import Group, Plan
from espalier.study.sources import Source, _framed
from espalier.study.task import Study
from espalier_scenes.geometry import icosphere

FINGERPRINT = {
    "processor": "Some processor",
    "cores": 2,
    "cores_available": 2,
    "instruction_set": "portable",
    "system": "Some system",
    "python": "3.11",
    "espalier": "0.1.0",
    "commit": None,
    "embree": None,
    "numpy": "1.26",
}
PLAN = Plan(
    scenes=("small", "large"),
    methods=("bvh-median", "bvh-sah", "grid", "hybrid-sampled"),
    classes=("primary-shadow", "diffuse"),
    resolutions=((24, 16),),
    repeats=2,
)


def load(group: Group, _progress: Callable[[float], None]) -> Source:
    """A sphere of 80 or of 1280 triangles."""
    vertices, triangles = icosphere({"small": 1, "large": 3}[group.scene])
    return _framed(group.scene, vertices, triangles, group.width / group.height)


def squashed(group: Group, progress: Callable[[float], None]) -> Source:
    """The same with another shape."""
    source = load(group, progress)
    return replace(source, vertices=source.vertices * np.array([1, 1, 0.5], np.float32))


def make(folder: Path, plan: Plan = PLAN, loader: Callable[..., Source] = load) -> Study:
    """A study in a folder, not started yet."""
    table = paper.read()
    return Study(plan, Journal(folder, plan, FINGERPRINT), loader, lambda done: writing.publish(folder, done, table))


def finished(folder: Path, plan: Plan = PLAN, loader: Callable[..., Source] = load) -> Study:
    """A study that has ended; raises what ended it early."""
    study = make(folder, plan, loader).start()
    assert study.wait(60)
    study.raise_error()
    return study
