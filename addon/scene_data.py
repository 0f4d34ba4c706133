"""What the export hands to the native core: frozen dataclasses of numpy arrays. No bpy.

Every field is named and measured as the argument of `espalier_rt.Scene`, `Camera` or `Mesh` it becomes;
`arguments()` gives the mapping those take. Matrices are (4, 4) float32, column vectors, world space in metres
of the scene (no unit scale applied). Colours are scene-linear Rec.709 RGB.
"""

from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
UInt32 = NDArray[np.uint32]
Color = tuple[float, float, float]


class _Arguments:
    """Turns a dataclass into keyword arguments, its arrays uncopied."""

    def arguments(self) -> dict[str, Any]:
        """Field values by name, without `name`, which is for people."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "name"}  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class TextureData(_Arguments):
    """An image texture: pixels (h, w, 4) float32 scene-linear, rows bottom-up."""

    name: str
    pixels: Float32
    interpolation: Literal["linear", "closest"] = "linear"
    extension: Literal["repeat", "extend", "clip"] = "repeat"


@dataclass(frozen=True, eq=False)
class MaterialData(_Arguments):
    """A surface. `texture` indexes `SceneData.textures` (-1: none) and then replaces `base_color`.

    `emission` is radiance: colour times strength. Smooth metals (metallic >= 0.5, roughness <= 0.2) are mirrors.
    """

    name: str
    base_color: Color = (0.8, 0.8, 0.8)
    texture: int = -1
    metallic: float = 0.0
    roughness: float = 0.5
    emission: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class LightData(_Arguments):
    """A light in Blender's units; `matrix` is light to world, and it shines along its local -Z.

    power: watts (sun: watts per square metre), exposure already applied. radius: metres (point, spot), of a disk that
    faces the lit point where soft_falloff, else of a sphere. angle: radians (sun). spot_size: radians of the full cone.
    size, size_y: metres (area), scaled by the matrix. spread: radians (area).
    """

    name: str
    kind: Literal["point", "sun", "spot", "area"]
    matrix: Float32
    color: Color = (1.0, 1.0, 1.0)
    power: float = 10.0
    radius: float = 0.0
    soft_falloff: bool = True
    angle: float = 0.0
    spot_size: float = float(np.pi / 4)
    spot_blend: float = 0.15
    shape: Literal["square", "rectangle", "disk", "ellipse"] = "square"
    size: float = 1.0
    size_y: float = 1.0
    spread: float = float(np.pi)
    normalize: bool = True
    shadow: bool = True


@dataclass(frozen=True, eq=False)
class CameraData(_Arguments):
    """A camera as Blender has it. lens and sensor in mm, clip in metres.

    resolution: (width, height) of the full frame after resolution percentage.
    border: (min_x, min_y, max_x, max_y) in 0..1 of the frame, or None for all of it.
    """

    name: str
    kind: Literal["perspective", "orthographic"]
    matrix: Float32
    resolution: tuple[int, int]
    lens: float = 50.0
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    sensor_fit: Literal["auto", "horizontal", "vertical"] = "auto"
    shift: tuple[float, float] = (0.0, 0.0)
    ortho_scale: float = 6.0
    clip: tuple[float, float] = (0.1, 1000.0)
    pixel_aspect: tuple[float, float] = (1.0, 1.0)
    border: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class GeometryData:
    """All triangles of a frame in world space, n vertices and m triangles.

    corner_normals are unit shading normals, corner_uvs the active render UV map (0 where a mesh has none).
    """

    vertices: Float32  # (n, 3)
    triangles: UInt32  # (m, 3) into vertices
    material_index: UInt32  # (m,) into SceneData.materials
    corner_normals: Float32  # (m, 3, 3)
    corner_uvs: Float32 | None  # (m, 3, 2); None where no mesh has a UV map
    mesh_count: int
    instance_count: int


@dataclass(frozen=True, eq=False)
class SceneData:
    """One frame of one view layer, ready for the native core.

    export_ms is the time the export took; warnings are one line each on what is approximated or left out.
    """

    name: str
    view_layer: str
    frame: int
    geometry: GeometryData
    camera: CameraData
    materials: tuple[MaterialData, ...]
    textures: tuple[TextureData, ...] = ()
    lights: tuple[LightData, ...] = ()
    world: Color = (0.0, 0.0, 0.0)
    warnings: tuple[str, ...] = ()
    export_ms: float = 0.0

    @property
    def triangle_count(self) -> int:
        """Number of triangles in world space, those of every instance counted."""
        return len(self.geometry.triangles)

    @property
    def vertex_count(self) -> int:
        """Number of vertices in world space, those of every instance counted."""
        return len(self.geometry.vertices)

    @property
    def instance_count(self) -> int:
        """Number of mesh instances flattened into the geometry."""
        return self.geometry.instance_count
