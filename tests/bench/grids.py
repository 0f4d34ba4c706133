"""`make bench-grids`: when a grid beats the best hierarchy, by content, length of rays, rays of a call, number of rays.

Our methods alone, in turns, on one thread, in the native harness; hits are compared between methods. SCENES (names,
space-separated) and RECORD=1 come from the environment. Writes out/grids.json and out/grids.svg; RECORD=1 keeps both
in tests/bench/record.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from math import isinf
from pathlib import Path
from typing import Any

import definitions
import espalier_rt
import harness
import ratio_figure
import record
import verdict
from rich.console import Console
from rich.table import Table

from espalier_scenes import SceneCatalogueError

Row = dict[str, Any]

OUT = Path("out")
COUNTS = (1e3, 1e8)
"""Numbers of rays between which the fastest method is told."""


def main() -> int:
    """Measure, print, write, keep; 1 where methods disagree or something is missing."""
    console = Console(width=None if sys.stdout.isatty() else 180)
    try:
        cases, builds, faults = measure(console)
    except (definitions.DefinitionError, harness.NativeError, SceneCatalogueError, OSError) as error:
        console.print(f"[red]bench:[/] {error}", highlight=False)
        return 1
    settings = definitions.load().grids
    result = summary(cases, builds, settings["occupied"])
    console.print(table(cases))
    for way, score in result["foretold"].get("one at a time", {}).items():
        console.print(f"{way}: right in {score['right']:.0%} of the cases, costs x{score['cost']:.2f}", highlight=False)
    keep(cases, result)
    for fault in faults:
        console.print(f"[red]bench:[/] {fault}", highlight=False)
    return 1 if faults else 0


def measure(console: Console) -> tuple[list[verdict.Case], dict[str, dict[str, float]], list[str]]:
    """All cases, seconds of builds by scene and method, and what is wrong with the hits."""
    defined = definitions.load()
    cases, builds, faults = [], {}, []
    scenes = chosen(defined, os.environ.get("SCENES", "").split())
    binary = harness.build()
    harness.pin(1)
    for scene in scenes:
        rows = list(measured(defined, scene, binary))
        faults += [f"{row['scene']} {row['class']} {row['method']}: {row['mismatches']} hits differ" for row in rows
                   if row["mismatches"]]  # fmt: skip
        builds[scene.name] = {row["method"]: row["seconds"] for row in rows if row["class"] == "build"}
        found = list(gathered(defined.grids, rows, occupancy(scene, defined.grids["density"])))
        console.print(line(found), highlight=False)
        cases += found
    return cases, builds, faults


def chosen(defined: definitions.Definitions, names: list[str]) -> list[definitions.Scene]:
    """The scenes named, or all of this benchmark's, surfaces first. Raises DefinitionError."""
    names = names or defined.grids["scenes"] + defined.grids["soups"]
    return [defined.soups.get(name) or defined.choose_scenes([name])[0] for name in names]


def measured(defined: definitions.Definitions, scene: definitions.Scene, binary: Path) -> Iterator[Row]:
    """The harness's rows of a scene: of builds, and of every reach and batch."""
    settings = defined.grids
    built = [name for name in settings["grids"] if name != harness.LEAVES] + settings["hierarchies"]
    classes = [{"name": "build", "kind": "build", "methods": built, "rival": []}]
    yield from _run(defined, scene, binary, classes, settings["build_seconds"])
    common = {"kind": "batch", "methods": [*built, harness.LEAVES], "rival": []}
    classes = [
        common | {"name": f"{reach} {batch}", "batch": batch, "rays": rays(max(settings["rays"], batch), reach)}
        for reach in settings["reaches"]
        for batch in settings["batches"]
    ]
    yield from _run(defined, scene, binary, classes, settings["seconds"])


def _run(
    defined: definitions.Definitions, scene: definitions.Scene, binary: Path, classes: list[Row], seconds: float
) -> Iterator[Row]:
    settings, directory = defined.grids, OUT / "bench"
    limits = {"rounds": settings["rounds"], "seconds": seconds, "hopeless": settings["hopeless"]}
    limits |= {"grid_of_leaves": settings["leaves_density"]}
    plan = defined.plan(scene, classes, directory, **limits)
    return harness.turns(binary, plan, directory / f"{scene.name}.json")


def rays(count: int, reach: float) -> Row:
    """The plan's rays of that reach."""
    return {"inside": {"count": count, "reach": None if isinf(reach) else reach}}


