"""Image files as arrays, read with ImageMagick, which these tests need for screenshots anyway."""

import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def read(path: Path) -> NDArray[np.uint8]:
    """The picture as (height, width, 3) uint8, as displayed."""
    size = subprocess.run(["identify", "-format", "%w %h", path], capture_output=True, check=True, text=True).stdout
    width, height = map(int, size.split())
    raw = subprocess.run(["convert", path, "-depth", "8", "rgb:-"], capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(height, width, 3)
