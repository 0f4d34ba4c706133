"""numpy in and out: layouts that are read in place, types that are converted, and errors that say what is wrong."""

import re

import espalier_rt as rt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rays_and_meshes import TRIANGLE, rays_through, soup

MESH = soup()
ACCELERATOR = rt.Accelerator.build(MESH)
ORIGINS, DIRECTIONS = rays_through(MESH, 3000)
EXPECTED = ACCELERATOR.closest(ORIGINS, DIRECTIONS)


def with_layout(array: np.ndarray, layout: str) -> np.ndarray:
    """The same values as an (n, 3) float32 array of another layout in memory."""
    n = len(array)
    wide = np.full((2 * n, 7), np.nan, np.float32)
    record = np.zeros(n, [("id", "u1"), ("place", "<f4", 3)])
    match layout:
        case "C":
            return array
        case "F":
            return np.asfortranarray(array)
        case "every other row and column":
            wide[::2, 1:6:2] = array
            return wide[::2, 1:6:2]
        case "transposed columns":
            wide[:3].reshape(-1)[: 3 * n] = 0
            columns = np.full((3, n + 5), np.nan, np.float32)
            columns[:, :n] = array.T
            return columns[:, :n].T
        case "reversed":
            return array[::-1].copy()[::-1]
        case "reversed columns":
            return array[:, ::-1].copy()[:, ::-1]
        case "unaligned":
            record["place"] = array
            return record["place"]
        case "big-endian":
            return array.astype(">f4")
        case "read-only":
            copy = array.copy()
            copy.flags.writeable = False
            return copy
        case "subclass":
            return array.view(np.recarray)
    raise AssertionError(layout)


LAYOUTS = [
    "C", "F", "every other row and column", "transposed columns", "reversed", "reversed columns", "unaligned",
    "big-endian", "read-only", "subclass",
]  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_any_layout_gives_the_same_hits(layout: str) -> None:
    origins, directions = with_layout(ORIGINS, layout), with_layout(DIRECTIONS, layout)
    np.testing.assert_array_equal(origins, ORIGINS)
    hits = ACCELERATOR.closest(origins, directions)
    np.testing.assert_array_equal(hits.t, EXPECTED.t)
    np.testing.assert_array_equal(hits.primitive, EXPECTED.primitive)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_any_layout_gives_the_same_mesh(layout: str) -> None:
    vertices = np.float32([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
    triangles = np.uint32([[0, 1, 2], [1, 2, 3]])
    mesh = rt.Mesh(with_layout(vertices, layout), np.asfortranarray(triangles))
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 2, 3]])
    hits = rt.Accelerator.build(mesh).closest([[0.1, 0.1, 9.0]], [[0.0, 0.0, -1.0]])
    assert hits.primitive[0] == 1


@settings(max_examples=200, deadline=None)
@given(
    rows=st.integers(0, 50), step=st.integers(1, 4), first=st.integers(0, 3), columns=st.permutations(range(3)),
    stretch=st.integers(1, 3), fortran=st.booleans(), reverse=st.booleans(),
)  # fmt: skip
def test_any_slice_of_a_larger_array_is_read_right(rows, step, first, columns, stretch, fortran, reverse) -> None:
    larger = np.full((first + rows * step + 5, 3 * stretch + 2), np.nan, np.float32, order="F" if fortran else "C")
    view = larger[first : first + rows * step : step, 1 : 1 + 3 * stretch : stretch]
    view = view[::-1] if reverse else view
    view[:] = ORIGINS[:rows]
    hits = ACCELERATOR.closest(view, DIRECTIONS[:rows])
    np.testing.assert_array_equal(hits.t, EXPECTED.t[:rows])


def test_one_origin_serves_all_rays() -> None:
    origin = MESH.bounds.mean(axis=0)
    shared = ACCELERATOR.closest(np.broadcast_to(origin, DIRECTIONS.shape), DIRECTIONS)
    repeated = ACCELERATOR.closest(np.tile(origin, (len(DIRECTIONS), 1)), DIRECTIONS)
    np.testing.assert_array_equal(shared.t, repeated.t)


@pytest.mark.parametrize("dtype", ["f2", "f8", ">f8", "g", "i1", "u1", "i2", "u2", ">i2"])
def test_floats_and_short_integers_are_converted(dtype: str) -> None:
    vertices = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype)
    mesh = rt.Mesh(vertices, [[0, 1, 2]])
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [4, 4, 0]])
    assert mesh.bounds.dtype == np.float32


