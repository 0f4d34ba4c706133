"""The results table: what a cell says, and which is the best."""

import pytest

from espalier import results_table as table
from espalier.methods import METHOD_NAMES
from espalier.results import CYCLES, Row

ROWS = (
    Row("bvh-median", 12.0, 0.5, 2.0, 4_000_000, 1000, 0, 0),
    Row("grid", 3.0, 0.8, 1.25, 3_000_000, 1, 1, 50_000),
    Row(CYCLES, 40.0, 1.5),
)


def column(field):
    return next(column for column in table.TIMES + table.SIZES if column.field == field)


def best(field, rows=ROWS):
    return [cell.best for cell in table.cells(rows, column(field))]


def test_the_best_is_least_time_most_rays_least_memory():
    assert best("build_ms") == [False, True, False]
    assert best("trace_s") == [True, False, False]
    assert best("mrays_per_s") == [True, False, False]
    assert best("bytes") == [False, True, False]


@pytest.mark.parametrize("field", ["nodes", "grids", "cells"])
def test_counts_have_no_best(field):
    assert best(field) == [False, False, False]


def test_equal_ones_are_both_best_and_a_lone_one_is_not():
    assert best("build_ms", (Row("grid", 1.0, 1.0), Row("bvh-sah", 1.0, 2.0))) == [True, True]
    assert best("build_ms", (Row("grid", 1.0, 1.0), Row("bvh-sah"))) == [False, False]


def test_cycles_is_where_it_has_numbers():
    assert [row.method for row in table.rows_for(ROWS, table.TIMES)] == ["bvh-median", "grid", CYCLES]
    assert [row.method for row in table.rows_for(ROWS, table.SIZES)] == ["bvh-median", "grid"]


def test_what_is_not_known_is_a_dash():
    assert [cell.text for cell in table.cells(ROWS, column("nodes"))] == ["1000", "1", "\N{EN DASH}"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0, "0"),
        (7, "7"),
        (0.0123456, "0.0123"),
        (0.35, "0.350"),
        (0.9996, "1.00"),
        (1.0 / 3, "0.333"),
        (9.996, "10.0"),
        (99.96, "100"),
        (9999.4, "9999"),
        (9999.6, "10.0k"),
        (871_414, "871k"),
        (999_600, "1.00M"),
        (2.5e9, "2.50G"),
        (0.000012, "1.2e-05"),
    ],
)
def test_numbers_have_three_digits(value, text):
    assert table.number_text(value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(512, "512"), (1536, "1.50K"), (40 * 2**20, "40M"), (1023 * 2**10, "0.999M"), (3 * 2**30, "3G")]
)
def test_bytes_are_in_binary_units(value, text):
    assert table.byte_text(value) == text


def test_every_method_has_a_name_of_its_own_long_and_short():
    for short in (False, True):
        names = [table.method_text(name, short=short) for name in (*METHOD_NAMES, CYCLES)]
        assert len(set(names)) == len(names)
        assert not set(names) & set(METHOD_NAMES)
