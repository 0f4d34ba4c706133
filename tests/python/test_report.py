"""The report: exactly the published schema, and a table a person can read."""

import json
from dataclasses import replace

import pytest

from espalier.report import (
    CyclesSummary,
    DifferenceSummary,
    ImageSummary,
    MethodSummary,
    Report,
    SceneSummary,
    memory,
)

METHOD = MethodSummary("grid", 12.5, 0.25, 1_000_000, 4.0, 3 << 20, 1, 0, 1, 4096, 3000, 5000)
REPORT = Report(
    scene=SceneSummary("Garden", 871_414, 437_645, 12),
    image=ImageSummary(1000, 800, 1),
    threads=2,
    machine="Some processor, 2 cores",
    export_ms=31.25,
    methods=(METHOD, replace(METHOD, name="hybrid", build_ms=50.0, trace_s=0.125, mrays_per_s=8.0, bytes=2000)),
    cycles=CyclesSummary(0.5, 1.25, 1.75),
    difference=DifferenceSummary(0.125, 0.0625),
)

SCHEMA = {
    "schema_version": int,
    "scene": {"name": str, "triangles": int, "vertices": int, "instances": int},
    "image": {"width": int, "height": int, "samples": int},
    "threads": int,
    "machine": str,
    "export_ms": float,
    "methods": [
        {
            "name": str,
            "build_ms": float,
            "trace_s": float,
            "rays": int,
            "mrays_per_s": float,
            "bytes": int,
            "nodes": int,
            "leaves": int,
            "grids": int,
            "cells": int,
            "empty_cells": int,
            "references": int,
        }
    ],
    "cycles": {"sync_s": float, "render_s": float, "total_s": float},
    "difference": {"flip_mean": float, "rmse": float},
}


def shape_of(value: object) -> object:
    """The schema of a value, of lists that of their first item."""
    if isinstance(value, dict):
        return {key: shape_of(item) for key, item in value.items()}
    if isinstance(value, list):
        assert all(shape_of(item) == shape_of(value[0]) for item in value)
        return [shape_of(value[0])]
    return type(value)


def test_json_has_exactly_the_schema() -> None:
    read = json.loads(REPORT.json())
    assert shape_of(read) == SCHEMA
    assert list(read) == list(SCHEMA)
    assert read["schema_version"] == 1
    assert read["scene"] == {"name": "Garden", "triangles": 871414, "vertices": 437645, "instances": 12}
    assert read["methods"][1]["name"] == "hybrid"


def test_without_cycles_its_parts_are_null() -> None:
    read = json.loads(replace(REPORT, cycles=None, difference=None).json())
    assert read["cycles"] is None
    assert read["difference"] is None
    assert list(read) == list(SCHEMA)


def test_a_number_that_json_has_not_is_refused() -> None:
    with pytest.raises(ValueError, match="JSON"):
        replace(REPORT, export_ms=float("inf")).json()


def test_the_table_has_a_row_a_method_and_marks_the_best() -> None:
    lines = REPORT.table().splitlines()
    assert lines[0] == "Garden: 871,414 triangles, 12 instances; 1000 x 800 pixels, 1 sample, 2 threads"
    grid = next(line for line in lines if "(grid)" in line)
    hybrid = next(line for line in lines if "(hybrid)" in line)
    assert [cell for cell in grid.split() if cell.endswith("*")] == ["12.5*"]
    assert [cell for cell in hybrid.split() if cell.endswith("*")] == ["0.125*", "8.00*", "KiB*"]
    assert "Cycles: 0.500 s synchronisation and BVH, 1.250 s rendering, 1.750 s in all" in lines
    assert "Difference: FLIP 0.1250, RMSE 0.0625" in lines


def test_columns_line_up() -> None:
    lines = REPORT.table().splitlines()
    head, rule, *rows = lines[2:6]
    assert set(rule) == {"-"}
    assert {len(row) for row in rows} == {len(head)} == {len(rule)}


def test_one_method_alone_is_not_the_best_of_anything() -> None:
    assert "*" not in replace(REPORT, methods=(METHOD,)).table()


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "0 B"),
        (1023, "1023 B"),
        (1024, "1.0 KiB"),
        (3 << 19, "1.5 MiB"),
        (5 << 30, "5.0 GiB"),
        (1 << 52, "4096.0 TiB"),
    ],
)
def test_memory_is_told_in_the_unit_that_fits(count: int, text: str) -> None:
    assert memory(count) == text