@pytest.mark.parametrize("dtype", ["i4", "u4", "i8", "u8", "?", "c8", "S4", "O", "M8[s]", "V4"])
def test_types_that_may_change_values_are_refused(dtype: str) -> None:
    vertices = np.zeros((3, 3), dtype)
    with pytest.raises(rt.MeshError, match=r"vertices must be a float32 array of shape \(n, 3\); got .*astype"):
        rt.Mesh(vertices, [[0, 1, 2]])


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4", ">u8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_integers_of_any_type_are_indices(dtype: str, order: str) -> None:
    triangles = np.array([[0, 1, 2], [2, 1, 3]], dtype, order=order)
    mesh = rt.Mesh(np.eye(4, 3, dtype=np.float32), triangles)
    hits = rt.Accelerator.build(mesh).closest([[0.3, 0.3, 0.3]], [[0.5, 0.5, 0.5]])
    assert mesh.triangle_count == 2
    assert hits.primitive[0] == 0


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8"])
def test_a_negative_index_is_named(dtype: str) -> None:
    with pytest.raises(rt.MeshError, match=r"triangles\[1\] is \[0, -1, 2\]; indices must be from 0 to"):
        rt.Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2], [0, -1, 2]], dtype))


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((4, 2), "f4"), [[0, 1, 2]], r"vertices must be .*\(n, 3\); got float32 of shape \(4, 2\)"),
        (np.zeros(9, "f4"), [[0, 1, 2]], r"got float32 of shape \(9,\)"),
        (np.zeros((1, 3, 3), "f4"), [[0, 1, 2]], r"got float32 of shape \(1, 3, 3\)"),
        (np.float32(1), [[0, 1, 2]], r"got float32 of shape \(\)"),
        (None, [[0, 1, 2]], r"vertices must be .*got object of shape \(\)"),
        ([[0.0, 0.0], [0.0]], [[0, 1, 2]], r"vertices must be .*'list'.*numpy makes no array"),
        (np.eye(3, dtype="f4"), [0, 1, 2], r"triangles must be a uint32 array of shape \(n, 3\); got int64 of"),
        (np.eye(3, dtype="f4"), np.zeros((2, 4), "u4"), r"triangles must be .*got uint32 of shape \(2, 4\)"),
        (np.eye(3, dtype="f4"), np.zeros((2, 3), "f4"), r"triangles must be .*got float32 of shape \(2, 3\)"),
        (np.eye(3, dtype="f4"), np.zeros((2, 3), "?"), r"triangles must be .*got bool of shape \(2, 3\)"),
        (np.eye(3, dtype="f4"), [[0, 1, 3]], r"triangle 0 has vertex indices \[0, 1, 3\].*only 3 vertices"),
        (np.eye(3, dtype="f4"), np.array([[0, 1, 2**32]]), r"triangles\[0\] is \[0, 1, 4294967296\]"),
        (np.float32([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]]), [[0, 1, 2]], r"vertex 1 is \(1, NaN, 0\)"),
        (np.float32([[0, 0, np.inf], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]], r"vertex 0 is \(0, 0, inf\)"),
        (np.float32([[0, 0, 0], [2e18, 0, 0], [0, 1, 0]]), [[0, 1, 2]], r"vertex 1 .*scale it down"),
    ],
)
def test_an_unusable_mesh_says_what_is_wrong(vertices: object, triangles: object, message: str) -> None:
    with pytest.raises(rt.MeshError, match=message):
        rt.Mesh(vertices, triangles)


RAY = np.float32([[0.2, 0.2, 1]]), np.float32([[0, 0, -1]])
QUERIES = ["closest", "occluded", "counted"]


@pytest.mark.parametrize("query", QUERIES)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((RAY[0][:, :2], RAY[1]), r"origins must be a float32 array of shape \(n, 3\); got float32 of shape \(1, 2\)"),
        ((RAY[0], RAY[1][0]), r"directions must be .*got float32 of shape \(3,\)"),
        ((RAY[0], np.int64([[0, 0, -1]])), r"directions must be .*got int64 .*astype\('float32'\)"),
        ((np.repeat(RAY[0], 2, axis=0), RAY[1]), "2 origins, but 1 directions"),
        ((*RAY, np.zeros(2)), r"tmin must be a number or a float32 array of shape \(1,\); got float64 of shape \(2,\)"),
        ((*RAY, 0.0, np.zeros((1, 1))), r"tmax must be .*got float64 of shape \(1, 1\)"),
        ((*RAY, "near"), r"tmin must be a number .*got <U4"),
        ((*RAY, 0.0, [None]), r"tmax must be .*got object of shape \(1,\)"),
        ((RAY[0], RAY[1] * 0), r"ray 0 has direction .*zero or too short"),
        ((RAY[0] * np.nan, RAY[1]), r"ray 0 has origin .*not finite"),
        ((RAY[0], RAY[1] * np.inf), r"ray 0 has direction .*not finite"),
        ((*RAY, np.nan), r"ray 0 has the interval \[NaN, inf\]"),
    ],
)
def test_unusable_rays_say_what_is_wrong(query: str, arguments: tuple, message: str) -> None:
    accelerator = rt.Accelerator.build(TRIANGLE)
    with pytest.raises(rt.RayError, match=message):
        getattr(accelerator, query)(*arguments)


def test_the_first_unusable_ray_is_named_for_any_number_of_threads() -> None:
    origins, directions = rays_through(MESH, 20_000)
    directions[[7_777, 15_000]] = 0
    for threads in (1, 2):
        with pytest.raises(rt.RayError, match=r"^ray 7777 "):
            ACCELERATOR.closest(origins, directions, threads=threads)


