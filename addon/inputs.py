"""What a comparison is made of, opened in Blender: a .blend file, a mesh file, or a scene of the catalogue."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np
from numpy.typing import NDArray

from . import catalogue
from .errors import EspalierAddonError
from .export.camera import resolution as _resolution
from .input_kinds import is_blend, scene_name

DEFAULT_RESOLUTION = (1000, 1000)
LENS = 50.0
DIRECTION = (0.45, -1.0, 0.5)
"""From a scene without a camera towards the one it gets."""


class InputError(EspalierAddonError):
    """An input that Blender cannot open."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path} cannot be opened ({reason}): check that it is a whole, valid file")


@dataclass
class Opened:
    """The scene, the size in pixels of its image, and one line for each thing that was added."""

    scene: bpy.types.Scene
    resolution: tuple[int, int]
    notes: list[str] = field(default_factory=list)


def open_input(
    text: str, frame: int | None, resolution: tuple[int, int] | None, progress: Callable[[float], None]
) -> Opened:
    """Open INPUT in place of the file that is open, at `frame` where one is given, and see to camera and light.

    resolution: of the image in pixels; None: the scene's own for a .blend, else DEFAULT_RESOLUTION.
    Raises InputError and SceneCatalogueError.
    """
    path = Path(text)
    if scene_name(text) is not None:
        opened = Opened(_empty_scene(text), resolution or DEFAULT_RESOLUTION)
        catalogue.find(text).build(opened.scene, progress=progress)
    elif is_blend(path):
        _call(path, bpy.ops.wm.open_mainfile, load_ui=False)
        opened = Opened(bpy.context.scene, resolution or _resolution(bpy.context.scene.render))
    else:
        opened = Opened(_empty_scene(path.stem), resolution or DEFAULT_RESOLUTION)
        _import_mesh(path)
        _add_light(opened)
    if frame is not None:
        opened.scene.frame_set(frame)
    if opened.scene.camera is None:
        _add_camera(opened)
    return opened


def _empty_scene(name: str) -> bpy.types.Scene:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.name = name
    return bpy.context.scene


def _import_mesh(path: Path) -> None:
    if path.suffix.lower() in {".glb", ".gltf"}:
        addon_utils.enable("io_scene_gltf2")
        _call(path, bpy.ops.import_scene.gltf)
    else:
        _call(path, getattr(bpy.ops.wm, f"{path.suffix.lower()[1:]}_import"))
    if not any(thing.type == "MESH" and thing.data.polygons for thing in bpy.context.scene.objects):
        raise InputError(path, "there is no face in it")


def _call(path: Path, operator: Any, **options: Any) -> None:
    """Run an operator on a file; what it says where it fails becomes the error."""
    try:
        result = operator("EXEC_DEFAULT", filepath=str(path.resolve()), **options)
    except RuntimeError as error:
        reason = str(error).strip().removeprefix("Error: ").splitlines()[0]
        raise InputError(path, reason.replace(f" '{path.resolve()}'", "")) from error
    if result != {"FINISHED"}:
        raise InputError(path, "Blender does not understand it")


def _corners(scene: bpy.types.Scene) -> NDArray[np.float64]:
    """(k, 3) corners of the boxes around all shown meshes, in the world."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = [
        np.array(instance.object.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]
        for instance in depsgraph.object_instances
        if instance.object.type == "MESH" and not instance.object.hide_render and instance.show_self
        for matrix in [np.array(instance.matrix_world)]
    ]
    return np.concatenate(found) if found else np.zeros((1, 3))


def _add_camera(opened: Opened) -> None:
    framing, stage, blender = (catalogue.module(name) for name in ("framing", "stage", "blender"))
    corners = _corners(opened.scene)
    found = framing.frame(corners, DIRECTION, LENS, opened.resolution[0] / opened.resolution[1])
    reach = float(np.linalg.norm(corners - found.position, axis=1).max())
    view = stage.View(tuple(found.position), tuple(found.target), LENS, (found.distance / 1000, 2 * reach))
    blender.add_camera(opened.scene, view)
    opened.notes.append("There is no camera: one was framed on everything that renders")


def _add_light(opened: Opened) -> None:
    """Two suns and a grey world, unless the file brought lights."""
    if any(thing.type == "LIGHT" for thing in opened.scene.objects):
        return
    stage, blender = (catalogue.module(name) for name in ("stage", "blender"))
    blender.add_light(opened.scene, stage.Light("sun", (-3, -4, 5), power=2.4, size=2.0), "Key")
    blender.add_light(opened.scene, stage.Light("sun", (5, -3, 2), power=0.6, size=20.0), "Fill")
    blender.set_world(opened.scene, (0.12, 0.13, 0.15))
    opened.notes.append("There is no light: two suns and a grey world were added")
