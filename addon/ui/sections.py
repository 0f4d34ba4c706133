"""Parts of panels, drawn alike wherever they appear: run, settings, results, overlay."""

import textwrap
from collections.abc import Sequence
from typing import Any

import bpy

from .. import methods, overlay, results
from .. import results_table as table
from ..operators import task

TABLES = (
    (520, (table.TIMES + table.SIZES,)),
    (290, (table.TIMES, table.SIZES)),
    (0, (table.TIMES[:2], (table.TIMES[2], table.SIZES[0]), table.SIZES[1:])),
)
"""From which width of the panel, in pixels at a scale of 1, which columns fit side by side; the rest go below."""

MOST_NOTES = 6
"""Most notes shown in a panel."""

NOTE_MARGIN, LETTER = 75, 5.8
"""Pixels at a scale of 1: around a note with its icon, and of a letter on average in Blender's font."""

BEST = "\N{BLACK STAR}"
"""Marks the best of a column."""

Layout = bpy.types.UILayout


def draw_run(layout: Layout, context: bpy.types.Context) -> None:
    """The buttons, the progress of what runs, and what the last export could not take over."""
    column = layout.column()
    column.scale_y = 1.25
    column.operator("espalier.build_trace", icon="RENDER_STILL")
    column.operator("espalier.compare", icon="IMAGE_RGB")
    column.operator("espalier.study", icon="GRAPH")
    current = task.current()
    if current is not None:
        row = layout.row(align=True)
        row.progress(factor=current.progress, text=current.status)
        row.operator("espalier.cancel", text="", icon="X")
    draw_notes(layout, results.of(context.scene.session_uid).notes, panel_width(context))


def panel_width(context: bpy.types.Context) -> float:
    """Width of the region in pixels at a scale of 1."""
    return context.region.width / context.preferences.system.ui_scale


def draw_notes(layout: Layout, notes: Sequence[str], width: float) -> None:
    """What the last run left out or approximated, wrapped to the panel."""
    if not notes:
        return
    box = layout.box().column(align=True)
    for note in notes[:MOST_NOTES]:
        lines = textwrap.wrap(note, max(int((width - NOTE_MARGIN) / LETTER), 16))
        for index, line in enumerate(lines):
            box.label(text=line, icon="BLANK1" if index else "ERROR")
    if len(notes) > MOST_NOTES:
        box.label(text=f"{len(notes) - MOST_NOTES} more in the Info editor", icon="BLANK1")


def draw_methods(layout: Layout, settings: Any) -> None:
    """Which methods the buttons run: kinds side by side where there is room. The names stand on the buttons alone."""
    layout.use_property_split = False
    kinds = layout.grid_flow(row_major=True, even_columns=True)
    for heading, belongs in methods.GROUPS.items():
        column = kinds.column(align=True)
        column.label(text=heading)
        for name in filter(belongs, methods.METHOD_NAMES):
            column.prop_enum(settings, "methods", name)


def draw_settings(layout: Layout, settings: Any) -> None:
    """How the frame is traced, and what the accelerator is built for."""
    layout.prop(settings, "samples")
    layout.prop(settings, "threads")
    layout.prop(settings, "expected_rays")


def draw_advanced(layout: Layout, settings: Any) -> None:
    """What is seldom changed."""
    layout.prop(settings, "max_bounces")
    layout.prop(settings, "seed")


def draw_results(layout: Layout, context: bpy.types.Context) -> None:
    """The table, in as many parts as the panel is narrow for it."""
    rows = results.of(context.scene.session_uid).rows
    if not rows:
        layout.label(text="Nothing traced yet")
        return
    width = panel_width(context)
    tables = next(tables for least, tables in TABLES if width >= least)
    for columns in tables:
        _draw_table(layout, rows, columns, short=len(tables) > 1)
    layout.operator("espalier.clear_results", icon="TRASH")


def _draw_table(layout: Layout, rows: Sequence[results.Row], columns: Sequence[table.Column], *, short: bool) -> None:
    rows = table.rows_for(rows, columns)
    split = layout.box().split(factor=1.3 / (len(columns) + 1.3), align=True)
    names = split.column(align=True)
    names.label(text="")
    for entry in rows:
        names.label(text=table.method_text(entry.method, short=short))
    numbers = split.row(align=True)
    for column in columns:
        _draw_column(numbers.column(align=True), rows, column)


def _draw_column(layout: Layout, rows: Sequence[results.Row], column: table.Column) -> None:
    layout.alignment = "RIGHT"
    layout.label(text=column.title)
    for cell in table.cells(rows, column):
        layout.label(text=f"{BEST} {cell.text}" if cell.best else cell.text)


def draw_overlay(layout: Layout, context: bpy.types.Context) -> None:
    """What the overlay draws, in a panel with property split."""
    settings = context.scene.espalier.overlay
    layout.active = settings.show
    layout.prop(settings, "method")
    column = layout.column(heading="Boxes", align=True)
    for names in overlay.TOGGLES.values():
        _draw_kind(column.row(), settings, *names)
    layout.prop(settings, "occupied_only")
    layout.prop(settings, "in_front")
    column = layout.column(align=True)
    column.prop(settings, "depth_min", text="Depth Min")
    column.prop(settings, "depth_max", text="Max")
    layout.prop(settings, "opacity")
    layout.prop(settings, "max_boxes")
    layout.label(text=overlay_text(context.scene), icon="INFO")


def draw_overlay_popover(layout: Layout, context: bpy.types.Context) -> None:
    """The same where height is short: two settings side by side."""
    settings = context.scene.espalier.overlay
    row = layout.row()
    row.prop(settings, "show")
    row.prop(settings, "method", text="")
    column = layout.column()
    column.active = settings.show
    grid = column.grid_flow(row_major=True, columns=2, even_columns=True)
    for names in overlay.TOGGLES.values():
        _draw_kind(grid.row(), settings, *names)
    grid.prop(settings, "occupied_only")
    grid.prop(settings, "in_front")
    row = column.row(align=True)
    row.prop(settings, "depth_min")
    row.prop(settings, "depth_max", text="Max")
    column.prop(settings, "opacity")
    column.label(text=overlay_text(context.scene), icon="INFO")


def _draw_kind(row: Layout, settings: Any, toggle: str, color: str) -> None:
    """The switch of a kind of box beside its colour."""
    row.prop(settings, toggle)
    swatch = row.row()
    swatch.ui_units_x = 2
    swatch.prop(settings, color, text="")


def overlay_text(scene: bpy.types.Scene) -> str:
    """What is drawn now, in one line."""
    drawing = overlay.drawing(scene)
    if drawing is None:
        return "Nothing built with this method"
    if drawing.shown < drawing.matched:
        return f"{drawing.shown:,} of {drawing.matched:,} boxes"
    return f"{drawing.shown:,} boxes"
