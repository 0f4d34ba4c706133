"""Run inside Blender with a window: runs the Python that the test leaves in a folder, on Blender's main thread.

`blender ... --python remote.py -- FOLDER`: where FOLDER/request.py appears, it is run with `window`, the first window,
in context, and FOLDER/reply.json is written: {"value": the variable `value`} or {"error": the traceback}.
"""

import json
import sys
import traceback
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
REQUEST = FOLDER / "request.py"
REPLY = FOLDER / "reply.json"
INTERVAL = 0.05


def answer(source: str) -> dict[str, object]:
    """Run `source`; its `value`, or its error as text."""
    names: dict[str, object] = {"bpy": bpy, "window": bpy.context.window_manager.windows[0], "value": None}
    try:
        with bpy.context.temp_override(window=names["window"]):
            exec(source, names)
        return {"value": names["value"]}
    except Exception:  # noqa: BLE001 - the test reads it as its own error
        return {"error": traceback.format_exc()}


def poll() -> float:
    """Blender's timer: answer the request that is there, if any."""
    if REQUEST.exists():
        source = REQUEST.read_text(encoding="utf-8")
        REQUEST.unlink()
        written = REPLY.with_suffix(".part")
        written.write_text(json.dumps(answer(source)), encoding="utf-8")
        written.rename(REPLY)
    return INTERVAL


bpy.app.timers.register(poll, persistent=True)
