"""How different two images look: FLIP, and the root mean square error. No bpy.

FLIP is the LDR form of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference
Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020; section and equation numbers
below are that paper's. Images are (h, w, 3) float32, display-referred sRGB in 0..1.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180
"""Viewing of section 4: a monitor 0.7 m wide of 3840 pixels, seen from 0.7 m."""

QC, QF = 0.7, 0.5
"""Exponents of colour (4.1.4) and feature differences (4.2)."""
PC, PT = 0.4, 0.95
"""Colour differences below PC times the largest fill the error's range up to PT (4.1.4)."""
FEATURE_DEGREES = 0.082
"""Width of the feature detectors, degrees of the visual field (4.2)."""

SRGB_TO_XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = SRGB_TO_XYZ.sum(axis=1)

SENSITIVITY = (((1.0, 0.0047), (0.0, 1e-5)), ((1.0, 0.0053), (0.0, 1e-5)), ((34.1, 0.04), (13.5, 0.025)))
"""Contrast sensitivity of Y, Cx, Cz: two Gaussians (a, b) each, Table 1."""
SEEN_DEGREES = 3 * math.sqrt(0.04 / (2 * math.pi**2))
"""Radius of the sensitivity filters, degrees: three deviations of the widest that counts."""

BAND = 64
"""Rows worked on at once: their arrays stay in cache, which halves the time."""


def flip(
    reference: Float32,
    test: Float32,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    progress: Callable[[float], None] = lambda _: None,
) -> Float32:
    """(h, w) differences in 0..1 as seen when flipping between the images; 0 where they look the same.

    progress is called with 0..1 after every BAND rows, and may raise to end the work. Raises ValueError where the
    shapes differ or are not (h, w, 3).
    """
    _require_same_shape(reference, test)
    height = len(reference)
    reach = math.ceil(max(SEEN_DEGREES, 1.5 * FEATURE_DEGREES) * pixels_per_degree)
    result = np.empty(reference.shape[:2], np.float32)
    for start in range(0, height, BAND):
        stop = min(start + BAND, height)
        top = max(start - reach, 0)
        rows = slice(top, stop + reach)
        result[start:stop] = _band(reference[rows], test[rows], pixels_per_degree)[start - top : stop - top]
        progress(stop / height)
    return result


def rmse(reference: Float32, test: Float32) -> float:
    """Root of the mean squared difference over all pixels and channels, 0..1 for images in 0..1."""
    _require_same_shape(reference, test)
    return float(np.sqrt(np.mean((reference.astype(np.float64) - test) ** 2)))


def _require_same_shape(reference: Float32, test: Float32) -> None:
    if reference.shape != test.shape or reference.ndim != 3 or reference.shape[2] != 3:
        raise ValueError(f"images must have one shape (h, w, 3), not {reference.shape} and {test.shape}")


def _band(reference: Float32, test: Float32, pixels_per_degree: float) -> NDArray[np.float64]:
    """Equation 12 on some rows: colour differences, raised where features differ."""
    first, second = (_opponent(_linear(np.clip(image, 0.0, 1.0).astype(np.float64))) for image in (reference, test))
    color = _color_difference(first, second, pixels_per_degree)
    feature = _feature_difference(first[..., 0], second[..., 0], pixels_per_degree)
    return color ** (1.0 - feature)


