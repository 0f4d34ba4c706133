"""Cancel what runs."""

from typing import ClassVar

import bpy

from . import task


class ESPALIER_OT_cancel(bpy.types.Operator):
    """Stop the work under way; methods that are finished keep their results"""

    bl_idname = "espalier.cancel"
    bl_label = "Cancel"
    bl_options: ClassVar[set[str]] = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if task.current() is None:
            cls.poll_message_set("Nothing is under way")
        return task.current() is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        current = task.current()
        if current is not None:
            current.cancel()
        return {"FINISHED"}


CLASSES = (ESPALIER_OT_cancel,)
