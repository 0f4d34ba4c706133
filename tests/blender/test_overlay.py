"""The overlay in a window: built once, rebuilt for other boxes, quick with many of them, freed with the file.

The tests share one Blender and run in the order of the file.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .blender import Blender
from .desktop import Desktop, wait_until

ROOT = Path(__file__).resolve().parents[2]
MODULE = "bl_ext.user_default.espalier"
PRELUDE = f"""
import importlib, time
overlay = importlib.import_module("{MODULE}.overlay")
settings = window.scene.espalier.overlay
view = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
region = next(region for region in view.regions if region.type == 'WINDOW')

def redraw(times=1):
    "Seconds of the processor for one redraw of the viewport."
    with bpy.context.temp_override(window=window, area=view, region=region):
        start = time.process_time()
        bpy.ops.wm.redraw_timer(type='DRAW', iterations=times)
        return (time.process_time() - start) / times

def drawn():
    redraw()
    return overlay.drawing(window.scene)
"""
BOXES = 100_000
SECONDS_IN_SOFTWARE = 1.0
"""Of one processor, for a frame with BOXES boxes and no GPU; a GPU takes a few milliseconds."""


@pytest.fixture(scope="module")
def desktop(blender: Blender, blend: Path) -> Iterator[Desktop]:
    with Desktop(blender, blend, ROOT / "out" / "overlay" / os.environ.get("ESPALIER_GUI", "")) as opened:
        opened.python("bpy.ops.espalier.build_trace()", timeout=120)
        yield opened


def ask(desktop: Desktop, source: str) -> Any:
    return desktop.python(PRELUDE + source, timeout=120)


def test_it_is_built_once_and_again_only_for_other_boxes(desktop: Desktop) -> None:
    same, recolored, others = ask(
        desktop,
        """
first = drawn()
same = all(drawn() is first for _ in range(3))
settings.opacity, settings.in_front, settings.cell_color = 0.9, True, (1, 0, 0)
recolored = drawn() is first
others = []
for name, value in (("leaves", False), ("depth_max", 3), ("occupied_only", False), ("method", "bvh-sah")):
    before = drawn()
    setattr(settings, name, value)
    others.append(drawn() is not before)
value = [same, recolored, others]
""",
    )
    assert same, "a redraw builds nothing"
    assert recolored, "colours, opacity and depth test build nothing"
    assert all(others), "other boxes are built"


def test_every_kind_can_be_left_out(desktop: Desktop) -> None:
    shown = ask(
        desktop,
        """
settings.method, settings.depth_min, settings.depth_max, settings.max_boxes = "grid", 0, 64, 1_000_000
value = []
toggles = {toggle for toggle, _color in overlay.TOGGLES.values()}
for toggle in sorted(toggles):
    for other in toggles:
        setattr(settings, other, other == toggle)
    kinds = [kind for kind, (shown_by, _color) in overlay.TOGGLES.items() if shown_by == toggle]
    value.append([kinds, sorted(drawn().batches)])
""",
    )
    assert len(shown) == 4
    assert all(set(batches) <= set(kinds) for kinds, batches in shown)
    assert [2] in [batches for _kinds, batches in shown], "the grid's own box"
    assert [3] in [batches for _kinds, batches in shown], "and its cells"


def test_nothing_to_draw_is_no_error(desktop: Desktop) -> None:
    shown = ask(
        desktop,
        """
for toggle, _color in overlay.TOGGLES.values():
    setattr(settings, toggle, False)
value = [drawn().shown, list(drawn().batches)]
""",
    )
    assert shown == [0, []]
    assert "Traceback" not in desktop.output()


def test_many_boxes_stay_interactive(desktop: Desktop) -> None:
    shown, matched, first, each, without = ask(
        desktop,
        f"""
for toggle, _color in overlay.TOGGLES.values():
    setattr(settings, toggle, True)
settings.occupied_only, settings.in_front, settings.max_boxes = False, True, {BOXES}
start = time.perf_counter()
drawing = drawn()
first = time.perf_counter() - start
each = redraw(5)
settings.show = False
redraw()
value = [drawing.shown, drawing.matched, first, each, redraw(5)]
settings.show = True
""",
    )
    print(f"{shown} of {matched} boxes: built in {first:.3f} s; a frame {each:.3f} s, without them {without:.3f} s")
    assert shown == min(matched, BOXES)
    assert each - without < SECONDS_IN_SOFTWARE


def test_an_undo_leaves_picture_table_and_boxes(desktop: Desktop) -> None:
    names, shown, rows, boxes = ask(
        desktop,
        f"""
results = importlib.import_module("{MODULE}.results")
area = next(area for area in window.screen.areas if area.type == 'OUTLINER')
area.type = 'IMAGE_EDITOR'
area.spaces.active.image = bpy.data.images["Espalier"]
with bpy.context.temp_override(window=window, area=view, region=region):
    bpy.ops.ed.undo_push(message="Test")
    bpy.ops.object.empty_add()
    bpy.ops.ed.undo_push(message="Test")
    bpy.ops.espalier.build_trace()
    bpy.ops.ed.undo()
names = [image.name for image in bpy.data.images if image.name.startswith("Espalier")]
shown = area.spaces.active.image
value = [names, shown and shown.name, len(results.of(window.scene.session_uid).rows), drawn().shown]
""",
    )
    assert names == ["Espalier"]
    assert shown == "Espalier"
    assert rows == 5
    assert boxes > 0


def test_clear_results_takes_the_boxes_away(desktop: Desktop) -> None:
    assert ask(desktop, "bpy.ops.espalier.clear_results()\nvalue = drawn() is None")


def test_another_file_frees_the_boxes(desktop: Desktop) -> None:
    ask(desktop, "settings.method = 'grid'\nbpy.ops.espalier.build_trace()\nassert drawn().shown")
    desktop.python("bpy.app.timers.register(lambda: bpy.ops.wm.read_homefile(use_factory_startup=True) and None)")
    left = f"import importlib\nvalue = len(importlib.import_module('{MODULE}.overlay')._drawings)"
    wait_until(lambda: desktop.python(left) == 0, 20, "no drawing is left")
    assert "Traceback" not in desktop.output()
