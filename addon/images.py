"""Pictures of a comparison: the map of differences in colour, the composite, and PNG files. No bpy.

Pictures are (h, w, 3) uint8, display-referred, rows bottom-up as Blender has them.
"""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

MAGMA = np.array(
    [
        (0, 0, 4), (28, 16, 68), (79, 18, 123), (129, 37, 129), (181, 54, 122),
        (229, 80, 100), (251, 135, 97), (254, 194, 135), (252, 253, 191),
    ],
    np.float64,
)  # fmt: skip
"""Nine even steps of magma (Smith, van der Walt 2015; CC0), whose lightness grows evenly: FLIP's own colours."""

BACKGROUND = 26
GAP = 8
"""Pixels between the pictures of the composite."""


def difference_colors(difference: NDArray[np.float32]) -> Picture:
    """Differences (h, w) in 0..1 as colours, from nearly black to pale yellow."""
    position = np.clip(difference, 0.0, 1.0) * (len(MAGMA) - 1)
    steps = np.arange(len(MAGMA))
    return np.stack([np.interp(position, steps, MAGMA[:, c]) for c in range(3)], axis=-1).round().astype(np.uint8)


def composite(ours: Picture, cycles: Picture, difference: Picture) -> Picture:
    """Ours left, Cycles right, the difference below in the middle, beside it the scale of its colours.

    All three have one shape. Raises ValueError where they do not.
    """
    if not ours.shape == cycles.shape == difference.shape:
        raise ValueError(f"pictures differ in shape: {ours.shape}, {cycles.shape}, {difference.shape}")
    height, width = ours.shape[:2]
    canvas = np.full((2 * height + GAP, 2 * width + GAP, 3), BACKGROUND, np.uint8)
    canvas[height + GAP :, :width] = ours
    canvas[height + GAP :, width + GAP :] = cycles
    left = (width + GAP) // 2
    canvas[:height, left : left + width] = difference
    bar_left = left + width + GAP
    bar_width = min(max(width // 40, 4), max(canvas.shape[1] - bar_left, 0))
    scale = difference_colors(np.linspace(0, 1, height, dtype=np.float32)[:, None])
    canvas[:height, bar_left : bar_left + bar_width] = scale
    return canvas


def write_png(path: Path, picture: Picture) -> None:
    """Write a picture as a PNG file."""
    path.write_bytes(png(picture))


def png(picture: Picture) -> bytes:
    """A picture as an 8-bit RGB PNG (W3C PNG 3rd edition; every row unfiltered)."""
    height, width = picture.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = picture[::-1].reshape(height, 3 * width)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b""))
    parts = [b"\x89PNG\r\n\x1a\n"]
    for kind, data in chunks:
        parts += [struct.pack(">I", len(data)), kind, data, struct.pack(">I", zlib.crc32(kind + data))]
    return b"".join(parts)