def gathered(settings: Row, rows: list[Row], occupied: float) -> Iterator[verdict.Case]:
    """The cases of a scene's rows."""
    for reach in settings["reaches"]:
        for batch in settings["batches"]:
            of = {row["method"]: row for row in rows if row["class"] == f"{reach} {batch}"}
            rates = {name: row["rays"] / row["seconds"] for name, row in of.items()}
            yield verdict.Case(
                scene=rows[0]["scene"],
                occupancy=round(occupied, 3),
                reach=None if isinf(reach) else reach,
                batch=batch,
                grids={name: rates[name] for name in settings["grids"]},
                hierarchies={name: rates[name] for name in settings["hierarchies"]},
                counts={name: (row["steps"], row["tests"]) for name, row in of.items()},
            )


def occupancy(scene: definitions.Scene, density: float) -> float:
    """The share of a grid's cells that hold a triangle; `density`: cells a triangle."""
    mesh = espalier_rt.Mesh(*scene.mesh())
    census = espalier_rt.Accelerator.build(mesh, "grid", {"grid_density": density}, threads=1).census()
    return 1 - census["empty_cells"] / census["cells"]


def summary(cases: list[verdict.Case], builds: dict[str, dict[str, float]], occupied: float) -> Row:
    """Which method is fastest from how many endless rays on, and how well the winner of cases can be foretold."""
    endless = {(case.scene, case.batch): case for case in cases if case.reach is None}
    counts = []
    for (scene, batch), case in endless.items():
        if batch in (1, max(case.batch for case in cases)):
            rates = case.grids | case.hierarchies
            ray_seconds = {name: 1 / rates[name] for name in builds[scene]}
            fastest = verdict.envelope(builds[scene], ray_seconds, *COUNTS)
            counts.append({"scene": scene, "batch": batch, "fastest": fastest})
    foretold = {
        "all": cases,
        "one at a time": [case for case in cases if case.batch == 1],
        "endless, one at a time": [case for case in endless.values() if case.batch == 1],
    }
    if len({case.scene for case in cases}) < 2:
        foretold = {}  # nothing to fit costs to
    scores = {name: verdict.scores(some, occupied) for name, some in foretold.items()}
    return {
        "builds": builds,
        "number_of_rays": counts,
        "foretold": {name: {way: vars(score) for way, score in ways.items()} for name, ways in scores.items()},
    }


def line(cases: list[verdict.Case]) -> str:
    """A scene in short: the ratios of single and of endless rays."""
    single = " ".join(f"{case.ratio:.2f}" for case in cases if case.batch == 1)
    endless = " ".join(f"{case.ratio:.2f}" for case in cases if case.reach is None)
    return f"{cases[0].scene:<16} one at a time, by length: {single}; endless, by batch: {endless}"


def table(cases: list[verdict.Case]) -> Table:
    """Every case: the best grid's rate over the best hierarchy's."""
    shown = Table(title="The fastest grid over the fastest hierarchy; above 1: a grid wins")
    for heading in ("scene", "occupied", "length"):
        shown.add_column(heading, no_wrap=True)
    batches = sorted({case.batch for case in cases})
    for batch in batches:
        shown.add_column(f"{batch:,}", justify="right")
    ratios = {(case.scene, case.reach, case.batch): case.ratio for case in cases}
    for scene, occupied, reach in dict.fromkeys((case.scene, case.occupancy, case.reach) for case in cases):
        found = [ratios[scene, reach, batch] for batch in batches]
        cells = [f"[green]{ratio:.2f}[/]" if ratio > 1 else f"{ratio:.2f}" for ratio in found]
        shown.add_row(scene, f"{occupied:.2f}", ratio_figure.length(reach), *cells)
    return shown


def keep(cases: list[verdict.Case], result: Row) -> None:
    """Write figures and picture, and with RECORD=1 their record."""
    about = record.header(argparse.Namespace(isa=espalier_rt.instruction_set(), threads=1))
    rows = ",\n".join(json.dumps(case.row()) for case in cases)
    parts = [f'"about": {json.dumps(about, indent=1)}', f'"summary": {json.dumps(result)}', f'"rows": [\n{rows}\n]']
    text = "{" + ",\n".join(parts) + "}\n"
    for folder in [OUT, record.FOLDER] if os.environ.get("RECORD") == "1" else [OUT]:
        folder.mkdir(exist_ok=True)
        (folder / "grids.json").write_text(text, encoding="utf-8")
        (folder / "grids.svg").write_text(ratio_figure.draw(cases), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
