"""Scenes, cameras and pictures: what goes in, what comes out, and errors that say what is wrong."""

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import METHODS, TRIANGLE, soup

LOOKING_DOWN = np.eye(4) + np.array([[0, 0, 0, 0.3], [0, 0, 0, 0.3], [0, 0, 0, 2], [0, 0, 0, 0]])
LIGHT = {"kind": "sun", "matrix": np.eye(4), "power": np.pi}


def camera(**changes: object) -> rt.Camera:
    """Above the triangle, looking down."""
    settings = {"kind": "perspective", "matrix": LOOKING_DOWN, "resolution": (16, 8)}
    return rt.Camera(**(settings | changes))


def scene(mesh: rt.Mesh = TRIANGLE, **changes: object) -> rt.Scene:
    """One grey material, unless changed."""
    return rt.Scene(mesh, **({"materials": [{}]} | changes))


def picture(of: rt.Scene, **settings: object) -> rt.Render:
    """The triangle, rendered."""
    return rt.render(rt.Accelerator.build(TRIANGLE), of, camera(), **settings)


def test_a_sun_of_pi_watts_shows_the_base_colour() -> None:
    made = picture(scene(materials=[{"base_color": (0.25, 0.5, 1.0)}], lights=[LIGHT]))
    assert made.combined.shape == (8, 16, 4)
    assert made.depth.shape == (8, 16)
    assert made.normal.shape == (8, 16, 3)
    assert made.cost is None
    assert {a.dtype.str for a in (made.combined, made.depth, made.normal)} == {"<f4"}
    assert made.combined.flags.c_contiguous
    np.testing.assert_allclose(made.combined[4, 8], [0.25, 0.5, 1, 1], rtol=1e-5)
    assert made.depth[4, 8] == pytest.approx(2)
    np.testing.assert_allclose(made.normal[4, 8], [0, 0, 1])
    assert made.primary_rays == 128
    assert made.rays == made.primary_rays + made.shadow_rays + made.bounce_rays
    assert 0 < made.trace_s <= made.total_s


