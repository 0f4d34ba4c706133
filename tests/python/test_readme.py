"""The README's examples run and print what it says, and what it names is there."""

import contextlib
import io
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def test_python_example_prints_what_it_says() -> None:
    (source,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(source, "README.md", "exec"), {})
    promised = re.findall(r"print\(.*\)  # (.*)", source)
    assert len(promised) >= 3
    assert printed.getvalue().splitlines()[: len(promised)] == promised


def test_links_lead_somewhere() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", TEXT)
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_every_make_target_is_named() -> None:
    targets = re.findall(r"^([a-z]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(targets) >= 7
    assert [target for target in targets if not re.search(rf"`(make )?{target}`|make {target}\b", TEXT)] == []


def test_every_method_is_named() -> None:
    import espalier_rt

    assert [method for method in espalier_rt.methods() if f"`{method}`" not in TEXT] == []
