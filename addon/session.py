"""Owns the native handles of every open scene; the interface reaches the native core only through here.

A scene's session holds its last run: the one under way, or the finished one whose accelerators the overlay draws.
Sessions are keyed by the scene's session_uid, which survives renaming and undo, and end with the file.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from .errors import BusyError
from .run import MethodResult, Options, Run
from .scene_data import SceneData

__all__ = ["MethodResult", "Options", "Run", "Session", "adopt", "clear", "drop", "of", "start"]

CANCEL_SECONDS = 1.0
"""How long to wait for a cancelled thread when its handles are dropped; it ends within 0.2 s."""


@dataclass
class Session:
    """One scene's last run. `revision` is different for every run, so that drawn data can tell when it is stale."""

    run: Run
    revision: int

    @property
    def busy(self) -> bool:
        """True while the thread works."""
        return not self.run.done

    def result(self, method: str) -> MethodResult | None:
        """The finished result of a method, or None."""
        return next((result for result in self.run.results if result.method == method), None)


_sessions: dict[int, Session] = {}
_revision = 0


def of(scene: bpy.types.Scene) -> Session | None:
    """The scene's session, or None where it was never run."""
    return _sessions.get(scene.session_uid)


def start(scene: bpy.types.Scene, data: SceneData, method_names: Sequence[str], options: Options) -> Session:
    """Start a run and make it the scene's session; the handles of the one before are freed.

    Raises BusyError while the scene's last run works, and NativeModuleMissingError.
    """
    last = of(scene)
    if last is not None and last.busy:
        raise BusyError(scene.name)
    _sessions.pop(scene.session_uid, None)
    return adopt(scene, Run(data, method_names, options).start())


def adopt(scene: bpy.types.Scene, run: Run) -> Session:
    """Make a run that another task drives, such as a comparison, the scene's session."""
    global _revision
    _revision += 1
    session = Session(run, _revision)
    _sessions[scene.session_uid] = session
    return session


def drop(scene_uid: int) -> None:
    """Drop the handles of a scene; what still runs is cancelled."""
    session = _sessions.pop(scene_uid, None)
    if session is not None:
        session.run.cancel()


def clear() -> None:
    """Cancel what runs and drop every handle."""
    sessions = list(_sessions.values())
    _sessions.clear()
    for session in sessions:
        session.run.cancel()
    for session in sessions:
        session.run.wait(CANCEL_SECONDS)


@bpy.app.handlers.persistent
def _on_load(*_arguments: object) -> None:
    clear()


def register() -> None:
    """Free all handles when another file is loaded."""
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Stop watching file loads and free all handles."""
    bpy.app.handlers.load_pre.remove(_on_load)
    clear()
