"""`blender --background FILE --engine ESPALIER`: one frame, an animation, the same picture every time."""

from pathlib import Path

import numpy as np

from . import images
from .blender import Blender


def render(blender: Blender, blend: Path, folder: Path, *frames: str) -> list[Path]:
    """Render `frames` (arguments of Blender) with Espalier into PNG files; the files, sorted."""
    output = ("--render-output", folder / "frame-####", "--render-format", "PNG")
    blender.run("--background", blend, "--engine", "ESPALIER", *output, *frames)
    return sorted(folder.iterdir())


def test_frame_shows_the_scene(blender: Blender, blend: Path, tmp_path: Path) -> None:
    (path,) = render(blender, blend, tmp_path, "--render-frame", "1")
    picture = images.read(path)
    assert picture.shape == (120, 160, 3)
    floor, head = picture[100, 80].astype(int), picture[55, 80].astype(int)
    assert floor.min() > 30, "the floor is lit"
    assert np.abs(floor - head).max() > 8, "the head stands out from the floor"
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


def test_same_frame_twice_is_the_same_picture(blender: Blender, blend: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    (one,) = render(blender, blend, first, "--threads", "1", "--render-frame", "1")
    (other,) = render(blender, blend, second, "--threads", "2", "--render-frame", "1")
    np.testing.assert_array_equal(images.read(one), images.read(other))


def test_animation_writes_every_frame(blender: Blender, blend: Path, tmp_path: Path) -> None:
    frames = render(blender, blend, tmp_path, "--frame-start", "1", "--frame-end", "3", "--render-anim")
    assert [path.name for path in frames] == ["frame-0001.png", "frame-0002.png", "frame-0003.png"]
