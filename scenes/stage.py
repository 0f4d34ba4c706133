"""What a generated scene is: parts, surfaces, lights and a camera, as data. No bpy.

Lengths in metres, angles in degrees, colours scene-linear Rec.709, z up.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .geometry import Mesh, instanced, join

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Surface:
    """A material. `texture` (h, w, 3) sRGB replaces `color` and repeats every `texture_size` metres.

    `image`, a file, does so too, laid on by the part's own texture coordinates. A mirror has metallic 1 and
    roughness 0. `emission` is radiance.
    """

    name: str
    color: Vector = (0.8, 0.8, 0.8)
    metallic: float = 0.0
    roughness: float = 0.7
    emission: float = 0.0
    texture: NDArray[np.float32] | None = None
    texture_size: float = 1.0
    image: Path | None = None


@dataclass(frozen=True, eq=False)
class Part:
    """One object, or with `placements` (k, 4, 4) as many instances of it.

    spread: how Blender gets the instances: "collection" by empties that instance a collection (parts that share
    one placements array share the collection), "nodes" by a Geometry Nodes modifier that instances on points (the
    placements then scale evenly and turn about z only).
    """

    name: str
    mesh: Mesh
    surface: Surface
    smooth: bool = False
    placements: NDArray[np.float64] | None = None
    spread: Literal["collection", "nodes"] = "collection"
    uvs: NDArray[np.float32] | None = None
    """(m, 3, 2) texture coordinates; None: the texture is laid on along the axes."""

    def world_mesh(self) -> Mesh:
        """The triangles as they stand in the scene, every instance written out."""
        return self.mesh if self.placements is None else instanced(self.mesh, self.placements)


@dataclass(frozen=True)
class Light:
    """An area light (square of edge `size`) or a sun (`size` is its angle) at `position`, shining at `target`.

    power: watts, for a sun watts per square metre.
    """

    kind: Literal["area", "sun"]
    position: Vector
    target: Vector = (0.0, 0.0, 0.0)
    power: float = 100.0
    size: float = 1.0
    color: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class View:
    """A perspective camera: sensor 36 mm wide, `lens` in mm."""

    position: Vector
    target: Vector
    lens: float = 50.0
    clip: tuple[float, float] = (0.05, 1000.0)


@dataclass(frozen=True, eq=False)
class Stage:
    """A whole scene. `world` is the constant background radiance."""

    parts: list[Part]
    lights: list[Light]
    view: View
    world: Vector = (0.05, 0.06, 0.08)

    def mesh(self) -> Mesh:
        """All triangles of the scene as one mesh."""
        return join([part.world_mesh() for part in self.parts])
