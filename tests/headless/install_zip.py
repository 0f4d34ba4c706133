"""Run by a Python with bpy: installs the extension's zip, renders a cube with it, disables it: `install_zip.py ZIP`."""

import sys
from pathlib import Path

import bpy
import numpy as np

MODULE = "bl_ext.user_default.espalier"


def render() -> np.ndarray:
    """The factory scene's cube by Espalier at 32x24: (24, 32, 4) float32."""
    scene = bpy.context.scene
    scene.render.engine = "ESPALIER"
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(Path(bpy.app.tempdir) / "cube.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(32 * 24 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(24, 32, 4)


def main() -> None:
    archive = str(Path(sys.argv[1]).resolve())
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    assert hasattr(bpy.types.Scene, "espalier"), "the extension is not enabled"
    picture = render()
    assert np.isfinite(picture).all()
    cube, corner = picture[12, 16, :3], picture[0, 0, :3]
    assert np.abs(cube - corner).max() > 0.01, f"the cube {cube} stands out from the world {corner}"
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "espalier")
    engines = [cls for cls in bpy.types.RenderEngine.__subclasses__() if cls.__module__.startswith(MODULE)]
    assert not any(cls.is_registered for cls in engines)
    print(f"bpy {bpy.app.version_string}: installed, rendered, disabled")


main()
