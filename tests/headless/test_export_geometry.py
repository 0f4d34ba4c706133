"""Export of geometry: modifiers, instances, mirrored matrices, normals, UV maps, slots, against known values."""

import bpy
import building
import numpy as np
import pytest
from mathutils import Matrix

from espalier import capture, export
from espalier.errors import NoCameraError, NoGeometryError, NonFiniteGeometryError


@pytest.fixture(autouse=True)
def _empty(scene):
    """Every test here starts from a scene without objects."""


def test_a_square_becomes_two_triangles_in_world_space():
    building.square(location=(5, 6, 7), scale=(2, 2, 2))
    data = building.export()
    assert data.triangle_count == 2
    assert data.vertex_count == 4
    np.testing.assert_allclose(data.geometry.vertices.min(axis=0), (3, 4, 7), atol=1e-6)
    np.testing.assert_allclose(data.geometry.vertices.max(axis=0), (7, 8, 7), atol=1e-6)
    np.testing.assert_allclose(building.face_normals(data), [(0, 0, 1)] * 2, atol=1e-6)
    np.testing.assert_allclose(data.geometry.corner_normals, np.broadcast_to((0, 0, 1), (2, 3, 3)), atol=1e-6)


def test_arrays_have_the_layout_that_the_native_core_takes():
    building.square()
    geometry = building.export().geometry
    for array, dtype in (
        (geometry.vertices, np.float32),
        (geometry.triangles, np.uint32),
        (geometry.material_index, np.uint32),
        (geometry.corner_normals, np.float32),
    ):
        assert array.dtype == dtype
        assert array.flags.c_contiguous


def test_modifiers_count_with_their_render_settings():
    subdivided = building.square().modifiers.new("Subdivision", "SUBSURF")
    subdivided.levels, subdivided.render_levels = 0, 3
    assert building.export().triangle_count == 2 * 4**3
    subdivided.show_render = False
    assert building.export().triangle_count == 2


def test_a_mesh_of_many_objects_is_read_once(monkeypatch):
    shared = building.mesh("Shared")
    for x in range(10):
        building.add(f"Object {x}", shared).location.x = 3.0 * x
    reads = []
    read_mesh = export.objects.read_mesh
    monkeypatch.setattr(
        export.objects, "read_mesh", lambda mesh, maps: reads.append(mesh.name) or read_mesh(mesh, maps)
    )
    data = building.export()
    assert reads == ["Shared"]
    assert (data.instance_count, data.geometry.mesh_count, data.triangle_count) == (10, 1, 20)
    centres = np.sort(building.corners(data)[:, :, 0].reshape(10, 6).mean(axis=1))
    np.testing.assert_allclose(np.diff(centres), 3.0, atol=1e-4)


def test_collection_instances_are_placed_by_the_instancer():
    collection = bpy.data.collections.new("Instanced")
    building.add("Inside", building.mesh("Inside"), collection).location.x = 1.0
    for y in (10.0, 20.0):
        empty = building.add(f"Empty {y}")
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location.y = y
    data = building.export()
    assert (data.instance_count, data.triangle_count) == (2, 4)
    np.testing.assert_allclose(building.corners(data).reshape(2, 6, 3).mean(axis=1), [(1, 10, 0), (1, 20, 0)], atol=0.5)


def _instance_on_points(of: bpy.types.Object) -> bpy.types.NodeTree:
    """Geometry nodes that put `of` on every vertex of their geometry."""
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    given, result = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    info, instances = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    info.inputs["Object"].default_value = of
    info.inputs["As Instance"].default_value = True
    tree.links.new(given.outputs[0], instances.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], instances.inputs["Instance"])
    tree.links.new(instances.outputs[0], result.inputs[0])
    return tree


