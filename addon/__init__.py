"""Espalier: ray-traces the open scene through BVH, uniform grid and hybrids of both.

This file imports without bpy, so that the modules that need none (`methods`, `scene_data`, `errors`, `report`)
serve the command line outside Blender too; what needs bpy is imported in `register`.
"""

from importlib import import_module

MODULES: tuple[str, ...] = (
    "properties",
    "session",
    "engine",
    "borrowed_panels",
    "overlay",
    "shown_images",
    "operators",
    "ui",
    "command_line",
)
"""Modules of this package that have `register()` and `unregister()`, in the order they are registered."""


def register() -> None:
    """Register every module in order; where one fails, those before it are unregistered and its error is raised."""
    registered = []
    try:
        for name in MODULES:
            module = import_module(f".{name}", __package__)
            module.register()
            registered.append(module)
    except BaseException:
        for module in reversed(registered):
            module.unregister()
        raise


def unregister() -> None:
    """Unregister every module in reverse order."""
    for name in reversed(MODULES):
        import_module(f".{name}", __package__).unregister()
