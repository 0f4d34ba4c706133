"""Areas of the interface: drawing them again, and showing an image in the Image Editors that are free for it."""

import functools

import bpy
import numpy as np
from numpy.typing import NDArray

SETTLE_SECONDS = (0.1, 0.4, 1.0)
"""When to draw panels again after their height changed; Blender animates the move for 0.3 s, and may be slow."""

MARK = "espalier"
"""Custom property of the images made here."""


def redraw(kinds: frozenset[str]) -> None:
    """Have every area of the given types, in every window, drawn again. Does nothing where there is no window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in kinds:
                area.tag_redraw()


def redraw_settled(kinds: frozenset[str]) -> None:
    """Redraw for changes of a panel's height: Blender moves the panels below only in the draws that follow."""
    redraw(kinds)
    if not bpy.app.background:
        for seconds in SETTLE_SECONDS:
            bpy.app.timers.register(functools.partial(redraw, kinds), first_interval=seconds)


def store_image(name: str, pixels: NDArray[np.float32]) -> bpy.types.Image:
    """Put pixels (h, w, 4), scene-linear, rows bottom-up, into the image datablock `name`, shown as a render is."""
    return _store(name, pixels, is_float=True)


def store_picture(name: str, picture: NDArray[np.uint8]) -> bpy.types.Image:
    """Put a picture (h, w, 3), sRGB as the screen shows it, rows bottom-up, into the image datablock `name`.

    Eight bits a channel: the picture has no more, and the view transform is in it already.
    """
    height, width = picture.shape[:2]
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = picture / np.float32(255)
    return _store(name, rgba, is_float=False)


def _store(name: str, pixels: NDArray[np.float32], *, is_float: bool) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = _own_image(name)
    if image is None or image.is_float != is_float:
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
        image[MARK] = name
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.use_view_as_render = is_float
    image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).reshape(-1))
    image.update()
    return image


def _own_image(name: str) -> bpy.types.Image | None:
    """The image made here under this name. One that the user gave another name to, or made himself, is his."""
    images = (image for image in bpy.data.images if image.get(MARK) == name)
    return next((image for image in images if image.source == "GENERATED" and image.name.startswith(name)), None)


def show_image(image: bpy.types.Image) -> None:
    """Show the image in every open Image Editor, but those whose image the user pinned, paints on or edits masks of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.ui_type == "IMAGE_EDITOR" and space.mode == "VIEW" and not space.use_image_pin:
                _show(image, window, area)


def _show(image: bpy.types.Image, window: bpy.types.Window, area: bpy.types.Area) -> None:
    """Show the image in an Image Editor, all of it where the editor showed another."""
    space = area.spaces.active
    if space.image != image:
        space.image = image
        region = next(region for region in area.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.image.view_all(fit_view=True)
    area.tag_redraw()
