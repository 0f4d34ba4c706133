"""Named scenes to trace: generated ones, and known models in a studio. Importing it needs no bpy.

`find("city").mesh()` gives arrays for benchmarks; `find("city").build(scene)` builds it in Blender.
"""

from .catalogue import ENTRIES, Entry, find, names
from .errors import SceneCatalogueError, UnknownSceneError

__all__ = ["ENTRIES", "Entry", "SceneCatalogueError", "UnknownSceneError", "find", "names"]
