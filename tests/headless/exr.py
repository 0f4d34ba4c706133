"""Reads the multilayer OpenEXR files that Blender writes without compression; Blender itself does not give them back.

Follows the file layout of OpenEXR's documentation: single part, scan lines, channels in alphabetical order.
"""

import struct
from pathlib import Path

import numpy as np

PIXEL_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}


def read(path: Path) -> dict[str, np.ndarray]:
    """Every channel by its name, such as 'ViewLayer.Combined.R', as (h, w) float32 with rows bottom-up."""
    data = path.read_bytes()
    header, start = _header(data)
    channels = _channels(header["channels"])
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    assert header["compression"] == b"\0", "write the file without compression"
    width, height = right - left + 1, bottom - top + 1
    images = {name: np.empty((height, width), np.float32) for name, _ in channels}
    for offset in np.frombuffer(data, "<u8", height, start):
        line = struct.unpack_from("<i", data, offset)[0] - top
        position = int(offset) + 8
        for name, dtype in channels:
            images[name][height - 1 - line] = np.frombuffer(data, dtype, width, position)
            position += width * dtype.itemsize
    return images


def layer_pass(images: dict[str, np.ndarray], layer: str, name: str) -> np.ndarray:
    """(h, w, channels) of one pass, its channels in the order of their usual letters."""
    prefix = f"{layer}.{name}."
    found = {channel[len(prefix) :]: image for channel, image in images.items() if channel.startswith(prefix)}
    return np.stack([found[letter] for letter in sorted(found, key="RGBXYZVA".index)], axis=2)


def _header(data: bytes) -> tuple[dict[str, bytes], int]:
    """Attributes by name, and where the table of lines begins."""
    assert data[:4] == b"\x76\x2f\x31\x01", "not an OpenEXR file"
    attributes, position = {}, 8
    while data[position]:
        name, position = _string(data, position)
        _, position = _string(data, position)
        (size,) = struct.unpack_from("<i", data, position)
        attributes[name] = data[position + 4 : position + 4 + size]
        position += 4 + size
    return attributes, position + 1


def _channels(data: bytes) -> list[tuple[str, np.dtype]]:
    channels, position = [], 0
    while data[position]:
        name, position = _string(data, position)
        channels.append((name, PIXEL_TYPES[struct.unpack_from("<i", data, position)[0]]))
        position += 16
    return channels


def _string(data: bytes, position: int) -> tuple[str, int]:
    end = data.index(b"\0", position)
    return data[position:end].decode(), end + 1
