"""The camera and the frame it looks through."""

from typing import Any

import bpy
import numpy as np

from ..errors import NoCameraError, UnsupportedCameraError
from ..scene_data import CameraData
from .notes import Notes

KINDS = {"PERSP": "perspective", "ORTHO": "orthographic"}


def read_camera(scene: bpy.types.Scene, name: str, notes: Notes) -> CameraData:
    """The active camera of the scene that errors call `name`. Raises NoCameraError or UnsupportedCameraError."""
    holder = scene.camera
    if holder is None or holder.type != "CAMERA":
        raise NoCameraError(name)
    camera: Any = holder.data
    if camera.type not in KINDS:
        kind = camera.bl_rna.properties["type"].enum_items[camera.type].name
        raise UnsupportedCameraError(holder.name, kind)
    if camera.dof.use_dof:
        notes.add(f"Camera '{holder.name}': depth of field is ignored")
    render = scene.render
    if render.use_multiview:
        notes.add("Stereoscopy is ignored: only the camera's own view is traced")
    if render.use_motion_blur:
        notes.add("Motion blur is ignored")
    return CameraData(
        name=holder.name,
        kind=KINDS[camera.type],
        matrix=np.array(holder.matrix_world.normalized(), np.float32),
        resolution=resolution(render),
        lens=camera.lens,
        sensor_width=camera.sensor_width,
        sensor_height=camera.sensor_height,
        sensor_fit=camera.sensor_fit.lower(),
        shift=(camera.shift_x, camera.shift_y),
        ortho_scale=camera.ortho_scale,
        clip=(camera.clip_start, camera.clip_end),
        pixel_aspect=(render.pixel_aspect_x, render.pixel_aspect_y),
        border=_border(render),
    )


def resolution(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """(width, height) of the full frame in pixels; Blender rounds the percentage down."""
    percentage = render.resolution_percentage
    return max(render.resolution_x * percentage // 100, 1), max(render.resolution_y * percentage // 100, 1)


def _border(render: bpy.types.RenderSettings) -> tuple[float, float, float, float] | None:
    """The render region as (min_x, min_y, max_x, max_y) in 0..1, or None where the whole frame is rendered."""
    if not render.use_border:
        return None
    return render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y
