"""The scene as numpy arrays: the only reader of meshes, materials, lights and cameras.

It reads what a *render* depsgraph shows, which Blender evaluates with render visibility and render settings of
modifiers; `capture` gets one outside of a render. Nothing in the file is changed.
"""

import time
from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..errors import NoGeometryError, NonFiniteGeometryError
from ..scene_data import GeometryData, SceneData
from .camera import read_camera
from .coordinates import move_uvs
from .flatten import Placement, flatten
from .images import Images
from .lights import read_world
from .materials import Materials
from .notes import Notes
from .objects import Objects, note_collections


def export_scene(
    depsgraph: bpy.types.Depsgraph, name: str | None = None, moved: Mapping[int, Matrix] | None = None
) -> SceneData:
    """One frame of one view layer of an evaluated render depsgraph.

    `name` stands for the scene's own, and `moved` has world matrices that stand for objects' own, by their pointers.

    Raises NoCameraError, UnsupportedCameraError, NoGeometryError, NonFiniteGeometryError, and ValueError for a
    viewport's depsgraph, whose geometry may differ from the render's: use `capture.export_frame` there.
    """
    if depsgraph.mode != "RENDER":
        raise ValueError("export_scene needs a render depsgraph; call capture.export_frame outside of a render")
    start = time.perf_counter()
    scene: Any = depsgraph.scene
    view_layer: Any = depsgraph.view_layer
    notes = Notes()
    images = Images(notes)
    materials = Materials(images, notes)
    name = name or scene.name
    camera = read_camera(scene, name, notes)
    note_collections(view_layer, notes)
    objects = Objects(depsgraph, materials, notes, moved or {})
    placements = objects.placements
    if not placements:
        raise NoGeometryError(name, view_layer.name)
    geometry = flatten(placements)
    move_uvs(geometry, materials.uv_matrices)
    _require_finite(geometry, placements)
    return SceneData(
        name=name,
        view_layer=view_layer.name,
        frame=scene.frame_current,
        geometry=geometry,
        camera=camera,
        materials=tuple(materials.materials),
        lights=tuple(objects.lights),
        world=read_world(scene.world, images, notes),
        textures=tuple(images.textures),
        warnings=notes.lines(),
        export_ms=(time.perf_counter() - start) * 1e3,
    )


def _require_finite(geometry: GeometryData, placements: list[Placement]) -> None:
    """Raise NonFiniteGeometryError with the names of meshes whose vertices are not all finite in world space."""
    if np.isfinite(geometry.vertices).all():
        return
    names, start = [], 0
    for placement in placements:
        stop = start + len(placement.matrices) * len(placement.mesh.positions)
        if not np.isfinite(geometry.vertices[start:stop]).all():
            names.append(placement.mesh.name)
        start = stop
    raise NonFiniteGeometryError(names)
