"""Martin Newell's teapot of 1975 from its control points. No bpy.

Rim, body, lid and bottom are the revolved Bezier profiles of the original data set (its quarter circles, cubic Bezier
arcs off by less than 0.1 %, are exact circles here); handle and spout are its bicubic patches, mirrored in y.
Units are Newell's: 3.15 high, from x = -3 (handle) to 3.525 (spout's control points), the axis along z.
"""

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, join, lathe, sheet, welded

PROFILES = {
    "rim": [[(1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)]],
    "body": [
        [(1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9)],
        [(2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)],
    ],
    "lid": [[(0.0, 3.15), (0.8, 3.15), (0.0, 2.7), (0.2, 2.55)], [(0.2, 2.55), (0.4, 2.4), (1.3, 2.4), (1.3, 2.25)]],
    "bottom": [[(1.5, 0.15), (1.5, 0.075), (1.425, 0.0), (0.0, 0.0)]],
}
"""(radius, height) control points, from top to bottom."""

HANDLE = [
    [(-1.6, 0, 2.025), (-1.6, -0.3, 2.025), (-1.5, -0.3, 2.25), (-1.5, 0, 2.25)],
    [(-2.3, 0, 2.025), (-2.3, -0.3, 2.025), (-2.5, -0.3, 2.25), (-2.5, 0, 2.25)],
    [(-2.7, 0, 2.025), (-2.7, -0.3, 2.025), (-3.0, -0.3, 2.25), (-3.0, 0, 2.25)],
    [(-2.7, 0, 1.8), (-2.7, -0.3, 1.8), (-3.0, -0.3, 1.8), (-3.0, 0, 1.8)],
    [(-2.7, 0, 1.575), (-2.7, -0.3, 1.575), (-3.0, -0.3, 1.35), (-3.0, 0, 1.35)],
    [(-2.5, 0, 1.125), (-2.5, -0.3, 1.125), (-2.65, -0.3, 0.9375), (-2.65, 0, 0.9375)],
    [(-2.0, 0, 0.9), (-2.0, -0.3, 0.9), (-1.9, -0.3, 0.6), (-1.9, 0, 0.6)],
]
SPOUT = [
    [(1.7, 0, 1.425), (1.7, -0.66, 1.425), (1.7, -0.66, 0.6), (1.7, 0, 0.6)],
    [(2.6, 0, 1.425), (2.6, -0.66, 1.425), (3.1, -0.66, 0.825), (3.1, 0, 0.825)],
    [(2.3, 0, 2.1), (2.3, -0.25, 2.1), (2.4, -0.25, 2.025), (2.4, 0, 2.025)],
    [(2.7, 0, 2.4), (2.7, -0.25, 2.4), (3.3, -0.25, 2.4), (3.3, 0, 2.4)],
    [(2.8, 0, 2.475), (2.8, -0.25, 2.475), (3.525, -0.25, 2.49375), (3.525, 0, 2.49375)],
    [(2.9, 0, 2.475), (2.9, -0.15, 2.475), (3.45, -0.15, 2.5125), (3.45, 0, 2.5125)],
    [(2.8, 0, 2.4), (2.8, -0.15, 2.4), (3.2, -0.15, 2.4), (3.2, 0, 2.4)],
]
"""Rows of control points of two bicubic patches that share the fourth row: one half of the part."""


def teapot(divisions: int = 16) -> Mesh:
    """The teapot, `divisions` along each cubic and 4 * divisions around; about 96 * divisions**2 triangles."""
    revolved = [_revolved(curves, divisions) for curves in PROFILES.values()]
    return join([*revolved, _tube(HANDLE, divisions), _tube(SPOUT, divisions)])


def _revolved(curves: list[list[tuple[float, float]]], divisions: int) -> Mesh:
    points = [_bernstein(divisions) @ np.array(curve) for curve in curves]
    profile = np.concatenate([points[0], *[curve[1:] for curve in points[1:]]])
    return lathe(profile[::-1], 4 * divisions)


def _tube(rows: list[list[tuple[float, float, float]]], divisions: int) -> Mesh:
    """The two patches of one half and their mirror images, welded along the plane y = 0."""
    control, weights = np.array(rows, float), _bernstein(divisions)
    halves = [np.einsum("ia,jb,abk->ijk", weights, weights, control[start : start + 4]) for start in (0, 3)]
    half = np.concatenate([halves[0], halves[1][1:]])
    mirrored = half[:, ::-1] * [1, -1, 1]
    return welded(join([sheet(half), sheet(mirrored)]))


def _bernstein(divisions: int) -> NDArray[np.float64]:
    """(divisions + 1, 4) weights of the cubic Bernstein polynomials at even steps of 0..1."""
    t = np.linspace(0, 1, divisions + 1)[:, None]
    return np.concatenate([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
