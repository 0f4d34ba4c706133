"""Lights and the world, in Blender's units."""

import math
from typing import Any, TypeAlias

import bpy
import numpy as np

from ..scene_data import Color, LightData
from .images import Images
from .nodes import Node, Path, Socket, as_color, as_float, constant, follow, node_tree, output_node
from .notes import Notes

Light: TypeAlias = Any
"""A `bpy.types.Light`. What one has depends on its kind, which Blender's type stubs cannot tell."""


def read_light(light: Light, matrix: Any, name: str, notes: Notes) -> LightData:
    """A light placed by a (4, 4) light-to-world matrix. Fields a kind does not have keep their defaults."""
    color, strength = _tint(light, notes)
    return LightData(
        name=name,
        kind=light.type.lower(),
        matrix=np.array(matrix, np.float32),
        color=color,
        power=light.energy * strength * 2.0 ** getattr(light, "exposure", 0.0),
        normalize=getattr(light, "normalize", True),
        shadow=light.use_shadow,
        **_SHAPES[light.type](light),
    )


def _sphere(light: Light) -> dict[str, Any]:
    return {"radius": light.shadow_soft_size, "soft_falloff": getattr(light, "use_soft_falloff", True)}


def _spot(light: Light) -> dict[str, Any]:
    return {**_sphere(light), "spot_size": light.spot_size, "spot_blend": light.spot_blend}


def _sun(light: Light) -> dict[str, Any]:
    return {"angle": light.angle}


def _area(light: Light) -> dict[str, Any]:
    return {
        "shape": light.shape.lower(),
        "size": light.size,
        "size_y": light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size,
        "spread": getattr(light, "spread", math.pi),
    }


_SHAPES = {"POINT": _sphere, "SPOT": _spot, "SUN": _sun, "AREA": _area}


def _tint(light: Light, notes: Notes) -> tuple[Color, float]:
    """Colour and factor of a light: its own colour, temperature, and an Emission node with constant inputs."""
    color: Color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = _times(color, light.temperature_color)
    tree = node_tree(light)
    output = None if tree is None else output_node(tree, "OUTPUT_LIGHT")
    if output is None:
        return color, 1.0
    end = follow(output.inputs["Surface"])
    if end.node is None:
        return color, 0.0
    if end.node.type == "EMISSION":
        tint = constant(end.node.inputs["Color"], end.path)
        strength = constant(end.node.inputs["Strength"], end.path)
        if tint is not None and strength is not None:
            return _times(color, as_color(tint)), as_float(strength)
    notes.add(f"Light '{light.name}': its nodes are ignored; only an Emission node with constant inputs is traced")
    return color, 1.0


def _times(one: Any, other: Any) -> Color:
    return one[0] * other[0], one[1] * other[1], one[2] * other[2]


def read_world(world: bpy.types.World | None, images: Images, notes: Notes) -> Color:
    """Radiance of the background: colour times strength. No world is black; a varying one is approximated, noted."""
    if world is None:
        return (0.0, 0.0, 0.0)
    tree = node_tree(world)
    if tree is None:
        return as_color(world.color)
    output = output_node(tree, "OUTPUT_WORLD")
    end = follow(output.inputs["Surface"]) if output is not None else None
    if end is None or end.node is None:
        return (0.0, 0.0, 0.0)
    if end.node.type != "BACKGROUND":
        notes.add(f"World '{world.name}': shader {end.node.bl_label} is traced as the world's viewport color")
        return as_color(world.color)
    return _background(world, end.node, end.path, images, notes)


def _background(world: bpy.types.World, node: Node, path: Path, images: Images, notes: Notes) -> Color:
    strength = constant(node.inputs["Strength"], path)
    color = constant(node.inputs["Color"], path)
    if strength is None:
        notes.add(f"World '{world.name}': a varying strength is traced as the value it has unlinked")
        strength = node.inputs["Strength"].default_value
    if color is None:
        color = _mean_background(world, node.inputs["Color"], path, images, notes)
    return _times(as_color(color), (as_float(strength),) * 3)


def _mean_background(world: bpy.types.World, socket: Socket, path: Path, images: Images, notes: Notes) -> Color:
    """One colour for a background that varies: an image's mean, otherwise the world's viewport colour."""
    end = follow(socket, path)
    if end.node is not None and end.node.type in {"TEX_ENVIRONMENT", "TEX_IMAGE"}:
        notes.add(f"World '{world.name}': its image is traced as the image's mean color")
        return images.mean_color(end.node.image) or (1.0, 0.0, 1.0)
    notes.add(f"World '{world.name}': a varying color is traced as the world's viewport color")
    return as_color(world.color)
