"""SVG and HTML as text: elements, scales, axes, numbers for people. No bpy."""

import html
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass


def tag(name: str, *children: str, **attributes: object) -> str:
    """An element. children are markup already; attributes are escaped, their `_` become `-`, `class_` is class."""
    names = {key: key.rstrip("_").replace("_", "-") for key in attributes}
    given = "".join(
        f' {names[key]}="{html.escape(_plain(value))}"' for key, value in attributes.items() if value is not None
    )
    return f"<{name}{given}>{''.join(children)}</{name}>"


def text(content: str, x: float, y: float, class_: str = "", anchor: str = "start") -> str:
    """A line of text in an SVG."""
    return tag("text", html.escape(content), x=x, y=y, class_=class_ or None, text_anchor=anchor)


def picture(width: float, height: float, label: str, *children: str) -> str:
    """An SVG that is as wide as the page lets it be; label: what a screen reader says."""
    box = f"0 0 {_plain(width)} {_plain(height)}"
    return tag("svg", *children, viewBox=box, role="img", aria_label=label, width=width, height=height)


def title(content: str) -> str:
    """What a pointer that rests on the parent shows."""
    return tag("title", html.escape(content))


def path(points: Iterable[tuple[float, float]], **attributes: object) -> str:
    """A line through points."""
    d = "M" + "L".join(f"{_plain(x)} {_plain(y)}" for x, y in points)
    return tag("path", d=d, **attributes)


def _plain(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Scale:
    """Numbers from low to high onto pixels from start to end, evenly or by their logarithm. low < high."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, value: float) -> float:
        """The pixel of a number; of one outside, the nearest end."""
        low, high, at = (math.log10(v) if self.log else v for v in (self.low, self.high, max(value, 1e-300)))
        share = min(max((at - low) / (high - low), 0.0), 1.0)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Round numbers inside: powers of ten, with some between them where those are few, or about five even steps."""
        if self.log:
            first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
            stride = max(1, -(-(last - first) // 8))
            found = [
                10.0**power * digit for power in range(first, last + 1, stride) for digit in self._digits(last - first)
            ]
            return [value for value in found if self.low * (1 - 1e-9) <= value <= self.high * (1 + 1e-9)]
        step = nice_step((self.high - self.low) / 5)
        count = math.floor((self.high - self.low) / step + 1e-9)
        return [self.low + step * index for index in range(count + 1)]

    @staticmethod
    def _digits(decades: int) -> tuple[int, ...]:
        """More numbers between the powers of ten where those are few."""
        return (1, 2, 5) if decades <= 2 else (1, 3) if decades <= 3 else (1,)


def log_scale(values: Sequence[float], start: float, end: float) -> Scale:
    """A logarithmic scale around positive numbers, with some room."""
    low, high = min(values) / 1.3, max(values) * 1.3
    return Scale(low, high, start, end, log=True)


def nice_step(least: float) -> float:
    """The least 1, 2 or 5 times a power of ten that is not below `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * digit for digit in (1, 2, 5, 10) if power * digit >= least * (1 - 1e-9))


def x_axis(scale: Scale, top: float, bottom: float, name: str, label: Callable[[float], str]) -> str:
    """Grid lines, numbers below them, and the name of the axis."""
    parts = []
    for value in scale.ticks():
        x = scale(value)
        parts.append(tag("line", x1=x, x2=x, y1=top, y2=bottom, class_="rule"))
        parts.append(text(label(value), x, bottom + 14, "tick", "middle"))
    parts.append(text(name, (scale.start + scale.end) / 2, bottom + 30, "axis", "middle"))
    return "".join(parts)


def y_axis(scale: Scale, left: float, right: float, name: str, label: Callable[[float], str]) -> str:
    """Grid lines, numbers to their left, and the name of the axis above."""
    parts = []
    for value in scale.ticks():
        y = scale(value)
        parts.append(tag("line", x1=left, x2=right, y1=y, y2=y, class_="rule"))
        parts.append(text(label(value), left - 6, y + 4, "tick", "end"))
    parts.append(text(name, 4, scale.end - 10, "axis"))
    return "".join(parts)


def apart(places: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Places for labels, each as near to its own as it can be, `gap` from the next, between low and high."""
    order = sorted(range(len(places)), key=lambda index: places[index])
    found = [places[index] for index in order]
    for index in range(len(found)):
        least = low if index == 0 else found[index - 1] + gap
        found[index] = max(found[index], least)
    most = high
    for index in reversed(range(len(found))):
        found[index] = min(found[index], most)
        most = found[index] - gap
    result = [0.0] * len(places)
    for index, place in zip(order, found, strict=True):
        result[index] = place
    return result


def seconds(value: float) -> str:
    """Three digits and the unit: '12.3 ms'."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size * 0.9995:
            return f"{digits(value / size)} {unit}"
    return f"{digits(value / 1e-9)} ns"


def count(value: float) -> str:
    """Three digits, with k, M, G for thousands, millions, billions."""
    for unit, size in (("G", 1e9), ("M", 1e6), ("k", 1e3)):
        if value >= size * 0.9995:
            return f"{digits(value / size)} {unit}"
    return digits(value)


def digits(value: float) -> str:
    """Three digits that matter, zeros behind the point left out only in whole numbers."""
    if value == 0 or value >= 99.95 or value == int(value):
        return f"{value:,.0f}"
    return f"{value:.1f}" if value >= 9.995 else f"{value:.2f}"
