"""Blender's own panels that make sense for Espalier too: camera, light, material, world, output and the like."""

from collections.abc import Iterator
from typing import Any

import bpy

ENGINE = "ESPALIER"
SHARED = "BLENDER_RENDER"
"""The mark of panels that any engine may show, by Blender's convention."""
EXCLUDED = {
    "DATA_PT_light",
    "NODE_DATA_PT_light",
    "RENDER_PT_gpencil",
    "RENDER_PT_stereoscopy",
    "RENDER_PT_output_views",
}
"""Shared panels for what Espalier does not trace, or that an EEVEE panel shows in full."""
EXCLUDED_PARTS = ("freestyle", "grease_pencil", "greasepencil")
EEVEE_PANELS = {
    "DATA_PT_EEVEE_light",
    "DATA_PT_EEVEE_light_shadow",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "NODE_DATA_PT_EEVEE_light",
}
"""EEVEE's panels for what Espalier reads, and for which there is no shared one."""

_borrowed: list[Any] = []


def register() -> None:
    """Show the panels for Espalier, too."""
    for panel in _panels():
        panel.COMPAT_ENGINES.add(ENGINE)
        _borrowed.append(panel)


def unregister() -> None:
    """Take back what `register` gave."""
    for panel in _borrowed:
        panel.COMPAT_ENGINES.discard(ENGINE)
    _borrowed.clear()


def _panels() -> Iterator[Any]:
    """Every panel to show that does not yet show for Espalier."""
    waiting: list[Any] = [bpy.types.Panel]
    while waiting:
        subclasses = waiting.pop().__subclasses__()
        waiting.extend(subclasses)
        yield from (panel for panel in subclasses if _suits(panel))


def _suits(panel: Any) -> bool:
    engines = getattr(panel, "COMPAT_ENGINES", ())
    name = panel.__name__
    if ENGINE in engines:
        return False
    if name in EEVEE_PANELS:
        return True
    return SHARED in engines and name not in EXCLUDED and not any(part in name for part in EXCLUDED_PARTS)
