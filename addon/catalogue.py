"""The catalogue of scenes: inside the installed extension, or beside the add-on as `espalier_scenes`. No bpy."""

import importlib
from types import ModuleType
from typing import Any


def module(name: str = "") -> ModuleType:
    """The catalogue's package, or its module `name`."""
    suffix = f".{name}" if name else ""
    try:
        return importlib.import_module(f"{__package__}.scenes{suffix}")
    except ModuleNotFoundError as error:
        if error.name != f"{__package__}.scenes":
            raise
    return importlib.import_module(f"espalier_scenes{suffix}")


def names() -> list[str]:
    """Names of all scenes."""
    found: list[str] = module().names()
    return found


def find(name: str) -> Any:
    """The scene of that name. Raises the catalogue's UnknownSceneError."""
    return module().find(name)
