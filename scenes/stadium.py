"""A teapot in a stadium: all detail in one small place, the case a single uniform grid is bad at. No bpy."""

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, box, instanced, join, lathe, plane, sheet, transformed
from .geometry import placement as place
from .stage import Light, Part, Stage, Surface, View
from .teapot import teapot
from .textures import speckle

ROWS = 36
TREAD, RISE = 0.85, 0.5
PITCH = np.array([62.0, 44.0])
"""Half axes of the oval in front of the first row, metres."""


def stands(segments: int = 320) -> Mesh:
    """The stepped bowl of ROWS rows, and its outer wall down to the ground."""
    steps = np.arange(ROWS)
    outward = np.repeat(np.append(steps, ROWS) * TREAD, 2)[1:-1]
    height = np.repeat(1.2 + steps * RISE, 2)
    outward = np.concatenate([[0.0], outward, outward[-1:]])
    height = np.concatenate([[0.0], height, [0.0]])
    return sheet(np.stack([_ring(segments, o, h) for o, h in zip(outward, height, strict=True)]))


def seats(seed: int = 0, pitch: float = 1.0) -> tuple[Mesh, Mesh]:
    """A seat every `pitch` metres on every row, in two colours at random."""
    random = np.random.default_rng(seed)
    matrices = np.concatenate([_seat_row(row, pitch) for row in range(ROWS)])
    first = random.random(len(matrices)) < 0.7
    seat = join([box((-0.24, -0.25, 0.0), (0.24, 0.2, 0.4)), box((-0.24, 0.2, 0.0), (0.24, 0.28, 0.85))])
    return instanced(seat, matrices[first]), instanced(seat, matrices[~first])


def roof(segments: int = 320) -> Mesh:
    """A ring over the upper rows, 0.4 m thick."""
    edge = ROWS * TREAD
    section = [(edge - 16, 25.0), (edge + 4, 28.0), (edge + 4, 28.4), (edge - 16, 25.4), (edge - 16, 25.0)]
    return sheet(np.stack([_ring(segments, outward, height) for outward, height in section]))


def stage(seed: int) -> Stage:
    """The teapot on the centre spot, seen from beside it, the stands around."""
    grass = Surface("Grass", texture=speckle(seed, color=(0.3, 0.47, 0.2)), texture_size=2.0)
    concrete = Surface("Concrete", texture=speckle(seed + 1, color=(0.62, 0.61, 0.59), contrast=0.15), texture_size=3.0)
    blue, white = seats(seed)
    pot = transformed(teapot(16), place((0.0, 0.0, 0.22), 0.45, 0.1))
    return Stage(
        parts=[
            Part("Pitch", plane(100.0, 8), grass),
            Part("Stands", stands(), concrete),
            Part("Seats Blue", blue, Surface("Blue", (0.03, 0.12, 0.5))),
            Part("Seats White", white, Surface("White", (0.8, 0.8, 0.8))),
            Part("Roof", roof(), Surface("Roof", (0.55, 0.57, 0.6))),
            Part(
                "Plinth", lathe([(0, 0), (0.3, 0), (0.27, 0.22), (0, 0.22)], 64), Surface("Plinth", (0.7, 0.68, 0.64))
            ),
            Part("Teapot", pot, Surface("Glaze", (0.75, 0.2, 0.08), roughness=0.4), smooth=True),
        ],
        lights=[
            Light("sun", (-30, -40, 60), power=3.2, size=2.0, color=(1.0, 0.95, 0.87)),
            Light("sun", (50, -30, 40), power=0.9, size=20.0, color=(0.8, 0.88, 1.0)),
        ],
        view=View((0.35, -1.3, 0.6), (0.02, 0.0, 0.47), 26.0, clip=(0.05, 500.0)),
        world=(0.42, 0.6, 0.9),
    )


def _oval(angle: NDArray[np.float64], outward: float) -> NDArray[np.float64]:
    """(n, 2) points of a rounded rectangle (superellipse of exponent 3) `outward` metres beyond the pitch."""
    cosine, sine = np.cos(angle), np.sin(angle)
    curve = np.stack([np.sign(cosine) * np.abs(cosine) ** (2 / 3), np.sign(sine) * np.abs(sine) ** (2 / 3)], axis=-1)
    return curve * (PITCH + outward)


def _ring(segments: int, outward: float, height: float) -> NDArray[np.float64]:
    points = _oval(np.linspace(0, 2 * np.pi, segments + 1), outward)
    return np.concatenate([points, np.full((segments + 1, 1), height)], axis=1)


def _seat_row(row: int, pitch: float) -> NDArray[np.float64]:
    """(k, 4, 4) placements of a row's seats, backs outwards."""
    fine = _oval(np.linspace(0, 2 * np.pi, 4096), (row + 0.6) * TREAD)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    at = np.arange(0.0, length[-1] - pitch / 2, pitch)
    points = np.stack([np.interp(at, length, fine[:, axis]) for axis in (0, 1)], axis=1)
    ahead = np.stack([np.interp(at + 0.05, length, fine[:, axis]) for axis in (0, 1)], axis=1)
    turn = np.arctan2(*(ahead - points).T[::-1]) + np.pi
    return np.stack([place((*point, 1.2 + row * RISE), angle) for point, angle in zip(points, turn, strict=True)])
