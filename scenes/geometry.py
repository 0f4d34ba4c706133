"""Triangle meshes from numpy: the solids and surfaces the generated scenes are made of. No bpy.

A mesh is `(vertices, triangles)`: (n, 3) float32 in metres, z up, and (m, 3) uint32, counter-clockwise from outside.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float32 = NDArray[np.float32]
UInt32 = NDArray[np.uint32]
Mesh = tuple[Float32, UInt32]


def mesh(vertices: ArrayLike, triangles: ArrayLike) -> Mesh:
    """The arrays in the types and shapes every generator returns."""
    points = np.ascontiguousarray(vertices, np.float32).reshape(-1, 3)
    return points, np.ascontiguousarray(triangles, np.uint32).reshape(-1, 3)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of several, in their order."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes[:-1]])
    vertices = np.concatenate([vertices for vertices, _ in meshes])
    return mesh(
        vertices, np.concatenate([tri.astype(np.int64) + start for (_, tri), start in zip(meshes, starts, strict=True)])
    )


def transformed(source: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """The mesh under a (4, 4) matrix of column vectors."""
    vertices, triangles = source
    return mesh(vertices @ matrix[:3, :3].T + matrix[:3, 3], triangles)


def instanced(source: Mesh, matrices: NDArray[np.float64]) -> Mesh:
    """Copies of a mesh, one for each of the (k, 4, 4) matrices, joined."""
    vertices, triangles = source
    points = np.einsum("kij,nj->kni", matrices[:, :3, :3], vertices) + matrices[:, None, :3, 3]
    starts = np.arange(len(matrices), dtype=np.int64)[:, None, None] * len(vertices)
    return mesh(points, triangles.astype(np.int64) + starts)


def placement(position: ArrayLike, turn: float = 0.0, scale: ArrayLike = 1.0) -> NDArray[np.float64]:
    """(4, 4) matrix: scale, then turn about z in radians, then move."""
    matrix = np.eye(4)
    cosine, sine = np.cos(turn), np.sin(turn)
    matrix[:3, :3] = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]) * np.asarray(scale)
    matrix[:3, 3] = position
    return matrix


def welded(source: Mesh) -> Mesh:
    """The mesh with bit-equal positions merged, and without the triangles that then repeat a vertex."""
    vertices, triangles = source
    points, index = np.unique(vertices + np.float32(0), axis=0, return_inverse=True)
    corners = index.reshape(-1)[triangles]
    a, b, c = corners.T
    return mesh(points, corners[(a != b) & (b != c) & (c != a)])


def sheet(points: NDArray[np.float64]) -> Mesh:
    """Two triangles for each quad of a (rows, columns, 3) net of points."""
    rows, columns = points.shape[:2]
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    return mesh(points, np.stack([a, b, c, a, c, d], axis=-1))


def plane(
    half: float,
    divisions: int = 1,
    height: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]] | None = None,
) -> Mesh:
    """A square of edge 2*half about the origin, facing up; `height(x, y)` lifts its points."""
    y, x = np.meshgrid(*[np.linspace(-half, half, divisions + 1)] * 2, indexing="ij")
    return sheet(np.stack([x, y, np.zeros_like(x) if height is None else height(x, y)], axis=-1))


def box(lower: ArrayLike, upper: ArrayLike) -> Mesh:
    """A closed axis-aligned box of 12 triangles."""
    unit = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]])
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    return mesh(lower + unit * (upper - lower), quads[:, [0, 1, 2, 0, 2, 3]])


def inverted(source: Mesh) -> Mesh:
    """The mesh facing the other way."""
    return mesh(source[0], source[1][:, ::-1])


def lathe(profile: ArrayLike, segments: int) -> Mesh:
    """The surface of revolution about z of a (k, 2) profile of (radius, height) points, listed upwards."""
    radius, height = np.asarray(profile, float).T
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    angle[-1] = 0.0
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = np.concatenate(
        [radius[:, None, None] * ring, np.broadcast_to(height[:, None, None], (len(height), segments + 1, 1))], axis=2
    )
    return welded(sheet(points))


def icosahedron() -> Mesh:
    """The regular icosahedron of circumradius 1."""
    golden = (1 + 5**0.5) / 2
    signs = [(a, b) for a in (-1, 1) for b in (-golden, golden)]
    points = [(0, a, b) for a, b in signs] + [(a, b, 0) for a, b in signs] + [(b, 0, a) for a, b in signs]
    vertices = np.array(points, float) / np.hypot(1, golden)
    distance = np.linalg.norm(vertices[:, None] - vertices, axis=-1)
    near = (distance > 0) & (distance < 1.2)
    faces = [
        (i, j, k) if np.dot(np.cross(vertices[i], vertices[j]), vertices[k]) > 0 else (i, k, j)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    return mesh(vertices, faces)


def icosphere(level: int, radius: float = 1.0) -> Mesh:
    """A closed sphere of 20 * 4**level triangles: the icosahedron's, each split in four `level` times."""
    vertices, triangles = icosahedron()
    points, faces = vertices.astype(float), triangles.astype(np.int64)
    for _ in range(level):
        points, faces = _split_in_four(points, faces)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return mesh(points * radius, faces)


def _split_in_four(
    points: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    key, index = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_inverse=True)
    middles = (points[key // len(points)] + points[key % len(points)]) / 2
    a, b, c = faces.T
    ab, bc, ca = (index.reshape(-1, 3) + len(points)).T
    split = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([points, middles]), split.reshape(-1, 3)


def waves(
    points: NDArray[np.float64], random: np.random.Generator, scale: float, octaves: int = 5, count: int = 12
) -> NDArray[np.float64]:
    """Smooth noise in about -1..1 at (..., 3) points: per octave `count` sine waves of random direction and phase.

    scale: length of the longest wave, in metres; each octave halves it and its height.
    """
    total = np.zeros(points.shape[:-1])
    for octave in range(octaves):
        directions = random.normal(size=(count, 3))
        directions *= (2 * np.pi * 2**octave / scale) / np.linalg.norm(directions, axis=1, keepdims=True)
        phases = random.uniform(0, 2 * np.pi, count)
        for direction, phase in zip(directions, phases, strict=True):
            total += np.sin(points @ direction + phase) * 0.5**octave
    return total / np.sqrt(2 * count)
