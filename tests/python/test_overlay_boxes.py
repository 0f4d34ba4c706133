"""Which boxes are drawn, and that their edges are all there, each once."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from espalier.overlay_boxes import BRANCH, CELL, GRID, LEAF, Filter, box_lines, select

EVERYTHING = Filter(frozenset({BRANCH, LEAF, GRID, CELL}), 0, 65535, occupied_only=False, max_boxes=10**9)


def cells(kind, depth, count):
    n = len(kind)
    return SimpleNamespace(
        lower=np.zeros((n, 3), np.float32),
        upper=np.ones((n, 3), np.float32),
        kind=np.array(kind, np.uint8),
        depth=np.array(depth, np.uint16),
        count=np.array(count, np.uint32),
        truncated=False,
    )


def chosen(some, **changes):
    rows, matched = select(some, Filter(**{**EVERYTHING.__dict__, **changes}))
    return rows.tolist(), matched


def segments(lines):
    """Every line as an unordered pair of points."""
    ends = lines.vertices[lines.indices]
    return [frozenset(map(tuple, pair.tolist())) for pair in ends]


def box_edges(low, high):
    """The twelve edges of a box, by walking its corners: pairs of corners that differ in one axis."""
    corners = list(product(*zip(low, high, strict=True)))
    return {frozenset((a, b)) for a in corners for b in corners if sum(x != y for x, y in zip(a, b, strict=True)) == 1}


TREE = cells(
    kind=[BRANCH, BRANCH, LEAF, LEAF, GRID, CELL, CELL], depth=[0, 1, 2, 2, 2, 3, 3], count=[9, 6, 4, 0, 5, 5, 0]
)


def test_everything_is_chosen_in_order():
    assert chosen(TREE) == ([0, 1, 2, 3, 4, 5, 6], 7)


def test_kinds_depths_and_emptiness_leave_out_what_they_say():
    assert chosen(TREE, kinds=frozenset({LEAF, CELL})) == ([2, 3, 5, 6], 4)
    assert chosen(TREE, kinds=frozenset()) == ([], 0)
    assert chosen(TREE, depth_min=1, depth_max=2) == ([1, 2, 3, 4], 4)
    assert chosen(TREE, occupied_only=True) == ([0, 1, 2, 4, 5], 5)


def test_branches_and_grids_are_never_taken_for_empty():
    some = cells(kind=[BRANCH, GRID, LEAF, CELL], depth=[0, 1, 1, 2], count=[0, 0, 0, 0])
    assert chosen(some, occupied_only=True) == ([0, 1], 2)


def test_the_deepest_are_left_out_first():
    some = cells(kind=[LEAF] * 4, depth=[5, 1, 3, 1], count=[1] * 4)
    assert chosen(some, max_boxes=3) == ([1, 2, 3], 4)


def test_no_boxes_have_no_lines():
    nothing = np.empty((0, 3), np.float32)
    lines = box_lines(nothing, nothing)
    assert lines.vertices.shape == (0, 3)
    assert lines.indices.shape == (0, 2)


def test_a_full_grid_has_each_edge_once():
    side = 5
    low = np.indices((side,) * 3).reshape(3, -1).T.astype(np.float32)
    lines = box_lines(low, low + 1)
    assert len(lines.vertices) == (side + 1) ** 3
    assert len(lines.indices) == 3 * side * (side + 1) ** 2


corner = st.tuples(*[st.integers(-4, 4)] * 3)


@settings(deadline=None)
@given(st.lists(st.tuples(corner, st.tuples(*[st.integers(1, 5)] * 3)), min_size=1, max_size=12))
def test_lines_are_the_union_of_the_boxes_edges(boxes):
    low = np.array([box[0] for box in boxes], np.float32)
    high = low + np.array([box[1] for box in boxes], np.float32)
    drawn = segments(box_lines(low, high))
    assert len(drawn) == len(set(drawn)), "an edge is drawn twice"
    assert set(drawn) == set().union(*(box_edges(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True)))


@pytest.mark.parametrize("flat_axes", [(0,), (0, 1), (0, 1, 2)])
def test_flat_boxes_have_no_lines_of_length_zero(flat_axes):
    low, high = np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)
    high[:, list(flat_axes)] = 0.0
    drawn = segments(box_lines(low, high))
    assert all(len(ends) == 2 for ends in drawn)
    assert set(drawn) == box_edges(low[0].tolist(), high[0].tolist())


def test_neighbours_that_differ_in_the_last_bit_share_their_edges():
    low = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], np.float32)
    high = np.array([[0.3, 1.0, 1.0], [1.0, 1.0, 1.0]], np.float32)
    high[0, 0] = np.nextafter(high[0, 0], np.float32(1))
    assert len(box_lines(low, high).indices) == 12 + 8
