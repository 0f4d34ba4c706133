"""What a study leaves in its folder beside the journal: study.json, study.csv, report.html. No bpy."""

from collections.abc import Callable
from pathlib import Path

from ..outputs import OutputFolder
from .journal import OUTPUTS, REPORT, Journal
from .paper import Paper
from .report.page import page
from .rows import Results, results


def publish(folder: Path, journal: Journal, paper: Paper) -> Results:
    """Write all files or none, and give what they tell. Raises OutputError."""
    found = results(journal)
    texts = {"study.json": found.json(), "study.csv": found.csv(), REPORT: page(found, paper)}
    with OutputFolder(folder, OUTPUTS) as outputs:
        outputs.publish({name: _writer(text) for name, text in texts.items()})
    return found


def _writer(text: str) -> Callable[[Path], object]:
    return lambda path: path.write_text(text, encoding="utf-8")
