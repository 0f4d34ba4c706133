"""The page: its head, its sections, its contents. Everything is inside of it. No bpy."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from ..paper import Paper
from ..rows import Results
from . import sections, tables
from .svg import tag

STYLE, SCRIPT = (Path(__file__).with_name(name) for name in ("style.css", "script.js"))


class Section(NamedTuple):
    """A part of the page: its anchor, its heading, and its markup; an empty one is left out."""

    name: str
    heading: str
    body: str


def page(results: Results, paper: Paper) -> str:
    """The whole page as text."""
    made = [
        Section("summary", "In short", sections.summary(results)),
        Section("claims", "The paper's claims", sections.claims(results, paper)),
        Section("paper", "The paper's table", tables.paper_table(results, paper)),
        Section("winners", "Who wins where", tables.winners(results)),
        Section("times", "Build and trace", sections.times(results)),
        Section("rays", "When does a grid pay?", sections.rays(results)),
        Section("growth", "Cost against triangles", sections.growth(results)),
        Section("heat", "Where the steps are", sections.heat(results)),
        Section("depth", "Depth of the trees", sections.depth(results)),
        Section("occupancy", "Triangles in leaves and cells", sections.occupancy(results)),
        Section("numbers", "All numbers", tables.numbers(results)),
        Section("failures", "What could not be measured", tables.failures(results)),
        Section("method", "How it was measured", sections.method(results)),
    ]
    kept = [section for section in made if section.body]
    head = "".join(
        (
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            tag("title", "Espalier study"),
            tag("style", STYLE.read_text(encoding="utf-8")),
        )
    )
    body = [tag("header", tag("h1", "Espalier study"), sections.head(results)), _contents(kept)]
    body.append(tag("main", *(_section(section) for section in kept)))
    body.append(tag("script", SCRIPT.read_text(encoding="utf-8")))
    return f'<!DOCTYPE html>\n<html lang="en">{tag("head", head)}{tag("body", *body)}</html>\n'


def _contents(made: Sequence[Section]) -> str:
    links = [tag("a", escape(section.heading), href=f"#{section.name}") for section in made]
    return tag("nav", *links, aria_label="Contents")


def _section(section: Section) -> str:
    return tag("section", tag("h2", escape(section.heading)), section.body, id=section.name)
