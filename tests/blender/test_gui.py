"""The extension under a user's hands: both buttons, the table, the picture, the cells, Esc, and off again.

The tests share one Blender and run in the order of the file, as a user would go on. Screenshots stay in out/gui.
"""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from . import panel
from .blender import Blender
from .desktop import Desktop, wait_until

ROOT = Path(__file__).resolve().parents[2]
MODULE = "bl_ext.user_default.espalier"
METHODS = ["bvh-median", "bvh-sah", "grid", "hybrid-sampled", "hybrid"]
ROWS = f"""
import importlib
session = importlib.import_module("{MODULE}.session").of(window.scene)
results = session.run.results if session else ()
value = [[result.method, result.build_ms, result.trace_s, result.rays] for result in results]
"""
THREADS = "import threading\nvalue = [thread.name for thread in threading.enumerate()]"
SNAPSHOT = f"""
import sys
sys.path.insert(0, {str(ROOT / "tests" / "blender" / "scripts")!r})
import snapshot
value = snapshot.take(window.scene)
"""
LAYOUT = """
view = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
with bpy.context.temp_override(window=window, area=view):
    bpy.ops.screen.area_split(direction='VERTICAL', factor=0.55)
areas = [area for area in window.screen.areas if area.type == 'VIEW_3D']
max(areas, key=lambda area: area.x).type = 'IMAGE_EDITOR'
properties = next(area for area in window.screen.areas if area.type == 'PROPERTIES')
properties.spaces.active.context = 'RENDER'
"""
ESCAPE_SECONDS = 0.2
ANSWERS = 3
"""Rounds between test and interface until Esc has arrived and its effect is seen."""
ALIVE_SECONDS = 2.0
"""A comparison takes several seconds; an interface that stands still for this long is noticed."""
MANY_SAMPLES = 1 << 20
MUCH_LARGER = 1000
"""Percentage of a frame that a study works on for a while; it does not know samples."""


@pytest.fixture(scope="module")
def desktop(blender: Blender, blend: Path) -> Iterator[Desktop]:
    folder = ROOT / "out" / "gui" / os.environ.get("ESPALIER_GUI", "")
    with Desktop(blender, blend, folder) as opened:
        opened.python(LAYOUT)
        opened.settled("start")
        yield opened


def modal(desktop: Desktop) -> list[str]:
    """Names of the extension's operators that run in the window right now."""
    names = desktop.python("value = [operator.bl_idname for operator in window.modal_operators]")
    return [name for name in names if name.startswith("ESPALIER_OT_")]


def press(desktop: Desktop, operator: str) -> None:
    """Click the button of the operator, as found with the mouse."""
    desktop.click(*panel.find_button(desktop, operator))


def wait_for_end(desktop: Desktop, seconds: float) -> None:
    """Wait until no operator of the extension runs."""
    wait_until(lambda: not modal(desktop), seconds, "the operator's end")


def changed(before: NDArray[np.uint8], after: NDArray[np.uint8], area: tuple[int, int, int, int]) -> float:
    """Part of the area's pixels that differ visibly, 0..1."""
    left, top, width, height = area
    part = np.s_[top : top + height, left : left + width]
    return float((np.abs(before[part].astype(int) - after[part].astype(int)).max(axis=2) > 12).mean())


def show_cells(desktop: Desktop, shown: bool) -> None:
    """Switch the overlay, of the method that has cells of grids in this scene."""
    desktop.python(f"overlay = window.scene.espalier.overlay\noverlay.method, overlay.show = 'hybrid-sampled', {shown}")


def test_build_and_trace_fills_the_table(desktop: Desktop) -> None:
    before = desktop.python(SNAPSHOT)
    press(desktop, "espalier.build_trace")
    wait_until(lambda: desktop.python(ROWS), 30, "the session of the run")
    wait_for_end(desktop, 60)
    desktop.settled("build-and-trace")
    rows = desktop.python(ROWS)
    assert [row[0] for row in rows] == METHODS
    assert all(build_ms > 0 and trace_s > 0 and rays >= 160 * 120 for _, build_ms, trace_s, rays in rows)
    assert desktop.python(SNAPSHOT) == before


