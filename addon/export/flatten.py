"""Flattens instances of meshes into one triangle soup in world space, vectorised over the instances. No bpy.

Normals go through the inverse transpose, and instances whose matrix mirrors get their winding turned, so that
front stays front: in Blender a negative scale does not turn a face around.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..scene_data import Float32, GeometryData, UInt32

if TYPE_CHECKING:
    from .meshes import LocalMesh

Matrix = Sequence[Sequence[float]]
"""Four rows of four, which iterate as tuples do: Blender's own matrix type is not named here."""
UNIT_TOLERANCE = 1e-5
"""How far the square of a normal's length may be from 1 before normals are divided by their lengths."""


@dataclass(eq=False)
class Placement:
    """All k instances of one mesh: k matrices (4, 4), and for each the material of every slot."""

    mesh: "LocalMesh"
    matrices: list[Matrix] = field(default_factory=list)
    materials: list[tuple[int, ...]] = field(default_factory=list)

    def add(self, matrix: Matrix, materials: tuple[int, ...]) -> None:
        """Add one instance; `materials` has the material index of every slot, at least one."""
        self.matrices.append(matrix)
        self.materials.append(materials)


class _Soup:
    """The arrays of GeometryData, filled block by block."""

    def __init__(self, vertices: int, triangles: int, with_uvs: bool) -> None:
        self.vertices = np.empty((vertices, 3), np.float32)
        self.triangles = np.empty((triangles, 3), np.uint32)
        self.material_index = np.empty(triangles, np.uint32)
        self.corner_normals = np.empty((triangles, 3, 3), np.float32)
        self.corner_uvs = np.zeros((triangles, 3, 2), np.float32) if with_uvs else None
        self._vertex = 0
        self._triangle = 0

    def append(self, mesh: "LocalMesh", matrices: Float32, materials: Sequence[tuple[int, ...]]) -> None:
        """Append k instances of a mesh whose matrices (k, 4, 4) all mirror, or all do not."""
        count, vertices, triangles = len(matrices), len(mesh.positions), len(mesh.triangle_corners)
        to_vertex = slice(self._vertex, self._vertex + count * vertices)
        to_triangle = slice(self._triangle, self._triangle + count * triangles)
        corners = mesh.triangle_corners
        if np.linalg.det(matrices[0, :3, :3].astype(np.float64)) < 0.0:
            corners = np.ascontiguousarray(corners[:, ::-1])

        self.vertices[to_vertex] = _points(mesh.positions, matrices).reshape(-1, 3)
        offsets = np.arange(self._vertex, to_vertex.stop, vertices, dtype=np.uint32)
        indices = self.triangles[to_triangle].reshape(count, triangles, 3)
        np.add(mesh.corner_vertices[corners], offsets[:, None, None], out=indices)
        normals = self.corner_normals[to_triangle].reshape(count, triangles, 3, 3)
        np.take(_normals(mesh.corner_normals, matrices), corners, axis=1, out=normals, mode="clip")
        if self.corner_uvs is not None and mesh.uvs is not None:
            self.corner_uvs[to_triangle].reshape(count, triangles, 3, 2)[:] = mesh.uvs[corners]
        self.material_index[to_triangle].reshape(count, triangles)[:] = _materials(mesh, materials)
        self._vertex, self._triangle = to_vertex.stop, to_triangle.stop


def flatten(placements: Iterable[Placement]) -> GeometryData:
    """World-space geometry of all instances, meshes in the given order, in each the ones that mirror last."""
    placements = list(placements)
    soup = _Soup(
        vertices=sum(len(p.matrices) * len(p.mesh.positions) for p in placements),
        triangles=sum(len(p.matrices) * len(p.mesh.triangle_corners) for p in placements),
        with_uvs=any(p.mesh.uvs is not None for p in placements),
    )
    for placement in placements:
        matrices = _matrices(placement.matrices)
        mirrors = np.linalg.det(matrices[:, :3, :3].astype(np.float64)) < 0.0
        for chosen in (np.flatnonzero(~mirrors), np.flatnonzero(mirrors)):
            if len(chosen):
                soup.append(placement.mesh, matrices[chosen], [placement.materials[i] for i in chosen])
    return GeometryData(
        vertices=soup.vertices,
        triangles=soup.triangles,
        material_index=soup.material_index,
        corner_normals=soup.corner_normals,
        corner_uvs=soup.corner_uvs,
        mesh_count=len(placements),
        instance_count=sum(len(p.matrices) for p in placements),
    )


def _matrices(matrices: list[Matrix]) -> Float32:
    """(k, 4, 4) array; unpacking rows is six times as fast as numpy's reading of Blender's matrices."""
    rows = [(*first, *second, *third, *fourth) for first, second, third, fourth in matrices]
    return np.array(rows, np.float32).reshape(-1, 4, 4)


def _points(positions: Float32, matrices: Float32) -> Float32:
    """(k, n, 3) positions under every matrix."""
    return positions @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]


def _normals(normals: Float32, matrices: Float32) -> Float32:
    """(k, c, 3) unit normals under every matrix. A normal of no length, as of a face without area, becomes +Z."""
    turned = normals @ _normal_matrices(matrices[:, :3, :3].astype(np.float64)).astype(np.float32)
    squared = np.einsum("kci,kci->kc", turned, turned)
    if np.abs(squared - 1.0).max(initial=0.0) > UNIT_TOLERANCE:
        lengths = np.sqrt(squared)
        turned /= np.where(lengths > 0.0, lengths, 1.0)[..., None]
        turned[lengths == 0.0] = (0.0, 0.0, 1.0)
    return turned


def _normal_matrices(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3, 3) matrices that turn normals given as rows: the inverse of each, up to a positive factor.

    That is the adjugate times the sign of the determinant, which also exists where a scale is 0.
    """
    x, y, z = linear[:, 0], linear[:, 1], linear[:, 2]
    adjugate = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)
    sign = np.where(np.linalg.det(linear) < 0.0, -1.0, 1.0)
    scale = np.sqrt(np.einsum("kij,kij->k", adjugate, adjugate) / 3.0)
    return adjugate * (sign / np.where(scale > 0.0, scale, 1.0))[:, None, None]


def _materials(mesh: "LocalMesh", materials: Sequence[tuple[int, ...]]) -> UInt32:
    """(k, m) or (k, 1) material of every triangle; a slot beyond the last is the last, as in Cycles."""
    if mesh.slots is None:
        return np.array([slots[0] for slots in materials], np.uint32)[:, None]
    table = np.array(materials, np.uint32)
    return table[:, np.clip(mesh.slots, 0, table.shape[1] - 1)]
