"""Which boxes of an accelerator the overlay draws, and their edges as arrays. No bpy.

`Cells` is anything with the fields of `espalier_rt.Cells`: lower, upper (n, 3) float32; kind (n,) uint8;
depth (n,) uint16; count (n,) uint32; truncated bool.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
UInt32 = NDArray[np.uint32]

BRANCH, LEAF, GRID, CELL, TETRAHEDRON, LAZY, REFINED = range(7)
"""Values of `Cells.kind`."""

CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=np.bool_)
"""(8, 3): whether a corner lies on the upper side of each axis; corner i has x, y, z as the bits of i."""

EDGES = np.array(
    [(corner, corner | bit) for bit in (1, 2, 4) for corner in range(8) if not corner & bit], dtype=np.uint32
)
"""(12, 2): the corners that each edge of a box joins."""


class Cells(Protocol):
    """Boxes of the partition, in world space."""

    lower: Float32
    upper: Float32
    kind: NDArray[np.uint8]
    depth: NDArray[np.uint16]
    count: UInt32
    truncated: bool


@dataclass(frozen=True)
class Filter:
    """What to draw. `kinds` holds values of `Cells.kind`; depths are inclusive."""

    kinds: frozenset[int]
    depth_min: int
    depth_max: int
    occupied_only: bool
    max_boxes: int


class Lines(NamedTuple):
    """Edges of boxes: vertices (8n, 3) float32, indices (12n, 2) uint32 into them."""

    vertices: Float32
    indices: UInt32


def select(cells: Cells, wanted: Filter) -> tuple[NDArray[np.intp], int]:
    """Rows of `cells` to draw, ascending, and how many matched before `max_boxes` cut the deepest off.

    Branches and grid boxes have no count of their own kind to be empty by, so `occupied_only` is for leaves and cells.
    """
    mask = np.isin(cells.kind, list(wanted.kinds))
    mask &= (cells.depth >= wanted.depth_min) & (cells.depth <= wanted.depth_max)
    if wanted.occupied_only:
        mask &= (cells.count > 0) | (cells.kind == BRANCH) | (cells.kind == GRID)
    rows = np.flatnonzero(mask)
    matched = len(rows)
    if matched > wanted.max_boxes:
        shallow_first = np.argsort(cells.depth[rows], kind="stable")
        rows = np.sort(rows[shallow_first[: wanted.max_boxes]])
    return rows, matched


def box_lines(lower: Float32, upper: Float32) -> Lines:
    """The edges of n boxes, each edge once; lower and upper are (n, 3) float32.

    Cells of a grid share corners and edges. Drawn once, an edge has the opacity asked for, and a full grid takes a
    quarter of the lines. Corners closer than 2^-20 of the boxes' extent are one corner.
    """
    if not len(lower):
        return Lines(np.empty((0, 3), np.float32), np.empty((0, 2), np.uint32))
    first, welded = _weld(_corner_keys(lower, upper))
    start, end = welded.reshape(-1, 8)[:, EDGES].reshape(-1, 2).T
    keys = np.unique((start << 32 | end)[start != end])
    box, corner = first >> 3, first & 7
    vertices = np.where(CORNERS[corner], upper[box], lower[box])
    return Lines(vertices, np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.uint32))


def _corner_keys(lower: Float32, upper: Float32) -> NDArray[np.int64]:
    """One key for each of 8n corners: its place on a lattice of 2^20 steps along each axis of the boxes' bounds."""
    origin = lower.min(axis=0).astype(np.float64)
    steps = (1 << 20) / np.maximum(upper.max(axis=0) - origin, np.finfo(np.float32).tiny)
    shifts = np.array([42, 21, 0])
    low = np.rint((lower - origin) * steps).astype(np.int64) << shifts
    high = np.rint((upper - origin) * steps).astype(np.int64) << shifts
    x, y, z = (np.where(CORNERS[:, axis], high[:, axis, None], low[:, axis, None]) for axis in range(3))
    return (x | y | z).reshape(-1)


def _weld(keys: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """Index of one element of each distinct key, ascending by key, and for each element the place of its key there."""
    order = np.argsort(keys)
    ascending = keys[order]
    is_new = np.concatenate([[True], ascending[1:] != ascending[:-1]])
    places = np.empty(len(keys), dtype=np.int64)
    places[order] = np.cumsum(is_new) - 1
    return order[is_new], places
