"""The render engine: a shell that exports a view layer, watches a run and hands its image to Blender."""

import traceback
from typing import Any

import bpy
import numpy as np

from . import capture, native
from .export import export_scene
from .run import MethodResult, Options, Run

POLL_SECONDS = 0.02
"""How often a render looks for Esc and tells its progress."""


class ESPALIER_RenderEngine(bpy.types.RenderEngine):
    """Renders the scene with the method, samples and threads of `scene.espalier`."""

    bl_idname = "ESPALIER"
    bl_label = "Espalier"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        """Tell Blender, and through it the compositor, of the passes."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        self.register_pass(scene, renderlayer, "Depth", 1, "Z", "VALUE")
        self.register_pass(scene, renderlayer, "Normal", 3, "XYZ", "VECTOR")
        if scene.espalier.cost_pass:
            self.register_pass(scene, renderlayer, "Cost", 1, "X", "VALUE")

    def render(self, depsgraph: Any) -> None:
        """Render one view layer. An error ends the render with its message: Blender would not stop for an exception."""
        try:
            if not capture.taken(depsgraph):
                self._render(depsgraph)
        except native.expected_errors() as error:
            self._fail(str(error))
        except Exception as error:  # noqa: BLE001 - told to Blender, whose render it ends
            traceback.print_exc()
            self._fail(f"{type(error).__name__}: {error}")

    def _render(self, depsgraph: Any) -> None:
        scene = depsgraph.scene
        settings = scene.espalier
        self.update_stats("", "Espalier: export")
        data = export_scene(depsgraph)
        for warning in data.warnings:
            self.report({"WARNING"}, warning)
        options = Options.of(settings, cost=settings.cost_pass, transparent=scene.render.film_transparent)
        run = Run(data, [settings.method], options).start()
        del data
        self._watch(run)
        run.raise_error()
        if not run.cancelled:
            self._hand_over(run.results[0], depsgraph.view_layer.name)

    def _fail(self, message: str) -> None:
        """Tell an error where people look: the report raises in scripts, the other stands above the image."""
        self.report({"ERROR"}, message)
        self.error_set(message)

    def _watch(self, run: Run) -> None:
        """Show progress until the run ends; Esc cancels it."""
        told = ""
        while not run.wait(POLL_SECONDS):
            self.update_progress(run.progress)
            if run.status != told:  # without a window each telling is a line of output
                told = run.status
                self.update_stats("", f"Espalier: {told}")
            if self._stopped():
                run.cancel()

    def _stopped(self) -> bool:
        """True once the user pressed Esc, or closed the render."""
        return self.test_break()

    def _hand_over(self, result: MethodResult, view_layer: str) -> None:
        """Fill Blender's passes."""
        render = result.render
        height, width = render.depth.shape
        passes = {"Combined": render.combined, "Depth": render.depth, "Normal": render.normal}
        if render.cost is not None:
            passes["Cost"] = render.cost
        blender_result: Any = self.begin_result(0, 0, width, height, layer=view_layer)
        try:
            for layer_pass in blender_result.layers[0].passes:
                if layer_pass.name in passes:
                    layer_pass.rect.foreach_set(np.ascontiguousarray(passes[layer_pass.name]).reshape(-1))
        finally:
            self.end_result(blender_result)


def register() -> None:
    """Offer the engine in Blender's render properties."""
    bpy.utils.register_class(ESPALIER_RenderEngine)


def unregister() -> None:
    """Take the engine away."""
    bpy.utils.unregister_class(ESPALIER_RenderEngine)
