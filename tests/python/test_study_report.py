"""The report is one well-formed page that needs nothing else, and says what the figures say."""

import json
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest
from studies import PLAN, finished

from espalier.study import claims, paper
from espalier.study.plan import Plan, StudyError
from espalier.study.report import charts, marks, svg
from espalier.study.report.page import page

VOID = {"meta", "img", "wbr"}


class Balanced(HTMLParser):
    """Fails where a tag is not closed in its place."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: set[str] = set()
        self.links: set[str] = set()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.ids |= {value for name, value in attributes if name == "id"}
        self.links |= {value for name, value in attributes if name == "href"}
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory):
    return finished(tmp_path_factory.mktemp("study")).results


@pytest.fixture(scope="module")
def text(results) -> str:
    return page(results, paper.read())


def test_every_tag_is_closed_and_every_link_leads_somewhere(text: str) -> None:
    parser = Balanced()
    parser.feed(text)
    parser.close()
    assert parser.open == []
    assert {link.removeprefix("#") for link in parser.links} <= parser.ids


def test_every_picture_is_well_formed_and_labelled(text: str) -> None:
    pictures = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(pictures) > 20
    for picture in pictures:
        root = ElementTree.fromstring(picture)
        assert root.get("aria-label")
        assert root.get("role") == "img"
        assert "nan" not in picture.lower().replace("fill", "")


def test_nothing_is_fetched(text: str) -> None:
    assert not re.findall(r"https?:|//[a-z]|@import|url\(", text)
    sources = re.findall(r'src="([^"]{0,30})', text)
    assert sources
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.findall(r"<link|<iframe|<object", text)


def test_every_section_is_there_and_names_every_method(text: str) -> None:
    for name in ("claims", "winners", "times", "rays", "growth", "heat", "depth", "occupancy", "numbers", "method"):
        assert f'<section id="{name}">' in text
    for method in PLAN.methods:
        assert text.count(method) > 10
    assert '<section id="failures">' not in text


def test_it_follows_dark_mode_and_print(text: str) -> None:
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text


def test_names_are_escaped(tmp_path: Path) -> None:
    plan = Plan(**{**vars(PLAN), "scenes": ("<b>&",), "classes": ("primary",)})

    def loader(_group, _progress):
        raise OSError("<script>alert(1)</script>")

    text = page(finished(tmp_path, plan, loader).results, paper.read())
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text


def test_claims_have_figures_of_every_scene(results) -> None:
    found = claims.claims(results, paper.read())
    questions = " ".join(claim.question for claim in found)
    assert "ever the slowest" in questions
    assert "overhead grow" in questions
    for claim in found:
        assert len(claim.figures) >= len(results.groups())
    assert "40 times" not in questions, "none of the paper's scenes is in this study"


def test_the_papers_times_are_not_made_up_and_come_from_a_file(tmp_path: Path) -> None:
    assert not paper.read().has_times
    content = json.loads(paper.FILE.read_text())
    content["rows"][0]["seconds"]["BVH"] = 12.5
    (tmp_path / "paper.json").write_text(json.dumps(content))
    given = paper.read(tmp_path / "paper.json")
    assert given.rows[0].seconds["BVH"] == 12.5
    content["rows"][0]["seconds"]["BVH"] = -1
    (tmp_path / "paper.json").write_text(json.dumps(content))
    with pytest.raises(StudyError, match="not above 0"):
        paper.read(tmp_path / "paper.json")


def test_the_papers_table_has_ratios_where_its_times_are_given(results) -> None:
    from espalier.study.report import tables

    table = paper.read()
    row = paper.PaperRow("Ball", "small", 80, 1.9, True, {"BVH": 3600.0, "grid": None, "hybrid": None})
    given = paper.Paper(table.source, table.methods, (row,))
    markup = tables.paper_table(results, given)
    ours = results.find(results.groups()[0], "bvh-median").total_s
    assert svg.digits(3600.0 / ours) in markup
    assert "Ball *" in markup
    (claim,) = (claim for claim in claims.claims(results, given) if "paper's on every row" in claim.question)
    assert claim.answer == "In 1 of 1 times" or claim.answer == "In 2 of 2 times"


def test_crossings_are_where_the_fastest_changes(results) -> None:
    group = results.groups()[0]
    rows = results.of(group)
    found = charts.crossings(rows)
    rays = [crossing.rays for crossing in found]
    assert rays == sorted(rays)
    for crossing in found:
        times = {row.method: row.build_s + crossing.rays * row.ray_s for row in rows}
        assert times[crossing.before] == pytest.approx(times[crossing.after])
        assert times[crossing.after] == pytest.approx(min(times.values()))


def test_the_best_hybrid_and_the_papers_methods_have_lines_of_their_own(results) -> None:
    assert set(marks.shown(results)) >= {"bvh-median", "bvh-sah", "grid", "hybrid-sampled"}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12.34, "12.3 s"),
        (0.0123456, "12.3 ms"),
        (4.56e-6, "4.56 µs"),
        (3e-9, "3 ns"),
        (0.9999, "1.00 s"),
        (150, "150 s"),
    ],
)
def test_seconds_are_told_in_the_unit_that_fits(value: float, text: str) -> None:
    assert svg.seconds(value) == text


def test_scales_have_round_ticks() -> None:
    assert svg.Scale(0, 97, 0, 100).ticks() == [0, 20, 40, 60, 80]
    assert svg.Scale(1, 1e5, 0, 100, log=True).ticks() == pytest.approx([1, 10, 100, 1e3, 1e4, 1e5])
    assert svg.Scale(15, 90, 0, 100, log=True).ticks() == pytest.approx([20, 50])
    assert svg.Scale(1, 100, 0, 50, log=True)(10) == pytest.approx(25)


def test_labels_are_moved_apart_and_stay_inside() -> None:
    places = svg.apart([10, 11, 50, 99, 100], 10, 0, 100)
    ordered = sorted(places)
    assert all(b - a >= 10 - 1e-9 for a, b in pairwise(ordered))
    assert min(places) >= 0
    assert max(places) <= 100
