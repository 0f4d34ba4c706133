"""Finds a button of a panel as a user does: by moving the mouse over it. Blender copies what it does on Ctrl C."""

import time

from .desktop import SIZE, Desktop

AREA = "next(area for area in window.screen.areas if area.type == '{type}')"
STEP = 9
"""Pixels between two looks: half the height of a button."""


def area(desktop: Desktop, kind: str) -> tuple[int, int, int, int]:
    """Left, top, width and height of the area of this type's main region, in pixels from the screen's upper left."""
    source = f"""
region = next(region for region in {AREA.format(type=kind)}.regions if region.type == 'WINDOW')
value = [region.x, region.y, region.width, region.height]
"""
    x, y, width, height = desktop.python(source)
    return x, SIZE[1] - y - height, width, height


def copied(desktop: Desktop) -> str:
    """What Ctrl C copies from the button under the mouse; empty where there is none."""
    desktop.python("bpy.context.window_manager.clipboard = ' '")
    desktop.key("ctrl+c")
    time.sleep(0.1)
    return str(desktop.python("value = bpy.context.window_manager.clipboard")).strip()


def find_button(desktop: Desktop, operator: str) -> tuple[int, int]:
    """Where in the Properties editor the button of `bpy.ops.OPERATOR` is; AssertionError where it is not to be seen."""
    left, top, width, height = area(desktop, "PROPERTIES")
    seen = []
    for column in (0.3, 0.75):
        for y in range(top + STEP, top + height, STEP):
            x = left + int(width * column)
            desktop.move(x, y)
            time.sleep(0.15)
            if (found := copied(desktop)).startswith(f"bpy.ops.{operator}("):
                return x, y
            seen.append(found)
    raise AssertionError(f"no button of {operator} in the Properties editor, only {sorted(set(seen))}")
