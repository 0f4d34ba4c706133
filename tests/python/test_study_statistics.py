"""Intervals enclose the median as often as they say; means and slopes are what they are called."""

import numpy as np
import pytest

from espalier.study.statistics import geometric_mean, interval, slope


def test_a_single_value_is_its_own_interval_without_confidence() -> None:
    assert interval([3.0]) == (3.0, 3.0, 3.0, 0.0, 1)


@pytest.mark.parametrize(
    ("count", "low", "high", "confidence"),
    [(2, 1, 2, 0.5), (5, 1, 5, 0.9375), (6, 1, 6, 0.96875), (7, 1, 7, 0.984375), (9, 2, 8, 0.9609375)],
)
def test_few_values_give_their_range_and_more_give_less_of_it(
    count: int, low: int, high: int, confidence: float
) -> None:
    found = interval([float(value) for value in range(count, 0, -1)])
    assert (found.low, found.high, found.number) == (low, high, count)
    assert found.confidence == pytest.approx(confidence)
    assert found.median == (count + 1) / 2


@pytest.mark.parametrize("count", [3, 7, 20])
def test_an_interval_encloses_the_true_median_as_often_as_it_says(count: int) -> None:
    random = np.random.default_rng(1)
    found = [interval(values) for values in random.lognormal(size=(4000, count)).tolist()]
    held = np.mean([each.low <= 1.0 <= each.high for each in found])
    assert held == pytest.approx(found[0].confidence, abs=0.02)


def test_a_slope_is_the_power_and_one_place_has_none() -> None:
    assert slope([(x, 3 * x**1.5) for x in (1.0, 10.0, 500.0)]) == pytest.approx(1.5)
    assert slope([(2.0, 1.0), (2.0, 3.0)]) is None
    assert geometric_mean([0.5, 8.0]) == pytest.approx(2.0)
