"""Draws the boxes of a built accelerator over the 3D viewport.

GPU batches are built once for each run and each change of what is to be drawn, and kept until then: `_drawing`
compares what is wanted with what the batches hold. Colour and opacity are uniforms, and rebuild nothing.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy
import gpu
from mathutils import Matrix

from . import session
from .areas import redraw
from .overlay_boxes import (
    BRANCH,
    CELL,
    GRID,
    LAZY,
    LEAF,
    REFINED,
    TETRAHEDRON,
    Filter,
    Lines,
    box_lines,
    select,
)

FETCH_LIMIT = 1 << 21
"""Most boxes asked of the native core, before those that are not wanted are left out: 62 MB while batches are built."""

DEPTH_BIAS = 3e-6
"""In normalised device depth, whose range is -1 to 1."""

TOGGLES = {BRANCH: ("branches", "branch_color"), LEAF: ("leaves", "leaf_color")}
TOGGLES |= {GRID: ("grids", "grid_color"), CELL: ("cells", "cell_color")}
TOGGLES |= {LAZY: ("leaves", "leaf_color"), REFINED: ("branches", "branch_color")}
TOGGLES |= {TETRAHEDRON: TOGGLES[CELL]}
"""Names of the setting that shows a kind of box, and of its colour, in the order they are drawn."""


class _Key(NamedTuple):
    """What a drawing was built from; batches are rebuilt when it differs."""

    revision: int
    method: str
    wanted: Filter


@dataclass(frozen=True)
class Drawing:
    """GPU batches by kind, and how many boxes they show of how many that matched the settings."""

    key: _Key
    batches: dict[int, Any]
    shown: int
    matched: int
    truncated: bool


_drawings: dict[int, Drawing] = {}
"""By the scene's session_uid."""
_handle: Any = None


def drawing(scene: bpy.types.Scene) -> Drawing | None:
    """What is drawn of a scene, or None where nothing is."""
    return _drawings.get(scene.session_uid)


def drop(scene_uid: int) -> None:
    """Free the GPU batches of a scene."""
    _drawings.pop(scene_uid, None)


def clear() -> None:
    """Free all GPU batches."""
    _drawings.clear()


def wanted_boxes(settings: Any) -> Filter:
    """What the property group `scene.espalier.overlay` wants drawn."""
    return Filter(
        kinds=frozenset(kind for kind, (toggle, _color) in TOGGLES.items() if getattr(settings, toggle)),
        depth_min=settings.depth_min,
        depth_max=settings.depth_max,
        occupied_only=settings.occupied_only,
        max_boxes=settings.max_boxes,
    )


def _draw() -> None:
    """The draw handler of every 3D viewport, in world space."""
    context = bpy.context
    settings = context.scene.espalier.overlay
    if not (settings.show and context.space_data.overlay.show_overlays):
        return
    current = _drawing(context.scene, settings)
    if current is not None:
        _draw_batches(current.batches, settings)


def _drawing(scene: bpy.types.Scene, settings: Any) -> Drawing | None:
    """The scene's drawing as its session and settings are now. A run under way leaves the last one until it is done."""
    uid = scene.session_uid
    current = session.of(scene)
    result = None if current is None else current.result(settings.method)
    if current is None or result is None:
        if current is None or not current.busy:
            _drawings.pop(uid, None)
        return _drawings.get(uid)
    key = _Key(current.revision, settings.method, wanted_boxes(settings))
    if uid not in _drawings or _drawings[uid].key != key:
        _drawings[uid] = _build(key, result.accelerator)
        redraw(frozenset({"PROPERTIES"}))  # whose panels show how many boxes are drawn, known only now
    return _drawings[uid]


def _build(key: _Key, accelerator: Any) -> Drawing:
    """Fetch the boxes, leave out what is not wanted, and hand their edges to the GPU."""
    wanted = key.wanted
    cells = accelerator.cells(max_depth=wanted.depth_max, occupied_only=wanted.occupied_only, max_count=FETCH_LIMIT)
    rows, matched = select(cells, wanted)
    kinds = cells.kind[rows]
    batches = {}
    for kind in TOGGLES:
        chosen = rows[kinds == kind]
        if len(chosen):
            batches[kind] = _batch(box_lines(cells.lower[chosen], cells.upper[chosen]))
    return Drawing(key, batches, len(rows), matched, bool(cells.truncated))


def _batch(lines: Lines) -> Any:
    """An indexed batch of line segments on the GPU."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="pos", comp_type="F32", len=3, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, len(lines.vertices))
    vertices.attr_fill("pos", lines.vertices)
    indices = gpu.types.GPUIndexBuf(type="LINES", seq=lines.indices)
    return gpu.types.GPUBatch(type="LINES", buf=vertices, elem=indices)


def _draw_batches(batches: dict[int, Any], settings: Any) -> None:
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE" if settings.in_front else "LESS_EQUAL")
    gpu.state.depth_mask_set(False)
    with gpu.matrix.push_pop_projection():
        gpu.matrix.load_projection_matrix(_nearer(gpu.matrix.get_projection_matrix()))
        for kind, batch in batches.items():
            shader.uniform_float("color", (*getattr(settings, TOGGLES[kind][1]), settings.opacity))
            batch.draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def _nearer(projection: Matrix) -> Matrix:
    """The projection with all depths `DEPTH_BIAS` nearer, so that edges that lie in a surface are seen whole."""
    nearer = projection.copy()
    nearer[2] -= DEPTH_BIAS * projection[3]
    return nearer


@bpy.app.handlers.persistent
def _on_load(*_arguments: object) -> None:
    clear()


def register() -> None:
    """Draw in every 3D viewport, and free the batches when another file is loaded. Background mode has no viewport."""
    global _handle
    if bpy.app.background:
        return
    _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Stop drawing and free the batches."""
    global _handle
    if _handle is None:
        return
    bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
    bpy.app.handlers.load_pre.remove(_on_load)
    _handle = None
    clear()
