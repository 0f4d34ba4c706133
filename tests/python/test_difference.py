"""FLIP against its authors' own program, and what must hold of any difference."""

import flip_evaluator
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from espalier.difference import BAND, flip, rmse

ORACLE_TOLERANCE = 2e-4
"""The authors' program works in single precision."""


def pattern(height: int, width: int) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width]
    waves = np.stack([np.sin(x / 9) / 2 + 0.5, np.cos(y / 13) / 2 + 0.5, ((x // 8 + y // 8) % 2) * 0.8], axis=-1)
    return waves.astype(np.float32)


def noisy(image: np.ndarray, seed: int, strength: float) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, strength, image.shape)
    return np.clip(image + noise, 0, 1).astype(np.float32)


def oracle(reference: np.ndarray, test: np.ndarray, **parameters: float) -> np.ndarray:
    found, _, _ = flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False, parameters=parameters)
    return np.asarray(found).reshape(reference.shape[:2])


@pytest.mark.parametrize("shape", [(1, 1), (3, 50), (BAND, 40), (BAND + 1, 90), (3 * BAND - 5, 70)])
@pytest.mark.parametrize("strength", [0.005, 0.1, 1.0])
def test_flip_equals_its_authors_program(shape: tuple[int, int], strength: float) -> None:
    reference = pattern(*shape)
    test = noisy(reference, 1, strength)
    assert np.abs(flip(reference, test) - oracle(reference, test)).max() < ORACLE_TOLERANCE


@pytest.mark.parametrize("pixels_per_degree", [20.0, 40.0, 100.0])
def test_it_does_at_other_distances_too(pixels_per_degree: float) -> None:
    reference = pattern(80, 60)
    test = np.roll(reference, 2, axis=1)
    expected = oracle(reference, test, ppd=pixels_per_degree)
    assert np.abs(flip(reference, test, pixels_per_degree) - expected).max() < ORACLE_TOLERANCE


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 1000))
def test_it_does_on_random_images(height: int, width: int, seed: int) -> None:
    reference, test = np.random.default_rng(seed).random((2, height, width, 3), dtype=np.float32)
    found = flip(reference, test)
    assert np.abs(found - oracle(reference, test)).max() < ORACLE_TOLERANCE
    assert found.min() >= 0
    assert found.max() <= 1


def test_equal_images_do_not_differ_and_black_and_white_differ_most() -> None:
    image = pattern(70, 50)
    assert flip(image, image).max() == 0
    assert rmse(image, image) == 0
    black, white = np.zeros((20, 30, 3), np.float32), np.ones((20, 30, 3), np.float32)
    assert flip(black, white).min() > 0.95
    assert rmse(black, white) == 1


def test_a_difference_is_found_where_it_is() -> None:
    reference = pattern(200, 100)
    test = reference.copy()
    test[150:160, 20:30] = 1 - test[150:160, 20:30]
    found = flip(reference, test)
    assert np.unravel_index(found.argmax(), found.shape)[0] in range(148, 162)
    assert found[:130].max() == 0


def test_rmse_is_the_root_of_the_mean_square() -> None:
    first, second = np.zeros((2, 2, 3), np.float32), np.zeros((2, 2, 3), np.float32)
    second[0, 0] = (0.5, 0.5, 0)
    assert rmse(first, second) == pytest.approx(np.sqrt(0.5 / 12))


def test_progress_runs_to_one_and_may_end_the_work() -> None:
    image = pattern(3 * BAND, 8)
    told: list[float] = []
    flip(image, image, progress=told.append)
    assert told == [1 / 3, 2 / 3, 1.0]

    def stop(_progress: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flip(image, image, progress=stop)


@pytest.mark.parametrize("shape", [(4, 4, 3), (5, 4), (5, 4, 4)])
def test_shapes_that_do_not_fit_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="one shape"):
        flip(np.zeros((5, 4, 3), np.float32), np.zeros(shape, np.float32))
    with pytest.raises(ValueError, match="one shape"):
        rmse(np.zeros((5, 4, 3), np.float32), np.zeros(shape, np.float32))
