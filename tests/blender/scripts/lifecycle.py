"""Run in Blender: disables and enables the installed extension again and again; nothing of it may stay behind."""

import threading

import bpy

MODULE = "bl_ext.user_default.espalier"
BASES = ("AddonPreferences", "Header", "Menu", "Operator", "Panel", "PropertyGroup", "RenderEngine", "UIList")


def registered() -> list[str]:
    """Names of the extension's classes that Blender knows; `dir(bpy.types)` would leave out the property groups."""
    bases = (getattr(bpy.types, name) for name in BASES)
    classes = (cls for base in bases for cls in base.__subclasses__())
    return sorted(cls.__name__ for cls in classes if cls.__module__.startswith(MODULE) and cls.is_registered)


def handlers() -> list[str]:
    """Modules of the extension whose functions Blender would call on an event."""
    lists = (found for name in dir(bpy.app.handlers) if isinstance(found := getattr(bpy.app.handlers, name), list))
    modules = (function.__module__ for functions in lists for function in functions)
    return [module for module in modules if module.startswith(MODULE)]


def traces() -> list[str]:
    """What of the extension is in Blender right now: classes, handlers, scene properties, threads."""
    properties = [name for name in dir(bpy.types.Scene) if name == "espalier"]
    threads = [thread.name for thread in threading.enumerate() if "espalier" in thread.name.lower()]
    return registered() + handlers() + properties + threads


def main() -> None:
    installed = traces()
    assert "ESPALIER_PG_settings" in installed, "the extension is not enabled after its installation"
    for _ in range(3):
        bpy.ops.preferences.addon_disable(module=MODULE)
        assert traces() == [], f"left behind: {traces()}"
        bpy.ops.preferences.addon_enable(module=MODULE)
        assert traces() == installed
    print("lifecycle ok")


main()
