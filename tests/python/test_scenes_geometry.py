"""The generators: right counts, closed where they should be, the same for the same seed."""

from collections import Counter

import numpy as np
import pytest

from espalier_scenes import city, forest, framing, geometry, room, soups, stadium
from espalier_scenes.catalogue import ENTRIES, find
from espalier_scenes.geometry import Mesh
from espalier_scenes.teapot import teapot

GENERATED = [entry.name for entry in ENTRIES[:8] if entry.finish is None]


def is_closed(mesh: Mesh) -> bool:
    """Every directed edge is met by one in the other direction."""
    a, b, c = mesh[1].astype(np.int64).T
    edges = Counter(np.concatenate([a, b, c]) << 32 | np.concatenate([b, c, a]))
    return all(count == 1 and edges[(edge & 0xFFFFFFFF) << 32 | edge >> 32] == 1 for edge, count in edges.items())


def volume(mesh: Mesh) -> float:
    """Signed volume by the divergence theorem: positive where the faces point outwards."""
    a, b, c = (mesh[0].astype(float)[mesh[1][:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("level", [0, 1, 2, 4])
def test_an_icosphere_is_closed_and_has_20_by_4_to_the_level_triangles(level: int) -> None:
    sphere = geometry.icosphere(level)
    assert len(sphere[1]) == 20 * 4**level
    assert len(sphere[0]) == 10 * 4**level + 2
    assert is_closed(sphere)
    assert np.allclose(np.linalg.norm(sphere[0], axis=1), 1, atol=1e-6)
    assert 0 < volume(sphere) <= 4 / 3 * np.pi


def test_boxes_lathes_and_the_scan_are_closed_and_face_outwards() -> None:
    assert volume(geometry.box((0, 0, 0), (1, 2, 3))) == pytest.approx(6)
    cone = geometry.lathe([(0, 0), (1, 0), (0, 1)], 64)
    assert volume(cone) == pytest.approx(np.pi / 3, rel=0.01)
    for mesh in (geometry.box((0, 0, 0), (1, 1, 1)), cone, room.scan(level=4)):
        assert is_closed(mesh)
        assert volume(mesh) > 0
    assert not is_closed(geometry.plane(1.0, 3))


def test_instancing_equals_transforming_one_by_one() -> None:
    source = geometry.box((0, 0, 0), (1, 1, 1))
    matrices = np.stack([geometry.placement((1, 2, 3), 0.3, 2.0), geometry.placement((-1, 0, 0), 1.0)])
    several, joined = (
        geometry.instanced(source, matrices),
        geometry.join([geometry.transformed(source, matrix) for matrix in matrices]),
    )
    assert np.allclose(several[0], joined[0], atol=1e-6)
    assert np.array_equal(several[1], joined[1])


def test_the_teapot_has_newells_extent() -> None:
    vertices, triangles = teapot(8)
    assert vertices.min(axis=0) == pytest.approx([-3, -2, 0], abs=0.01)
    assert vertices.max(axis=0) == pytest.approx([3.434, 2, 3.15], abs=0.01)
    assert len(teapot(16)[1]) == pytest.approx(4 * len(triangles), rel=0.05)


def test_no_generator_makes_a_degenerate_triangle_of_the_teapot() -> None:
    vertices, triangles = teapot(12)
    a, b, c = vertices[triangles].astype(float).transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0


@pytest.mark.parametrize("name", GENERATED)
def test_a_scene_is_the_same_for_a_seed_and_well_formed(name: str) -> None:
    vertices, triangles = find(name).mesh(seed=3)
    assert vertices.dtype == np.float32
    assert triangles.dtype == np.uint32
    assert np.isfinite(vertices).all()
    assert triangles.max() < len(vertices)
    again = find(name).mesh(seed=3)
    assert np.array_equal(vertices, again[0])
    assert np.array_equal(triangles, again[1])


@pytest.mark.parametrize("make", [soups.triangle_soup, soups.thin_triangles, city.cars, forest.tuft, room.scan])
def test_another_seed_gives_another_mesh(make: object) -> None:
    assert not np.array_equal(make(seed=0)[0], make(seed=1)[0])


def test_the_soup_fills_its_cube_evenly() -> None:
    vertices, triangles = soups.triangle_soup(count=80_000)
    octant = (vertices[triangles].mean(axis=1) > 0) @ [1, 2, 4]
    assert np.bincount(octant, minlength=8) == pytest.approx(np.full(8, 10_000), rel=0.05)


def test_thin_triangles_are_thin() -> None:
    vertices, triangles = soups.thin_triangles(count=1000)
    a, b, c = vertices[triangles].astype(float).transpose(1, 0, 2)
    assert (np.linalg.norm(c - a, axis=1) / np.linalg.norm(b - a, axis=1)).min() > 100


def test_the_room_is_closed_to_rays_from_its_camera() -> None:
    """Floor, ceiling and walls alone: every direction from inside meets one."""
    stage = room.stage(0)
    shell = geometry.join([part.mesh for part in stage.parts if part.name.endswith(("Wall", "Floor", "Ceiling"))])
    assert is_closed(geometry.welded(shell))
    assert volume(shell) == pytest.approx(-room.WIDTH * room.DEPTH * room.HEIGHT, rel=1e-5)


def test_most_of_the_stadium_is_far_from_its_teapot() -> None:
    parts = {part.name: part.mesh for part in stadium.stage(0).parts}
    assert np.ptp(parts["Teapot"][0], axis=0).max() < 1 < 150 < np.ptp(parts["Stands"][0], axis=0).max()


def test_every_house_of_the_city_stands_alone() -> None:
    boxes = np.array([house.footprint for house in city.buildings(1)])
    apart = (boxes[:, None, 2] < boxes[:, 0]) | (boxes[:, None, 3] < boxes[:, 1])
    assert (apart | apart.T | np.eye(len(boxes), dtype=bool)).all()


@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.8])
@pytest.mark.parametrize("backward", [(1, -2, 1), (0, 0, 1), (0, -1, 0)])
def test_a_framed_camera_sees_all_points_and_one_at_the_edge(aspect: float, backward: tuple[int, int, int]) -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3)) * [3, 1, 0.5] + [100, -40, 7]
    found = framing.frame(points, backward, lens=50.0, aspect=aspect, margin=1.0)
    matrix = framing.camera_to_world(found.position, found.target)
    x, y, z = (np.linalg.inv(matrix) @ np.c_[points, np.ones(len(points))].T)[:3]
    slope = 18.0 / 50.0
    reach = np.maximum(np.abs(x / -z) / (slope * min(1, aspect)), np.abs(y / -z) / (slope * min(1, 1 / aspect)))
    assert (z < 0).all()
    assert reach.max() == pytest.approx(1.0, abs=1e-6)
