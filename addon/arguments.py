"""What options of the command line may say, read and checked. No bpy."""

import argparse
from collections.abc import Callable, Sequence

from .errors import EspalierAddonError

MAX_PIXELS = 65536


class UsageError(EspalierAddonError):
    """An option that cannot be used."""


def resolution(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels."""
    sides = text.lower().split("x")
    if len(sides) != 2 or not all(side.isascii() and side.isdigit() and 1 <= int(side) <= MAX_PIXELS for side in sides):
        raise argparse.ArgumentTypeError(f"'{text}' is no WIDTHxHEIGHT of 1 to {MAX_PIXELS} pixels")
    return int(sides[0]), int(sides[1])


def count(least: int, most: int) -> Callable[[str], int]:
    """A parser of whole numbers in a range."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is no whole number from {least} to {most}")
        return value

    return parse


def some_of(kind: str, known: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """A parser of names with commas between them, each at most once."""

    def parse(text: str) -> tuple[str, ...]:
        names = listed(text)
        unknown = [name for name in names if name not in known]
        if unknown or not names:
            raise argparse.ArgumentTypeError(f"no {kind} '{', '.join(unknown)}', choose from {', '.join(known)}")
        return names

    return parse


def listed(text: str) -> tuple[str, ...]:
    """What stands between commas, each at most once."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
