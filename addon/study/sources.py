"""What rays are traced through: a mesh, a camera and a light, from the catalogue, a mesh file, or Blender. No bpy.

Models of the catalogue and files that `mesh_files` reads need no Blender. Whatever else there is, whoever starts the
study opens in Blender first, on the main thread, and hands over as SceneData.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import catalogue, input_kinds
from ..scene_data import Float32, LightData, SceneData, UInt32
from . import mesh_files

LENS = 50.0
DIRECTION = (0.45, -1.0, 0.5)
"""From a mesh without a camera towards the one it gets, z up."""

LIGHT = (-0.6, 0.8, 0.3)
"""Where the light of a mesh without one is: from the camera to the left, up and back, in distances to the middle."""

SUN_DISTANCE = 1000.0
"""A sun shines from this many diagonals of the scene's box away."""

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Source:
    """A scene as arrays. camera: arguments of `espalier_rt.Camera` but `resolution`, which the plan has.

    light: (3,) the point that shadow rays aim at.
    """

    name: str
    vertices: Float32
    triangles: UInt32
    camera: dict[str, Any]
    light: Float32

    @property
    def digest(self) -> str:
        """Tells this source from any other: of geometry, camera and light."""
        content = hashlib.sha256(np.ascontiguousarray(self.vertices).tobytes())
        content.update(np.ascontiguousarray(self.triangles).tobytes())
        content.update(repr(sorted((key, np.asarray(value).tolist()) for key, value in self.camera.items())).encode())
        content.update(self.light.tobytes())
        return content.hexdigest()[:16]


def needs_blender(text: str) -> bool:
    """Whether only Blender can open this input, a scene's name or a path."""
    name = input_kinds.scene_name(text)
    if name is not None:
        return catalogue.find(name).finish is not None
    return Path(text).suffix.lower() not in mesh_files.READERS


def load(text: str, aspect: float, progress: Progress = lambda _: None) -> Source:
    """Open an input that needs no Blender. aspect: width by height of the picture.

    Raises SceneCatalogueError where a model is missing or broken, MeshFileError, and OSError.
    """
    name = input_kinds.scene_name(text)
    if name is None:
        vertices, triangles = mesh_files.read(Path(text))
        return _framed(Path(text).stem, vertices, triangles, aspect)
    model = next((model for model in catalogue.module("models").MODELS if model.name == name), None)
    if model is not None:
        mesh = catalogue.module("models").load(model, progress)
        vertices, triangles = catalogue.module("studio").standing(mesh, model.up, model.turn)
        return _framed(name, vertices, triangles, aspect)
    stage = catalogue.find(name).stage(progress=progress)
    view = stage.view
    vertices, triangles = stage.mesh()
    return _seen(name, vertices, triangles, np.array(view.position), np.array(view.target), view.lens)


def of_scene_data(data: SceneData) -> Source:
    """A frame that was exported from Blender, with its own camera, and its first light or one beside the camera."""
    camera = data.camera.arguments() | {"border": None}
    del camera["resolution"]
    points = data.geometry.vertices
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    diagonal = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    if data.lights:
        light = _position(data.lights[0], middle, diagonal)
    else:
        matrix = np.asarray(data.camera.matrix, float)
        light = matrix[:3, 3] + matrix[:3, :3] @ np.array(LIGHT) * np.linalg.norm(matrix[:3, 3] - middle)
    return Source(data.name, points, data.geometry.triangles, camera, np.asarray(light, np.float32))


def renamed(source: Source, name: str) -> Source:
    """The source under the name that the plan has for it."""
    return replace(source, name=name)


def _framed(name: str, vertices: Float32, triangles: UInt32, aspect: float) -> Source:
    """A mesh alone, all of it in the picture."""
    used = vertices[np.unique(triangles)]
    found = catalogue.module("framing").frame(used, DIRECTION, LENS, aspect)
    return _seen(name, vertices, triangles, found.position, found.target, LENS)


def _seen(name: str, vertices: Float32, triangles: UInt32, position: Any, target: Any, lens: float) -> Source:
    matrix = catalogue.module("framing").camera_to_world(position, target)
    distance = float(np.linalg.norm(position - target))
    light = position + matrix[:3, :3] @ np.array(LIGHT) * distance
    camera = {
        "kind": "perspective",
        "matrix": matrix.astype(np.float32),
        "lens": lens,
        "clip": (distance / 1000, 1000 * distance),
    }
    return Source(name, vertices, triangles, camera, light.astype(np.float32))


def _position(light: LightData, middle: Float32, diagonal: float) -> Float32:
    """Where a light is; a sun is far away, along its direction."""
    matrix = np.asarray(light.matrix, np.float32)
    if light.kind != "sun":
        return matrix[:3, 3]
    return middle + matrix[:3, 2] * np.float32(SUN_DISTANCE * diagonal)
