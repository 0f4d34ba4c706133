"""What queries find: against a brute-force oracle in double precision, and against each other."""

import espalier_rt as rt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rays_and_meshes import METHODS, TRIANGLE, brute_force, rays_through, soup

from espalier_scenes.soups import triangle_soup


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 300), size=st.sampled_from([0.01, 0.1, 1.0]))
def test_closest_hits_are_those_of_brute_force(method: str, seed: int, count: int, size: float) -> None:
    vertices, triangles = triangle_soup(seed, count, size)
    mesh = rt.Mesh(vertices, triangles)
    box = mesh if count else TRIANGLE
    origins, directions = rays_through(box, 100, seed)
    hits = rt.Accelerator.build(mesh, method).closest(origins, directions)
    expected, margin = brute_force(vertices, triangles, origins, directions)
    clear = margin > 1e-5
    np.testing.assert_allclose(hits.t[clear], expected[clear], rtol=1e-4, atol=1e-6)
    assert clear.mean() > 0.9


def test_all_methods_agree_to_the_bit() -> None:
    mesh = soup()
    origins, directions = rays_through(mesh, 20_000)
    first, *others = (rt.Accelerator.build(mesh, method).closest(origins, directions) for method in METHODS)
    assert (first.primitive != rt.MISS).mean() > 0.5
    for other in others:
        for column in ("t", "primitive", "u", "v", "normal"):
            np.testing.assert_array_equal(getattr(other, column), getattr(first, column), column)


@pytest.mark.parametrize("method", METHODS)
def test_any_hit_says_whether_there_is_a_closest_one(method: str) -> None:
    mesh = soup()
    accelerator = rt.Accelerator.build(mesh, method)
    origins, directions = rays_through(mesh, 20_000)
    far = np.linspace(0, 5, len(origins), dtype=np.float32)
    occluded = accelerator.occluded(origins, directions, 0.01, far)
    assert occluded.dtype == np.bool_
    assert 0.1 < occluded.mean() < 0.9
    np.testing.assert_array_equal(occluded, accelerator.closest(origins, directions, 0.01, far).primitive != rt.MISS)


def test_a_hit_is_described_by_its_triangle() -> None:
    vertices, triangles = triangle_soup(3, 1000, 0.1)
    mesh = rt.Mesh(vertices, triangles)
    origins, directions = rays_through(mesh, 5000)
    hits = rt.Accelerator.build(mesh).closest(origins, directions)
    hit = hits.primitive != rt.MISS
    a, b, c = vertices[triangles[hits.primitive[hit]]].astype(float).transpose(1, 0, 2)
    u, v = hits.u[hit, None].astype(float), hits.v[hit, None].astype(float)
    point = origins[hit] + hits.t[hit, None].astype(float) * directions[hit]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, point, atol=2e-5)
    normal = np.cross(b - a, c - a)
    np.testing.assert_allclose(hits.normal[hit], normal / np.linalg.norm(normal, axis=1, keepdims=True), atol=1e-6)


def test_a_miss_is_marked_in_every_column() -> None:
    hits = rt.Accelerator.build(TRIANGLE).closest([[2.0, 2.0, 1.0]], [[0.0, 0.0, -1.0]])
    assert (hits.t[0], hits.primitive[0], hits.u[0], hits.v[0]) == (np.inf, rt.MISS, 0, 0)
    np.testing.assert_array_equal(hits.normal, [[0, 0, 0]])


@pytest.mark.parametrize(
    ("tmin", "tmax", "hit"),
    [(0, np.inf, True), (2, 2, True), (2.5, np.inf, False), (0, 1.5, False), (3, 1, False), (-np.inf, 2, True)],
)
def test_both_ends_of_the_interval_belong_to_it(tmin: float, tmax: float, hit: bool) -> None:
    accelerator = rt.Accelerator.build(TRIANGLE)
    rays = [[0.2, 0.2, 1.0]], [[0.0, 0.0, -0.5]]
    hits = accelerator.closest(*rays, tmin, tmax)
    assert hits.t[0] == (2 if hit else np.inf)
    assert accelerator.occluded(*rays, tmin, tmax)[0] == hit


@pytest.mark.parametrize("method", METHODS)
def test_counting_tells_steps_and_tests_of_every_ray(method: str) -> None:
    mesh = soup()
    accelerator = rt.Accelerator.build(mesh, method)
    steps, tests = accelerator.counted(*rays_through(mesh, 1000))
    assert steps.dtype == tests.dtype == np.uint32
    assert steps.shape == tests.shape == (1000,)
    assert steps.max() > 3
    assert 0 < tests.max() <= accelerator.census()["references"]
    away, none = accelerator.counted([[9.0, 9.0, 9.0]], [[1.0, 0.0, 0.0]])
    assert away[0] <= 1
    assert none[0] == 0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("triangles", [np.empty((0, 3), np.uint32), np.uint32([[0, 0, 1], [0, 1, 0]])])
def test_a_mesh_without_area_is_never_hit(method: str, triangles: np.ndarray) -> None:
    mesh = rt.Mesh(np.float32([[0, 0, 0], [1, 0, 0]]), triangles)
    assert mesh.degenerate_count == mesh.triangle_count == len(triangles)
    accelerator = rt.Accelerator.build(mesh, method)
    origins, directions = rays_through(TRIANGLE, 100)
    assert (accelerator.closest(origins, directions).primitive == rt.MISS).all()
    assert not accelerator.occluded(origins, directions).any()
    assert accelerator.census()["references"] == 0
    assert len(accelerator.cells()) == 0
