"""Reads one evaluated mesh into numpy arrays, in the mesh's own space, each array with one bulk call."""

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene_data import Float32, UInt32


@dataclass(frozen=True, eq=False)
class LocalMesh:
    """A triangulated mesh of n vertices, c face corners and m triangles, before any instance places it.

    `slots` are material slot numbers; None means slot 0 everywhere. `uvs` is the active render UV map.
    """

    name: str
    positions: Float32  # (n, 3)
    corner_vertices: UInt32  # (c,) into positions
    corner_normals: Float32  # (c, 3)
    triangle_corners: UInt32  # (m, 3) into the corner arrays
    uvs: Float32 | None  # (c, 2)
    slots: NDArray[np.int32] | None  # (m,)


def read_mesh(mesh: Any) -> LocalMesh | None:
    """The arrays of a `bpy.types.Mesh`, or None where it has no face."""
    if len(mesh.polygons) == 0:
        return None
    mesh.calc_loop_triangles()
    triangles = len(mesh.loop_triangles)
    corners = len(mesh.loops)
    return LocalMesh(
        name=mesh.name,
        positions=_read(mesh.attributes["position"].data, "vector", np.float32, (len(mesh.vertices), 3)),
        corner_vertices=_read(mesh.attributes[".corner_vert"].data, "value", np.int32, (corners,)).view(np.uint32),
        corner_normals=_read(mesh.corner_normals, "vector", np.float32, (corners, 3)),
        triangle_corners=_read(mesh.loop_triangles, "loops", np.int32, (triangles, 3)).view(np.uint32),
        uvs=_render_uvs(mesh, corners),
        slots=_slots(mesh, triangles),
    )


def _read(data: Any, name: str, dtype: type, shape: tuple[int, ...]) -> NDArray[Any]:
    """A property of every element of a Blender collection, as an array."""
    values: NDArray[Any] = np.empty(shape, dtype)
    data.foreach_get(name, values.reshape(-1))
    return values


def _render_uvs(mesh: bpy.types.Mesh, corners: int) -> Float32 | None:
    """(c, 2) coordinates of the UV map that is active for rendering; None where the mesh has no map."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return None if layer is None else _read(layer.uv, "vector", np.float32, (corners, 2))


def _slots(mesh: bpy.types.Mesh, triangles: int) -> NDArray[np.int32] | None:
    """(m,) material slot of each triangle; None where all faces use slot 0."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None or attribute.domain != "FACE" or attribute.data_type != "INT":
        return None
    face_slots = _read(attribute.data, "value", np.int32, (len(mesh.polygons),))
    if not face_slots.any():
        return None
    return face_slots[_read(mesh.loop_triangle_polygons, "value", np.int32, (triangles,))]
