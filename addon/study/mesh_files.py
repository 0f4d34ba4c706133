"""Mesh files read without Blender: triangle PLY, OBJ and STL. No bpy.

Only positions and faces are read. As Blender's importers do, an OBJ is turned from y up to z up.
"""

from pathlib import Path

import numpy as np

from .. import catalogue
from ..errors import EspalierAddonError
from ..scene_data import Float32, UInt32

Mesh = tuple[Float32, UInt32]

STL_HEADER, STL_TRIANGLE = 84, 50
"""Bytes of a binary STL before its triangles, and of each triangle."""


class MeshFileError(EspalierAddonError):
    """A mesh file that cannot be read."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path} cannot be read ({reason}): check that it is a whole, valid file")


def read(path: Path) -> Mesh:
    """(n, 3) vertices and (m, 3) triangles, at least one. Raises MeshFileError, or what `read_ply` raises."""
    try:
        vertices, triangles = READERS[path.suffix.lower()](path)
    except (OSError, ValueError, IndexError) as error:
        raise MeshFileError(path, str(error)) from error
    if not len(triangles):
        raise MeshFileError(path, "there is no face in it")
    if triangles.max() >= len(vertices):
        raise MeshFileError(path, "a face names a vertex that is not there")
    return vertices, triangles


def _read_ply(path: Path) -> Mesh:
    mesh: Mesh = catalogue.module("ply").read_ply(path)
    return mesh


def _read_obj(path: Path) -> Mesh:
    """Faces of more corners become fans."""
    points: list[tuple[float, ...]] = []
    triangles: list[tuple[int, int, int]] = []
    with path.open(encoding="utf-8", errors="replace") as stream:
        for line in stream:
            words = line.split()
            if words[:1] == ["v"]:
                points.append(tuple(map(float, words[1:4])))
            elif words[:1] == ["f"]:
                corners = [_obj_index(word, len(points)) for word in words[1:]]
                triangles += [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    vertices = np.array(points, np.float32).reshape(-1, 3)[:, [0, 2, 1]] * np.array([1, -1, 1], np.float32)
    return vertices, np.array(triangles, np.uint32).reshape(-1, 3)


def _obj_index(word: str, known: int) -> int:
    """A corner's vertex, counted from 0: files count from 1, or from the last one back with negative numbers."""
    index = int(word.partition("/")[0])
    found = index - 1 if index > 0 else known + index
    if found < 0 or index == 0:
        raise ValueError(f"a face names the vertex {index}")
    return found


def _read_stl(path: Path) -> Mesh:
    """Binary or text, equal positions merged."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:STL_HEADER], "little")
    if len(content) == STL_HEADER + STL_TRIANGLE * count:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(content, kind, count, STL_HEADER)["corners"].reshape(-1, 3)
    else:
        rows = [line.split()[1:4] for line in content.split(b"\n") if line.lstrip().startswith(b"vertex")]
        corners = np.array(rows, np.float32).reshape(-1, 3)
    if len(corners) % 3:
        raise ValueError("its last facet is cut short")
    vertices, index = np.unique(corners + np.float32(0), axis=0, return_inverse=True)
    return vertices.astype(np.float32), index.reshape(-1, 3).astype(np.uint32)


READERS = {".ply": _read_ply, ".obj": _read_obj, ".stl": _read_stl}
"""What reads a file, by its suffix."""
