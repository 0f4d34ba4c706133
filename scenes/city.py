"""A city: axis-aligned walls, large and small triangles side by side, most of space empty. No bpy."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, box, join, mesh, plane
from .stage import Light, Part, Stage, Surface, View
from .textures import bricks, speckle

BLOCKS = 9
BLOCK, STREET = 44.0, 14.0
FLOOR = 3.4
"""Edge of a block, width of a street, height of a storey, metres."""


class Building(NamedTuple):
    """A footprint (x0, y0, x1, y1) in metres and a number of storeys."""

    footprint: tuple[float, float, float, float]
    floors: int

    @property
    def height(self) -> float:
        """Height of the roof above the ground, metres."""
        return self.floors * FLOOR + 0.8

    def walls(self) -> Mesh:
        """The body, from 0.2 m below the pavement."""
        x0, y0, x1, y1 = self.footprint
        return box((x0, y0, -0.2), (x1, y1, self.height))

    def roof(self, random: np.random.Generator) -> Mesh:
        """A parapet-high machine house somewhere on the roof."""
        x0, y0, x1, y1 = self.footprint
        width, depth = (x1 - x0) * random.uniform(0.2, 0.5), (y1 - y0) * random.uniform(0.2, 0.5)
        x, y = random.uniform(x0, x1 - width), random.uniform(y0, y1 - depth)
        return box((x, y, self.height), (x + width, y + depth, self.height + random.uniform(1.5, 4.0)))

    def windows(self) -> Mesh:
        """Two triangles for every window of every storey, 3 cm before the wall."""
        x0, y0, x1, y1 = self.footprint
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        return join([self._facade(np.array(corners[i]), np.array(corners[(i + 1) % 4])) for i in range(4)])

    def _facade(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> Mesh:
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        bays = max(1, round(length / 3.2))
        origin = start + np.array([along[1], -along[0]]) * 0.03
        s0 = (np.arange(bays) + 0.18) * length / bays
        s1 = (np.arange(bays) + 0.82) * length / bays
        z0 = np.arange(self.floors) * FLOOR + 1.2
        s = np.stack([s0, s1, s1, s0], axis=1)[None]
        z = np.stack([z0, z0, z0 + 1.7, z0 + 1.7], axis=1)[:, None]
        s, z = np.broadcast_arrays(s, z)
        corners = np.concatenate([origin + s[..., None] * along, z[..., None]], axis=-1).reshape(-1, 3)
        quads = np.arange(len(corners)).reshape(-1, 4)
        return mesh(corners, quads[:, [0, 1, 2, 0, 2, 3]])


def buildings(seed: int = 0) -> list[Building]:
    """One to four buildings on each block, higher towards the middle, one block in nine left as a square."""
    random = np.random.default_rng(seed)
    found = []
    for row in range(BLOCKS):
        for column in range(BLOCKS):
            corner = (np.array([column, row]) - BLOCKS / 2) * (BLOCK + STREET) + STREET / 2
            nearness = 1 - np.linalg.norm(corner + BLOCK / 2) / (BLOCKS * (BLOCK + STREET) * 0.72)
            if random.random() > 1 / 9:
                found += _block(random, corner, max(0.0, float(nearness)))
    return found


def _block(random: np.random.Generator, corner: NDArray[np.float64], nearness: float) -> list[Building]:
    cuts_x = [0.0, BLOCK] if random.random() < 0.3 else [0.0, BLOCK * random.uniform(0.4, 0.6), BLOCK]
    cuts_y = [0.0, BLOCK] if random.random() < 0.3 else [0.0, BLOCK * random.uniform(0.4, 0.6), BLOCK]
    found = []
    for x0, x1 in pairwise(cuts_x):
        for y0, y1 in pairwise(cuts_y):
            low = corner + np.array([x0, y0]) + random.uniform(1.5, 4.0, 2)
            high = corner + np.array([x1, y1]) - random.uniform(1.5, 4.0, 2)
            floors = int(3 + random.exponential(5 + 26 * nearness**2.5))
            found.append(Building((*low, *high), min(floors, 55)))
    return found


def cars(seed: int = 0, count: int = 500) -> Mesh:
    """Cars of two boxes in the streets."""
    random = np.random.default_rng(seed)
    span, step = BLOCKS * (BLOCK + STREET) / 2, BLOCK + STREET
    found = []
    for _ in range(count):
        lane = (random.integers(BLOCKS) - BLOCKS / 2) * step + random.choice([-2.4, 2.4])
        at = random.uniform(-span, span)
        body, cabin = np.array([[-2.2, -0.9], [2.2, 0.9]]), np.array([[-1.3, -0.8], [1.0, 0.8]])
        center = np.array([at, lane])
        if random.random() < 0.5:
            body, cabin, center = body[:, ::-1], cabin[:, ::-1], center[::-1]
        found += [box((*(body[0] + center), 0.3), (*(body[1] + center), 0.9))]
        found += [box((*(cabin[0] + center), 0.9), (*(cabin[1] + center), 1.5))]
    return join(found)


def stage(seed: int) -> Stage:
    """The city from the air in the afternoon."""
    random = np.random.default_rng(seed)
    houses = buildings(seed)
    groups = [houses[index::3] for index in range(3)]
    facades = [
        Surface("Brick", texture=bricks(seed), texture_size=2.0),
        Surface("Sandstone", (0.62, 0.53, 0.4)),
        Surface("Concrete", texture=speckle(seed, color=(0.66, 0.66, 0.66), contrast=0.12), texture_size=6.0),
    ]
    ground = Surface("Asphalt", texture=speckle(seed, color=(0.27, 0.28, 0.3), contrast=0.2), texture_size=8.0)
    return Stage(
        parts=[
            Part("Ground", plane(1600.0, 8), ground),
            Part("Pavements", _pavements(), Surface("Pavement", (0.42, 0.41, 0.39))),
            *[
                Part(f"Walls {facade.name}", join([house.walls() for house in group]), facade)
                for facade, group in zip(facades, groups, strict=True)
            ],
            Part("Windows", join([house.windows() for house in houses]), Surface("Glass", (0.5, 0.6, 0.7), 1.0, 0.05)),
            Part(
                "Roof Houses",
                join([house.roof(random) for house in houses]),
                Surface("Metal Sheet", (0.35, 0.36, 0.38)),
            ),
            Part("Cars", cars(seed), Surface("Car Paint", (0.55, 0.04, 0.03))),
        ],
        lights=[
            Light("sun", (-60, -45, 70), power=3.6, size=1.0, color=(1.0, 0.92, 0.8)),
            Light("sun", (40, -60, 60), power=0.7, size=30.0, color=(0.75, 0.86, 1.0)),
        ],
        view=View((-205, -300, 165), (8, 10, 18), 35.0, clip=(1.0, 4000.0)),
        world=(0.5, 0.66, 0.9),
    )


def _pavements() -> Mesh:
    slabs = []
    for row in range(BLOCKS):
        for column in range(BLOCKS):
            x, y = (np.array([column, row]) - BLOCKS / 2) * (BLOCK + STREET) + STREET / 2
            slabs.append(box((x, y, -0.2), (x + BLOCK, y + BLOCK, 0.15)))
    return join(slabs)
