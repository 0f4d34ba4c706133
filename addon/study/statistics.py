"""Medians and how sure they are. No bpy.

An interval is made of order statistics: the k-th smallest and k-th largest of n independent values enclose the median
of what they are drawn from with probability 1 - 2 P(B < k), where B is binomial of n and one half, whatever the
distribution (David, Nagaraja, "Order Statistics", 3rd edition, 2003, section 7.1). Timings are skewed by whatever else
a machine does, so nothing is assumed of them. k is the largest that keeps the confidence at WANTED or more; with too
few values the interval is their whole range, and its confidence is told beside it.
"""

import math
import statistics
from collections.abc import Sequence
from typing import NamedTuple

WANTED = 0.95
"""Confidence of an interval where there are values enough, which is from six on."""


class Interval(NamedTuple):
    """A median, the interval that encloses the true one, its confidence in 0..1, and how many values it comes from."""

    median: float
    low: float
    high: float
    confidence: float
    number: int


def interval(values: Sequence[float]) -> Interval:
    """The median of at least one value, with its interval. A single value is its own, with confidence 0."""
    ordered = sorted(values)
    count = len(ordered)
    rank = max(1, max((k for k in range(1, count // 2 + 1) if _confidence(count, k) >= WANTED), default=1))
    return Interval(
        statistics.median(ordered), ordered[rank - 1], ordered[count - rank], _confidence(count, rank), count
    )


def geometric_mean(values: Sequence[float]) -> float:
    """The mean of ratios. All must be positive."""
    return math.exp(math.fsum(map(math.log, values)) / len(values))


def slope(points: Sequence[tuple[float, float]]) -> float | None:
    """The exponent p of y = c x^p that fits positive points best (least squares of logarithms); None of one x alone."""
    xs, ys = ([math.log(point[axis]) for point in points] for axis in (0, 1))
    if len(set(xs)) < 2:
        return None
    return statistics.linear_regression(xs, ys).slope


def _confidence(count: int, rank: int) -> float:
    """The probability that the rank-th smallest and largest of `count` values enclose the median."""
    if count < 2:
        return 0.0
    return 1.0 - 2.0 * sum(math.comb(count, below) for below in range(rank)) / 2.0**count