def test_geometry_nodes_instances_arrive_with_their_own_material():
    red = building.material("Red", Base_Color=(1, 0, 0, 1))
    leaf = building.square("Leaf", hide_render=True)
    leaf.data.materials.append(red)
    holder = building.add("Points", building.mesh("Points", ((0, 0, 0), (10, 0, 0), (0, 10, 0)), ((0, 1, 2),)))
    holder.modifiers.new("Nodes", "NODES").node_group = _instance_on_points(leaf)
    data = building.export()
    assert (data.instance_count, data.triangle_count) == (3, 6)
    assert {data.materials[index].name for index in data.geometry.material_index} == {"Red"}


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -2, 1), (1, 1, -3), (-1, -1, -1)])
def test_a_mirrored_object_keeps_its_front_in_front(scale):
    """A closed mesh stays closed and outward: its signed volume stays positive, normals agree with the winding."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.scale = scale
    data = building.export()
    a, b, c = building.corners(data).astype(np.float64).transpose(1, 0, 2)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(8.0 * abs(np.prod(scale)), rel=1e-5)
    np.testing.assert_allclose(data.geometry.corner_normals[:, 0], building.face_normals(data), atol=1e-5)


def test_mirrored_and_plain_instances_of_one_mesh_go_together():
    shared = building.mesh("Shared")
    building.add("Plain", shared)
    mirrored = building.add("Mirrored", shared)
    mirrored.scale.x = -1.0
    data = building.export()
    assert data.instance_count == 2
    np.testing.assert_allclose(building.face_normals(data), [(0, 0, 1)] * 4, atol=1e-6)


def test_normals_of_a_stretched_sphere_are_those_of_an_ellipsoid():
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
    bpy.ops.object.shade_smooth()
    bpy.context.object.scale = (1.0, 2.0, 4.0)
    data = building.export()
    expected = building.corners(data) / np.square((1.0, 2.0, 4.0))
    expected /= np.linalg.norm(expected, axis=2, keepdims=True)
    lengths = np.linalg.norm(data.geometry.corner_normals, axis=2)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-5)
    assert np.einsum("mci,mci->mc", expected, data.geometry.corner_normals).min() > 0.999


def test_flat_faces_have_face_normals_and_smooth_ones_do_not():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    flat = building.export()
    np.testing.assert_allclose(
        flat.geometry.corner_normals, building.face_normals(flat)[:, None].repeat(3, 1), atol=1e-5
    )
    bpy.ops.object.shade_smooth()
    smooth = building.export()
    spread = np.ptp(smooth.geometry.corner_normals, axis=1).max(axis=1)
    assert spread.min() > 0.1


def test_custom_normals_arrive():
    holder = building.square()
    holder.data.normals_split_custom_set([(0.0, 0.6, 0.8)] * 4)
    data = building.export()
    np.testing.assert_allclose(data.geometry.corner_normals, np.broadcast_to((0, 0.6, 0.8), (2, 3, 3)), atol=1e-3)


def test_normals_stay_finite_under_a_scale_of_zero():
    building.square("Flattened", scale=(1, 0, 1))
    building.square()
    data = building.export()
    assert np.isfinite(data.geometry.corner_normals).all()
    np.testing.assert_allclose(np.linalg.norm(data.geometry.corner_normals, axis=2), 1.0, atol=1e-5)


def test_the_uv_map_that_is_active_for_rendering_is_exported():
    holder = building.square()
    for name in ("Shown", "Rendered"):
        holder.data.uv_layers.new(name=name)
    shown = holder.data.uv_layers["Shown"]
    rendered = holder.data.uv_layers["Rendered"]
    shown.uv.foreach_set("vector", np.full(8, 0.25, np.float32))
    rendered.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    rendered.active_render = True
    holder.data.uv_layers.active = shown
    data = building.export()
    expected = (building.corners(data)[..., :2] + 1.0) / 2.0
    np.testing.assert_allclose(data.geometry.corner_uvs, expected, atol=1e-6)


def test_no_uv_map_anywhere_exports_none_and_a_mesh_without_one_has_zeros():
    building.square()
    assert building.export().geometry.corner_uvs is None
    mapped = building.square("Mapped")
    mapped.data.uv_layers.new(name="Map").uv.foreach_set("vector", np.full(8, 0.5, np.float32))
    uvs = building.export().geometry.corner_uvs
    assert sorted(np.unique(uvs).tolist()) == [0.0, 0.5]


def test_every_face_gets_the_material_of_its_slot():
    red, green = (building.material(name) for name in ("Red", "Green"))
    faces = ((0, 1, 2), (0, 2, 3))
    holder = building.add("Two", building.mesh("Two", building.SQUARE, faces))
    holder.data.materials.append(red)
    holder.data.materials.append(green)
    holder.data.polygons[1].material_index = 1
    data = building.export()
    assert [data.materials[index].name for index in data.geometry.material_index] == ["Red", "Green"]


def test_an_objects_own_slot_wins_over_the_meshs():
    red, green = (building.material(name) for name in ("Red", "Green"))
    shared = building.mesh("Shared")
    shared.materials.append(red)
    building.add("Red", shared)
    other = building.add("Green", shared)
    other.material_slots[0].link, other.material_slots[0].material = "OBJECT", green
    data = building.export()
    assert sorted(data.materials[index].name for index in data.geometry.material_index) == ["Green"] * 2 + ["Red"] * 2


def test_a_slot_beyond_the_last_is_the_last():
    holder = building.square()
    holder.data.materials.append(building.material("Only"))
    holder.data.polygons[0].material_index = 7
    data = building.export()
    assert {data.materials[index].name for index in data.geometry.material_index} == {"Only"}


@pytest.mark.parametrize(
    ("operator", "settings"),
    [
        ("curve.primitive_bezier_circle_add", {"bevel_depth": 0.1}),
        ("object.text_add", {}),
        ("object.metaball_add", {}),
        ("surface.primitive_nurbs_surface_sphere_add", {}),
    ],
)
def test_what_is_no_mesh_but_makes_one_arrives_exactly_once(operator, settings):
    group, name = operator.split(".")
    getattr(getattr(bpy.ops, group), name)()
    holder = bpy.context.object
    for setting, value in settings.items():
        setattr(holder.data, setting, value)
    holder.location.x = 4.0
    data = building.export()
    assert data.instance_count == 1
    # No triangle is there twice.
    centres = building.corners(data).mean(axis=1)
    assert len(np.unique(centres.round(4), axis=0)) > 0.95 * data.triangle_count
    assert centres[:, 0].mean() > 3.0


def test_edits_not_yet_applied_to_the_mesh_are_exported():
    edited = building.square()
    edited.modifiers.new("Array", "ARRAY").count = 3
    bpy.context.view_layer.objects.active = edited
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.subdivide()
        data = building.export()
        assert bpy.context.object.mode == "EDIT"
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert data.triangle_count == 3 * 8


def test_edges_and_points_without_faces_are_nothing_to_trace(scene):
    building.add("Wire", building.mesh("Wire", ((0, 0, 0), (1, 0, 0)), ()))
    with pytest.raises(NoGeometryError, match="no triangle that renders"):
        building.export()


def test_no_camera_is_a_named_error(scene):
    building.square()
    with pytest.raises(NoCameraError, match="has no camera: add one"):
        capture.export_frame(scene)


def test_vertices_that_are_not_finite_name_their_mesh():
    building.square("Fine")
    broken = building.square("Broken")
    broken.data.vertices[0].co.x = float("nan")
    with pytest.raises(NonFiniteGeometryError, match="'Broken'"):
        building.export()


def test_an_animated_object_is_exported_at_its_frame(scene):
    holder = building.square()
    for frame, x in ((1, 0.0), (11, 10.0)):
        holder.location.x = x
        holder.keyframe_insert("location", index=0, frame=frame)
    for frame, x in ((1, 0.0), (11, 10.0)):
        scene.frame_set(frame)
        data = building.export()
        assert data.frame == frame
        assert data.geometry.vertices[:, 0].mean() == pytest.approx(x, abs=1e-4)


def test_a_parents_shear_is_in_the_matrix():
    parent = building.add("Parent")
    parent.scale = (1, 3, 1)
    child = building.square("Child")
    child.parent = parent
    child.rotation_euler.z = 0.5
    data = building.export()
    expected = Matrix.Diagonal((1, 3, 1)).to_4x4() @ Matrix.Rotation(0.5, 4, "Z")
    wanted = sorted(tuple(round(x, 4) for x in expected @ Matrix.Translation(v).translation) for v in building.SQUARE)
    found = sorted(tuple(round(float(x), 4) for x in vertex) for vertex in data.geometry.vertices)
    np.testing.assert_allclose(found, wanted, atol=1e-3)


def test_a_simulated_rigid_body_is_where_the_simulation_put_it(scene):
    falling = building.square("Falling", location=(0, 0, 100))
    child = building.square("Child", location=(5, 0, 0))
    child.parent = falling
    still = building.square("Still")
    bpy.context.view_layer.objects.active = falling
    falling.select_set(True)
    bpy.ops.rigidbody.object_add()
    for frame in range(1, 21):
        scene.frame_set(frame)
    fallen = falling.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation.z
    assert fallen < 99.0
    heights = sorted(building.corners(building.export())[:, :, 2].mean(axis=1))
    np.testing.assert_allclose(heights, [still.location.z] * 2 + [fallen] * 4, atol=1e-3)


def test_a_view_layers_material_override_covers_everything(scene):
    building.square("Bare")
    building.square("Red").data.materials.append(building.material("Red"))
    scene.view_layers[0].material_override = building.material("Clay")
    data = building.export()
    assert {data.materials[index].name for index in data.geometry.material_index} == {"Clay"}
