"""Espalier's panels in the render properties: whole under its own engine, in one compact panel under others."""

from typing import ClassVar

import bpy

from . import sections

ENGINE = "ESPALIER"


class RenderPanel:
    """Where the panels are."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class EspalierEngine(RenderPanel):
    """A panel that is there while Espalier is the render engine."""

    COMPAT_ENGINES: ClassVar[set[str]] = {ENGINE}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES


class ESPALIER_PT_trace(EspalierEngine, bpy.types.Panel):
    """Settings, buttons and progress."""

    bl_label = "Espalier"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.espalier, "method")
        sections.draw_settings(layout, context.scene.espalier)
        sections.draw_run(layout, context)


class ESPALIER_PT_methods(EspalierEngine, bpy.types.Panel):
    """Which methods are compared."""

    bl_label = "Compared Methods"
    bl_parent_id = "ESPALIER_PT_trace"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        sections.draw_methods(self.layout, context.scene.espalier)


class ESPALIER_PT_results(EspalierEngine, bpy.types.Panel):
    """The table of results."""

    bl_label = "Results"
    bl_parent_id = "ESPALIER_PT_trace"

    def draw(self, context: bpy.types.Context) -> None:
        sections.draw_results(self.layout, context)


class ESPALIER_PT_overlay(EspalierEngine, bpy.types.Panel):
    """What is drawn over the 3D viewport."""

    bl_label = "Viewport Overlay"
    bl_parent_id = "ESPALIER_PT_trace"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.espalier.overlay, "show", text="")

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        sections.draw_overlay(self.layout, context)


class ESPALIER_PT_advanced(EspalierEngine, bpy.types.Panel):
    """What is seldom changed."""

    bl_label = "Advanced"
    bl_parent_id = "ESPALIER_PT_trace"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        sections.draw_advanced(self.layout, context.scene.espalier)


class ESPALIER_PT_compact(RenderPanel, bpy.types.Panel):
    """The same in one panel, so that the open scene can be traced whatever engine renders it."""

    bl_label = "Espalier"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}
    bl_order = 100

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine != ENGINE

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.espalier
        sections.draw_run(layout, context)
        if body := _section(layout, "settings", "Settings", closed=True):
            sections.draw_methods(body, settings)
            sections.draw_settings(body, settings)
            sections.draw_advanced(body, settings)
        if body := _section(layout, "results", "Results", closed=False):
            sections.draw_results(body, context)
        if body := _section(layout, "overlay", "Viewport Overlay", closed=True, toggle=(settings.overlay, "show")):
            sections.draw_overlay(body, context)


def _section(
    layout: bpy.types.UILayout, name: str, title: str, *, closed: bool, toggle: tuple[object, str] | None = None
) -> bpy.types.UILayout | None:
    """A part of the panel that folds; None while it is folded."""
    header, body = layout.panel(f"ESPALIER_PT_compact_{name}", default_closed=closed)
    if toggle is not None:
        header.use_property_split = False
        header.prop(*toggle, text="")
    header.label(text=title)
    return body


CLASSES = (
    ESPALIER_PT_trace,
    ESPALIER_PT_methods,
    ESPALIER_PT_results,
    ESPALIER_PT_overlay,
    ESPALIER_PT_advanced,
    ESPALIER_PT_compact,
)
