"""Reading and writing triangle meshes as PLY with numpy: ASCII, and binary of either byte order. No bpy."""

from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .errors import BrokenModelError
from .geometry import Mesh, mesh

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
"""PLY's names of scalar types, as numpy's."""

HEADER_LIMIT = 1 << 16
"""Most bytes of a header; real ones have some hundreds."""


@dataclass(frozen=True)
class Element:
    """An element of the header: `properties` maps a name to a numpy type, or to two (count and items) of a list."""

    name: str
    count: int
    properties: dict[str, str | tuple[str, str]]


@dataclass(frozen=True, eq=False)
class PlyData:
    """A file's numbers: columns of its n vertices and m triangles by name, and the triangles' corners (m, 3) int64."""

    vertex: dict[str, NDArray[Any]]
    corners: NDArray[np.int64]
    face: dict[str, NDArray[Any]]

    @property
    def mesh(self) -> Mesh:
        """Vertices and triangles alone."""
        return mesh(np.stack([self.vertex[axis] for axis in "xyz"], axis=1), self.corners)


def read_ply(path: Path | str) -> Mesh:
    """The vertices and triangles of a PLY file, everything else in it left out. Raises as `read_ply_data`."""
    return read_ply_data(path).mesh


def read_ply_data(path: Path | str) -> PlyData:
    """All numbers of a PLY file whose vertices come first and then faces, all of them triangles.

    Raises BrokenModelError where the file is no such PLY, is cut short, or names a vertex it has not; OSError where
    it cannot be read.
    """
    path = Path(path)
    with path.open("rb") as stream:
        try:
            order, elements = _read_header(stream)
            vertex, face = _vertex_and_face(elements)
            found = _read_text(stream, vertex, face) if order == "a" else _read_binary(stream, order, vertex, face)
        except (ValueError, KeyError, IndexError) as error:
            raise BrokenModelError(path, str(error)) from error
    count = len(found.vertex["x"])
    if len(found.corners) and not (found.corners.min() >= 0 and found.corners.max() < count):
        raise BrokenModelError(path, "a face names a vertex that is not in the file")
    return found


def write_ply(path: Path | str, source: Mesh, comments: tuple[str, ...] = ()) -> None:
    """Write a mesh as binary little-endian PLY, the form of this project's models."""
    vertices, triangles = source
    lines = ["ply", "format binary_little_endian 1.0", *(f"comment {comment}" for comment in comments)]
    lines += [f"element vertex {len(vertices)}", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    records = np.empty(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    records["count"], records["corners"] = 3, triangles
    with Path(path).open("wb") as stream:
        stream.write("\n".join(lines).encode("ascii"))
        stream.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        stream.write(records.tobytes())


def _read_header(stream: IO[bytes]) -> tuple[str, list[Element]]:
    """Byte order ("a" for ASCII, "<", ">") and elements; the stream is left at the first byte of data."""
    if stream.readline(HEADER_LIMIT).strip() != b"ply":
        raise ValueError("it does not begin with 'ply'")
    order, elements = "", []
    while True:
        line = stream.readline(HEADER_LIMIT)
        if not line or stream.tell() > HEADER_LIMIT:
            raise ValueError("its header does not end")
        words = line.decode("ascii", "replace").split()
        if words[:1] == ["end_header"]:
            break
        if words[:1] == ["format"]:
            order = {"ascii": "a", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
        elif words[:1] == ["element"]:
            elements.append(Element(words[1], int(words[2]), {}))
        elif words[:2] == ["property", "list"]:
            elements[-1].properties[words[4]] = (TYPES[words[2]], TYPES[words[3]])
        elif words[:1] == ["property"]:
            elements[-1].properties[words[2]] = TYPES[words[1]]
    if not order:
        raise ValueError("its header names no format")
    return order, elements


def _vertex_and_face(elements: list[Element]) -> tuple[Element, Element]:
    if [element.name for element in elements[:2]] != ["vertex", "face"]:
        raise ValueError("its first elements are not vertex and face")
    vertex, face = elements[:2]
    if any(isinstance(kind, tuple) for kind in vertex.properties.values()) or not {*"xyz"} <= vertex.properties.keys():
        raise ValueError("its vertices are not scalars with x, y and z")
    if not isinstance(next(iter(face.properties.values()), None), tuple):
        raise ValueError("its faces do not begin with a list of vertices")
    return vertex, face


def _read_binary(stream: IO[bytes], order: str, vertex: Element, face: Element) -> PlyData:
    columns = np.dtype([(name, order + str(kind)) for name, kind in vertex.properties.items()])
    records = _records(stream, columns, vertex)
    listed = next(iter(face.properties.values()))
    assert isinstance(listed, tuple)
    fields: list[Any] = [("count", order + listed[0]), ("corners", order + listed[1], 3)]
    others = list(face.properties.items())[1:]
    for name, kind in others:
        if isinstance(kind, tuple):
            raise ValueError(f"its faces have a second list, '{name}'")
        fields.append((f"face {name}", order + kind))
    faces = _records(stream, np.dtype(fields), face)
    if len(faces) and not (faces["count"] == 3).all():
        raise ValueError("it has faces that are not triangles")
    return PlyData(
        {name: records[name] for name in vertex.properties},
        faces["corners"].astype(np.int64),
        {name: faces[f"face {name}"] for name, _ in others},
    )


def _records(stream: IO[bytes], dtype: np.dtype[Any], element: Element) -> NDArray[Any]:
    data = stream.read(element.count * dtype.itemsize)
    if len(data) != element.count * dtype.itemsize:
        raise ValueError(f"it ends within its {element.count} {element.name} records")
    return np.frombuffer(data, dtype, element.count)


def _read_text(stream: IO[bytes], vertex: Element, face: Element) -> PlyData:
    points, faces = _rows(stream, vertex), _rows(stream, face)
    if points.shape[1] < len(vertex.properties):
        raise ValueError("its vertex lines are short")
    if len(faces) and (faces.shape[1] < 3 + len(face.properties) or not (faces[:, 0] == 3).all()):
        raise ValueError("it has faces that are not triangles")
    others = list(face.properties)[1:]
    return PlyData(
        {name: points[:, column] for column, name in enumerate(vertex.properties)},
        faces[:, 1:4].astype(np.int64),
        {name: faces[:, 4 + column] for column, name in enumerate(others)},
    )


def _rows(stream: IO[bytes], element: Element) -> NDArray[np.float64]:
    """(count, columns) float64 of the next `count` lines, which all have as many numbers."""
    if element.count == 0:
        return np.zeros((0, 3 + len(element.properties)))
    lines = [stream.readline() for _ in range(element.count)]
    if not lines[-1]:
        raise ValueError(f"it ends within its {element.count} {element.name} lines")
    columns = len(lines[0].split())
    numbers = np.array(b" ".join(lines).split(), np.float64)
    if len(numbers) != columns * element.count:
        raise ValueError(f"its {element.name} lines have different lengths")
    return numbers.reshape(element.count, columns)
