"""What a study measures: scenes, methods, ray classes, resolutions, and how often. No bpy."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from ..errors import EspalierAddonError

RAY_CLASSES = {
    "primary-shadow": "a ray through the centre of each pixel, and from each hit one shadow ray to the light, as the "
    "paper does",
    "primary": "a ray through the centre of each pixel: closest hit",
    "ao": "a short ray from each hit in a random direction, cosine-distributed: any hit",
    "diffuse": "a ray without end from each hit in a random direction, cosine-distributed: closest hit",
}
"""The kinds of rays, each with what it is."""

PAPER_RAYS = "primary-shadow"

PAPER_SCENES = ("bunny1", "bunny2", "horse1_sub", "horse2", "goldfish1_sub", "goldfish2_sub", "dragon")
"""The paper's seven scenes by their names in the catalogue, in the paper's order."""

EMBREE = "embree"
"""The name of the reference in place of a method's."""

FALLBACK_REFERENCE = "bvh-median"
"""What other methods are compared with where Embree is not installed: the paper's own benchmark."""


class StudyError(EspalierAddonError):
    """A study that cannot be made, or cannot go on."""


class Group(NamedTuple):
    """What is measured on the same rays, its methods in turns."""

    scene: str
    width: int
    height: int
    rays: str

    @property
    def label(self) -> str:
        """For people: the scene, and what else tells it from other groups of a study."""
        return f"{self.scene}, {self.rays}, {self.width} x {self.height}"


class Case(NamedTuple):
    """One method on one group's rays."""

    group: Group
    method: str


@dataclass(frozen=True)
class Plan:
    """A study to be made. `methods` may hold EMBREE beside native names; threads is at least 1."""

    scenes: tuple[str, ...]
    methods: tuple[str, ...]
    classes: tuple[str, ...] = (PAPER_RAYS,)
    resolutions: tuple[tuple[int, int], ...] = ((1000, 1000),)
    threads: int = 1
    repeats: int = 7
    """Most measurements of a case. Seven give an interval for the median with 98 % confidence, see statistics."""
    seconds: float = 4.0
    """A case is measured again while all of its runs stay within this time: thrice where one run does, else once."""
    limit_seconds: float = 60.0
    """A build or trace that takes longer is given up, and said to be too slow."""
    seed: int = 0

    def groups(self) -> Iterator[Group]:
        """All groups, a scene's after one another, so that no scene is opened twice."""
        for scene in self.scenes:
            for width, height in self.resolutions:
                for rays in self.classes:
                    yield Group(scene, width, height, rays)

    def cases(self) -> Iterator[Case]:
        """All cases, by groups."""
        return (Case(group, method) for group in self.groups() for method in self.methods)

    def as_dict(self) -> dict[str, Any]:
        """The plan in plain types."""
        values = asdict(self)
        lists = {name: list(values[name]) for name in ("scenes", "methods", "classes")}
        return values | lists | {"resolutions": [list(size) for size in self.resolutions]}

    @classmethod
    def of(cls, values: dict[str, Any]) -> "Plan":
        """The plan that `as_dict` made these values of. Raises TypeError or KeyError where it did not."""
        tuples = {name: tuple(values[name]) for name in ("scenes", "methods", "classes")}
        return cls(**values | tuples | {"resolutions": tuple((w, h) for w, h in values["resolutions"])})


FAMILIES = {
    "bvh": "hierarchies",
    "grid": "grids",
    "hybrid": "hybrids of both",
    "reference": "Embree",
}
"""Kinds of methods, which reports tell apart by colour."""


def family(method: str) -> str:
    """The kind of a method, told by its name."""
    if method == EMBREE:
        return "reference"
    if method.startswith("grid"):
        return "grid"
    return "hybrid" if method.startswith(("hybrid", "hapala", "fellner")) else "bvh"
