"""The overlay's colours keep apart with any colour vision, and stand out from the viewport of either theme.

Colour blindness as in Machado, Oliveira, Fernandes, "A Physiologically-based Model for Simulation of Color Vision
Deficiency", IEEE TVCG 15(6), 2009, at full severity; distances in CIELAB (CIE76).
"""

from itertools import combinations

import bpy
import numpy as np
import pytest

from espalier.overlay import TOGGLES

VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = TO_XYZ.sum(axis=1)
BACKGROUNDS = {"dark": 61 / 255, "light": 100 / 255}
"""sRGB grey of the 3D viewport in Blender's two themes."""


def linear(color):
    color = np.asarray(color, float)
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    ratio = TO_XYZ @ rgb / WHITE
    x, y, z = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.fixture
def colors(scene):
    settings = bpy.context.scene.espalier.overlay
    return {color: linear(getattr(settings, color)) for _toggle, color in TOGGLES.values()}


@pytest.mark.parametrize("vision", VISION)
def test_kinds_keep_apart(colors, vision):
    seen = {name: lab(np.clip(np.array(VISION[vision]) @ color, 0.0, 1.0)) for name, color in colors.items()}
    for first, second in combinations(seen, 2):
        assert np.linalg.norm(seen[first] - seen[second]) > 20, (first, second)


@pytest.mark.parametrize("theme", BACKGROUNDS)
def test_kinds_stand_out(colors, theme):
    background = float(linear(BACKGROUNDS[theme]))
    for name, color in colors.items():
        luminance = float(TO_XYZ[1] @ color)
        assert (luminance + 0.05) / (background + 0.05) > 2.4, name
