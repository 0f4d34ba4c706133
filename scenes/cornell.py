"""The Cornell box: few large triangles, coloured walls, one lamp and a weak one before it. No bpy.

Laid out after the box of Goral and others 1984 at its measured size of 5.5 m (in the original: 5.5 units); the tall
block is a mirror.
"""

import numpy as np

from .geometry import Mesh, box, mesh, placement, transformed
from .stage import Light, Part, Stage, Surface, View

EDGE = 5.5


def quad(corner: tuple[float, ...], first: tuple[float, ...], second: tuple[float, ...]) -> Mesh:
    """A parallelogram of two triangles, facing along first x second."""
    a, u, v = (np.asarray(values, float) for values in (corner, first, second))
    return mesh([a, a + u, a + u + v, a + v], [[0, 1, 2], [0, 2, 3]])


def stage(seed: int) -> Stage:
    """The open box seen from its open side; the seed changes nothing."""
    white = Surface("White", (0.73, 0.71, 0.68))
    red, green = Surface("Red", (0.63, 0.065, 0.05)), Surface("Green", (0.14, 0.45, 0.091))
    low, high = 1.95, 3.55
    return Stage(
        parts=[
            Part("Floor", quad((0, 0, 0), (EDGE, 0, 0), (0, EDGE, 0)), white),
            Part("Ceiling", quad((0, 0, EDGE), (0, EDGE, 0), (EDGE, 0, 0)), white),
            Part("Back", quad((0, EDGE, 0), (EDGE, 0, 0), (0, 0, EDGE)), white),
            Part("Left", quad((0, 0, 0), (0, EDGE, 0), (0, 0, EDGE)), red),
            Part("Right", quad((EDGE, 0, 0), (0, 0, EDGE), (0, EDGE, 0)), green),
            Part("Lamp", quad((2.1, 2.2, EDGE - 0.01), (0, 1.1, 0), (1.3, 0, 0)), Surface("Lamp", emission=2.0)),
            Part("Short Block", _block((3.7, 1.7), 1.65, low - 0.3, -0.3), white),
            Part("Tall Block", _block((1.85, 3.7), 1.65, high - 0.25, 0.62), Surface("Mirror", (0.95,) * 3, 1.0, 0.0)),
        ],
        lights=[
            Light("area", (2.75, 2.75, EDGE - 0.05), (2.75, 2.75, 0), power=260, size=1.2, color=(1.0, 0.9, 0.75)),
            Light("area", (2.75, -4.5, 3.6), (2.75, 2.75, 2.75), power=150, size=3.0),
        ],
        view=View((2.75, -7.6, 2.75), (2.75, 2.75, 2.75), 47.0),
        world=(0.0, 0.0, 0.0),
    )


def _block(center: tuple[float, float], edge: float, height: float, turn: float) -> Mesh:
    half = edge / 2
    return transformed(box((-half, -half, 0), (half, half, height)), placement((*center, 0.0), turn))
