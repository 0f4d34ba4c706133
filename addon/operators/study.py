"""Measure every chosen method on the open scene, and write the report of the study."""

import tempfile
from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from .. import capture, machine, methods, results
from ..study import paper, sources, writing
from ..study.fingerprint import fingerprint
from ..study.journal import REPORT, Journal, forget, is_interrupted
from ..study.plan import Plan
from ..study.task import Study
from . import reasons
from .task import Task, TaskOperator

RAYS = ("primary-shadow", "ao", "diffuse")
"""The ray classes of the button's study."""


class ESPALIER_OT_study(TaskOperator, bpy.types.Operator):
    """Build each chosen method over the scene and trace rays of several kinds, again and again, \
and write a report of times, steps and memory. Scene and settings stay as they are"""

    bl_idname = "espalier.study"
    bl_label = "Run Study"

    directory: StringProperty(
        name="Directory",
        description="Folder the report is written to; empty for one beside the file, or a temporary one",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    open_report: BoolProperty(
        name="Open Report",
        description="Show the report in the web browser when it is there",
        default=True,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return reasons.can_trace(cls, context)

    def begin(self, context: bpy.types.Context) -> Task:
        scene = context.scene
        data = capture.export_frame(scene, context.view_layer, border=False)
        self._warnings = data.warnings
        self._folder = Path(bpy.path.abspath(self.directory)) if self.directory else default_folder(scene)
        source = sources.of_scene_data(data)
        wanted = plan_of(scene, data.camera.resolution)
        folder, table = self._folder, paper.read()
        return Study(
            wanted,
            _journal(folder, wanted, source.digest),
            lambda _group, _progress: source,
            lambda journal: writing.publish(folder, journal, table),
            {scene.name: data.triangle_count},
        ).start()

    def advance(self, _context: bpy.types.Context) -> None:
        results.store(self._scene_uid, results.of(self._scene_uid).rows, self._warnings)

    def finish(self, context: bpy.types.Context) -> str:
        report = self._folder / REPORT
        if self.open_report and not bpy.app.background:
            bpy.ops.wm.url_open(url=report.resolve().as_uri())
        return f"Report: {report}"


def plan_of(scene: bpy.types.Scene, resolution: tuple[int, int]) -> Plan:
    """The study that the button makes of a scene with its settings."""
    settings = scene.espalier
    return Plan(
        scenes=(scene.name,),
        methods=tuple(name for name in methods.METHOD_NAMES if name in settings.methods),
        classes=RAYS,
        resolutions=(resolution,),
        threads=settings.threads or machine.available_threads(),
        seed=settings.seed,
    )


def default_folder(scene: bpy.types.Scene) -> Path:
    """Beside the file where it is saved, else in the folder for temporary files, which outlives Blender's own."""
    name = bpy.path.clean_name(f"{scene.name}-study")
    saved = bpy.data.filepath
    if saved:
        return Path(saved).parent / f"{Path(saved).stem}-{name}"
    return Path(tempfile.gettempdir()) / f"espalier-{name}"


def _journal(folder: Path, plan: Plan, digest: str) -> Journal:
    """The journal of an interrupted study of this very scene, to go on with; else a new one."""
    about = fingerprint()
    if not is_interrupted(folder, plan, about, digest):
        forget(folder)
    return Journal(folder, plan, about)


CLASSES = (ESPALIER_OT_study,)
