"""A stage built into a Blender scene: objects, materials, instances, lights and a camera. Needs bpy."""

from collections.abc import Iterable

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from .framing import camera_to_world
from .geometry import Mesh
from .stage import Light, Part, Stage, Surface, View

SUZANNE_LEVELS = 4


def build(stage: Stage, scene: bpy.types.Scene) -> None:
    """Add everything of the stage to the scene and make its camera and world the scene's."""
    materials: dict[int, bpy.types.Material] = {}
    for part in stage.parts:
        if id(part.surface) not in materials:
            materials[id(part.surface)] = make_material(part.surface)
    for part in (part for part in stage.parts if part.placements is None):
        scene.collection.objects.link(_object(part, materials))
    _add_collections(stage.parts, materials, scene)
    for part in (part for part in stage.parts if part.placements is not None and part.spread == "nodes"):
        _add_scattered(part, materials, scene)
    for index, light in enumerate(stage.lights):
        add_light(scene, light, f"Light {index + 1}")
    add_camera(scene, stage.view)
    set_world(scene, stage.world)


def add_suzanne(scene: bpy.types.Scene, surface: Surface, matrix: NDArray[np.float64]) -> bpy.types.Object:
    """Blender's monkey under a Subdivision Surface modifier of SUZANNE_LEVELS levels, placed by a (4, 4) matrix."""
    data = bpy.data.meshes.new("Suzanne")
    shape = bmesh.new()
    bmesh.ops.create_monkey(shape)
    shape.to_mesh(data)
    shape.free()
    data.materials.append(make_material(surface))
    data.polygons.foreach_set("use_smooth", np.ones(len(data.polygons), bool))
    suzanne = bpy.data.objects.new("Suzanne", data)
    modifier = suzanne.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, SUZANNE_LEVELS
    suzanne.matrix_world = matrix.T
    scene.collection.objects.link(suzanne)
    return suzanne


def make_mesh(name: str, source: Mesh, smooth: bool = False, uvs: NDArray[np.float64] | None = None) -> bpy.types.Mesh:
    """A Blender mesh of the triangles; uvs (m, 3, 2) become its UV map."""
    vertices, triangles = source
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(vertices))
    data.vertices.foreach_set("co", vertices.reshape(-1))
    data.loops.add(triangles.size)
    data.loops.foreach_set("vertex_index", triangles.reshape(-1).astype(np.int32))
    data.polygons.add(len(triangles))
    data.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    data.polygons.foreach_set("use_smooth", np.full(len(triangles), smooth))
    if uvs is not None:
        data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uvs.astype(np.float32).reshape(-1))
    data.update()
    return data


def make_material(surface: Surface) -> bpy.types.Material:
    """A Principled material; emission is its colour times strength, a texture repeats through the UV map."""
    material = bpy.data.materials.new(surface.name)
    if not material.node_tree:
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*surface.color, 1.0)
    shader.inputs["Metallic"].default_value = surface.metallic
    shader.inputs["Roughness"].default_value = surface.roughness
    shader.inputs["Specular IOR Level"].default_value = 0.5 if surface.metallic else 0.0
    if surface.emission:
        shader.inputs["Emission Color"].default_value = (*surface.color, 1.0)
        shader.inputs["Emission Strength"].default_value = surface.emission
    if surface.texture is not None or surface.image is not None:
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = _image(surface)
        texture.location = (-320, 280)
        links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return material


def add_light(scene: bpy.types.Scene, light: Light, name: str) -> bpy.types.Object:
    """An area light or a sun, aimed at its target."""
    data = bpy.data.lights.new(name, light.kind.upper())
    data.energy, data.color = light.power, light.color
    if isinstance(data, bpy.types.SunLight):
        data.angle = np.radians(light.size)
    else:
        data.shape, data.size = "SQUARE", light.size
    lamp = bpy.data.objects.new(name, data)
    lamp.matrix_world = camera_to_world(light.position, light.target).T
    scene.collection.objects.link(lamp)
    return lamp


def add_camera(scene: bpy.types.Scene, view: View) -> bpy.types.Object:
    """A camera, made the scene's."""
    data = bpy.data.cameras.new("Camera")
    data.lens = view.lens
    data.clip_start, data.clip_end = view.clip
    camera = bpy.data.objects.new("Camera", data)
    camera.matrix_world = camera_to_world(view.position, view.target).T
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def set_world(scene: bpy.types.Scene, radiance: Iterable[float]) -> None:
    """A new world of one colour."""
    world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*radiance, 1.0)
    world.color = tuple(radiance)
    scene.world = world


