"""Texture coordinates: which UV map an image lies on, and how Mapping nodes move it there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from mathutils import Euler, Matrix

from ..scene_data import Float32, GeometryData
from .nodes import Node, Path, constant, follow


@dataclass(frozen=True)
class Coordinates:
    """A UV map by name ('' is the active render map), and a (4, 4) matrix that its coordinates go through."""

    uv_map: str
    matrix: Matrix


def coordinates(node: Node, path: Path) -> Coordinates | None:
    """Where the image of an Image Texture node lies; None where that is on no UV map, or varies otherwise."""
    if node.projection != "FLAT":
        return None
    matrix = Matrix.Identity(4)
    end = follow(node.inputs["Vector"], path)
    if end.node is None:
        return Coordinates("", matrix)
    while end.node is not None and end.node.type == "MAPPING":
        mapping = _mapping(end.node, end.path)
        if mapping is None:
            return None
        matrix = matrix @ mapping
        end = follow(end.node.inputs["Vector"], end.path)
    if end.node is not None and end.node.type == "UVMAP":
        return Coordinates(end.node.uv_map, matrix)
    if end.node is not None and end.node.type == "TEX_COORD" and end.socket.name == "UV":
        return Coordinates("", matrix)
    return None


def _mapping(node: Node, path: Path) -> Matrix | None:
    """The matrix of a Mapping node; None where an input varies, or for kinds that are no affine map of coordinates."""
    inputs = {socket.name: constant(socket, path) for socket in node.inputs if socket.name != "Vector"}
    if any(inputs.get(name) is None for name in ("Rotation", "Scale")):
        return None
    linear = Euler(inputs["Rotation"]).to_matrix().to_4x4() @ Matrix.Diagonal((*inputs["Scale"], 1.0))
    if node.vector_type == "VECTOR":
        return linear
    if node.vector_type == "NORMAL" or inputs.get("Location") is None:
        return None
    placed = Matrix.Translation(inputs["Location"]) @ linear
    return placed if node.vector_type == "POINT" else placed.inverted_safe()


def move_uvs(geometry: GeometryData, matrices: Mapping[int, Matrix]) -> None:
    """Move the coordinates of all triangles of each material, by its index, through a matrix, in place."""
    if geometry.corner_uvs is None:
        return
    for material, matrix in matrices.items():
        chosen = geometry.material_index == material
        geometry.corner_uvs[chosen] = _moved(geometry.corner_uvs[chosen], np.array(matrix, np.float32))


def _moved(uvs: Float32, matrix: Float32) -> Float32:
    """(m, 3, 2) coordinates through a (4, 4) matrix, in whose plane z = 0 they lie."""
    return uvs @ matrix[:2, :2].T + matrix[:2, 3]
