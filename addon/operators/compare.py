"""Compare every chosen method, and Cycles, on the current frame."""

import bpy

from .. import compare, methods, results, session, shown_images
from . import reasons
from .task import Task, TaskOperator

IMAGE = "Espalier Compare"
"""Name of the image datablock that holds the comparison."""


class ESPALIER_OT_compare(TaskOperator, bpy.types.Operator):
    """Trace the current frame with each chosen method, render it with Cycles in a second Blender, and show both \
images above their difference. Scene and settings stay as they are"""

    bl_idname = "espalier.compare"
    bl_label = "Compare with Cycles"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return reasons.can_trace(cls, context)

    def begin(self, context: bpy.types.Context) -> Task:
        scene = context.scene
        settings = scene.espalier
        chosen = [name for name in methods.METHOD_NAMES if name in settings.methods]
        wanted = compare.Settings(methods=chosen, options=session.Options.of(settings))
        self._comparison = compare.begin(scene, wanted, context.view_layer)
        session.adopt(scene, self._comparison.run)
        return self._comparison

    def advance(self, _context: bpy.types.Context) -> None:
        rows = list(results.rows(self._comparison.run))
        if not self._comparison.done:
            rows.append(results.Row(results.CYCLES))
        results.store(self._scene_uid, rows, self._comparison.run.data.warnings)

    def finish(self, _context: bpy.types.Context) -> str:
        outcome = self._comparison.outcome
        cycles, difference = outcome.report.cycles, outcome.report.difference
        rows = [*results.rows(self._comparison.run), results.cycles_row(cycles)]
        results.store(self._scene_uid, rows, outcome.notes)
        shown_images.show(shown_images.store(IMAGE, outcome.picture))
        return f"Cycles took {cycles.total_s:.2f} s; the images differ by {difference.flip_mean:.3f} (FLIP, 0 to 1)"


CLASSES = (ESPALIER_OT_compare,)
