"""The rays of a group, made with numpy, the same for every method. No bpy.

They come in blocks of BLOCK x BLOCK pixels, in whose order a renderer of tiles asks. What is random of them comes from
the plan's seed. Rays from hits start where `bvh-sah` finds the hits; every method finds the same.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .. import native
from ..scene_data import Float32
from .plan import Group
from .sources import Source

BLOCK = 8
"""Edge of the blocks of pixels."""

LIFT = 1e-5
"""How far a ray starts from the surface it leaves, as a share of the scene's diagonal or largest coordinate."""

AO_REACH = 0.05
"""Length of an ambient occlusion ray, as a share of the diagonal of the scene's box."""

HIT_METHOD = "bvh-sah"


@dataclass(frozen=True, eq=False)
class Batch:
    """n rays that are asked together: origins and directions (n, 3), tmax (n,) in lengths of the direction."""

    query: Literal["closest", "occluded"]
    origins: Float32
    directions: Float32
    tmax: Float32

    def __len__(self) -> int:
        return len(self.origins)

    def some(self, most: int) -> "Batch":
        """At most `most` of the rays, evenly picked."""
        step = max(1, -(-len(self) // most))
        return Batch(self.query, self.origins[::step], self.directions[::step], self.tmax[::step])


@dataclass(frozen=True, eq=False)
class Scene:
    """A source in the core, with what rays from hits are made of."""

    source: Source
    mesh: Any
    build: Callable[[str], Any]
    """Builds a method over the mesh, untimed."""


def primary(source: Source, width: int, height: int) -> Batch:
    """A ray through the centre of each pixel, in blocks. Raises the core's SceneError."""
    camera = native.module().Camera(**source.camera, resolution=(width, height))
    origins, directions = camera.rays()
    order = block_order(width, height)
    return Batch("closest", origins[order], directions[order], _endless(len(order)))


def block_order(width: int, height: int) -> NDArray[np.intp]:
    """Indices of the pixels, counted by rows, in the order of blocks; blocks at the borders may be smaller."""
    across, down = -(-width // BLOCK), -(-height // BLOCK)
    pixels = np.full((down * BLOCK, across * BLOCK), -1, np.intp)
    pixels[:height, :width] = np.arange(width * height).reshape(height, width)
    ordered = pixels.reshape(down, BLOCK, across, BLOCK).transpose(0, 2, 1, 3).reshape(-1)
    return ordered[ordered >= 0]


def batches(group: Group, scene: Scene, seed: int, look: Callable[[], None]) -> tuple[Batch, ...]:
    """What is timed of a group, see plan.RAY_CLASSES. `look` is called now and then, and may raise.

    Raises the core's errors.
    """
    first = primary(scene.source, group.width, group.height)
    if group.rays == "primary":
        return (first,)
    look()
    points, normals, diagonal = _hits(scene, first)
    look()
    if group.rays == "primary-shadow":
        directions = (scene.source.light - points).astype(np.float32)
        return (first, Batch("occluded", points, directions, np.ones(len(points), np.float32)))
    directions = _cosine(normals, seed)
    if group.rays == "ao":
        return (Batch("occluded", points, directions, np.full(len(points), AO_REACH * diagonal, np.float32)),)
    return (Batch("closest", points, directions, _endless(len(points))),)


def _hits(scene: Scene, rays: Batch) -> tuple[Float32, NDArray[np.float64], float]:
    """Points just above what the rays hit, unit normals on the rays' side, and the diagonal of the scene's box."""
    hits = scene.build(HIT_METHOD).closest(rays.origins, rays.directions)
    hit = hits.primitive != native.module().MISS
    lower, upper = scene.mesh.bounds.astype(float)
    diagonal = float(np.linalg.norm(upper - lower))
    lift = LIFT * max(diagonal, float(np.abs([lower, upper]).max()))
    directions = rays.directions[hit].astype(float)
    normals = hits.normal[hit].astype(float)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals *= np.where(np.einsum("ij,ij->i", normals, directions) > 0, -1.0, 1.0)[:, None]
    points = rays.origins[hit] + hits.t[hit, None] * directions + lift * normals
    return points.astype(np.float32), normals, diagonal


def _cosine(normals: NDArray[np.float64], seed: int) -> Float32:
    """Unit directions about unit normals with density in proportion to the cosine: a point of the unit sphere added to
    the normal."""
    sphere = np.random.default_rng(seed).normal(size=normals.shape)
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    directions = normals + 0.9999 * sphere  # short of the whole sphere, where the sum may vanish
    return (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)


def _endless(count: int) -> Float32:
    return np.full(count, np.inf, np.float32)
