"""Embree through the package embreex, as the reference of a study. For development; never required. No bpy."""

import time
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene_data import Float32, UInt32

CHUNK = 1 << 16
"""Rays of a call: between calls a cancel is heard."""


def version() -> str | None:
    """The installed version of embreex, or None where there is none."""
    try:
        import embreex.rtcore_scene  # noqa: F401 - a package that is there may still not load
    except ImportError:
        return None
    return metadata.version("embreex")


class Embree:
    """A mesh in Embree, with the queries of an accelerator. It traces ray by ray on one thread, as embreex does."""

    def __init__(self, vertices: Float32, triangles: UInt32) -> None:
        """Build at once: Embree does so before its first ray."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        begin = time.perf_counter()
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, vertices, triangles.astype(np.int32))
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        self.build_ms = (time.perf_counter() - begin) * 1000

    def primitives(self, query: str, origins: Float32, directions: Float32, tmax: Float32) -> NDArray[Any]:
        """By ray: the index of what is hit ("INTERSECT"), or 0 ("OCCLUDED"); -1 for a miss."""
        return self._scene.run(origins, directions, dists=tmax, query=query)
