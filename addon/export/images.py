"""Reads Blender images as scene-linear pixels.

So they are filtered after they are linear, as in EEVEE. Cycles filters sRGB bytes first, which magnified pixels show.
"""

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..scene_data import Color, Float32, TextureData
from .notes import Notes

LINEAR_SPACES = {"Linear Rec.709", "Linear", "Non-Color", "Raw"}
SRGB_SPACES = {"sRGB"}
INTERPOLATIONS = {"Linear": "linear", "Closest": "closest"}
EXTENSIONS = {"REPEAT": "repeat", "EXTEND": "extend", "CLIP": "clip"}


class Images:
    """Every image texture of an export. Pixels are read once an image, however many nodes use it."""

    def __init__(self, notes: Notes) -> None:
        self.textures: list[TextureData] = []
        self._notes = notes
        self._pixels: dict[str, Float32 | None] = {}
        self._indices: dict[tuple[str, str, str], int] = {}

    def texture(self, node: Any) -> int | None:
        """Index into `textures` of an Image Texture node; None where its image is missing, which is noted."""
        pixels = self._read(node.image)
        if pixels is None:
            return None
        name = node.image.name_full
        interpolation = self._known(INTERPOLATIONS, node.interpolation, "linear", "interpolation", name)
        extension = self._known(EXTENSIONS, node.extension, "repeat", "extension", name)
        key = (name, interpolation, extension)
        if key not in self._indices:
            self._indices[key] = len(self.textures)
            self.textures.append(TextureData(name, pixels, interpolation, extension))
        return self._indices[key]

    def mean_color(self, image: Any) -> Color | None:
        """The mean scene-linear colour of an image; None where it is missing, which is noted."""
        pixels = self._read(image)
        if pixels is None:
            return None
        red, green, blue = pixels[..., :3].mean(axis=(0, 1), dtype=np.float64)
        return float(red), float(green), float(blue)

    def _known(self, table: dict[str, str], value: str, fallback: str, what: str, image: str) -> str:
        if value not in table:
            self._notes.add(f"Image '{image}': {what} {value.title()} is traced as {fallback.title()}")
        return table.get(value, fallback)

    def _read(self, image: Any) -> Float32 | None:
        if image is None:
            self._notes.add("An Image Texture node has no image and is traced as pink: choose an image")
            return None
        if image.name_full not in self._pixels:
            self._pixels[image.name_full] = self._read_pixels(image)
        return self._pixels[image.name_full]

    def _read_pixels(self, image: Any) -> Float32 | None:
        if image.source in {"SEQUENCE", "MOVIE", "TILED"}:
            self._notes.add(f"Image '{image.name}': only the {_part(image.source)} is traced")
        with _as_it_was(image):
            width, height = image.size
            if width * height == 0 or image.channels == 0:
                self._notes.add(
                    f"Image '{image.name}' is missing and is traced as pink: relink {image.filepath or 'it'}"
                )
                return None
            pixels = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(pixels)
            return self._linear(image, _four_channels(pixels.reshape(height, width, -1)))

    def _linear(self, image: Any, pixels: Float32) -> Float32:
        """Scene-linear pixels. Blender has converted float images when it loaded them, byte images not."""
        space = image.colorspace_settings
        if image.is_float or space.name in LINEAR_SPACES or space.is_data:
            return pixels
        if space.name not in SRGB_SPACES:
            self._notes.add(f"Image '{image.name}': color space {space.name} is traced as sRGB")
        pixels[..., :3] = SRGB_TO_LINEAR[np.rint(pixels[..., :3] * 255.0).astype(np.uint8)]
        return pixels


def _srgb_table() -> Float32:
    """Scene-linear value of each of the 256 byte values of sRGB (IEC 61966-2-1)."""
    encoded = np.arange(256) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)


SRGB_TO_LINEAR = _srgb_table()


def _part(source: str) -> str:
    return "first tile" if source == "TILED" else "frame that is loaded"


def _four_channels(pixels: Float32) -> Float32:
    """(h, w, 4) pixels of an image with 1 to 4 channels: grey is repeated, alpha is 1 where there is none."""
    channels = pixels.shape[2]
    if channels == 4:
        return pixels
    full = np.ones((*pixels.shape[:2], 4), np.float32)
    full[..., :3] = pixels[..., :3] if channels == 3 else pixels[..., :1]
    return full


@contextlib.contextmanager
def _as_it_was(image: Any) -> Iterator[None]:
    """Frees pixels that were loaded only to be read, so that an export leaves the memory of images as it was."""
    loaded = image.has_data
    try:
        yield
    finally:
        if not loaded and image.has_data and not image.is_dirty and image.source in {"FILE", "TILED"}:
            image.buffers_free()
