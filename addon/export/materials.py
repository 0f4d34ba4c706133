"""Materials as the core can trace them, read from shader nodes.

What the core has is one base colour (constant or an image through the active render UV map), constant metallic and
roughness, and constant emission. What is read exactly: Principled, Diffuse, Glossy and Emission shaders with
constant inputs or an Image Texture as base colour, alone or with an emission added. Everything else is approximated
and noted once a material:
- a shader that has no such form (glass, hair, volume, a mix of shaders): the material's viewport colour, diffuse;
- a base colour that varies otherwise than by an image on the UV map: the material's viewport colour;
- metallic, roughness or emission strength that vary: the value the input has when unlinked;
- an emission colour from an image: the image's mean colour; other varying ones: the colour the input has unlinked;
- a mix with a transparent shader, alpha, transmission, normal and displacement maps: as if they were not there.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
from mathutils import Matrix

from ..scene_data import Color, MaterialData
from .coordinates import Coordinates, coordinates
from .images import Images
from .nodes import End, Node, Path, Socket, as_color, as_float, constant, follow, node_tree
from .notes import Notes

PINK: Color = (1.0, 0.0, 1.0)
"""What Blender shows where an image is missing."""
BLACK: Color = (0.0, 0.0, 0.0)
IGNORED_WEIGHTS = ("Transmission Weight", "Subsurface Weight", "Coat Weight", "Sheen Weight")


class Materials:
    """Every material of an export, in the order they first came up; index 0 is the one of faces without any.

    By the index of a textured material: `uv_maps` has the name of its UV map ('' is the active render map),
    `uv_matrices` how its coordinates move, where they do.
    """

    def __init__(self, images: Images, notes: Notes) -> None:
        self.materials: list[MaterialData] = [MaterialData("")]
        self.uv_maps: dict[int, str] = {}
        self.uv_matrices: dict[int, Matrix] = {}
        self._images = images
        self._notes = notes
        self._indices: dict[str, int] = {}

    def index(self, material: bpy.types.Material | None) -> int:
        """Index into `materials` of a slot's material."""
        if material is None:
            return 0
        name = material.name_full
        if name not in self._indices:
            self._indices[name] = len(self.materials)
            self.materials.append(self._read(material, len(self.materials)))
        return self._indices[name]

    def _read(self, material: bpy.types.Material, index: int) -> MaterialData:
        reader = _Reader(material, self._images)
        data = reader.read()
        if reader.coordinates is not None:
            self.uv_maps[index] = reader.coordinates.uv_map
            if reader.coordinates.matrix != Matrix.Identity(4):
                self.uv_matrices[index] = reader.coordinates.matrix
        if reader.approximated:
            self._notes.add(f"Material '{material.name}': approximated {', '.join(dict.fromkeys(reader.approximated))}")
        return data


