"""The report of a comparison: its numbers, as JSON and as a table in plain text. No bpy."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from . import methods as method_names

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class SceneSummary:
    """What was traced, every instance written out: `instances` is how many meshes were placed."""

    name: str
    triangles: int
    vertices: int
    instances: int


@dataclass(frozen=True)
class ImageSummary:
    """Size in pixels, and samples a pixel."""

    width: int
    height: int
    samples: int


@dataclass(frozen=True)
class MethodSummary:
    """One accelerator: wall time of build and of intersection work, its rays of all kinds, and its census."""

    name: str
    build_ms: float
    trace_s: float
    rays: int
    mrays_per_s: float
    bytes: int
    nodes: int
    leaves: int
    grids: int
    cells: int
    empty_cells: int
    references: int


@dataclass(frozen=True)
class CyclesSummary:
    """Wall seconds of Cycles on the same frame: synchronisation with the build of its BVH, then rendering."""

    sync_s: float
    render_s: float
    total_s: float


@dataclass(frozen=True)
class DifferenceSummary:
    """Between our picture and Cycles', both display-referred in 0..1: mean LDR-FLIP, root mean square error."""

    flip_mean: float
    rmse: float


@dataclass(frozen=True)
class Report:
    """One comparison. `cycles` and `difference` are None where Cycles was left out. `machine` is for people."""

    scene: SceneSummary
    image: ImageSummary
    threads: int
    machine: str
    export_ms: float
    methods: tuple[MethodSummary, ...]
    cycles: CyclesSummary | None = None
    difference: DifferenceSummary | None = None
    schema_version: int = SCHEMA_VERSION

    def as_dict(self) -> dict[str, Any]:
        """The report in plain types, `schema_version` first."""
        values = asdict(self)
        return {"schema_version": values.pop("schema_version"), **values, "methods": list(values["methods"])}

    def json(self) -> str:
        """The report as indented JSON, ending in a line feed. Raises ValueError for a number that is not finite."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def table(self) -> str:
        """The report as text: a line on the frame, one row a method, Cycles, the difference. `*` marks the best."""
        scene, image = self.scene, self.image
        head = (
            f"{scene.name}: {scene.triangles:,} triangles, {scene.instances:,} instances; "
            f"{image.width} x {image.height} pixels, {image.samples} {_plural(image.samples, 'sample')}, "
            f"{self.threads} {_plural(self.threads, 'thread')}"
        )
        lines = [head, "", *aligned([COLUMNS, *self._rows()])]
        if self.cycles is not None:
            lines += [
                "",
                f"Cycles: {self.cycles.sync_s:.3f} s synchronisation and BVH, {self.cycles.render_s:.3f} s rendering, "
                f"{self.cycles.total_s:.3f} s in all",
            ]
        if self.difference is not None:
            lines.append(f"Difference: FLIP {self.difference.flip_mean:.4f}, RMSE {self.difference.rmse:.4f}")
        return "\n".join(lines) + "\n"

    def _rows(self) -> list[list[str]]:
        best = {
            "build_ms": min((method.build_ms for method in self.methods), default=None),
            "trace_s": min((method.trace_s for method in self.methods), default=None),
            "mrays_per_s": max((method.mrays_per_s for method in self.methods), default=None),
            "bytes": min((method.bytes for method in self.methods), default=None),
        }

        def marked(method: MethodSummary, field: str, text: str) -> str:
            is_best = len(self.methods) > 1 and getattr(method, field) == best[field]
            return text + ("*" if is_best else " ")

        return [
            [
                f"{method_names.label(method.name)} ({method.name})",
                marked(method, "build_ms", f"{method.build_ms:,.1f}"),
                marked(method, "trace_s", f"{method.trace_s:.3f}"),
                marked(method, "mrays_per_s", f"{method.mrays_per_s:.2f}"),
                marked(method, "bytes", memory(method.bytes)),
                f"{method.nodes:,}",
                f"{method.grids:,}",
                f"{method.cells:,}",
            ]
            for method in self.methods
        ]


COLUMNS = ["Method", "Build ms ", "Trace s ", "Mrays/s ", "Memory ", "Nodes", "Grids", "Cells"]


def memory(count: int) -> str:
    """Bytes in the unit that keeps the number below 1024."""
    size, units = float(count), ["B", "KiB", "MiB", "GiB", "TiB"]
    while size >= 1024 and len(units) > 1:
        size /= 1024
        units.pop(0)
    return f"{size:.0f} {units[0]}" if units[0] == "B" else f"{size:.1f} {units[0]}"


def _plural(count: int, noun: str) -> str:
    return noun if count == 1 else f"{noun}s"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Columns two spaces apart, the first to the left, the others to the right, a rule below the first row."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [
        "  ".join(
            [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        )
        for row in rows
    ]
    rule = "-" * max(map(len, lines))
    return [lines[0].rstrip(), rule, *(line.rstrip() for line in lines[1:])]
