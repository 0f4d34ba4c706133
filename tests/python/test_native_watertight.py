"""Closed meshes leak nothing."""

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import METHODS

from espalier_scenes.geometry import icosphere

VERTICES, TRIANGLES = icosphere(6)


def midpoints() -> np.ndarray:
    """The middle of every edge, once, rounded to single precision."""
    edges = np.unique(np.sort(TRIANGLES[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return VERTICES[edges].mean(axis=1, dtype=np.float64).astype(np.float32)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("origin", [(0, 0, 0), (0.3, -0.2, 0.1)])
def test_no_ray_from_inside_a_sphere_slips_through_a_vertex_or_an_edge(method: str, origin: tuple[float, ...]) -> None:
    assert len(TRIANGLES) == 81_920
    accelerator = rt.Accelerator.build(rt.Mesh(VERTICES, TRIANGLES), method)
    start = np.float32(origin)
    for targets in (VERTICES, midpoints()):
        directions = targets - start
        origins = np.broadcast_to(start, directions.shape)
        hits = accelerator.closest(origins, directions)
        assert np.count_nonzero(hits.primitive == rt.MISS) == 0
        assert np.abs(hits.t - 1).max() < 1e-4
        assert accelerator.occluded(origins, directions).all()
