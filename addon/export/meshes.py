"""Reads one evaluated mesh into numpy arrays, in the mesh's own space, each array with one bulk call."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene_data import Float32, UInt32


@dataclass(frozen=True, eq=False)
class LocalMesh:
    """A triangulated mesh of n vertices, c face corners and m triangles, before any instance places it.

    `slots` are material slot numbers; None means slot 0 everywhere. `uvs` are of the map that each slot asks for.
    """

    name: str
    positions: Float32  # (n, 3)
    corner_vertices: UInt32  # (c,) into positions
    corner_normals: Float32  # (c, 3)
    triangle_corners: UInt32  # (m, 3) into the corner arrays
    uvs: Float32 | None  # (c, 2)
    slots: NDArray[np.int32] | None  # (m,)


def read_mesh(mesh: Any, uv_maps: Sequence[str] = ("",)) -> LocalMesh | None:
    """The arrays of a `bpy.types.Mesh`, or None where it has no face.

    `uv_maps` names the UV map of every material slot; '' is the active render map.
    """
    if len(mesh.polygons) == 0:
        return None
    mesh.calc_loop_triangles()
    triangles = len(mesh.loop_triangles)
    corners = len(mesh.loops)
    slots = _slots(mesh, triangles)
    triangle_corners = _read(mesh.loop_triangles, "loops", np.int32, (triangles, 3)).view(np.uint32)
    return LocalMesh(
        name=mesh.name,
        positions=_read(mesh.attributes["position"].data, "vector", np.float32, (len(mesh.vertices), 3)),
        corner_vertices=_read(mesh.attributes[".corner_vert"].data, "value", np.int32, (corners,)).view(np.uint32),
        corner_normals=_read(mesh.corner_normals, "vector", np.float32, (corners, 3)),
        triangle_corners=triangle_corners,
        uvs=_uvs(mesh, uv_maps, slots, triangle_corners),
        slots=slots,
    )


def _read(data: Any, name: str, dtype: type, shape: tuple[int, ...]) -> NDArray[Any]:
    """A property of every element of a Blender collection, as an array."""
    values: NDArray[Any] = np.empty(shape, dtype)
    data.foreach_get(name, values.reshape(-1))
    return values


def _uvs(
    mesh: Any, uv_maps: Sequence[str], slots: NDArray[np.int32] | None, triangle_corners: UInt32
) -> Float32 | None:
    """(c, 2) coordinates of the map that each corner's slot asks for; zeros where there is no such map, as in Blender.

    None where the mesh has no map at all.
    """
    if len(mesh.uv_layers) == 0:
        return None
    if slots is None or len(set(uv_maps)) == 1:
        return _map(mesh, uv_maps[0])
    maps = {name: _map(mesh, name) for name in set(uv_maps) if name}
    uvs = _map(mesh, "")
    used = np.clip(slots, 0, len(uv_maps) - 1)
    for slot, name in enumerate(uv_maps):
        if name:
            corners = triangle_corners[used == slot]
            uvs[corners] = maps[name][corners]
    return uvs


def _map(mesh: Any, name: str) -> Float32:
    """(c, 2) coordinates of one UV map."""
    found = [layer for layer in mesh.uv_layers if (layer.name == name if name else layer.active_render)]
    shape = (len(mesh.loops), 2)
    return _read(found[0].uv, "vector", np.float32, shape) if found else np.zeros(shape, np.float32)


def _slots(mesh: bpy.types.Mesh, triangles: int) -> NDArray[np.int32] | None:
    """(m,) material slot of each triangle; None where all faces use slot 0."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None or attribute.domain != "FACE" or attribute.data_type != "INT":
        return None
    face_slots = _read(attribute.data, "value", np.int32, (len(mesh.polygons),))
    if not face_slots.any():
        return None
    return face_slots[_read(mesh.loop_triangle_polygons, "value", np.int32, (triangles,))]
