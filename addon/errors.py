"""Errors of the add-on that a user can act on; each message says what to do. No bpy."""


class EspalierAddonError(Exception):
    """Any expected failure of the add-on. Its message is one line, fit for a report, a log or a terminal."""


class NoCameraError(EspalierAddonError):
    """The scene has no camera to trace from."""

    def __init__(self, scene: str) -> None:
        super().__init__(f"Scene '{scene}' has no camera: add one, or set one in Scene Properties > Camera")


class UnsupportedCameraError(EspalierAddonError):
    """The camera's projection cannot be traced."""

    def __init__(self, camera: str, kind: str) -> None:
        super().__init__(
            f"Camera '{camera}' is {kind.lower()}, which Espalier cannot trace: "
            "set Lens > Type to Perspective or Orthographic"
        )


class NoGeometryError(EspalierAddonError):
    """Nothing that is shown in renders has a triangle."""

    def __init__(self, scene: str, view_layer: str) -> None:
        super().__init__(
            f"View layer '{view_layer}' of scene '{scene}' has no triangle that renders: "
            "add a mesh, or enable an object or collection in renders"
        )


class NonFiniteGeometryError(EspalierAddonError):
    """An object's vertices or matrix hold infinite or not-a-number values."""

    def __init__(self, names: list[str]) -> None:
        shown = ", ".join(f"'{name}'" for name in names[:3]) + (", ..." if len(names) > 3 else "")
        super().__init__(
            f"Vertices that are infinite or not a number in {shown}: "
            "check the transform and modifiers, or disable the object in renders"
        )


class NativeModuleMissingError(EspalierAddonError):
    """The compiled module `espalier_rt` cannot be imported."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"The compiled module espalier_rt cannot be loaded ({reason}): "
            "reinstall the extension from the zip made for this platform"
        )


class BusyError(EspalierAddonError):
    """A build or trace of the same scene is still running."""

    def __init__(self, scene: str) -> None:
        super().__init__(f"Scene '{scene}' is still being traced: wait for it, or press Esc to cancel it")


class CaptureError(EspalierAddonError):
    """Blender could not evaluate the scene as a render would."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"The scene cannot be evaluated for a render ({reason}): wait until no render or bake is under way"
        )


class CancelledError(EspalierAddonError):
    """The user cancelled."""

    def __init__(self) -> None:
        super().__init__("Cancelled")


class ComparisonSaveError(EspalierAddonError):
    """The copy of the file that Cycles renders cannot be written."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"A copy of the scene for Cycles cannot be saved ({reason}): free space in the temporary folder"
        )
