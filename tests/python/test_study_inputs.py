"""Meshes are read without Blender, and rays are what their class says."""

from pathlib import Path

import espalier_rt
import numpy as np
import pytest
from studies import load

from espalier.study import mesh_files, rays, sources
from espalier.study.plan import RAY_CLASSES, Group, family

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3//1 -1\n"
STL = """solid s
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1 0
 endloop
endfacet
endsolid s
"""


def test_an_obj_is_turned_up_and_its_faces_are_fanned(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(OBJ)
    vertices, triangles = mesh_files.read(tmp_path / "a.obj")
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]


def test_an_stl_is_read_as_text_and_as_binary(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_text(STL)
    record = np.zeros(2, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]))
    record["corners"] = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]]
    (tmp_path / "b.stl").write_bytes(b"solid".ljust(80) + (2).to_bytes(4, "little") + record.tobytes())
    for name, count in (("a", 1), ("b", 2)):
        vertices, triangles = mesh_files.read(tmp_path / f"{name}.stl")
        assert triangles.shape == (count, 3)
        assert len(vertices) == count + 2, "equal positions are merged"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.obj", "v 0 0 0\nf 1 2 3\n"),
        ("a.obj", "v 0 0 0\nf 0 1 1\n"),
        ("a.obj", "v zero\n"),
        ("a.obj", "nothing"),
        ("a.stl", "solid\nvertex 0 0 0\n"),
        ("a.stl", ""),
    ],
)
def test_a_broken_file_is_named(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(mesh_files.MeshFileError, match=name):
        mesh_files.read(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "needs"),
    [("suzanne", True), ("dragon", False), ("city", False), ("a.blend", True), ("a.glb", True), ("a.PLY", False)],
)
def test_what_needs_blender_is_known(text: str, needs: bool) -> None:
    assert sources.needs_blender(text) is needs


def test_a_generated_scene_has_its_own_camera() -> None:
    source = sources.load("cornell_box", 1.0)
    camera = espalier_rt.Camera(**source.camera, resolution=(32, 32))
    accelerator = espalier_rt.Accelerator.build(espalier_rt.Mesh(source.vertices, source.triangles), "bvh-sah")
    assert (accelerator.closest(*camera.rays()).primitive != espalier_rt.MISS).mean() > 0.5
    assert source.digest == sources.load("cornell_box", 1.0).digest


def test_blocks_hold_every_pixel_once() -> None:
    order = rays.block_order(20, 11)
    assert sorted(order) == list(range(220))
    y, x = np.divmod(order[:64], 20)
    assert x.max() == y.max() == 7


@pytest.fixture(scope="module")
def scene() -> rays.Scene:
    source = load(Group("large", 32, 24, "primary"), lambda _: None)
    mesh = espalier_rt.Mesh(source.vertices, source.triangles)
    return rays.Scene(source, mesh, lambda method: espalier_rt.Accelerator.build(mesh, method))


def batches(scene: rays.Scene, name: str) -> tuple[rays.Batch, ...]:
    return rays.batches(Group("large", 32, 24, name), scene, 0, lambda: None)


@pytest.mark.parametrize("name", RAY_CLASSES)
def test_every_class_has_rays_and_the_same_ones_again(scene: rays.Scene, name: str) -> None:
    for first, second in zip(batches(scene, name), batches(scene, name), strict=True):
        assert len(first) > 100
        assert (first.origins == second.origins).all()
        assert (first.directions == second.directions).all()


def test_shadow_rays_end_at_the_light_and_start_above_the_surface(scene: rays.Scene) -> None:
    _, shadow = batches(scene, "primary-shadow")
    assert shadow.query == "occluded"
    ends = shadow.origins + shadow.directions
    np.testing.assert_allclose(ends, np.broadcast_to(scene.source.light, ends.shape), rtol=1e-5, atol=1e-5)
    radii = np.linalg.norm(shadow.origins, axis=1)
    lit = np.einsum("ij,ij->i", shadow.origins / radii[:, None], shadow.directions) > 0
    occluded = scene.build("bvh-sah").occluded(shadow.origins, shadow.directions, tmax=1.0)
    assert (occluded != lit).mean() > 0.97, "on a ball, what faces the light is lit"


def test_diffuse_rays_leave_the_surface_cosine_distributed(scene: rays.Scene) -> None:
    (diffuse,) = batches(scene, "diffuse")
    normals = diffuse.origins / np.linalg.norm(diffuse.origins, axis=1, keepdims=True)
    cosines = np.einsum("ij,ij->i", normals, diffuse.directions)
    assert cosines.min() > -0.2, "facets lean from the ball's normal"
    assert cosines.mean() == pytest.approx(2 / 3, abs=0.05)
    (ao,) = batches(scene, "ao")
    assert ao.query == "occluded"
    assert ao.tmax.max() < np.inf


@pytest.mark.parametrize(
    ("method", "kind"),
    [
        ("bvh-sah+reinsert", "bvh"),
        ("sbvh", "bvh"),
        ("grid-two-level", "grid"),
        ("hybrid-sampled", "hybrid"),
        ("hapala", "hybrid"),
        ("fellner", "hybrid"),
        ("embree", "reference"),
    ],
)
def test_methods_belong_to_families(method: str, kind: str) -> None:
    assert family(method) == kind
