"""The native core of Espalier: acceleration structures of branches, leaves and uniform grids, and rays through them.

Arrays are numpy's. Each docstring of the module gives shapes, types, units and errors; help(espalier_rt) shows them.
"""

from collections.abc import Mapping
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Method: TypeAlias = Literal["bvh-median", "bvh-sah", "grid", "hybrid-sampled", "hybrid-cost"]

__version__: str
MISS: Final[int]

def methods() -> list[str]: ...
def instruction_set() -> str: ...
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
        method: str = "hybrid-sampled",
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
