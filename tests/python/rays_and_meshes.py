"""Meshes, rays and oracles that the tests of the compiled module share."""

import espalier_rt as rt
import numpy as np
from numpy.typing import NDArray

from espalier_scenes.soups import triangle_soup

METHODS = rt.methods()
Rays = tuple[NDArray[np.float32], NDArray[np.float32]]

TRIANGLE = rt.Mesh(np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.uint32([[0, 1, 2]]))
"""Faces +Z."""


def soup(seed: int = 0, count: int = 2000) -> rt.Mesh:
    """Small triangles all over the unit cube."""
    return rt.Mesh(*triangle_soup(seed, count, 0.1))


def rays_through(mesh: rt.Mesh, count: int, seed: int = 0) -> Rays:
    """Rays from around the mesh through its box, with directions of many lengths."""
    random = np.random.default_rng(seed)
    lower, upper = mesh.bounds.astype(float)
    centre, size = (lower + upper) / 2, np.linalg.norm(upper - lower)
    start = random.normal(size=(count, 3))
    start *= size * random.uniform(0.1, 2.0, (count, 1)) / np.linalg.norm(start, axis=1, keepdims=True)
    target = random.uniform(lower, upper, (count, 3))
    directions = (target - centre - start) * random.uniform(0.01, 100, (count, 1))
    return (centre + start).astype(np.float32), directions.astype(np.float32)


def one_triangle(triangle: NDArray[np.float64], origin: NDArray[np.float64], direction: NDArray[np.float64]):
    """Where rays meet planes of triangles, in double precision, by broadcasting: t, u, v and the least weight, which is
    negative outside. Moeller and Trumbore's test; nan in a plane that the ray is parallel to."""
    a, b, c = triangle[..., 0, :], triangle[..., 1, :], triangle[..., 2, :]
    across = np.cross(direction, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / np.einsum("...i,...i", across, b - a)
        u = np.einsum("...i,...i", across, origin - a) * inverse
        up = np.cross(origin - a, b - a)
        v = np.einsum("...i,...i", up, direction) * inverse
        t = np.einsum("...i,...i", up, c - a) * inverse
    return t, u, v, np.minimum(np.minimum(u, v), 1 - u - v)


def brute_force(vertices, triangles, origins, directions):
    """Closest t of every ray in double precision, inf for a miss; and how near to an edge the nearest decision was."""
    corners = vertices[triangles].astype(float)
    closest, margin = np.empty(len(origins)), np.empty(len(origins))
    for index, (origin, direction) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        t, _, _, least = one_triangle(corners, origin, direction)
        inside = (least >= 0) & (t >= 0)
        closest[index] = t[inside].min(initial=np.inf)
        margin[index] = np.nanmin(np.abs(least), initial=np.inf)
    return closest, margin
