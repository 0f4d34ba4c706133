"""The door to the compiled module `espalier_rt`, and SceneData turned into its handles. No bpy."""

from types import ModuleType
from typing import Any, NamedTuple

from .errors import EspalierAddonError, NativeModuleMissingError
from .scene_data import SceneData


class Handles(NamedTuple):
    """Native mesh, scene and camera of one frame; none of them refers back to the arrays of SceneData."""

    mesh: Any
    scene: Any
    camera: Any


def module() -> ModuleType:
    """The compiled module. Raises NativeModuleMissingError where it is not installed or not made for this platform."""
    try:
        import espalier_rt
    except ImportError as error:
        raise NativeModuleMissingError(str(error)) from error
    return espalier_rt


def expected_errors() -> tuple[type[Exception], ...]:
    """The errors whose message tells the user what to do; any other is a bug, and keeps its traceback."""
    try:
        return (EspalierAddonError, module().EspalierError)
    except NativeModuleMissingError:
        return (EspalierAddonError,)


def handles(data: SceneData) -> Handles:
    """Copy and validate a frame into the native core. Raises the core's MeshError or SceneError on bad values."""
    native = module()
    geometry = data.geometry
    mesh = native.Mesh(geometry.vertices, geometry.triangles)
    scene = native.Scene(
        mesh,
        materials=[material.arguments() for material in data.materials],
        material_index=geometry.material_index,
        corner_normals=geometry.corner_normals,
        corner_uvs=geometry.corner_uvs,
        textures=[texture.arguments() for texture in data.textures],
        lights=[light.arguments() for light in data.lights],
        world=data.world,
    )
    return Handles(mesh, scene, native.Camera(**data.camera.arguments()))
