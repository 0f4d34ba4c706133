"""Errors of the catalogue; each message is one line that says what to do. No bpy."""

from pathlib import Path


class SceneCatalogueError(Exception):
    """Any expected failure of the catalogue of scenes."""


class UnknownSceneError(SceneCatalogueError):
    """No scene of that name."""

    def __init__(self, name: str, known: list[str]) -> None:
        super().__init__(f"No scene is named '{name}': choose one of {', '.join(known)}")


class BrokenModelError(SceneCatalogueError):
    """A model file that cannot be read."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path} cannot be read as a triangle mesh ({reason}): replace the file")


class DownloadError(SceneCatalogueError):
    """A model's archive cannot be reached."""

    def __init__(self, url: str, reason: str) -> None:
        super().__init__(
            f"{url} cannot be downloaded ({reason}): "
            "check the network, or set ESPALIER_MODELS to a folder with the model"
        )


class ChecksumError(SceneCatalogueError):
    """What arrived is not what was pinned."""

    def __init__(self, url: str, expected: str, found: str) -> None:
        super().__init__(
            f"{url} does not give the model expected (SHA-256 {found[:12]}..., not {expected[:12]}...): "
            "try again, or set ESPALIER_MODELS to a folder with the model"
        )


class ModelMissingError(SceneCatalogueError):
    """A model that no archive holds, and that is not in the folder of models."""

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"Model '{name}' is not here, and {reason}: set ESPALIER_MODELS to a folder with {name}.ply")
