"""Small scenes for the tests: objects, materials and images made in a line."""

from collections.abc import Sequence

import bpy
import numpy as np

from espalier import capture
from espalier.scene_data import SceneData

SQUARE = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))


def add(name: str, data: object = None, collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    """A new object of any data, linked into a collection (the scene's own by default)."""
    new = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(new)
    return new


def camera(**settings: object) -> bpy.types.Object:
    """The scene's camera, ten units up and looking down."""
    data = bpy.data.cameras.new("Camera")
    for name, value in settings.items():
        setattr(data, name, value)
    holder = add("Camera", data)
    holder.location.z = 10.0
    bpy.context.scene.camera = holder
    return holder


def mesh(name: str, vertices: Sequence = SQUARE, faces: Sequence = ((0, 1, 2, 3),)) -> bpy.types.Mesh:
    """A mesh; by default a square of side 2 that faces up."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    return data


def square(name: str = "Square", **settings: object) -> bpy.types.Object:
    """An object with a square of its own."""
    new = add(name, mesh(name))
    for setting, value in settings.items():
        setattr(new, setting, value)
    return new


def use_nodes(owner: object) -> None:
    """Let a material, world or light have a node tree; from 5.0 on it always has one."""
    if bpy.app.version < (5, 0) or owner.node_tree is None:
        owner.use_nodes = True


def material(name: str, shader: str = "ShaderNodeBsdfPrincipled", **inputs: object) -> bpy.types.Material:
    """A material of one shader with values for its inputs, whose spaces are written as underscores."""
    new = bpy.data.materials.new(name)
    use_nodes(new)
    tree = new.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    for name_, value in inputs.items():
        node.inputs[name_.replace("_", " ")].default_value = value
    return new


def shader(of: bpy.types.Material) -> bpy.types.Node:
    """The shader node of a material made by `material`."""
    return of.node_tree.nodes[0]


def image(name: str, pixels: object, *, float_buffer: bool = False, space: str | None = None) -> bpy.types.Image:
    """A generated image of (h, w, 4) pixels, as Blender stores them."""
    values = np.asarray(pixels, np.float32)
    height, width, _ = values.shape
    new = bpy.data.images.new(name, width, height, alpha=True, float_buffer=float_buffer)
    if space is not None:
        new.colorspace_settings.name = space
    new.pixels.foreach_set(values.reshape(-1))
    new.update()
    return new


def textured(name: str, of: bpy.types.Image | None) -> bpy.types.Material:
    """A Principled material with an image as base colour."""
    new = material(name)
    node = new.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = of
    new.node_tree.links.new(node.outputs["Color"], shader(new).inputs["Base Color"])
    return new


def export(**arguments: object) -> SceneData:
    """The scene as a render sees it, with a camera made where there is none."""
    if bpy.context.scene.camera is None:
        camera()
    return capture.export_frame(bpy.context.scene, **arguments)


def corners(data: SceneData) -> np.ndarray:
    """(m, 3, 3) positions of every triangle's corners."""
    return data.geometry.vertices[data.geometry.triangles]


def face_normals(data: SceneData) -> np.ndarray:
    """(m, 3) unit normals that the winding of the triangles gives."""
    a, b, c = corners(data).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
