"""`make bench`: measure Espalier against Embree, print a table, write out/bench.json.

Choices come from the environment, as make passes them on, or from the command line:
SCENES, CLASSES (names, space-separated), MODELS (a folder: every .ply in it), METHODS, THREADS, ISA, ROUNDS,
RECORD=1 (keep the results in tests/bench/record).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import definitions
import harness
import record
import table
from rich.console import Console

from espalier_scenes import SceneCatalogueError

OUT = Path("out")


def main() -> int:
    """Run, print, write; 1 where an answer is not what it should be."""
    console = Console(width=None if sys.stdout.isatty() else 180)
    arguments = _arguments()
    try:
        rows, faults = measure(arguments, console)
    except (definitions.DefinitionError, harness.NativeError, SceneCatalogueError, OSError) as error:
        console.print(f"[red]bench:[/] {error}", highlight=False)
        return 1
    console.print(table.render(rows))
    console.print(table.summary(rows, definitions.load().classes))
    OUT.mkdir(exist_ok=True)
    (OUT / "bench.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if arguments.record:
        console.print(f"recorded in {record.keep(rows, arguments)}")
    for fault in faults:
        console.print(f"[red]bench:[/] {fault}", highlight=False)
    return 1 if faults else 0


def measure(arguments: argparse.Namespace, console: Console) -> tuple[list[dict[str, Any]], list[str]]:
    """All rows, and what is wrong with the answers in them."""
    defined = definitions.load()
    scenes = defined.choose_scenes(arguments.scenes, arguments.models)
    classes = defined.choose_classes(arguments.classes)
    if arguments.methods:
        classes = [entry | {"methods": arguments.methods} for entry in classes]
    settings = {"library": str(harness.embree()), "threads": arguments.threads, "isa": arguments.isa}
    settings |= {"rounds": arguments.rounds} if arguments.rounds else {}
    binary = harness.build()
    harness.pin(arguments.threads)
    rows, faults = [], []
    for scene in scenes:
        plan = defined.plan(scene, classes, OUT / "bench", **settings)
        for row in harness.run(binary, "race", plan, OUT / "bench" / f"{scene.name}.json"):
            console.print(table.line(row), highlight=False)
            rows.append(row)
            faults += _faults(row, scene)
    return rows, faults


def _faults(row: dict[str, Any], scene: definitions.Scene) -> list[str]:
    """Answers that are wrong, or not those expected."""
    where = f"{row['scene']} {row['class']} {row['method']}"
    faults = [f"{where}: {row['ours_wrong']} wrong answers"] if row["ours_wrong"] else []
    expected = scene.hits.get(row["class"])
    if expected is not None and expected != row["hits"]:
        faults.append(f"{where}: {row['hits']} hits, {expected} expected")
    return faults


def _arguments() -> argparse.Namespace:
    """The command line, its defaults from the environment."""
    words, given = str.split, os.environ.get
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=words, default=words(given("SCENES", "")))
    parser.add_argument("--classes", type=words, default=words(given("CLASSES", "")))
    parser.add_argument("--methods", type=words, default=words(given("METHODS", "")))
    parser.add_argument("--models", type=Path, default=Path(given("MODELS")) if given("MODELS") else None)
    parser.add_argument("--threads", type=int, default=int(given("THREADS") or 1))
    parser.add_argument("--rounds", type=int, default=int(given("ROUNDS") or 0))
    parser.add_argument("--isa", choices=["avx2", "avx512"], default=given("ISA") or None)
    parser.add_argument("--record", action="store_true", default=given("RECORD") == "1")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
