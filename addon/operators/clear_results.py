"""Free what the last run left."""

import bpy

from .. import areas, overlay, results, session
from . import task


class ESPALIER_OT_clear_results(bpy.types.Operator):
    """Empty the results table, remove the cells from the viewport, and free the memory of the accelerators"""

    bl_idname = "espalier.clear_results"
    bl_label = "Clear Results"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if task.current() is not None:
            cls.poll_message_set("Espalier is at work: wait for it, or press Esc to cancel it")
            return False
        if not results.of(context.scene.session_uid).rows:
            cls.poll_message_set("There are no results")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        uid = context.scene.session_uid
        results.drop(uid)
        session.drop(uid)
        overlay.drop(uid)
        areas.redraw_settled(task.VIEWS)
        return {"FINISHED"}


CLASSES = (ESPALIER_OT_clear_results,)
