"""Areas of the interface: having them drawn again."""

import functools

import bpy

SETTLE_SECONDS = (0.1, 0.4, 1.0)
"""When to draw panels again after their height changed; Blender animates the move for 0.3 s, and may be slow."""


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