def test_what_is_given_by_array_arrives_where_it_belongs() -> None:
    pixels = np.zeros((2, 2, 4), np.float32)
    pixels[0, 0], pixels[0, 1], pixels[1, 0] = (1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1)
    made = picture(
        scene(
            materials=[{}, {"texture": 0, "emission": (0, 0, 0)}],
            material_index=np.array([1]),
            corner_uvs=[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
            corner_normals=[[[0.0, 0.6, 0.8]] * 3],
            textures=[{"pixels": pixels, "interpolation": "closest", "extension": "extend"}],
            lights=[LIGHT],
        )
    )
    np.testing.assert_allclose(made.normal[4, 8], [0, 0.6, 0.8], atol=1e-6)
    color = made.combined[4, 8, :3]
    assert color[0] > 0
    assert color[1] == color[2] == 0


def test_a_transparent_film_leaves_the_world_out() -> None:
    above = scene(world=(0.5, 0.5, 0.5))
    np.testing.assert_allclose(picture(above).combined[0, 0], [0.5, 0.5, 0.5, 1])
    np.testing.assert_array_equal(picture(above, transparent=True).combined[0, 0], [0, 0, 0, 0])


def test_cost_is_counted_when_asked_for_and_changes_nothing_else() -> None:
    mesh = soup()
    accelerator, dressed = rt.Accelerator.build(mesh), scene(mesh, lights=[LIGHT])
    view = camera(matrix=np.eye(4) + np.array([[0, 0, 0, 0.5], [0, 0, 0, 0.5], [0, 0, 0, 3], [0, 0, 0, 0]]))
    counted, plain = (rt.render(accelerator, dressed, view, cost=cost) for cost in (True, False))
    np.testing.assert_array_equal(counted.combined, plain.combined)
    assert counted.cost is not None
    assert counted.cost.shape == (8, 16)
    steps, _ = accelerator.counted(*view.rays(), 0.0, np.inf)
    assert counted.cost.max() <= steps.max() + 1
    assert counted.cost.max() > 1


@pytest.mark.parametrize("method", METHODS)
def test_pictures_are_the_same_for_any_method_and_number_of_threads(method: str) -> None:
    mesh = soup()
    dressed = scene(mesh, materials=[{"metallic": 1.0, "roughness": 0.0}], lights=[LIGHT], world=(0.1, 0.2, 0.3))
    view = camera(resolution=(100, 70), matrix=LOOKING_DOWN)
    expected = rt.render(rt.Accelerator.build(mesh, "bvh-sah"), dressed, view, samples=2, threads=1)
    made = rt.render(rt.Accelerator.build(mesh, method), dressed, view, samples=2, threads=2)
    np.testing.assert_array_equal(made.combined, expected.combined)
    np.testing.assert_array_equal(made.depth, expected.depth)
    assert made.rays == expected.rays


def test_a_camera_gives_the_rays_of_its_pixels_from_the_bottom_left() -> None:
    view = camera(kind="orthographic", ortho_scale=2.0, resolution=(4, 2))
    origins, directions = view.rays()
    assert view.size == (4, 2)
    np.testing.assert_array_equal(directions, np.tile(np.float32([0, 0, -1]), (8, 1)))
    np.testing.assert_allclose(origins[0], [0.3 - 0.75, 0.3 - 0.25, 2], atol=1e-6)
    np.testing.assert_allclose(origins[-1], [0.3 + 0.75, 0.3 + 0.25, 2], atol=1e-6)
    assert camera(resolution=(10, 10), border=(0.0, 0.5, 0.3, 1.0)).size == (3, 5)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"materials": []}, "at least one material"),
        ({"materials": 7}, "materials must be a sequence of mappings"),
        ({"materials": [3]}, "material 0 must be a mapping of names to values"),
        ({"materials": [{}, {"colour": 1}]}, "material 1 has no 'colour'; it can have: base_color, texture"),
        ({"materials": [{"base_color": (1, 2)}]}, r"material 0: base_color must be three numbers; got \(1, 2\)"),
        ({"materials": [{"roughness": None}]}, "material 0: roughness must be a number; got None"),
        ({"materials": [{"metallic": float("nan")}]}, "material 0 has a value that is not finite"),
        ({"materials": [{"texture": 0}]}, "material 0 refers to a texture beyond the 0 there are"),
        ({"materials": [{"texture": -2}]}, "material 0: texture must be an index, or -1 for none; got -2"),
        ({"material_index": [0, 0]}, "material_index is for 2 triangles, but the mesh has 1"),
        ({"material_index": [1]}, "triangle 0 has material 1, but there are only 1"),
        ({"material_index": [-1]}, r"material_index\[0\] is \[-1\]"),
        ({"material_index": [0.0]}, r"material_index must be a uint32 array of shape \(n,\); got float64"),
        ({"corner_normals": np.zeros((1, 3))}, r"corner_normals must be .*\(m, 3, 3\); got float64 of shape \(1, 3\)"),
        ({"corner_normals": np.zeros((2, 3, 3))}, "corner_normals is for 2 triangles, but the mesh has 1"),
        ({"corner_uvs": np.full((1, 3, 2), np.nan)}, "corner_uvs of triangle 0 are not finite"),
        ({"textures": [{}]}, "texture 0 has no pixels: give one"),
        (
            {"textures": [{"pixels": np.zeros((2, 2, 3))}]},
            r"texture 0: pixels must be a float32 array of shape \(h, w, 4",
        ),
        ({"textures": [{"pixels": np.zeros((0, 2, 4))}]}, "texture 0: a texture of 2 by 0"),
        ({"textures": [{"pixels": np.zeros((1, 1, 4)), "extension": "mirror"}]}, "extension must be one of 'repeat', "),
        ({"lights": [{}]}, "light 0 has no kind: give one"),
        ({"lights": [{"kind": "lamp"}]}, "light 0: kind must be one of 'point', 'sun', 'spot', 'area'; got 'lamp'"),
        ({"lights": [{"kind": "sun"}]}, "light 0 has no matrix: give one"),
        ({"lights": [LIGHT, LIGHT | {"matrix": np.zeros((4, 4))}]}, "light 1: its matrix"),
        ({"lights": [LIGHT | {"power": float("inf")}]}, "light 0: its colour or power is not finite"),
        ({"lights": [LIGHT | {"shadow": "yes"}]}, "light 0: shadow must be True or False; got 'yes'"),
        ({"world": (0.0, float("nan"), 0.0)}, "the world's colour"),
    ],
)
def test_an_unusable_scene_says_what_is_wrong(changes: dict, message: str) -> None:
    with pytest.raises(rt.SceneError, match=message):
        scene(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "panoramic"}, "kind is 'panoramic'; it must be 'perspective' or 'orthographic'"),
        ({"sensor_fit": "AUTO"}, "sensor_fit is 'AUTO'; it must be 'auto', 'horizontal' or 'vertical'"),
        ({"matrix": np.eye(3)}, r"the camera's matrix must be .*\(4, 4\); got float64 of shape \(3, 3\)"),
        ({"matrix": np.zeros((4, 4))}, "singular"),
        ({"resolution": (0, 4)}, "sides must be 1 to"),
        ({"resolution": (-1, 4)}, "a side of -1 pixels"),
        ({"lens": 0.0}, "lens is 0"),
        ({"clip": (1.0, 0.5)}, "clip range is 1 to 0.5"),
        ({"border": (0.5, 0.5, 0.5, 0.5)}, "holds no pixel"),
    ],
)
def test_an_unusable_camera_says_what_is_wrong(changes: dict, message: str) -> None:
    with pytest.raises(rt.SceneError, match=message):
        camera(**changes)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"samples": 0}, rt.SceneError, "0 samples per pixel"),
        ({"samples": -1}, rt.SceneError, "samples is -1"),
        ({"max_bounces": -1}, rt.SceneError, "max_bounces is -1"),
        ({"max_bounces": 5000}, rt.SceneError, "5000 bounces"),
        ({"threads": -2}, rt.ConfigError, "threads is -2"),
    ],
)
def test_unusable_settings_of_a_picture_say_what_is_wrong(settings: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        picture(scene(), **settings)


def test_accelerator_and_scene_must_be_of_one_mesh() -> None:
    with pytest.raises(rt.SceneError, match="different meshes"):
        rt.render(rt.Accelerator.build(soup()), scene(), camera())
    dressed = scene()
    assert dressed.mesh is TRIANGLE
    assert repr(dressed) == "Scene(triangles=1, materials=1, textures=0, lights=0)"
    assert repr(camera()) == "Camera(size=(16, 8))"
    assert repr(picture(dressed)).startswith("Render(rays=")