def test_overlay_draws_the_cells_and_takes_them_away(desktop: Desktop) -> None:
    view = panel.area(desktop, "VIEW_3D")
    show_cells(desktop, False)
    without = desktop.settled("overlay-off")
    show_cells(desktop, True)
    assert changed(without, desktop.settled("overlay-on"), view) > 0.02, "boxes are drawn over the viewport"
    show_cells(desktop, False)
    assert changed(without, desktop.settled("overlay-off-again"), view) < 0.001, "and nothing of them stays"


def test_compare_shows_both_pictures(desktop: Desktop) -> None:
    before = desktop.python(SNAPSHOT)
    press(desktop, "espalier.compare")
    slowest = slowest_answer_while_modal(desktop)
    assert slowest < ALIVE_SECONDS, "the interface stays alive"
    picture = desktop.settled("compare")
    assert desktop.python(SNAPSHOT) == before
    name = desktop.python(
        "area = next(area for area in window.screen.areas if area.type == 'IMAGE_EDITOR')\n"
        "image = area.spaces.active.image\n"
        "value = image and [image.name, *image.size]"
    )
    assert name is not None, "the Image Editor shows the comparison"
    left, top, width, height = panel.area(desktop, "IMAGE_EDITOR")
    assert picture[top : top + height, left : left + width].std() > 10


def slowest_answer_while_modal(desktop: Desktop) -> float:
    """Seconds of the slowest answer that Blender's interface gave until the operator ended."""
    slowest, deadline = 0.0, time.monotonic() + 120
    while True:
        asked = time.monotonic()
        running = modal(desktop)
        slowest = max(slowest, time.monotonic() - asked)
        if not running:
            return slowest
        assert time.monotonic() < deadline, "the comparison does not end"
        time.sleep(0.05)


def test_run_study_writes_a_report(desktop: Desktop, blend: Path) -> None:
    before = desktop.python(SNAPSHOT)
    press(desktop, "espalier.study")
    slowest = slowest_answer_while_modal(desktop)
    assert slowest < ALIVE_SECONDS, "the interface stays alive"
    desktop.settled("study")
    assert desktop.python(SNAPSHOT) == before
    (folder,) = blend.parent.glob(f"{blend.stem}-*-study")
    assert {path.name for path in folder.iterdir()} == {"report.html", "study.json", "study.csv", "runs.jsonl"}


@pytest.mark.parametrize("operator", ["espalier.build_trace", "espalier.compare", "espalier.study"])
def test_escape_in_the_middle_stops_and_changes_nothing(desktop: Desktop, operator: str) -> None:
    desktop.python(f"window.scene.espalier.samples = {MANY_SAMPLES}")
    desktop.python(
        f"window.scene.render.resolution_percentage = {MUCH_LARGER if operator == 'espalier.study' else 100}"
    )
    before = desktop.python(SNAPSHOT)
    idle = desktop.settled("idle")
    press(desktop, operator)
    wait_until(lambda: modal(desktop), 5, f"{operator} is at work", 0.02)
    time.sleep(1.0)
    at_work = desktop.screenshot(f"at-work-{operator}")
    assert changed(idle, at_work, panel.area(desktop, "PROPERTIES")) > 0.005, "the panel shows progress"
    assert modal(desktop), "work for many minutes is still going on"
    overhead = desktop.answer_seconds()
    elapsed = seconds_to_end_on_escape(desktop)
    desktop.settled(f"escape-{operator}")
    assert elapsed < ESCAPE_SECONDS + ANSWERS * overhead, f"an answer alone takes {overhead:.2f} s"
    assert desktop.python(SNAPSHOT) == before
    desktop.python("window.scene.espalier.samples = 1")
    desktop.python("window.scene.render.resolution_percentage = 100")
    assert not [name for name in desktop.python(THREADS) if "espalier" in name]


def seconds_to_end_on_escape(desktop: Desktop) -> float:
    """Press Esc over the window; the seconds until no operator of the extension runs."""
    pressed = time.monotonic()
    desktop.key("Escape")
    wait_until(lambda: not modal(desktop), 5, "the operator's end after Esc", 0.02)
    return time.monotonic() - pressed


def test_disabled_it_leaves_the_interface_clean(desktop: Desktop) -> None:
    desktop.python(f"bpy.ops.preferences.addon_disable(module='{MODULE}')")
    desktop.settled("disabled")
    assert desktop.python("value = hasattr(window.scene, 'espalier')") is False
    assert "Traceback" not in desktop.output()
