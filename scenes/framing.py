"""Where to put a perspective camera so that points fill its frame. No bpy."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

SENSOR_MM = 36.0
"""Blender's default sensor, spanned by the longer side of the frame (sensor fit "auto")."""


class Frame(NamedTuple):
    """A camera's place, the point it looks at, and its distance from it in metres."""

    position: NDArray[np.float64]
    target: NDArray[np.float64]
    distance: float


def axes(backward: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) matrix whose columns are a camera's right, up and backward axes in the world; up leans towards +z."""
    back = np.asarray(backward, float) / np.linalg.norm(backward)
    reference = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(reference, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)


def camera_to_world(position: ArrayLike, target: ArrayLike) -> NDArray[np.float64]:
    """(4, 4) matrix of a camera or lamp at `position` that looks along its -Z at `target`."""
    matrix = np.eye(4)
    matrix[:3, :3] = axes(np.asarray(position, float) - np.asarray(target, float))
    matrix[:3, 3] = position
    return matrix


def frame(points: ArrayLike, backward: ArrayLike, lens: float, aspect: float = 1.0, margin: float = 1.08) -> Frame:
    """The nearest camera in direction `backward` from the points' middle that has all of them in its frame.

    points (n, 3) in metres; lens in mm; aspect width / height; margin scales the points' extent in the frame.
    """
    world = np.asarray(points, float).reshape(-1, 3)
    target = (world.min(axis=0) + world.max(axis=0)) / 2
    right, up, back = axes(backward).T @ (world - target).T
    slope = SENSOR_MM / 2 / lens
    slope_x, slope_y = slope * min(1.0, aspect), slope * min(1.0, 1.0 / aspect)
    needed = np.maximum(np.abs(right) / slope_x, np.abs(up) / slope_y) * margin + back
    distance = max(float(needed.max()), 1e-6)
    return Frame(target + axes(backward)[:, 2] * distance, target, distance)