@pytest.mark.parametrize(
    "limit", [2, 2.0, np.float32(2), np.float64(2), np.int16(2), np.array(2.0), np.full(3000, 2.0)]
)
def test_a_limit_is_a_number_or_one_for_each_ray(limit: object) -> None:
    expected = np.where(EXPECTED.t <= 2, EXPECTED.t, np.inf)
    assert 0 < np.isfinite(expected).sum() < np.isfinite(EXPECTED.t).sum()
    np.testing.assert_array_equal(ACCELERATOR.closest(ORIGINS, DIRECTIONS, 0, limit).t, expected)


def test_limits_of_every_ray_may_have_strides() -> None:
    limits = np.random.default_rng(0).uniform(0, 5, (3000, 2)).astype(np.float32)
    expected = np.where((limits[:, 0] <= EXPECTED.t) & (EXPECTED.t <= limits[:, 1]), EXPECTED.t, np.inf)
    found = ACCELERATOR.closest(ORIGINS, DIRECTIONS, limits[:, 0], limits[:, 1]).t
    first = limits[:, 0] <= EXPECTED.t
    np.testing.assert_array_equal(found[first], expected[first])
    np.testing.assert_array_equal(ACCELERATOR.closest(ORIGINS, DIRECTIONS, 0, limits[::-1, 1]).t <= limits[::-1, 1],
                                  EXPECTED.t <= limits[::-1, 1])  # fmt: skip


def test_no_ray_gives_empty_arrays() -> None:
    none = np.empty((0, 3), np.float32)
    hits = ACCELERATOR.closest(none, none)
    assert len(hits) == 0
    assert hits.t.shape == hits.primitive.shape == hits.u.shape == hits.v.shape == (0,)
    assert hits.normal.shape == (0, 3)
    assert ACCELERATOR.occluded(none, none, np.empty(0), np.empty(0)).shape == (0,)


def test_hits_are_numpy_arrays_that_nobody_can_change() -> None:
    hits = ACCELERATOR.closest(ORIGINS, DIRECTIONS)
    assert [a.dtype for a in (hits.t, hits.primitive, hits.u, hits.v, hits.normal)] == ["f4", "u4", "f4", "f4", "f4"]
    for array in (hits.t, hits.primitive, hits.u, hits.v, hits.normal):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert hits.normal is hits.normal
    assert hits.t is hits.t
    with pytest.raises(AttributeError):
        hits.t = np.zeros(3)


def test_results_outlive_what_they_came_from() -> None:
    mesh = rt.Mesh(np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]])
    accelerator = rt.Accelerator.build(mesh)
    assert accelerator.mesh is mesh
    hits = accelerator.closest(*RAY)
    del mesh, accelerator
    np.testing.assert_array_equal(hits.normal, [[0, 0, 1]])


def test_the_callers_arrays_stay_as_they_were() -> None:
    origins, directions = ORIGINS.copy(), DIRECTIONS.copy()
    ACCELERATOR.closest(origins, directions)
    np.testing.assert_array_equal(origins, ORIGINS)
    np.testing.assert_array_equal(directions, DIRECTIONS)
    assert origins.flags.writeable


def test_everything_says_what_it_is() -> None:
    assert repr(TRIANGLE) == "Mesh(vertices=3, triangles=1)"
    accelerator = rt.Accelerator.build(TRIANGLE, "grid")
    assert repr(accelerator) == "Accelerator(method='grid', triangles=1)"
    assert repr(accelerator.closest(*RAY)) == "Hits(rays=1, hit=1)"
    assert repr(rt.Job()) == "Job(phase='', progress=0.000, cancelled=False)"
    assert re.fullmatch(r"Cells\(count=\d+, truncated=False\)", repr(accelerator.cells()))


@pytest.mark.parametrize(
    ("error", "base"),
    [
        (rt.MeshError, ValueError),
        (rt.RayError, ValueError),
        (rt.ConfigError, ValueError),
        (rt.SceneError, ValueError),
        (rt.Cancelled, Exception),
        (rt.OutOfMemory, MemoryError),
        (rt.InternalError, RuntimeError),
    ],
)
def test_errors_are_python_errors_with_a_place_and_a_text(error: type[Exception], base: type[Exception]) -> None:
    assert issubclass(error, (rt.EspalierError, base))
    assert issubclass(error, rt.EspalierError)
    assert issubclass(error, base)
    assert error.__module__ == "espalier_rt"
    assert error.__doc__


def test_an_allocation_that_is_refused_is_out_of_memory() -> None:
    none = np.broadcast_to(np.zeros(3, np.float32), (2**58, 3))
    with pytest.raises(rt.OutOfMemory, match=r"memory|allocate"):
        ACCELERATOR.closest(none, none)
    with pytest.raises(MemoryError):
        rt.Mesh(none, [[0, 1, 2]])
