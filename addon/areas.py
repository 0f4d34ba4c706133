"""Areas of the interface: drawing them again, and showing an image in the Image Editors that are free for it."""

import bpy
import numpy as np
from numpy.typing import NDArray


def redraw(kinds: frozenset[str]) -> None:
    """Have every area of the given types, in every window, drawn again. Does nothing where there is no window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in kinds:
                area.tag_redraw()


def store_image(name: str, pixels: NDArray[np.float32]) -> bpy.types.Image:
    """Put pixels (h, w, 4), scene-linear, rows bottom-up, into the image datablock `name`, made where it is missing.

    An image of that name which is a file or a render result of the user's is left alone: ours is then `name.001`.
    """
    height, width = pixels.shape[:2]
    image = bpy.data.images.get(name)
    if image is None or image.source != "GENERATED":
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
        image.use_view_as_render = True
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).reshape(-1))
    image.update()
    return image


def show_image(image: bpy.types.Image) -> None:
    """Show the image in every open Image Editor, but those whose image the user pinned, paints on or edits masks of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.ui_type == "IMAGE_EDITOR" and space.mode == "VIEW" and not space.use_image_pin:
                space.image = image
                area.tag_redraw()
