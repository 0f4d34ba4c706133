"""`make bench-paper`: the paper's comparison in its own setting, so that it is fair: rays traced one at a time, no
batches, the same loop for every method. The lists of `grid` and of the paper's hybrid are gathered triangle by
triangle; `grid-of-leaves` has the leaves of the hierarchies in its cells, but a builder that nobody has sped up.

Builds, traces a megapixel of camera rays and does both in one go, in turns, on one thread, in the native harness.
SCENES and METHODS (names, space-separated) and RECORD=1 come from the environment. Writes out/paper.json; RECORD=1
keeps it in tests/bench/record.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import definitions
import espalier_rt
import harness
import record
from rich.console import Console
from rich.table import Table

from espalier_scenes import SceneCatalogueError

Row = dict[str, Any]

OUT = Path("out")
PARTS = {"build_s": {"kind": "build"}, "trace_s": {"kind": "batch"}, "total_s": {"kind": "image"}}
"""What is timed. A total is from raw arrays to the last hit; methods that build as rays come do so within it."""


def main() -> int:
    """Measure, print, write, keep; 1 where methods disagree or something is missing."""
    console = Console(width=None if sys.stdout.isatty() else 180)
    try:
        rows = measure(console)
    except (definitions.DefinitionError, harness.NativeError, SceneCatalogueError, OSError) as error:
        console.print(f"[red]bench:[/] {error}", highlight=False)
        return 1
    console.print(table(rows))
    about = record.header(argparse.Namespace(isa=espalier_rt.instruction_set(), threads=1))
    lines = ",\n".join(json.dumps(row) for row in rows)
    for folder in [OUT, record.FOLDER] if os.environ.get("RECORD") == "1" else [OUT]:
        folder.mkdir(exist_ok=True)
        text = f'{{"about": {json.dumps(about, indent=1)},\n"rows": [\n{lines}\n]}}\n'
        (folder / "paper.json").write_text(text, encoding="utf-8")
    differing = [row for row in rows if row["mismatches"]]
    for row in differing:
        console.print(f"[red]bench:[/] {row['scene']} {row['method']}: {row['mismatches']} hits differ")
    return 1 if differing else 0


def measure(console: Console) -> list[Row]:
    """A row for every scene and method."""
    defined = definitions.load()
    settings, directory = defined.paper, OUT / "bench"
    methods = os.environ.get("METHODS", "").split() or settings["methods"]
    common = {"methods": methods, "rival": [], "rays": "primary", "batch": 1}
    classes = [common | {"name": name} | part for name, part in PARTS.items()]
    scenes = defined.choose_scenes(os.environ.get("SCENES", "").split() or settings["scenes"])
    binary = harness.build()
    harness.pin(1)
    rows = []
    for scene in scenes:
        limits = {"rounds": settings["rounds"], "seconds": settings["seconds"]}
        limits |= {"grid_of_leaves": settings["leaves_density"]}
        plan = defined.plan(scene, classes, directory, **limits)
        found = gathered(list(harness.turns(binary, plan, directory / f"{scene.name}.json")))
        console.print(*(line(row) for row in found), sep="\n", highlight=False)
        rows += found
    return rows


def gathered(turns: list[Row]) -> list[Row]:
    """A row a method of the harness's rows of one scene, with ratios to the first method."""
    times: dict[str, Row] = {}
    for turn in turns:
        of = times.setdefault(turn["method"], {"scene": turn["scene"], "method": turn["method"], "mismatches": 0})
        of |= {turn["class"]: turn["seconds"], "mismatches": of["mismatches"] + turn["mismatches"]}
    first = next(iter(times.values()))
    ratios = {name: {part: of[part] / first[part] for part in PARTS} for name, of in times.items()}
    return [of | {"ratios": ratios[name]} for name, of in times.items()]


def line(row: Row) -> str:
    """A row in short."""
    times = " ".join(f"{part[:-2]} {row[part] * 1e3:8.1f} ms x{row['ratios'][part]:.2f}" for part in PARTS)
    return f"{row['scene']:<14} {row['method']:<15} {times}"


def table(rows: list[Row]) -> Table:
    """Ratios of totals: a scene a row, a method a column."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    shown = Table(title=f"Build and trace one ray at a time, over {methods[0]}; below 1: faster")
    shown.add_column("scene")
    for method in methods:
        shown.add_column(method, justify="right")
    for scene in dict.fromkeys(row["scene"] for row in rows):
        totals = {row["method"]: row["ratios"]["total_s"] for row in rows if row["scene"] == scene}
        shown.add_row(scene, *(f"{totals[method]:.2f}" for method in methods))
    return shown


if __name__ == "__main__":
    sys.exit(main())
