"""Build and trace the open scene with every chosen method."""

import bpy

from .. import capture, methods, results, session, shown_images
from . import reasons
from .task import Task, TaskOperator

IMAGE = "Espalier"
"""Name of the image datablock that holds the traced frame."""


class ESPALIER_OT_build_trace(TaskOperator, bpy.types.Operator):
    """Build each chosen acceleration method over the scene, trace the current frame with it, \
and show times, image and cells"""

    bl_idname = "espalier.build_trace"
    bl_label = "Build & Trace"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return reasons.can_trace(cls, context)

    def begin(self, context: bpy.types.Context) -> Task:
        scene = context.scene
        settings = scene.espalier
        data = capture.export_frame(scene, context.view_layer)
        chosen = [name for name in methods.METHOD_NAMES if name in settings.methods]
        self._session = session.start(scene, data, chosen, session.Options.of(settings))
        self._shown_method = settings.method
        return self._session.run

    def advance(self, _context: bpy.types.Context) -> None:
        run = self._session.run
        results.store(self._scene_uid, results.rows(run), run.data.warnings)

    def finish(self, _context: bpy.types.Context) -> str:
        finished = self._session.run.results
        shown = self._session.result(self._shown_method) or finished[-1]
        shown_images.show(shown_images.store(IMAGE, shown.render.combined))
        fastest = min(finished, key=time_to_image)
        return (
            f"Traced {self._session.run.data.triangle_count:,} triangles; "
            f"fastest was {methods.label(fastest.method)}, {time_to_image(fastest):.2f} s"
        )


def time_to_image(result: session.MethodResult) -> float:
    """Seconds of building and tracing together."""
    return result.build_ms / 1000 + result.trace_s


CLASSES = (ESPALIER_OT_build_trace,)
