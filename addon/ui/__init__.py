"""Panels. They draw what is there and do no work."""

import bpy

from . import render_panels, viewport_panel

CLASSES = render_panels.CLASSES + viewport_panel.CLASSES


def register() -> None:
    """Register every panel, parents first."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister every panel, children first."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