def box_uvs(source: Mesh, size: float) -> NDArray[np.float32]:
    """(m, 3, 2) texture coordinates: each triangle seen along the axis it faces most, `size` metres a repeat."""
    vertices, triangles = source
    corners = vertices[triangles].astype(float)
    facing = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).argmax(axis=1)
    axes = np.array([[1, 2], [0, 2], [0, 1]])[facing]
    return (np.take_along_axis(corners, axes[:, None, :], axis=2) / size).astype(np.float32)


def _image(surface: Surface) -> bpy.types.Image:
    if surface.image is not None:
        return bpy.data.images.load(str(surface.image), check_existing=True)
    assert surface.texture is not None
    height, width = surface.texture.shape[:2]
    image = bpy.data.images.new(surface.name, width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = surface.texture
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()
    image.pack()
    return image


def _object(part: Part, materials: dict[int, bpy.types.Material]) -> bpy.types.Object:
    surface, uvs = part.surface, part.uvs
    if surface.texture is not None and uvs is None:
        uvs = box_uvs(part.mesh, surface.texture_size)
    data = make_mesh(part.name, part.mesh, part.smooth, uvs)
    data.materials.append(materials[id(surface)])
    return bpy.data.objects.new(part.name, data)


def _add_collections(parts: list[Part], materials: dict[int, bpy.types.Material], scene: bpy.types.Scene) -> None:
    """A collection of the parts that share placements, instanced by one empty for each placement."""
    groups: dict[int, list[Part]] = {}
    for part in parts:
        if part.placements is not None and part.spread == "collection":
            groups.setdefault(id(part.placements), []).append(part)
    for group in groups.values():
        collection = bpy.data.collections.new(group[0].name)
        for part in group:
            collection.objects.link(_object(part, materials))
        assert group[0].placements is not None
        for matrix in group[0].placements:
            empty = bpy.data.objects.new(collection.name, None)
            empty.instance_type, empty.instance_collection = "COLLECTION", collection
            empty.matrix_world = matrix.T
            scene.collection.objects.link(empty)


def _add_scattered(part: Part, materials: dict[int, bpy.types.Material], scene: bpy.types.Scene) -> None:
    """A mesh of points whose Geometry Nodes modifier instances the part, with its turn and scale as attributes."""
    assert part.placements is not None
    matrices = part.placements
    source = _object(part, materials)
    points = bpy.data.meshes.new(f"{part.name} Points")
    points.vertices.add(len(matrices))
    points.vertices.foreach_set("co", np.ascontiguousarray(matrices[:, :3, 3], np.float32).reshape(-1))
    turn = np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0])
    for name, values in (("turn", turn), ("size", np.linalg.norm(matrices[:, :3, 0], axis=1))):
        points.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", values.astype(np.float32))
    scattered = bpy.data.objects.new(f"{part.name} Scattered", points)
    scattered.modifiers.new("Scatter", "NODES").node_group = _scatter_nodes(source)
    scene.collection.objects.link(scattered)


def _scatter_nodes(source: bpy.types.Object) -> bpy.types.NodeTree:
    """Geometry Nodes: `source` instanced on the points, turned about z by `turn` and scaled by `size`."""
    tree = bpy.data.node_groups.new(f"Scatter {source.name}", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    names = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")
    start, end, instance, info = (tree.nodes.new(name) for name in names)
    turn, size = (tree.nodes.new("GeometryNodeInputNamedAttribute") for _ in range(2))
    combine = tree.nodes.new("ShaderNodeCombineXYZ")
    for node, name in ((turn, "turn"), (size, "size")):
        node.data_type = "FLOAT"
        node.inputs["Name"].default_value = name
    info.inputs["Object"].default_value = source
    info.inputs["As Instance"].default_value = True
    for output, target in (
        (start.outputs["Geometry"], instance.inputs["Points"]),
        (info.outputs["Geometry"], instance.inputs["Instance"]),
        (turn.outputs["Attribute"], combine.inputs["Z"]),
        (combine.outputs["Vector"], instance.inputs["Rotation"]),
        (size.outputs["Attribute"], instance.inputs["Scale"]),
        (instance.outputs["Instances"], end.inputs["Geometry"]),
    ):
        tree.links.new(output, target)
    return tree
