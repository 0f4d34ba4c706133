"""The image datablocks that hold our pictures, shown in the Image Editors that are free for them.

A picture makes no undo step, as nothing of the scene changes; so an undo would take its datablock away with the step
before. It is put back then: undo must not cost a picture that took minutes.
"""

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

MARK = "espalier"
"""Custom property of the images made here."""

_kept: dict[str, NDArray[Any]] = {}
"""What was last stored under each name."""
_before_undo: set[str] = set()
"""The names whose image was there when an undo began."""


def store(name: str, pixels: NDArray[Any]) -> bpy.types.Image:
    """Put a picture, rows bottom-up, into the image datablock `name`, made where it is missing.

    float32 (h, w, 4) is scene-linear, and shown as a render is. uint8 (h, w, 3) is sRGB as the screen shows it, with
    the view transform in it already. An image of the user's that has the name is left alone: ours is `name.001`.
    """
    _kept[name] = pixels
    is_float = pixels.dtype == np.float32
    height, width = pixels.shape[:2]
    image = _own(name)
    if image is None or image.is_float != is_float:
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
        image[MARK] = name
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.use_view_as_render = is_float
    image.pixels.foreach_set((pixels if is_float else _rgba(pixels)).reshape(-1))
    image.update()
    return image


def show(image: bpy.types.Image, *, only_empty: bool = False) -> None:
    """Show the image in every open Image Editor, but those whose image the user pinned, paints on or edits masks of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            is_free = area.ui_type == "IMAGE_EDITOR" and space.mode == "VIEW" and not space.use_image_pin
            if is_free and (space.image is None or not only_empty):
                _show(image, window, area)


def clear() -> None:
    """Forget what was stored; the images stay."""
    _kept.clear()


def _show(image: bpy.types.Image, window: bpy.types.Window, area: bpy.types.Area) -> None:
    """Show the image in an Image Editor, all of it where the editor showed another."""
    space = area.spaces.active
    if space.image != image:
        space.image = image
        region = next(region for region in area.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.image.view_all(fit_view=True)
    area.tag_redraw()


def _rgba(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    rgba = np.ones((*picture.shape[:2], 4), np.float32)
    rgba[..., :3] = picture / np.float32(255)
    return rgba


def _own(name: str) -> bpy.types.Image | None:
    """The image made here under this name. One that the user gave another name to, or made himself, is his."""
    images = (image for image in bpy.data.images if image.get(MARK) == name)
    return next((image for image in images if image.source == "GENERATED" and image.name.startswith(name)), None)


@bpy.app.handlers.persistent
def _on_undo_begin(*_arguments: object) -> None:
    _before_undo.clear()
    _before_undo.update(name for name in _kept if _own(name) is not None)


@bpy.app.handlers.persistent
def _on_undo_end(*_arguments: object) -> None:
    for name in _before_undo:
        if _own(name) is None:
            show(store(name, _kept[name]), only_empty=True)


@bpy.app.handlers.persistent
def _on_load(*_arguments: object) -> None:
    clear()


HANDLERS = {
    "undo_pre": _on_undo_begin,
    "undo_post": _on_undo_end,
    "redo_pre": _on_undo_begin,
    "redo_post": _on_undo_end,
    "load_pre": _on_load,
}


def register() -> None:
    """Watch undo and file loads."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop watching, and forget what was stored."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    clear()