def _linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _opponent(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear RGB in the opponent space Y Cx Cz (section 4.1.1)."""
    x, y, z = np.moveaxis(linear @ SRGB_TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _linear_of_opponent(opponent: NDArray[np.float64]) -> NDArray[np.float64]:
    y = (opponent[..., 0] + 16) / 116
    xyz = np.stack([y + opponent[..., 1] / 500, y, y - opponent[..., 2] / 200], axis=-1) * WHITE
    return xyz @ np.linalg.inv(SRGB_TO_XYZ).T


def _hunt_lab(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """CIELAB with chroma scaled by lightness, the Hunt effect (4.1.2)."""
    ratio = linear @ SRGB_TO_XYZ.T / WHITE
    delta = 6 / 29
    x, y, z = np.moveaxis(np.where(ratio > delta**3, np.cbrt(ratio), ratio / (3 * delta**2) + 4 / 29), -1, 0)
    lightness = 116 * y - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)], axis=-1)


def _hyab(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """City block in lightness, Euclidean in chroma (equation 8)."""
    difference = first - second
    return np.abs(difference[..., 0]) + np.hypot(difference[..., 1], difference[..., 2])


def _color_difference(
    first: NDArray[np.float64], second: NDArray[np.float64], pixels_per_degree: float
) -> NDArray[np.float64]:
    """(h, w) in 0..1 (sections 4.1.1 to 4.1.4)."""
    labs = []
    for image in (first, second):
        seen = np.stack([_seen(image[..., i], SENSITIVITY[i], pixels_per_degree) for i in range(3)], axis=-1)
        labs.append(_hunt_lab(np.clip(_linear_of_opponent(seen), 0.0, 1.0)))
    power = _hyab(*labs) ** QC
    largest = float(_hyab(_hunt_lab(np.array([0.0, 1.0, 0.0])), _hunt_lab(np.array([0.0, 0.0, 1.0])))) ** QC
    bend = PC * largest
    return np.where(power < bend, PT / bend * power, PT + (power - bend) / (largest - bend) * (1 - PT))


def _seen(channel: NDArray[np.float64], sensitivity: object, pixels_per_degree: float) -> NDArray[np.float64]:
    """The channel as the eye resolves it: filtered by its contrast sensitivity, a sum of two Gaussians (4.1.1)."""
    radius = math.ceil(SEEN_DEGREES * pixels_per_degree)
    offsets = np.arange(-radius, radius + 1) / pixels_per_degree
    result, weight = np.zeros_like(channel), 0.0
    for a, b in sensitivity:  # type: ignore[attr-defined]
        if a == 0.0:
            continue
        kernel = np.exp(-(math.pi**2) * offsets**2 / b)
        scale = a * math.sqrt(math.pi / b)
        result += scale * _convolved(_convolved(channel, kernel, 0), kernel, 1)
        weight += scale * kernel.sum() ** 2
    return result / weight


def _feature_difference(
    first: NDArray[np.float64], second: NDArray[np.float64], pixels_per_degree: float
) -> NDArray[np.float64]:
    """(h, w) differences of edges and points of the achromatic channel, 0..1 (section 4.2)."""
    deviation = 0.5 * FEATURE_DEGREES * pixels_per_degree
    radius = math.ceil(3 * deviation)
    offsets = np.arange(-radius, radius + 1).astype(np.float64)
    gauss = np.exp(-(offsets**2) / (2 * deviation**2))
    edge = _balanced(-offsets * gauss)
    point = _balanced((offsets**2 / deviation**2 - 1) * gauss)
    gauss /= gauss.sum()
    features = [_magnitudes((image + 16) / 116, gauss, (edge, point)) for image in (first, second)]
    differences = [np.abs(a - b) for a, b in zip(*features, strict=True)]
    return (np.maximum(*differences) / math.sqrt(2)) ** QF


def _balanced(kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    """The kernel with its positive weights summing to 1 and its negative ones to -1."""
    return np.where(kernel > 0, kernel / kernel[kernel > 0].sum(), kernel / -kernel[kernel < 0].sum())


def _magnitudes(
    channel: NDArray[np.float64], gauss: NDArray[np.float64], detectors: tuple[NDArray[np.float64], ...]
) -> list[NDArray[np.float64]]:
    """Length of each detector's answer along x and y."""
    smooth_y, smooth_x = (_convolved(channel, gauss, axis) for axis in (0, 1))
    return [np.hypot(_convolved(smooth_y, kernel, 1), _convolved(smooth_x, kernel, 0)) for kernel in detectors]


def _convolved(channel: NDArray[np.float64], kernel: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Convolution along one axis; beyond the border the border's values go on."""
    radius, size = len(kernel) // 2, channel.shape[axis]
    padded = np.pad(channel, [(radius, radius) if axis == i else (0, 0) for i in range(2)], mode="edge")
    result = np.zeros_like(channel)
    for index, weight in enumerate(kernel[::-1]):
        if weight:
            result += weight * (padded[index : index + size] if axis == 0 else padded[:, index : index + size])
    return result
