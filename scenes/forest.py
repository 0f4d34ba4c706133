"""A forest: few meshes, many instances, thin leaves that overlap in space. No bpy."""

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, join, lathe, mesh, plane, transformed
from .geometry import placement as place
from .stage import Light, Part, Stage, Surface, View
from .textures import speckle

HALF = 60.0
"""Half the edge of the ground, metres."""


def ground_height(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rolling ground, metres."""
    return 1.3 * np.sin(x / 13 + 0.6) * np.cos(y / 17) + 0.5 * np.sin(x / 5 + y / 7) + 0.0009 * (x**2 + y**2)


def conifer(seed: int = 0, tiers: int = 14, points: int = 26) -> Mesh:
    """The needles of a conifer about 9 m high: star-shaped cones stacked on each other."""
    random = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, 2 * points + 1)[:-1]
    found = []
    for tier in range(tiers):
        up = tier / (tiers - 1)
        base, reach = 1.2 + 7.0 * up, (2.3 * (1 - up) + 0.25) * random.uniform(0.9, 1.1)
        radius = reach * np.where(np.arange(2 * points) % 2, 0.55, random.uniform(0.85, 1.15, 2 * points))
        drop = np.where(np.arange(2 * points) % 2, 0.1, -0.25) * (1.4 - up)
        rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), base + drop], axis=1)
        corners = np.concatenate([rim, [[0, 0, base + 1.5 - 0.4 * up]], [[0, 0, base + 0.45]]])
        here, there = np.arange(2 * points), np.roll(np.arange(2 * points), -1)
        top, under = np.full_like(here, 2 * points), np.full_like(here, 2 * points + 1)
        faces = np.concatenate([np.stack([here, there, top], 1), np.stack([there, here, under], 1)])
        found.append(transformed(mesh(corners, faces), place((0, 0, 0), random.uniform(0, 2 * np.pi))))
    return join(found)


def foliage(seed: int = 0, leaves: int = 1500, height: float = 5.2, radius: float = 2.1) -> Mesh:
    """The leaves of a broadleaf tree: pointed quads through a few overlapping balls."""
    random = np.random.default_rng(seed)
    balls = np.concatenate([[[0, 0, height]], [0, 0, height] + random.normal(0, 0.9, (6, 3)) * [1, 1, 0.7]])
    outward = random.normal(size=(leaves, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    reach = radius * 0.62 * random.uniform(0.75, 1.05, (leaves, 1))
    center = balls[random.integers(len(balls), size=leaves)] + outward * reach
    tilt = outward + random.normal(0, 0.45, (leaves, 3))
    side = np.cross(tilt, random.normal(size=(leaves, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    along = np.cross(tilt / np.linalg.norm(tilt, axis=1, keepdims=True), side)
    size = random.uniform(0.13, 0.24, (leaves, 1))
    corners = np.stack(
        [center - along * size, center + side * size * 0.6, center + along * size, center - side * size * 0.6], 1
    )
    return mesh(corners, np.arange(4 * leaves).reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]])


def trunk(height: float, radius: float) -> Mesh:
    """A tapering stem with a wider foot."""
    profile = [(radius * 1.6, -0.6), (radius * 1.1, 0.25), (radius * 0.8, height * 0.6), (0.0, height)]
    return lathe(profile, 12)


def tuft(seed: int = 0, blades: int = 22) -> Mesh:
    """Grass: single triangles that lean out of one spot, about 0.3 m high."""
    random = np.random.default_rng(seed)
    turn = random.uniform(0, 2 * np.pi, blades)
    lean = random.uniform(0.05, 0.22, blades)
    foot = random.normal(0, 0.05, (blades, 2))
    across = np.stack([-np.sin(turn), np.cos(turn)], 1) * 0.012
    tip = foot + np.stack([np.cos(turn), np.sin(turn)], 1) * lean[:, None]
    flat = np.zeros((blades, 1))
    high = random.uniform(0.16, 0.34, (blades, 1))
    corners = np.stack([np.c_[foot - across, flat], np.c_[foot + across, flat], np.c_[tip, high]], 1)
    return mesh(corners, np.arange(3 * blades))


def tree_places(seed: int = 0, spacing: float = 5.4) -> NDArray[np.float64]:
    """(k, 4, 4) placements on a jittered lattice, with a clearing in the foreground."""
    random = np.random.default_rng(seed)
    lattice = np.arange(-HALF + 6, HALF - 6, spacing)
    spots = np.stack(np.meshgrid(lattice, lattice), -1).reshape(-1, 2)
    spots = spots + random.uniform(-0.36, 0.36, spots.shape) * spacing
    clearing = np.hypot(spots[:, 0] / 0.9, spots[:, 1] + 33) < 15
    return _places(random, spots[~clearing], 0.75, 1.3)


def grass_places(seed: int = 0, count: int = 5000) -> NDArray[np.float64]:
    """(count, 4, 4) placements in the clearing, denser near the camera."""
    random = np.random.default_rng(seed)
    ahead = 26 * random.uniform(0, 1, count) ** 1.6
    spots = np.stack([random.uniform(-0.75, 0.75, count) * (3 + ahead), ahead - 40], 1)
    return _places(random, spots, 0.7, 1.7)


def _places(random: np.random.Generator, spots: NDArray[np.float64], least: float, most: float) -> NDArray[np.float64]:
    turns = random.uniform(0, 2 * np.pi, len(spots))
    scales = random.uniform(least, most, len(spots))
    heights = ground_height(*spots.T)
    rows = zip(spots, heights, turns, scales, strict=True)
    return np.stack([place((*spot, height), turn, scale) for spot, height, turn, scale in rows])


def stage(seed: int) -> Stage:
    """A clearing at the edge of a mixed wood."""
    random = np.random.default_rng(seed)
    places = tree_places(seed)
    kind = random.choice(3, len(places), p=[0.5, 0.3, 0.2])
    firs, oaks, birches = (places[kind == index] for index in range(3))
    bark, soil = Surface("Bark", (0.17, 0.1, 0.06)), speckle(seed, color=(0.32, 0.34, 0.17))
    return Stage(
        parts=[
            Part("Ground", plane(HALF, 96, ground_height), Surface("Soil", texture=soil, texture_size=3.0), True),
            Part("Fir Trunk", trunk(8.0, 0.2), bark, True, firs),
            Part("Fir Needles", conifer(seed), Surface("Needles", (0.035, 0.12, 0.045)), False, firs),
            Part("Oak Trunk", trunk(6.0, 0.24), bark, True, oaks),
            Part("Oak Leaves", foliage(seed), Surface("Oak Leaves", (0.13, 0.25, 0.04)), False, oaks),
            Part("Birch Trunk", trunk(7.0, 0.12), Surface("Birch Bark", (0.7, 0.68, 0.62)), True, birches),
            Part(
                "Birch Leaves",
                foliage(seed + 1, 1200, 6.0, 1.7),
                Surface("Birch Leaves", (0.42, 0.4, 0.06)),
                False,
                birches,
            ),
            Part("Grass", tuft(seed), Surface("Grass", (0.16, 0.3, 0.05)), False, grass_places(seed), "nodes"),
        ],
        lights=[
            Light("sun", (-45, -50, 55), power=3.8, size=1.0, color=(1.0, 0.93, 0.8)),
            Light("sun", (40, -45, 40), power=0.9, size=30.0, color=(0.75, 0.87, 1.0)),
        ],
        view=View((0.0, -43.0, 5.6), (0.0, -18.0, 4.9), 38.0, clip=(0.1, 400.0)),
        world=(0.45, 0.62, 0.88),
    )
