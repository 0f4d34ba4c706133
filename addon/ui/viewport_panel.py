"""Espalier's part of the 3D viewport's overlay popover."""

import bpy

from . import sections


class ESPALIER_PT_viewport_overlay(bpy.types.Panel):
    """What is drawn over the 3D viewport."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_overlay"
    bl_label = "Espalier"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.active = context.space_data.overlay.show_overlays
        sections.draw_overlay_popover(self.layout, context)


CLASSES = (ESPALIER_PT_viewport_overlay,)
