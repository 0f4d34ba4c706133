"""`make bench-growth`, `bench-threads`, `bench-totals`: how builds and traces scale with triangles, threads and rays.

growth: build time and memory per triangle of a generated landscape of 100 thousand to 20 million triangles, and the
greatest of each over the least, in memory that the machine has at hand; beside it, the system's share of the time.
threads: one thread against two, in turns, over the benchmarks' scenes of more than 50,000 triangles. totals: build and
trace together for ten thousand to ten million rays of the camera, the hybrid against the best of other methods, in
turns, on one thread. METHODS, SCENES (not of growth) and MOST (triangles, growth only) come from the environment. Each
writes a file named like itself to out; with RECORD=1 it is kept in tests/bench/record, too.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import definitions
import espalier_rt
import harness
import numpy as np
import record
from numpy.typing import NDArray

from espalier_scenes import geometry

Row = dict[str, Any]

METHODS = ("lbvh", "bvh-clusters", "bvh-sah", "hybrid")
TRIANGLES = (100_000, 300_000, 1_000_000, 3_000_000, 10_000_000, 20_000_000)
"""Sizes of the landscapes."""
ROUNDS_OF = 6_000_000
"""Rounds are as many as this many triangles allow, from 1 to 9; the least time counts."""
FEWEST = 50_000
"""Scenes with fewer triangles are not worth a second thread."""
GROWTH_ROW = (
    "{method:<14} {triangles:>12,} triangles {build_ns:8.1f} ns, {system_ns:5.1f} the system's; {bytes:5.1f} bytes each"
)
BYTES = 250
"""More than a build needs of the system per triangle."""
COUNTS = (10_000, 100_000, 1_000_000, 10_000_000)
"""Numbers of rays whose totals are taken."""
TOTALED = ("hybrid", "lbvh", "bvh-clusters", "bvh-sah", "bvh-median")
"""The hybrid, and whom it is compared with where METHODS names nobody."""


def main() -> int:
    """Measure what the command line names; print, write, keep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("subject", choices=list(SUBJECTS))
    subject = parser.parse_args().subject
    rows = SUBJECTS[subject](os.environ.get("METHODS", "").split())
    about = record.header(argparse.Namespace(isa=None, threads="1, 2" if subject == "threads" else 1))
    text = json.dumps({"about": about, "rows": rows}, indent=1) + "\n"
    Path("out").mkdir(exist_ok=True)
    Path(f"out/{subject}.json").write_text(text, encoding="utf-8")
    if os.environ.get("RECORD") == "1":
        (record.FOLDER / f"{subject}.json").write_text(text, encoding="utf-8")
    return 0


