"""Long work of the interface: one task at a time, watched by a modal operator, cancelled with Esc or a button."""

from collections.abc import Callable
from typing import Any, ClassVar, Protocol

import bpy

from .. import results
from ..areas import redraw, redraw_settled
from ..native import expected_errors

TICK_SECONDS = 0.05
"""How often progress is looked at; the core polls for a cancel as often, so Esc is obeyed within 0.2 s."""

CANCEL_SECONDS = 0.15
"""How long Esc waits for the thread, which needs less: a next tick may be late where redraws are slow."""

PANELS = frozenset({"PROPERTIES"})
VIEWS = PANELS | {"VIEW_3D"}


class Task(Protocol):
    """Work in a daemon thread, such as `run.Run`. Nothing of it touches Blender's data."""

    @property
    def done(self) -> bool: ...
    @property
    def cancelled(self) -> bool: ...
    @property
    def progress(self) -> float: ...
    @property
    def status(self) -> str: ...
    def cancel(self) -> None: ...
    def wait(self, timeout: float | None = None) -> bool: ...
    def raise_error(self) -> None: ...


_current: Task | None = None


def current() -> Task | None:
    """The task under way, or None."""
    return _current


class TaskOperator:
    """Base of operators that start a task. In background mode, and when called to execute, they wait for it.

    Subclasses have `begin`, which starts the task on the main thread; `advance`, which takes over what is finished,
    called with every tick; and `finish`, called once, which answers what to report. None of them may rely on objects
    of Blender kept from before: undo replaces them while the task runs.
    """

    report: Callable[[set[str], str], None]
    begin: Callable[[bpy.types.Context], Task]
    advance: Callable[[bpy.types.Context], None]
    finish: Callable[[bpy.types.Context], str]

    _task: Task
    _scene_uid: int
    _timer: Any = None
    _shown = ("", "")
    bl_options: ClassVar[set[str]] = set()

    def execute(self, context: bpy.types.Context) -> set[str]:
        if not self._start(context):
            return {"CANCELLED"}
        try:
            self._task.wait()
        except KeyboardInterrupt:
            self.cancel(context)
            raise
        return self._end(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        if not self._start(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        try:
            return self._look(context, event)
        except BaseException:
            self.cancel(context)
            raise

    def _look(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self._task.cancel()
            return self._end(context) if self._task.wait(CANCEL_SECONDS) else {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._task.done:
            return self._end(context)
        self._show_progress(context)
        return {"PASS_THROUGH"}

    def _show_progress(self, context: bpy.types.Context) -> None:
        """Bring status bar and panels up to date. Only where something is new: redraws are what costs time here."""
        shown = (self._task.status, f"{self._task.progress:.0%}")
        if shown == self._shown:
            return
        has_other_rows = shown[0] != self._shown[0]
        self._shown = shown
        self.advance(context)
        context.workspace.status_text_set("   ".join((*shown, "Esc: Cancel")))
        (redraw_settled if has_other_rows else redraw)(PANELS)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator: another file is loaded, or the window closes."""
        self._task.cancel()
        self._release(context)

    def _start(self, context: bpy.types.Context) -> bool:
        """Begin the task; False where an error was reported instead."""
        global _current
        window = context.window
        if window is not None:
            window.cursor_set("WAIT")
        try:
            self._scene_uid = context.scene.session_uid
            self._task = _current = self.begin(context)
        except expected_errors() as error:
            self.report({"ERROR"}, str(error))
            return False
        finally:
            if window is not None:
                window.cursor_set("DEFAULT")
        return True

    def _end(self, context: bpy.types.Context) -> set[str]:
        """Take over the results and report how it went. What was finished before a cancel or an error is kept."""
        self._release(context)
        self.advance(context)
        redraw_settled(VIEWS)
        if self._task.cancelled:
            self.report({"WARNING"}, "Cancelled")
            return {"CANCELLED"}
        try:
            self._task.raise_error()
            message = self.finish(context)
        except expected_errors() as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for note in results.of(self._scene_uid).notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, message)
        return {"FINISHED"}

    def _release(self, context: bpy.types.Context) -> None:
        """Give back what the task held of the interface."""
        global _current
        _current = None
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            for workspace in bpy.data.workspaces:  # the user may have gone to another since
                workspace.status_text_set(None)
            self._timer = None
