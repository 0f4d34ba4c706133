"""`espalier study`: its options, and what it does with them. It imports without bpy."""

import argparse
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, TextIO

from .. import catalogue, input_kinds, machine, native
from ..arguments import count, listed, resolution, some_of
from ..report import aligned
from ..terminal import ProgressLine, heeding_ctrl_c, own_streams
from . import check, embree, paper, sources, writing
from .fingerprint import fingerprint
from .journal import REPORT, Journal, forget
from .plan import EMBREE, PAPER_SCENES, RAY_CLASSES, Group, Plan
from .rows import Results
from .task import Loader, Study

DEFAULT_FOLDER = Path("out") / "study"
POLL_SECONDS = 0.05
STOP_SECONDS = 5.0
"""How long an interrupted study may take to stop: Embree's builds hear no cancel."""

Blender = Callable[[], AbstractContextManager[None]]
"""Blender with the add-on registered, as a context."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options. What is left out is as the paper did, or with --check as the older study did."""
    add = parser.add_argument
    add(
        "inputs", metavar="INPUT", nargs="*", help="scenes' names, meshes (.ply .obj .stl), .blend (the paper's models)"
    )
    add("--methods", type=listed, metavar="A,B", help="acceleration methods (all)")
    classes = some_of("ray class", list(RAY_CLASSES))
    add("--rays", type=classes, metavar="A,B", help=f"some of {','.join(RAY_CLASSES)} (primary-shadow)")
    add("--resolutions", type=_resolutions, metavar="WxH,...", help="sizes of the picture (1000x1000)")
    add("--threads", type=count(0, 1024), metavar="N", help="0, the default: all cores")
    add("--repeats", type=count(1, 1000), metavar="N", help="most measurements of a case (7)")
    add("--seconds", type=count(0, 86400), metavar="N", help="most seconds of a case's measurements, but one (4)")
    add("--embree", action=argparse.BooleanOptionalAction, default=True, help="measure embreex too, where installed")
    add("--out", type=Path, default=DEFAULT_FOLDER, metavar="DIR", help=f"where everything goes ({DEFAULT_FOLDER})")
    add("--restart", action="store_true", help="begin anew, whatever DIR holds")
    add("--check", type=Path, metavar="OLD.json", help="say what got slower since an older study.json; status 1 if any")
    add("--paper", type=Path, default=paper.FILE, metavar="FILE", help="the paper's times: a copy of study/paper.json")


def run(options: argparse.Namespace, blender: Blender) -> int:
    """Measure, or go on; write everything; with --check compare. Raises what tells the user what to do."""
    old = check.read(options.check) if options.check else None
    table = paper.read(options.paper)
    plan = plan_of(options, old)
    for text in plan.scenes:
        input_kinds.check(text)
    in_blender = sys.modules.get("bpy") is not None or any(map(sources.needs_blender, plan.scenes))
    with own_streams() as (stdout, stderr), blender() if in_blender else nullcontext():
        results = _measure(plan, options, table, ProgressLine(stdout, stderr), stderr)
        stdout.write(f"\n{summary(results)}\nReport: {options.out / REPORT}\n")
        if old is None:
            return 0
        found = check.check(old, results)
        stdout.writelines(f"{line}\n" for line in found.lines())
        return 0 if found.passed else 1


def plan_of(options: argparse.Namespace, old: dict[str, Any] | None) -> Plan:
    """The plan: of what options say, then of the older study, then as the paper did. Raises ConfigError."""
    before = Plan.of(old["plan"]) if old else None
    default = before or Plan(PAPER_SCENES, tuple(native.module().methods()))
    methods = options.methods or tuple(name for name in default.methods if name != EMBREE)
    for name in methods:
        native.module().default_config(name)
    with_embree = options.embree and embree.version() is not None
    return Plan(
        scenes=tuple(dict.fromkeys(options.inputs)) or default.scenes,
        methods=(*methods, EMBREE) if with_embree else methods,
        classes=options.rays or default.classes,
        resolutions=options.resolutions or default.resolutions,
        threads=(default.threads if before else machine.available_threads())
        if options.threads is None
        else options.threads or machine.available_threads(),
        repeats=options.repeats or default.repeats,
        seconds=default.seconds if options.seconds is None else float(options.seconds),
    )


def summary(results: Results) -> str:
    """A table of times to the image in milliseconds: methods down, scenes across; `*` marks the best of a column."""
    groups = results.groups()
    lines = [["ms to image", *(_heading(results, group) for group in groups)]]
    least = {
        group: min((row.total_s for row in results.of(group) if row.method != EMBREE), default=0) for group in groups
    }
    for method in results.plan.methods:
        cells = []
        for group in groups:
            row = results.find(group, method)
            mark = "*" if row and row.total_s == least[group] else " "
            cells.append(f"{row.total_s * 1000:,.1f}{mark}" if row else "failed ")
        lines.append([method, *cells])
    text = "\n".join(aligned(lines)) if groups else "Nothing could be measured"
    methods: dict[str, list[str]] = {}
    for row in results.failures:
        methods.setdefault(f"{row.case.group.scene}: {row.failure}", []).append(row.method)
    reasons = [f"Failed: {why} ({', '.join(dict.fromkeys(names))})" for why, names in methods.items()]
    return "\n".join([text, *reasons]) + "\n"


def _heading(results: Results, group: Group) -> str:
    plan = results.plan
    size = f" {group.width}x{group.height}" if len(plan.resolutions) > 1 else ""
    return results.name(group) + (f" {group.rays}" if len(plan.classes) > 1 else "") + size


def _measure(
    plan: Plan, options: argparse.Namespace, table: paper.Paper, line: ProgressLine, stderr: TextIO
) -> Results:
    line.update(0.0, "Open")
    load = _loader(plan)
    if options.restart:
        forget(options.out)
    journal = Journal(options.out, plan, fingerprint())
    study = Study(plan, journal, load, lambda done: writing.publish(options.out, done, table), _sizes())
    try:
        with heeding_ctrl_c():
            study.start()
            while not study.wait(POLL_SECONDS):
                line.update(study.progress, study.scene, study.detail)
    except KeyboardInterrupt:
        line.close()
        stderr.write(f"espalier: the study goes on from here with the same command and the same --out {options.out}\n")
        raise
    finally:
        study.cancel()
        study.wait(STOP_SECONDS)
        line.close()
    study.raise_error()
    assert study.results is not None
    return study.results


def _loader(plan: Plan) -> Loader:
    """What gives each group its scene; what needs Blender is opened now, on the main thread."""
    opened = {}
    for group in plan.groups():
        key = (group.scene, group.width, group.height)
        if sources.needs_blender(group.scene) and key not in opened:
            opened[key] = _open_in_blender(group)

    def load(group: Group, progress: Callable[[float], None]) -> sources.Source:
        found = opened.get((group.scene, group.width, group.height))
        return found or sources.load(group.scene, group.width / group.height, progress)

    return load


def _open_in_blender(group: Group) -> sources.Source:
    from .. import inputs
    from ..capture import export_frame

    size = (group.width, group.height)
    opened = inputs.open_input(group.scene, None, size, lambda _progress: None)
    source = sources.of_scene_data(export_frame(opened.scene, resolution=size, border=False))
    return sources.renamed(source, Path(group.scene).stem)


def _sizes() -> dict[str, int]:
    return {model.name: model.triangles for model in catalogue.module("models").MODELS}


def _resolutions(text: str) -> tuple[tuple[int, int], ...]:
    return tuple(dict.fromkeys(resolution(part) for part in text.split(",")))
