"""A photographer's corner for one object: a curved backdrop, a key, a fill and a rim light. No bpy."""

import numpy as np
from numpy.typing import ArrayLike

from .framing import frame
from .geometry import Mesh, icosphere, mesh, placement, sheet, transformed
from .stage import Light, Part, Stage, Surface, View
from .textures import checker

DIRECTION = (0.42, -1.0, 0.42)
"""From the object towards the camera."""

BALL = (1.3, -0.35, 0.33)
"""Middle of the mirror ball, which stands on the floor, metres."""


def backdrop(half: float = 14.0, radius: float = 3.0, wall: float = 9.0) -> Mesh:
    """A floor at z = 0 that bends upwards at the back (+y) without an edge."""
    bend = np.linspace(0, np.pi / 2, 17)
    y = np.concatenate([np.linspace(-half, 5.0, 12)[:-1], 5.0 + radius * np.sin(bend), [5.0 + radius]])
    z = np.concatenate([np.zeros(11), radius * (1 - np.cos(bend)), [wall]])
    x = np.linspace(-half, half, 3)
    net = np.stack(np.broadcast_arrays(x[None, :], y[:, None], z[:, None]), axis=-1)
    return sheet(net)


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
    """The parts in the studio, the camera framed on the points `subject` (n, 3)."""
    floor = checker(dark=(0.46, 0.47, 0.5), light=(0.62, 0.62, 0.62))
    parts = [Part("Backdrop", backdrop(), Surface("Backdrop", texture=floor, texture_size=2.0)), *parts]
    if mirror_ball:
        ball = transformed(icosphere(5), placement(BALL, 0.0, BALL[2]))
        subject = np.concatenate([np.asarray(subject), ball[0]])
        parts.append(Part("Mirror Ball", ball, Surface("Mirror", (0.94, 0.94, 0.95), 1.0, 0.0), smooth=True))
    view = frame(subject, DIRECTION, 60.0, margin=1.12)
    lights = [
        Light("area", (-3.6, -4.0, 5.2), (0, 0, 0.8), power=850, size=2.6, color=(1.0, 0.96, 0.9)),
        Light("area", (5.0, -2.6, 2.6), (0, 0, 0.8), power=240, size=3.0, color=(0.82, 0.9, 1.0)),
        Light("area", (1.5, 4.0, 5.0), (0, 0, 0.8), power=320, size=2.0),
    ]
    return Stage(parts, lights, View(tuple(view.position), tuple(view.target), 60.0), world=(0.2, 0.22, 0.25))


def model_stage(source: Mesh, up: str = "z", turn: float = 0.0) -> Stage:
    """One model of any size and place, scaled to 2 m, in the studio."""
    model = standing(source, up, turn)
    part = Part("Model", model, Surface("Clay", (0.72, 0.5, 0.34), roughness=0.5), smooth=True)
    return stage([part], model[0], mirror_ball=False)
