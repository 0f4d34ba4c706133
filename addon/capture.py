"""Exports the frame that a render would show, without rendering it.

Only a render makes Blender evaluate render visibility and the render settings of modifiers, so a capture starts one
with Espalier's engine, which exports and draws nothing. It renders a passing copy of the scene: the user's scene,
its settings, and its Render Result stay as they are. The copy shares objects and data, so it costs milliseconds.

Blender 4.2 miscounts users where a scene is copied: what is directly in the scene's own collection shows one user
too many after the copy is gone, until the file is loaded again. 4.3 has it right; Python cannot correct it.
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import bpy
from mathutils import Matrix

from .errors import CaptureError, NoCameraError
from .export import export_scene
from .scene_data import SceneData

RENDER_HANDLERS = ("render_init", "render_pre", "render_post", "render_complete", "render_cancel", "render_stats")
"""Handlers that tell other add-ons of a render, which a capture is not."""

_take: Callable[[bpy.types.Depsgraph], None] | None = None


def export_frame(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer | None = None,
    *,
    resolution: tuple[int, int] | None = None,
    border: bool = True,
) -> SceneData:
    """Export a view layer (None: the first that renders) of the scene at its current frame, on the main thread.

    `resolution` replaces the frame's width and height in pixels; `border=False` exports the whole frame.
    Raises what `export_scene` raises, and CaptureError where a render cannot start.
    """
    if scene.camera is None:
        raise NoCameraError(scene.name)
    layer = view_layer or next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    moved = _moved_by_physics(scene, layer)
    with _copy(scene) as copy:
        _prepare(copy, layer.name, resolution, border)
        return _export(copy, scene.name, moved)


def taken(depsgraph: bpy.types.Depsgraph) -> bool:
    """Called by the engine first: True where the render is a capture, which then has what it wants."""
    if _take is None:
        return False
    _take(depsgraph)
    return True


def _export(scene: bpy.types.Scene, name: str, moved: Mapping[int, Matrix]) -> SceneData:
    global _take
    outcome: list[SceneData | Exception] = []

    def take(depsgraph: bpy.types.Depsgraph) -> None:
        if outcome:  # the second eye of a stereoscopic scene
            return
        try:
            outcome.append(export_scene(depsgraph, name, moved))
        except Exception as error:  # noqa: BLE001 - raised again by the caller, outside of the render
            outcome.append(error)

    _take = take
    try:
        with _silent_handlers():
            bpy.ops.render.render("EXEC_DEFAULT", scene=scene.name)
    except RuntimeError as error:
        raise CaptureError(str(error).strip()) from error
    finally:
        _take = None
    if not outcome:
        raise CaptureError("Blender did not start it")
    if isinstance(outcome[0], Exception):
        raise outcome[0]
    return outcome[0]


def _moved_by_physics(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> dict[int, Matrix]:
    """World matrices, by pointer, of rigid bodies and their children: a copied scene has no simulation of its own."""
    world = scene.rigidbody_world
    if world is None or not world.enabled:
        return {}
    depsgraph: Any = layer.depsgraph
    depsgraph.update()
    return {
        thing.as_pointer(): thing.evaluated_get(depsgraph).matrix_world.copy()
        for thing in layer.objects
        if _is_rigid(thing)
    }


def _is_rigid(thing: bpy.types.Object | None) -> bool:
    """Whether an object or one of its parents is a rigid body."""
    while thing is not None:
        if thing.rigid_body is not None:
            return True
        thing = thing.parent
    return False


def _prepare(scene: bpy.types.Scene, view_layer: str, resolution: tuple[int, int] | None, border: bool) -> None:
    """Make the copy render one view layer, with our engine alone."""
    for layer in scene.view_layers:
        layer.use = layer.name == view_layer
    render: Any = scene.render
    render.use_single_layer = False
    render.engine = "ESPALIER"
    render.use_compositing = render.use_sequencer = False
    render.use_border = render.use_border and border
    if resolution is not None:
        render.resolution_x, render.resolution_y = resolution
        render.resolution_percentage = 100


@contextlib.contextmanager
def _copy(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A copy of the scene for as long as it is needed; a Render Result that only it made goes with it."""
    had_result = "Render Result" in bpy.data.images
    copy = scene.copy()
    try:
        yield copy
    finally:
        bpy.data.scenes.remove(copy)
        result = bpy.data.images.get("Render Result")
        if result is not None and not had_result:
            bpy.data.images.remove(result)


@contextlib.contextmanager
def _silent_handlers() -> Iterator[None]:
    """Keep a capture from other add-ons that wait for renders."""
    lists = [getattr(bpy.app.handlers, name) for name in RENDER_HANDLERS]
    kept = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:] = before