def growth(named: list[str]) -> list[Row]:
    """Nanoseconds and bytes per triangle, by method and size."""
    methods = named or METHODS
    harness.pin(1)
    rows: list[Row] = []
    most = int(os.environ.get("MOST") or TRIANGLES[-1])
    for size in (size for size in TRIANGLES if size <= most):
        vertices, triangles = landscape(size)
        mesh, count = espalier_rt.Mesh(vertices, triangles), len(triangles)
        for method in methods:
            rounds = max(1, min(9, ROUNDS_OF // size))
            claim(count * BYTES)
            before = os.times().system
            took, accelerator = best(rounds, lambda: espalier_rt.Accelerator.build(mesh, method, threads=1))  # noqa: B023
            system = (os.times().system - before) / rounds
            row = {"method": method, "triangles": count, "build_ns": took / count * 1e9}
            row |= {"system_ns": system / count * 1e9, "bytes": accelerator.census()["bytes"] / count}
            rows.append(row)
            print(GROWTH_ROW.format(**row), flush=True)
            del accelerator
    for method in methods:
        print(
            f"{method:<14} " + ", ".join(f"{what} x{spread(rows, method, what):.2f}" for what in ("build_ns", "bytes"))
        )
    return rows


def claim(size: int) -> None:
    """Have the machine own so many free bytes.

    A virtual one gives what nobody has used for some seconds back to its host, and to get it again was measured to take
    0.2 to 2.5 milliseconds a megabyte, against 0.05 for fresh pages otherwise. Sizes of which many rounds are built do
    not meet that; those of which only one is would be compared by it. A build of many seconds loses the memory again.
    """
    np.ones(size, np.uint8)


def landscape(triangles: int) -> geometry.Mesh:
    """Hills of about so many triangles, of as many waves whatever their number."""

    def height(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.1 * np.sin(9 * x) * np.cos(7 * y) + 0.02 * np.sin(61 * x + 3 * y) + 0.01 * np.cos(97 * y - 5 * x)

    return geometry.plane(1.0, round((triangles / 2) ** 0.5), height)


def spread(rows: list[Row], method: str, what: str) -> float:
    """The greatest over the least of a column of a method."""
    values = [row[what] for row in rows if row["method"] == method]
    return max(values) / min(values)


def threads(named: list[str]) -> list[Row]:
    """Seconds of building and of tracing a million primary rays on one thread and on two, and their ratios."""
    methods = named or METHODS
    defined = definitions.load()
    names = os.environ.get("SCENES", "").split()
    binary = harness.build()
    rows: list[Row] = []
    for scene in defined.choose_scenes(names):
        vertices, triangles = scene.mesh()
        if len(triangles) < FEWEST:
            continue
        mesh, rays = espalier_rt.Mesh(vertices, triangles), primary_rays(defined, scene, binary)
        for method in methods:
            row = {"scene": scene.name, "method": method, "triangles": len(triangles)} | both(mesh, method, *rays)
            rows.append(row)
            print(f"{scene.name:<20} {method:<14} build x{row['build']:.2f} trace x{row['trace']:.2f}", flush=True)
    return rows


def primary_rays(defined: definitions.Definitions, scene: definitions.Scene, binary: Path) -> list[NDArray[np.float32]]:
    """(n, 3) origins and directions of the benchmarks' primary rays."""
    directory = Path("out/bench")
    classes = [entry | {"methods": ["lbvh"]} for entry in defined.choose_classes(["primary"])]
    plan, file = defined.plan(scene, classes, directory, rounds=1), directory / f"{scene.name}.rays"
    list(harness.run(binary, "rays", plan, directory / f"{scene.name}.json", "primary", file))
    columns = np.fromfile(file, "<f4").reshape(8, -1)
    return [columns[:3].T, columns[3:6].T]


def both(
    mesh: espalier_rt.Mesh, method: str, origins: NDArray[np.float32], directions: NDArray[np.float32]
) -> dict[str, float]:
    """Least times on the clock on one thread and on two, in turns, over seven rounds, and their ratios."""
    times: dict[str, float] = {}
    for _ in range(7):
        for count in (1, 2):
            took, accelerator = best(1, lambda: espalier_rt.Accelerator.build(mesh, method, threads=count))  # noqa: B023
            _least(times, f"build_s_{count}", took)
            took, _ = best(1, lambda: accelerator.closest(origins, directions, threads=count))  # noqa: B023
            _least(times, f"trace_s_{count}", took)
    ratios = {what: times[f"{what}_s_1"] / times[f"{what}_s_2"] for what in ("build", "trace")}
    return times | ratios


def totals(named: list[str]) -> list[Row]:
    """Seconds to build and to trace so many camera rays, by scene and number, and the first method's over the others'
    best."""
    harness.pin(1)
    defined, binary, methods = definitions.load(), harness.build(), named or TOTALED
    rows: list[Row] = []
    for scene in defined.choose_scenes(os.environ.get("SCENES", "").split()):
        vertices, triangles = scene.mesh()
        mesh, rays = espalier_rt.Mesh(vertices, triangles), primary_rays(defined, scene, binary)
        for count in COUNTS:
            times: dict[str, float] = {}
            chosen = None
            for turn in turns(least=3 if count > COUNTS[-2] else 5):
                # Who comes after the same method's builder finds its pages warm: a tenth of ten thousand rays' time.
                for method in methods if turn % 2 == 0 else reversed(methods):
                    took, accelerator = best(1, lambda: built_and_traced(mesh, method, count, rays))  # noqa: B023
                    _least(times, method, took)
                    chosen = next(iter(accelerator.choice()), chosen)
            others = {method: took for method, took in times.items() if method != methods[0]}
            fastest = min(others, key=others.__getitem__)
            row = {"scene": scene.name, "triangles": len(triangles), "rays": count, "seconds": times, "chosen": chosen}
            rows.append(row | {"best": fastest, "ratio": times[methods[0]] / others[fastest]})
            print(
                f"{scene.name:<20} {count:>10,} rays: {methods[0]} ({chosen}) x{rows[-1]['ratio']:.2f} of {fastest}",
                flush=True,
            )
    if rows:
        ratios = [row["ratio"] for row in rows]
        print(f"greatest x{max(ratios):.2f}, geometric mean x{np.exp(np.log(ratios).mean()):.2f}")
    return rows


def turns(least: int) -> Iterator[int]:
    """Count at least so many turns, and more of them until half a second is over: what takes a millisecond needs many
    until its code and memory are where they will be."""
    end = time.perf_counter() + 0.5
    for turn in itertools.count():
        if turn >= least and time.perf_counter() > end:
            return
        yield turn


def built_and_traced(
    mesh: espalier_rt.Mesh, method: str, count: int, rays: list[NDArray[np.float32]]
) -> espalier_rt.Accelerator:
    """An accelerator built for `count` rays, which were then traced: every so many-th of `rays`, or all repeatedly."""
    accelerator = espalier_rt.Accelerator.build(mesh, method, {"expected_rays": count}, threads=1)
    step = max(1, len(rays[0]) // count)
    origins, directions = (column[::step] for column in rays)
    for first in range(0, count, len(origins)):
        part = slice(0, count - first)
        accelerator.closest(origins[part], directions[part], threads=1)
    return accelerator


def _least(times: dict[str, float], name: str, took: float) -> None:
    times[name] = min(took, times.get(name, took))


def best(rounds: int, work: Callable[[], Any]) -> tuple[float, Any]:
    """The least seconds on the clock that some work took, and what it gave at last."""
    least, result = float("inf"), None
    for _ in range(rounds):
        result = None
        start = time.perf_counter()
        result = work()
        least = min(least, time.perf_counter() - start)
    return least, result


SUBJECTS = {"growth": growth, "threads": threads, "totals": totals}


if __name__ == "__main__":
    sys.exit(main())
