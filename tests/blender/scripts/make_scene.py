"""Run in Blender: makes a scene with a modifier, collection instances and lights: `-- OUT.blend`."""

import sys
from math import radians

import bpy

SIZE = (160, 120)


def add_meshes() -> None:
    """A floor, and Suzanne under a Subdivision Surface, instanced twice beside herself."""
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1))
    suzanne = bpy.context.object
    suzanne.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    heads = bpy.data.collections.new("Heads")
    heads.objects.link(suzanne)
    for x in (-3, 3):
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type = "COLLECTION"
        instance.instance_collection = heads
        instance.location.x = x
        bpy.context.collection.objects.link(instance)


def add_camera_and_lights() -> None:
    """A camera that sees the heads, a sun and a point light."""
    bpy.ops.object.camera_add(location=(0, -10, 4), rotation=(radians(72), 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="SUN", rotation=(radians(40), radians(20), 0))
    bpy.context.object.data.energy = 3.0
    bpy.ops.object.light_add(type="POINT", location=(-2, -3, 4))
    bpy.context.object.data.energy = 300.0


def main() -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=False)
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    add_meshes()
    add_camera_and_lights()
    scene = bpy.context.scene
    scene.render.engine = "ESPALIER"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])


main()
