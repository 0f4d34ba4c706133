"""What kind of thing INPUT of the command line is, told before Blender starts. No bpy."""

from pathlib import Path

from . import catalogue
from .errors import EspalierAddonError

MESH_SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf")


class UnknownInputError(EspalierAddonError):
    """Neither a file nor a scene."""

    def __init__(self, text: str) -> None:
        looks_like_path = Path(text).suffix or "/" in text or "\\" in text
        known = "check the path" if looks_like_path else f"scenes are {', '.join(catalogue.names())}"
        super().__init__(f"There is no file and no scene '{text}': {known}")


class UnknownFormatError(EspalierAddonError):
    """A file of a kind that is not read."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path} is no file that can be traced: give one of .blend {' '.join(MESH_SUFFIXES)}")


def check(text: str) -> None:
    """Raise UnknownInputError or UnknownFormatError where INPUT can be seen to be wrong without opening it."""
    path = Path(text)
    if scene_name(text) is not None:
        return
    if not path.exists():
        raise UnknownInputError(text)
    if not path.is_file() or not (is_blend(path) or path.suffix.lower() in MESH_SUFFIXES):
        raise UnknownFormatError(path)


def scene_name(text: str) -> str | None:
    """INPUT as the name of a scene of the catalogue, or None. A file of that very name goes first."""
    return text if text in catalogue.names() and not Path(text).is_file() else None


def is_blend(path: Path) -> bool:
    """True for Blender's own files."""
    return path.suffix.lower() == ".blend"