class _Reader:
    """Reads one material; `approximated` names what is not traced as it is, `coordinates` where its texture lies."""

    def __init__(self, material: bpy.types.Material, images: Images) -> None:
        self.approximated: list[str] = []
        self.coordinates: Coordinates | None = None
        self._material = material
        self._images = images
        self._plain = MaterialData(material.name, base_color=as_color(material.diffuse_color))

    def read(self) -> MaterialData:
        """The material's surface."""
        tree: Any = node_tree(self._material)
        if tree is None:
            return self._plain
        output = tree.get_output_node("ALL") or tree.get_output_node("CYCLES")
        if output is None:
            return replace(self._plain, base_color=BLACK)
        self._note(output.inputs["Displacement"].is_linked, "displacement")
        self._note(output.inputs["Volume"].is_linked, "volume")
        return self._shader(follow(output.inputs["Surface"]))

    def _shader(self, end: End) -> MaterialData:
        """The surface of the shader that links end at; no shader at all is black, as in Cycles."""
        if end.node is None:
            return replace(self._plain, base_color=BLACK)
        read = SHADERS.get(end.node.type)
        if read is None:
            self._note(True, f"shader {end.node.bl_label}")
            return self._plain
        return read(self, end.node, end.path)

    def _principled(self, node: Node, path: Path) -> MaterialData:
        self._normal(node)
        self._note(as_float(self._value(node, path, "Alpha", "alpha")) < 1.0, "alpha")
        for name in IGNORED_WEIGHTS:
            self._note(as_float(self._value(node, path, name, name.lower())) > 0.0, name.lower())
        strength = as_float(self._value(node, path, "Emission Strength", "emission strength"))
        return replace(
            self._base_color(node.inputs["Base Color"], path),
            metallic=as_float(self._value(node, path, "Metallic", "metallic")),
            roughness=as_float(self._value(node, path, "Roughness", "roughness")),
            emission=self._emitted(node.inputs["Emission Color"], path, strength),
        )

    def _diffuse(self, node: Node, path: Path) -> MaterialData:
        self._normal(node)
        return replace(self._base_color(node.inputs["Color"], path), roughness=1.0)

    def _glossy(self, node: Node, path: Path) -> MaterialData:
        self._normal(node)
        roughness = as_float(self._value(node, path, "Roughness", "roughness"))
        return replace(self._base_color(node.inputs["Color"], path), metallic=1.0, roughness=roughness)

    def _emission(self, node: Node, path: Path) -> MaterialData:
        strength = as_float(self._value(node, path, "Strength", "emission strength"))
        emission = self._emitted(node.inputs["Color"], path, strength)
        return replace(self._plain, base_color=BLACK, emission=emission)

    def _add(self, node: Node, path: Path) -> MaterialData:
        """A shader plus an emission; two shaders that both reflect have no such form."""
        first, second = follow(node.inputs[0], path), follow(node.inputs[1], path)
        if second.node is None or _is_emission(first):
            first, second = second, first
        if first.node is None:
            return self._shader(second)
        if not _is_emission(second):
            self._note(True, "a sum of shaders")
            return self._plain
        one, other = self._shader(first), self._shader(second)
        red, green, blue = (a + b for a, b in zip(one.emission, other.emission, strict=True))
        return replace(one, emission=(red, green, blue))

    def _mix(self, node: Node, path: Path) -> MaterialData:
        """The shader that a factor of 0 or 1 leaves, or the one mixed with a transparent shader."""
        ends = follow(node.inputs[1], path), follow(node.inputs[2], path)
        factor = constant(node.inputs[0], path)
        if factor is not None and as_float(factor) in {0.0, 1.0}:
            return self._shader(ends[int(as_float(factor))])
        for end, other in (ends, ends[::-1]):
            if other.node is not None and other.node.type == "BSDF_TRANSPARENT":
                self._note(True, "transparency")
                return self._shader(end)
        self._note(True, "a mix of shaders")
        return self._plain

    def _base_color(self, socket: Socket, path: Path) -> MaterialData:
        """The plain material with the base colour that reaches a socket."""
        end = follow(socket, path)
        if end.node is not None and end.node.type == "TEX_IMAGE" and end.socket.name == "Color":
            return self._textured(end.node, end.path)
        color = constant(socket, path)
        self._note(color is None, "base color")
        return self._plain if color is None else replace(self._plain, base_color=as_color(color))

    def _textured(self, node: Node, path: Path) -> MaterialData:
        placed = coordinates(node, path)
        if placed is None:
            self._note(True, "texture coordinates")
            return self._plain
        texture = self._images.texture(node)
        if texture is None:
            return replace(self._plain, base_color=PINK)
        self.coordinates = placed
        return replace(self._plain, texture=texture)

    def _emitted(self, socket: Socket, path: Path, strength: float) -> Color:
        """Radiance of the colour that reaches a socket times a strength."""
        if strength == 0.0:
            return BLACK
        color = constant(socket, path)
        if color is None:
            self._note(True, "emission color")
            node: Node = follow(socket, path).node
            color = socket.default_value
            if node.type == "TEX_IMAGE":
                color = self._images.mean_color(node.image) or PINK
        red, green, blue = as_color(color)
        return red * strength, green * strength, blue * strength

    def _value(self, node: Node, path: Path, name: str, what: str) -> float:
        """An input's constant; where it varies, the value it has when unlinked, and a note."""
        value = constant(node.inputs[name], path)
        self._note(value is None, what)
        return node.inputs[name].default_value if value is None else value

    def _normal(self, node: Node) -> None:
        self._note(node.inputs["Normal"].is_linked, "normal map")

    def _note(self, true: bool, what: str) -> None:
        if true:
            self.approximated.append(what)


def _is_emission(end: End) -> bool:
    return end.node is not None and end.node.type == "EMISSION"


SHADERS: dict[str, Callable[[_Reader, Node, Path], MaterialData]] = {
    "BSDF_PRINCIPLED": _Reader._principled,
    "BSDF_DIFFUSE": _Reader._diffuse,
    "BSDF_GLOSSY": _Reader._glossy,
    "BSDF_METALLIC": _Reader._glossy,
    "EMISSION": _Reader._emission,
    "ADD_SHADER": _Reader._add,
    "MIX_SHADER": _Reader._mix,
}
