"""Triangles without connection: the cases that volume-filling structures win or lose on. No bpy."""

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, mesh
from .stage import Light, Part, Stage, Surface, View

COLORS = {"Amber": (0.85, 0.42, 0.08), "Teal": (0.05, 0.42, 0.45), "Ivory": (0.85, 0.8, 0.68)}


def triangle_soup(seed: int = 0, count: int = 200_000, size: float = 0.025) -> Mesh:
    """`count` triangles of edge about `size`, evenly spread over the cube -1..1 and turned every way."""
    random = np.random.default_rng(seed)
    centers = random.uniform(-1, 1, (count, 1, 3))
    corners = centers + random.normal(0, size / 2, (count, 3, 3))
    return mesh(corners, np.arange(3 * count))


def thin_triangles(seed: int = 0, count: int = 40_000, length: float = 1.3, width: float = 0.004) -> Mesh:
    """`count` triangles some 250 times as long as wide, laid across a ball of radius 1 like straw in a nest."""
    random = np.random.default_rng(seed)
    outward = _unit(random.normal(size=(count, 3)))
    along = _unit(np.cross(outward, random.normal(size=(count, 3))))
    across = np.cross(outward, along)
    middle = outward * random.uniform(0.55, 1.0, (count, 1))
    half = along * random.uniform(0.5, 1.0, (count, 1)) * length / 2
    side = across * width / 2
    return mesh(np.stack([middle - half - side, middle - half + side, middle + half], axis=1), np.arange(3 * count))


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def soup_stage(seed: int) -> Stage:
    """The soup, floating, lit from three sides."""
    return _floating(triangle_soup(seed), View((2.9, -3.9, 2.5), (0, 0, -0.05), 50.0))


def thin_stage(seed: int) -> Stage:
    """The nest of thin triangles, floating, lit from three sides."""
    return _floating(thin_triangles(seed), View((2.4, -3.4, 1.7), (0, 0, 0), 50.0))


def _floating(source: Mesh, view: View) -> Stage:
    """The triangles in three colours by height, as three objects."""
    vertices, triangles = source
    by_height = vertices.reshape(-1, 3, 3)[np.argsort(vertices[triangles, 2].mean(axis=1), kind="stable")]
    shares = np.array_split(by_height, len(COLORS))
    parts = [
        Part(name, mesh(share, np.arange(3 * len(share))), Surface(name, color))
        for (name, color), share in zip(COLORS.items(), shares, strict=True)
    ]
    lights = [
        Light("area", (-4, -4, 5), power=1100, size=2.5),
        Light("area", (5, -2, 1), power=350, size=2, color=(0.75, 0.85, 1.0)),
        Light("area", (0, 5, 4), power=500, size=3),
    ]
    return Stage(parts, lights, view, world=(0.03, 0.035, 0.045))
