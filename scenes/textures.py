"""Small tiling textures from numpy. No bpy.

Each is (size, size, 3) float32, display-referred sRGB in 0..1, rows bottom-up, and repeats without a seam.
"""

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Color = tuple[float, float, float]


def checker(
    size: int = 256, tiles: int = 2, dark: Color = (0.32, 0.34, 0.37), light: Color = (0.78, 0.77, 0.74)
) -> Float32:
    """A chess board of tiles * tiles fields."""
    step = np.arange(size) * tiles // size
    odd = (step[:, None] + step) % 2
    return np.where(odd[..., None] == 1, light, dark).astype(np.float32)


def bricks(seed: int = 0, size: int = 256, rows: int = 8) -> Float32:
    """Running bond: rows of bricks twice as long as high, each brick in its own shade, mortar between."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] * (rows / size)
    row = y.astype(int)
    along = (x / 2 + row % 2 / 2) % (rows // 2)
    mortar = (y % 1 < 0.1) | (along % 1 < 0.05)
    shade = random.uniform(0.75, 1.1, (rows, rows // 2))[row, along.astype(int)]
    color = np.array([0.62, 0.33, 0.25]) * shade[..., None]
    return np.where(mortar[..., None], [0.7, 0.68, 0.64], color).astype(np.float32)


def planks(seed: int = 0, size: int = 256, boards: int = 6) -> Float32:
    """Wooden boards along y with grain."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size
    board = (x * boards).astype(int)
    offset = random.uniform(0, 1, boards)[board]
    grain = np.sin(2 * np.pi * (14 * x + 0.25 * np.sin(2 * np.pi * (y + offset)) + offset))
    shade = random.uniform(0.8, 1.05, boards)[board] + 0.05 * grain
    joint = (x * boards % 1 < 0.03) | (np.abs((y + offset) % 1 - 0.5) < 0.004)
    color = np.array([0.66, 0.47, 0.3]) * shade[..., None]
    return np.where(joint[..., None], color * 0.45, color).clip(0, 1).astype(np.float32)


def speckle(seed: int = 0, size: int = 256, color: Color = (0.36, 0.44, 0.24), contrast: float = 0.35) -> Float32:
    """Noise about one colour, smoothed once over neighbours: grass, asphalt, plaster."""
    noise = np.random.default_rng(seed).uniform(-1, 1, (size, size))
    for axis in (0, 1):
        noise = (noise + np.roll(noise, 1, axis) + np.roll(noise, -1, axis)) / 3
    return (np.array(color) * (1 + contrast * noise[..., None])).clip(0, 1).astype(np.float32)
