"""A closed room with a dense scan in it: every ray hits, and most triangles are in one place. No bpy."""

import numpy as np

from .cornell import quad
from .geometry import Mesh, box, icosphere, join, lathe, mesh, placement, transformed, waves
from .stage import Light, Part, Stage, Surface, View
from .teapot import teapot
from .textures import bricks, planks, speckle

WIDTH, DEPTH, HEIGHT = 6.0, 6.5, 3.2


def scan(seed: int = 0, level: int = 7) -> Mesh:
    """A closed, weathered figure of 20 * 4**level triangles, 1 m high, dense and uneven like a laser scan."""
    random = np.random.default_rng(seed)
    vertices, triangles = icosphere(level)
    sphere = vertices.astype(float)
    twist = 2.2 * sphere[:, 2]
    folds = np.cos(3 * np.arctan2(sphere[:, 1], sphere[:, 0]) + twist) * (1 - sphere[:, 2] ** 2)
    radius = 1 + 0.16 * folds + 0.11 * waves(sphere, random, 1.1, 4) + 0.012 * waves(sphere, random, 0.12, 3)
    neck = 1 - 0.42 * np.exp(-(((sphere[:, 2] - 0.42) / 0.2) ** 2))
    points = sphere * radius[:, None] * np.stack([0.62 * neck, 0.55 * neck, np.ones_like(neck)], axis=1)
    low, high = points[:, 2].min(), points[:, 2].max()
    points[:, 2] -= low
    return mesh(points / (high - low), triangles)


def stage(seed: int) -> Stage:
    """The room from one corner: the scan on its plinth, a mirror behind it, a table with a teapot."""
    x, y, z = WIDTH / 2, DEPTH / 2, HEIGHT
    plaster = Surface("Plaster", texture=speckle(seed, color=(0.8, 0.77, 0.71), contrast=0.06), texture_size=1.0)
    wall = Surface("Bricks", texture=bricks(seed), texture_size=1.2)
    mirror = Surface("Mirror", (0.92, 0.93, 0.95), 1.0, 0.0)
    wood = Surface("Wood", (0.3, 0.17, 0.08), roughness=0.5)
    return Stage(
        parts=[
            Part(
                "Floor",
                quad((-x, -y, 0), (2 * x, 0, 0), (0, 2 * y, 0)),
                Surface("Planks", texture=planks(seed), texture_size=1.2),
            ),
            Part("Ceiling", quad((-x, -y, z), (0, 2 * y, 0), (2 * x, 0, 0)), plaster),
            Part("Back Wall", quad((-x, y, 0), (2 * x, 0, 0), (0, 0, z)), wall),
            Part("Front Wall", quad((x, -y, 0), (-2 * x, 0, 0), (0, 0, z)), wall),
            Part("Left Wall", quad((-x, -y, 0), (0, 2 * y, 0), (0, 0, z)), plaster),
            Part("Right Wall", quad((x, y, 0), (0, -2 * y, 0), (0, 0, z)), plaster),
            Part(
                "Scan",
                transformed(scan(seed), placement((0.35, 0.6, 0.7), 0.6, 1.45)),
                Surface("Stone", (0.72, 0.66, 0.56)),
                True,
            ),
            Part("Plinth", box((-0.15, 0.1, 0), (0.85, 1.1, 0.71)), Surface("Slate", (0.18, 0.19, 0.2))),
            Part("Looking Glass", box((-2.5, y - 0.06, 0.75), (-1.0, y - 0.03, 2.45)), mirror),
            Part("Glass Frame", box((-2.58, y - 0.03, 0.67), (-0.92, y, 2.53)), wood),
            Part("Table", _table((-1.75, 0.6)), wood),
            Part(
                "Teapot",
                transformed(teapot(12), placement((-1.7, 0.6, 0.8), 2.4, 0.12)),
                Surface("Glaze", (0.1, 0.3, 0.45)),
                True,
            ),
            Part("Ball", transformed(icosphere(5), placement((1.75, -0.55, 0.38), 0, 0.38)), mirror, True),
        ],
        lights=[
            Light("area", (-0.9, -1.2, 3.1), (-0.4, 0.2, 0.0), power=130, size=1.2, color=(1.0, 0.9, 0.76)),
            Light("area", (1.6, 1.9, 3.1), (0.6, 0.8, 0.5), power=70, size=0.9, color=(0.85, 0.92, 1.0)),
            Light("area", (2.4, -2.9, 2.6), (-0.3, 1.0, 1.3), power=60, size=1.0),
        ],
        view=View((1.5, -3.0, 1.75), (-0.2, 0.9, 1.2), 24.0),
        world=(0.0, 0.0, 0.0),
    )


def _table(center: tuple[float, float]) -> Mesh:
    leg = lathe([(0, 0), (0.3, 0), (0.28, 0.04), (0.05, 0.1), (0.05, 0.74), (0, 0.74)], 32)
    top = lathe([(0, 0.74), (0.55, 0.74), (0.57, 0.77), (0.55, 0.8), (0, 0.8)], 48)
    return transformed(join([leg, top]), placement((*center, 0.0)))
