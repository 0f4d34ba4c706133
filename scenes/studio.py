"""A photographer's corner for one object: a plate, a key, a fill and a rim light. No bpy."""

import numpy as np
from numpy.typing import ArrayLike

from .framing import frame
from .geometry import Mesh, box, icosphere, mesh, placement, transformed
from .stage import Light, Part, Stage, Surface, View
from .textures import checker

DIRECTION = (0.42, -1.0, 0.42)
"""From the object towards the camera."""

BALL = (1.3, -0.35, 0.33)
"""Middle of the mirror ball, which stands on the plate, metres."""


def plate(subject: ArrayLike) -> Mesh:
    """A slab under the points (n, 3), hardly larger than they are.

    Not a floor to the horizon: with one, every model would be a teapot in a stadium, and a grid's cells as large as
    its details.
    """
    points = np.asarray(subject, float)
    low, high = points.min(axis=0), points.max(axis=0)
    rim = 0.08 * (high - low).max()
    return box((low[0] - rim, low[1] - rim, low[2] - 0.08), (high[0] + rim, high[1] + rim, low[2]))


def standing(source: Mesh, up: str = "z", turn: float = 0.0, height: float = 2.0) -> Mesh:
    """The mesh scaled to at most `height` metres in every direction, its middle over the origin, its foot on z = 0.

    up: the source's axis that points up, "y" or "z"; turn about it in degrees.
    """
    points = source[0].astype(float)
    if up == "y":
        points = points[:, [0, 2, 1]] * [1, -1, 1]
    points = points @ placement((0, 0, 0), np.radians(turn))[:3, :3].T
    low, high = points.min(axis=0), points.max(axis=0)
    points = (points - [*((low + high) / 2)[:2], low[2]]) * (height / (high - low).max())
    return mesh(points, source[1])


def stage(parts: list[Part], subject: ArrayLike, mirror_ball: bool = True) -> Stage:
    """The parts on a plate, the camera framed on the points `subject` (n, 3), which have their foot on z = 0."""
    points = np.asarray(subject, float)
    if mirror_ball:
        ball = transformed(icosphere(5), placement(BALL, 0.0, BALL[2]))
        points = np.concatenate([points, ball[0]])
        parts = [*parts, Part("Mirror Ball", ball, Surface("Mirror", (0.94, 0.94, 0.95), 1.0, 0.0), smooth=True)]
    slab = plate(points)
    tiles = Surface("Tiles", texture=checker(dark=(0.46, 0.47, 0.5), light=(0.66, 0.66, 0.66)), texture_size=0.6)
    view = frame(np.concatenate([points, slab[0]]), DIRECTION, 60.0, margin=1.06)
    lights = [
        Light("area", (-3.6, -4.0, 5.2), (0, 0, 0.8), power=850, size=2.6, color=(1.0, 0.96, 0.9)),
        Light("area", (5.0, -2.6, 2.6), (0, 0, 0.8), power=240, size=3.0, color=(0.82, 0.9, 1.0)),
        Light("area", (1.5, 4.0, 5.0), (0, 0, 0.8), power=320, size=2.0),
    ]
    camera = View(tuple(view.position), tuple(view.target), 60.0)
    return Stage([Part("Plate", slab, tiles), *parts], lights, camera, world=(0.1, 0.11, 0.13))


def model_stage(source: Mesh, up: str = "z", turn: float = 0.0) -> Stage:
    """One model of any size and place, scaled to 2 m, in the studio."""
    model = standing(source, up, turn)
    part = Part("Model", model, Surface("Clay", (0.72, 0.5, 0.34), roughness=0.5), smooth=True)
    return stage([part], model[0], mirror_ball=False)
