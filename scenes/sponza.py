"""Crytek's Sponza (Frank Meinl, after Marko Dabrovic) with its textures, from the folder of models. No bpy."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from . import models
from .errors import BrokenModelError, ModelMissingError
from .geometry import mesh
from .ply import PlyData, read_ply_data
from .stage import Light, Part, Stage, Surface, View

SCALE = 0.1
"""Metres in a unit of the file."""


def stage() -> Stage:
    """The atrium seen along its length, the sun through its open roof. Raises ModelMissingError, BrokenModelError."""
    path = models.folder() / "textured" / "sponza_crytek.ply"
    listed = path.with_suffix(".materials.json")
    if not (path.is_file() and listed.is_file()):
        raise ModelMissingError("textured/sponza_crytek", "no archive holds it with its textures")
    try:
        materials = json.loads(listed.read_text(encoding="utf-8"))["materials"]
        return Stage(
            parts=_parts(read_ply_data(path), [_surface(path.parent, material) for material in materials]),
            lights=[
                Light("sun", (-3, 4, 20), power=5.0, size=1.0, color=(1.0, 0.94, 0.84)),
                Light("area", (-11, 0.6, 12), (2, 0, 3), power=2600, size=6.0, color=(0.8, 0.88, 1.0)),
                Light("area", (8, 0.6, 12), (0, 0, 3), power=2600, size=6.0, color=(0.8, 0.88, 1.0)),
                Light("area", (-9.5, 0.5, 4.5), (4, 0.6, 3), power=900, size=2.5, color=(1.0, 0.95, 0.88)),
            ],
            view=View((-9.2, 0.2, 2.2), (3.0, 0.8, 4.4), 20.0, clip=(0.05, 100.0)),
            world=(0.5, 0.65, 0.9),
        )
    except (ValueError, KeyError, IndexError) as error:
        raise BrokenModelError(path, str(error)) from error


def _surface(folder: Path, material: dict[str, Any]) -> Surface:
    image = folder / material["texture"] if "texture" in material else None
    red, green, blue = material["kd"]
    return Surface(material["name"], (red, green, blue), roughness=0.8, image=image)


def _parts(data: PlyData, surfaces: list[Surface]) -> list[Part]:
    """One part for each material that has triangles, turned from y up to z up."""
    vertices = (data.mesh[0].astype(float)[:, [0, 2, 1]] * [1, -1, 1]) * SCALE
    texture = np.stack([data.vertex["s"], data.vertex["t"]], axis=1)
    parts = []
    for index in np.unique(data.face["material"]):
        corners = data.corners[data.face["material"] == index]
        used, local = np.unique(corners, return_inverse=True)
        surface = surfaces[int(index)]
        parts.append(
            Part(surface.name, mesh(vertices[used], local.reshape(-1, 3)), surface, True, uvs=texture[corners])
        )
    return parts
