"""Operators, one verb a file."""

import bpy

from .. import results
from . import build_trace, cancel, clear_results, compare, study

CLASSES = build_trace.CLASSES + compare.CLASSES + study.CLASSES + cancel.CLASSES + clear_results.CLASSES


@bpy.app.handlers.persistent
def _on_load(*_arguments: object) -> None:
    results.clear()


def register() -> None:
    """Register every operator, and forget the results when another file is loaded."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Unregister every operator and forget the results."""
    bpy.app.handlers.load_pre.remove(_on_load)
    results.clear()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
