"""What the scaling benchmarks trace and how they sum it up; no time is asserted."""

import sys
from pathlib import Path

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import rays_through, soup

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))
import scaling


@pytest.mark.parametrize(("count", "traced"), [(10, [10]), (1000, [1000]), (2500, [1000, 1000, 500])])
def test_a_total_traces_as_many_rays_as_it_says(monkeypatch: pytest.MonkeyPatch, count: int, traced: list[int]) -> None:
    calls: list[int] = []

    class Counting:
        def closest(self, origins: np.ndarray, directions: np.ndarray, threads: int) -> None:
            assert len(origins) == len(directions)
            assert threads == 1
            calls.append(len(origins))

    def build(mesh: rt.Mesh, method: str, config: dict[str, float], threads: int) -> Counting:
        assert config == {"expected_rays": count}
        return Counting()

    monkeypatch.setattr(
        scaling, "espalier_rt", type("Module", (), {"Accelerator": type("A", (), {"build": staticmethod(build)})})
    )
    scaling.built_and_traced(soup(), "hybrid", count, list(rays_through(soup(), 1000)))
    assert calls == traced


def test_a_spread_is_the_greatest_over_the_least_of_its_method() -> None:
    rows = [{"method": "a", "bytes": 2.0}, {"method": "b", "bytes": 9.0}, {"method": "a", "bytes": 3.0}]
    assert scaling.spread(rows, "a", "bytes") == 1.5


def test_a_landscape_has_about_as_many_triangles_as_asked_for() -> None:
    vertices, triangles = scaling.landscape(5000)
    assert len(triangles) == pytest.approx(5000, rel=0.1)
    assert rt.Mesh(vertices, triangles).bounds is not None
