"""Run in Blender: disables and enables the installed extension again and again; nothing of it may stay behind."""

import sys
import threading

import addon_utils
import bpy

MODULE = "bl_ext.user_default.espalier"


def traces() -> list[str]:
    """What of the extension Blender knows right now: classes, scene properties, handlers, timers, threads."""
    classes = [name for name in dir(bpy.types) if name.startswith("ESPALIER")]
    engines = [cls.__name__ for cls in bpy.types.RenderEngine.__subclasses__() if cls.is_registered]
    properties = [name for name in dir(bpy.types.Scene) if name == "espalier"]
    handlers = [
        function.__module__
        for name in dir(bpy.app.handlers)
        if isinstance(found := getattr(bpy.app.handlers, name), list)
        for function in found
        if function.__module__.startswith(MODULE)
    ]
    threads = [thread.name for thread in threading.enumerate() if "espalier" in thread.name.lower()]
    return classes + [name for name in engines if "ESPALIER" in name] + properties + handlers + threads


def main() -> None:
    assert "ESPALIER_PG_settings" in traces(), "the extension is not enabled after its installation"
    for _ in range(3):
        addon_utils.disable(MODULE)
        assert traces() == [], f"left behind: {traces()}"
        addon_utils.enable(MODULE)
        assert "ESPALIER_PG_settings" in traces()
    print("lifecycle ok", file=sys.stdout)


main()
