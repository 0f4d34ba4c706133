"""Why a button is greyed out, as the tooltip says it."""

import functools

import bpy

from .. import native
from ..errors import NativeModuleMissingError
from . import task

GEOMETRY = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME"}
"""Types of objects that can arrive as triangles, by themselves or through modifiers."""


@functools.cache
def missing_native() -> str | None:
    """What is wrong with the compiled module, or None. Asked once, because a failing import is slow."""
    try:
        native.module()
    except NativeModuleMissingError as error:
        return str(error)
    return None


def no_trace(context: bpy.types.Context) -> str | None:
    """The reason why the open scene cannot be traced now, or None where it can."""
    if task.current() is not None:
        return "Espalier is at work: wait for it, or press Esc to cancel it"
    scene = context.scene
    if scene.camera is None:
        return "The scene has no camera: add one, or set one in Scene Properties > Camera"
    if scene.camera.type == "CAMERA" and scene.camera.data.type == "PANO":
        return "The camera is panoramic: set Lens > Type to Perspective or Orthographic"
    if not any(may_have_triangles(ob) for ob in scene.objects):
        return "The scene has no geometry that renders: add a mesh, or enable an object in renders"
    if not scene.espalier.methods:
        return "No method is chosen: enable at least one under Methods"
    return missing_native()


def can_trace(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """The poll of operators that trace, with its message."""
    reason = no_trace(context)
    if reason is not None:
        operator.poll_message_set(reason)
    return reason is None


def may_have_triangles(ob: bpy.types.Object) -> bool:
    """Whether an object or the instances of it can have triangles in a render; the export knows for sure."""
    return not ob.hide_render and (ob.type in GEOMETRY or ob.instance_type != "NONE")
