"""What structures tell about themselves: census, boxes, and the evidence of decisions."""

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import METHODS, soup

MESH = soup(count=20_000)
BUILT = {method: rt.Accelerator.build(MESH, method) for method in METHODS}


@pytest.mark.parametrize("method", METHODS)
def test_a_census_counts_what_is_there(method: str) -> None:
    census = BUILT[method].census()
    assert census["method"] == method
    assert census["triangles"] == 20_000
    assert census["references"] >= 20_000
    assert sum(census["depth_histogram"]) == sum(census[kind] for kind in ("nodes", "leaves", "grids", "lazy_cells"))
    assert len(census["depth_histogram"]) == census["max_depth"] + 1
    assert (census["grids"] > 0) == (census["cells"] > 0)
    assert census["empty_cells"] <= census["cells"]
    assert census["bytes"] > 20_000
    assert census["sah_cost"] > 1
    assert all(milliseconds >= 0 for milliseconds in census["phases"].values())
    assert 0 < sum(census["phases"].values()) <= census["build_ms"] * 1.01


@pytest.mark.parametrize("method", METHODS)
def test_boxes_are_those_of_the_census_from_the_root_down(method: str) -> None:
    accelerator = BUILT[method]
    cells, census = accelerator.cells(), accelerator.census()
    found = [int(np.count_nonzero(cells.kind == kind)) for kind in range(5)]
    assert [*found[:3], sum(found[3:])] == [census["nodes"], census["leaves"], census["grids"], census["cells"]]
    assert np.count_nonzero(cells.kind >= 5) == census["lazy_cells"]
    assert np.count_nonzero(cells.kind == 6) == census["refined_cells"]
    assert np.count_nonzero(np.isin(cells.kind, [3, 4]) & (cells.count == 0)) == census["empty_cells"]
    assert not cells.truncated
    assert len(cells) == len(cells.depth) == len(cells.lower) == len(cells.upper) == len(cells.count)
    assert (np.diff(cells.depth.astype(int)) >= 0).all()
    assert (cells.lower <= cells.upper).all()
    np.testing.assert_allclose([cells.lower.min(axis=0), cells.upper.max(axis=0)], MESH.bounds, atol=1e-6)
    types = {"lower": "f4", "upper": "f4", "kind": "u1", "depth": "u2", "count": "u4"}
    for name, dtype in types.items():
        assert getattr(cells, name).dtype == dtype
        assert not getattr(cells, name).flags.writeable


def test_boxes_can_be_fewer() -> None:
    accelerator = BUILT["grid"]
    census = accelerator.census()
    assert len(accelerator.cells(max_depth=0)) == 1
    assert len(accelerator.cells(occupied_only=True)) == 1 + census["cells"] - census["empty_cells"]
    few = accelerator.cells(max_count=10)
    assert (len(few), few.truncated) == (10, True)
    assert (len(accelerator.cells(max_count=0)), accelerator.cells(max_count=0).truncated) == (0, True)
    for name in ("max_depth", "max_count"):
        with pytest.raises(rt.ConfigError, match=f"{name} is -1; it must be from 0 to"):
            accelerator.cells(**{name: -1})


@pytest.mark.parametrize("method", METHODS)
def test_methods_that_decide_keep_their_evidence(method: str) -> None:
    decisions = BUILT[method].decisions()
    lengths = {len(column) for column in decisions.values()}
    decides = method in {"hybrid-sampled", "hybrid-sequential", "hapala", "fellner"}
    assert max(lengths) == min(lengths) if decides else lengths == {0}
    assert decisions["lower"].shape[1:] == decisions["upper"].shape[1:] == (3,)
    assert decisions["verdict"].dtype == np.uint8
    assert np.isin(decisions["verdict"], [0, 1, 2]).all()
    assert (decisions["hits"] <= decisions["rays"]).all()
    assert np.count_nonzero(decisions["verdict"] == 1) == (BUILT[method].census()["grids"] if lengths != {0} else 0)
    if method in {"hybrid-sampled", "hybrid-sequential"}:
        assert (decisions["depth"][0], decisions["primitives"][0]) == (0, 20_000)
        np.testing.assert_allclose([decisions["lower"][0], decisions["upper"][0]], MESH.bounds, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_hybrid_tells_what_each_builder_was_expected_to_cost(method: str) -> None:
    choice = BUILT[method].choice()
    if method != "hybrid":
        assert choice == {}
        return
    assert sorted(choice) == ["bvh-clusters", "bvh-sah", "lazy", "lbvh"]
    assert list(choice.values()) == sorted(choice.values())
    assert min(choice.values()) > 0


def test_the_more_rays_are_to_come_the_better_a_tree_is_chosen() -> None:
    chosen = []
    for rays in (0.0, 1e10):
        accelerator = rt.Accelerator.build(MESH, "hybrid", {"expected_rays": rays})
        chosen.append(next(iter(accelerator.choice())))
        assert (accelerator.census()["lazy_cells"] > 0) == (chosen[-1] == "lazy")
    assert chosen == ["lazy", "bvh-sah"]
