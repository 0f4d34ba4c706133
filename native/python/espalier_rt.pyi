"""The native core of Espalier: acceleration structures of branches, leaves and uniform grids, and rays through them.

Arrays are numpy's. Each docstring of the module gives shapes, types, units and errors; help(espalier_rt) shows them.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "MISS",
    "Accelerator",
    "Camera",
    "Cancelled",
    "Cells",
    "ConfigError",
    "EspalierError",
    "Hits",
    "InternalError",
    "Job",
    "Mesh",
    "MeshError",
    "OutOfMemory",
    "RayError",
    "Render",
    "Scene",
    "SceneError",
    "__version__",
    "calibrate",
    "default_config",
    "instruction_set",
    "methods",
    "render",
]

__version__: str
MISS: Final[int]

def methods() -> list[str]: ...
def instruction_set() -> str: ...
def calibrate() -> dict[str, float]: ...
def default_config(method: str) -> dict[str, Any]: ...

class EspalierError(Exception): ...
class MeshError(EspalierError, ValueError): ...
class RayError(EspalierError, ValueError): ...
class ConfigError(EspalierError, ValueError): ...
class SceneError(EspalierError, ValueError): ...
class Cancelled(EspalierError): ...
class OutOfMemory(EspalierError, MemoryError): ...
class InternalError(EspalierError, RuntimeError): ...

@final
class Job:
    def __new__(cls) -> Job: ...
    @property
    def progress(self) -> float: ...
    @property
    def phase(self) -> Literal["", "build", "trace"]: ...
    @property
    def cancelled(self) -> bool: ...
    def cancel(self) -> None: ...

@final
class Mesh:
    def __new__(cls, vertices: ArrayLike, triangles: ArrayLike) -> Mesh: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def degenerate_count(self) -> int: ...
    @property
    def bounds(self) -> NDArray[np.float32]: ...

@final
class Hits:
    @property
    def t(self) -> NDArray[np.float32]: ...
    @property
    def primitive(self) -> NDArray[np.uint32]: ...
    @property
    def u(self) -> NDArray[np.float32]: ...
    @property
    def v(self) -> NDArray[np.float32]: ...
    @property
    def normal(self) -> NDArray[np.float32]: ...
    def __len__(self) -> int: ...

@final
class Accelerator:
    @staticmethod
    def build(
        mesh: Mesh,
        method: str = "hybrid",
        config: Mapping[str, Any] | None = None,
        threads: int = 0,
        job: Job | None = None,
    ) -> Accelerator: ...
    @property
    def method(self) -> str: ...
    @property
    def mesh(self) -> Mesh: ...
    def closest(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmin: ArrayLike = ...,
        tmax: ArrayLike = ...,
        *,
        threads: int = 0,
        job: Job | None = None,
    ) -> Hits: ...
    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmin: ArrayLike = ...,
        tmax: ArrayLike = ...,
        *,
        threads: int = 0,
        job: Job | None = None,
    ) -> NDArray[np.bool_]: ...
    def counted(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmin: ArrayLike = ...,
        tmax: ArrayLike = ...,
        *,
        threads: int = 0,
        job: Job | None = None,
    ) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]: ...
    def census(self) -> Census: ...
    def cells(
        self, *, max_depth: int | None = None, occupied_only: bool = False, max_count: int | None = None
    ) -> Cells: ...
    def decisions(self) -> dict[str, NDArray[Any]]: ...
    def choice(self) -> dict[str, float]: ...

@final
class Cells:
    @property
    def lower(self) -> NDArray[np.float32]: ...
    @property
    def upper(self) -> NDArray[np.float32]: ...
    @property
    def kind(self) -> NDArray[np.uint8]: ...
    @property
    def depth(self) -> NDArray[np.uint16]: ...
    @property
    def count(self) -> NDArray[np.uint32]: ...
    @property
    def truncated(self) -> bool: ...
    def __len__(self) -> int: ...

@type_check_only
class Census(TypedDict):
    method: str
    triangles: int
    nodes: int
    leaves: int
    grids: int
    cells: int
    empty_cells: int
    lazy_cells: int
    refined_cells: int
    references: int
    bytes: int
    max_depth: int
    depth_histogram: list[int]
    sah_cost: float
    phases: dict[str, float]
    build_ms: float

@final
class Scene:
    def __new__(
        cls,
        mesh: Mesh,
        *,
        materials: Sequence[Mapping[str, Any]],
        material_index: ArrayLike | None = None,
        corner_normals: ArrayLike | None = None,
        corner_uvs: ArrayLike | None = None,
        textures: Sequence[Mapping[str, Any]] | None = None,
        lights: Sequence[Mapping[str, Any]] | None = None,
        world: tuple[float, float, float] = ...,
    ) -> Scene: ...
    @property
    def mesh(self) -> Mesh: ...

@final
class Camera:
    def __new__(
        cls,
        *,
        kind: str,
        matrix: ArrayLike,
        resolution: tuple[int, int],
        lens: float = 50.0,
        sensor_width: float = 36.0,
        sensor_height: float = 24.0,
        sensor_fit: str = "auto",
        shift: tuple[float, float] = ...,
        ortho_scale: float = 6.0,
        clip: tuple[float, float] = ...,
        pixel_aspect: tuple[float, float] = ...,
        border: tuple[float, float, float, float] | None = None,
    ) -> Camera: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def rays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...

@final
class Render:
    @property
    def combined(self) -> NDArray[np.float32]: ...
    @property
    def depth(self) -> NDArray[np.float32]: ...
    @property
    def normal(self) -> NDArray[np.float32]: ...
    @property
    def cost(self) -> NDArray[np.float32] | None: ...
    @property
    def rays(self) -> int: ...
    @property
    def primary_rays(self) -> int: ...
    @property
    def shadow_rays(self) -> int: ...
    @property
    def bounce_rays(self) -> int: ...
    @property
    def trace_s(self) -> float: ...
    @property
    def total_s(self) -> float: ...

def render(
    accelerator: Accelerator,
    scene: Scene,
    camera: Camera,
    *,
    samples: int = 1,
    seed: int = 0,
    max_bounces: int = 4,
    threads: int = 0,
    cost: bool = False,
    transparent: bool = False,
    job: Job | None = None,
) -> Render: ...
