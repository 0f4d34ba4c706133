"""Pictures: the colours of differences, the composite, and PNG files as another program reads them."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from espalier.images import BACKGROUND, GAP, composite, difference_colors, write_png


def test_colours_grow_lighter_all_the_way() -> None:
    colors = difference_colors(np.linspace(0, 1, 101, dtype=np.float32)[None])[0].astype(float)
    luminance = (colors / 255) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > 0).all()
    assert colors[0].tolist() == [0, 0, 4]
    assert colors[-1].tolist() == [252, 253, 191]


def test_differences_beyond_the_scale_have_its_ends() -> None:
    colors = difference_colors(np.array([[-1.0, 0.0, 1.0, 2.0]], np.float32))[0]
    assert (colors[0] == colors[1]).all()
    assert (colors[2] == colors[3]).all()


@pytest.mark.parametrize("shape", [(30, 50, 3), (1, 1, 3), (60, 20, 3)])
def test_the_composite_has_ours_left_cycles_right_and_the_difference_below(shape: tuple[int, int, int]) -> None:
    height, width = shape[:2]
    ours, cycles, difference = (np.full(shape, value, np.uint8) for value in (50, 100, 200))
    picture = composite(ours, cycles, difference)
    assert picture.shape == (2 * height + GAP, 2 * width + GAP, 3)
    top, bottom = picture[height + GAP :], picture[:height]  # rows are bottom-up
    assert (top[:, :width] == 50).all()
    assert (top[:, width + GAP :] == 100).all()
    assert (top[:, width : width + GAP] == BACKGROUND).all()
    left = (width + GAP) // 2
    assert (bottom[:, left : left + width] == 200).all()


def test_pictures_of_different_shapes_are_refused() -> None:
    small, large = np.zeros((2, 2, 3), np.uint8), np.zeros((2, 3, 3), np.uint8)
    with pytest.raises(ValueError, match="differ in shape"):
        composite(small, large, small)


@pytest.mark.parametrize("shape", [(1, 1, 3), (7, 13, 3), (64, 48, 3)])
def test_png_reads_back_the_right_way_up(tmp_path: Path, shape: tuple[int, int, int]) -> None:
    picture = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    write_png(tmp_path / "picture.png", picture)
    with Image.open(tmp_path / "picture.png") as read:
        assert read.mode == "RGB"
        assert np.array_equal(np.asarray(read), picture[::-1])
