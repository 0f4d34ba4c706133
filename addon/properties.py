"""Settings of Espalier, kept on the scene as `scene.espalier`."""

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
)

from .areas import redraw
from .methods import COMPARED_METHODS, DEFAULT_METHOD, GROUPS, METHODS

METHOD_ITEMS = [
    item
    for heading, belongs in GROUPS.items()
    for item in (
        ("", heading, "", 0),  # a column of its own in the list
        *((name, label, text, index) for index, (name, label, text) in enumerate(METHODS) if belongs(name)),
    )
]
METHOD_FLAGS = [(method.name, method.label, method.description, 1 << index) for index, method in enumerate(METHODS)]
STATIC: Any = set()
"""Property options of a setting that cannot be animated."""


def _redraw(_settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Show a change that a script made, too: Blender redraws by itself only for changes in its interface."""
    redraw(frozenset({"VIEW_3D", "PROPERTIES"}))


DRAWN: Any = {"options": STATIC, "update": _redraw}
"""Property arguments of what the overlay draws."""


def color(name: str, description: str, default: tuple[float, float, float]) -> Any:
    """A colour setting as the screen shows it, in sRGB."""
    return FloatVectorProperty(
        name=name,
        description=description,
        default=default,
        min=0.0,
        max=1.0,
        size=3,
        subtype="COLOR_GAMMA",
        **DRAWN,
    )


class ESPALIER_PG_overlay(bpy.types.PropertyGroup):
    """What the overlay draws. The colours keep apart with any colour vision, and stand out on dark and light themes."""

    show: BoolProperty(
        name="Show Cells",
        description="Draw the boxes of the accelerator last built over the 3D viewport",
        default=True,
        **DRAWN,
    )
    method: EnumProperty(
        name="Method",
        description="Acceleration method whose boxes are drawn, once it is built",
        items=METHOD_ITEMS,
        default=DEFAULT_METHOD,
        **DRAWN,
    )
    branches: BoolProperty(name="Branches", description="Draw the boxes of inner nodes", default=False, **DRAWN)
    leaves: BoolProperty(
        name="Leaves", description="Draw the boxes of nodes that hold triangles", default=True, **DRAWN
    )
    grids: BoolProperty(name="Grids", description="Draw the outer boxes of uniform grids", default=True, **DRAWN)
    cells: BoolProperty(name="Grid Cells", description="Draw the cells of uniform grids", default=True, **DRAWN)
    branch_color: color("Branch Color", "Color of the boxes of inner nodes", (0.95, 0.95, 0.95))
    leaf_color: color("Leaf Color", "Color of the boxes of nodes that hold triangles", (0.25, 0.69, 1.0))
    grid_color: color("Grid Color", "Color of the outer boxes of uniform grids", (1.0, 0.48, 0.72))
    cell_color: color("Grid Cell Color", "Color of the cells of uniform grids", (1.0, 0.76, 0.04))
    depth_min: IntProperty(
        name="Depth Min",
        description="Least depth in the tree of boxes to draw; the root has depth 0",
        default=0,
        min=0,
        max=65535,
        soft_max=64,
        **DRAWN,
    )
    depth_max: IntProperty(
        name="Depth Max",
        description="Greatest depth in the tree of boxes to draw; the root has depth 0",
        default=64,
        min=0,
        max=65535,
        soft_max=64,
        **DRAWN,
    )
    occupied_only: BoolProperty(
        name="Occupied Only", description="Leave out boxes that hold no triangle", default=True, **DRAWN
    )
    in_front: BoolProperty(
        name="In Front", description="Draw the boxes in front of all objects", default=False, **DRAWN
    )
    opacity: FloatProperty(
        name="Opacity",
        description="Opacity of the boxes",
        default=0.3,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        **DRAWN,
    )
    max_boxes: IntProperty(
        name="Max Boxes",
        description="Most boxes to draw; beyond it the deepest are left out",
        default=100_000,
        min=1,
        soft_max=1_000_000,
        max=10_000_000,
        **DRAWN,
    )


class ESPALIER_PG_settings(bpy.types.PropertyGroup):
    """How Espalier traces this scene, and what its overlay draws."""

    method: EnumProperty(
        name="Method",
        description="Acceleration method that renders use",
        items=METHOD_ITEMS,
        default=DEFAULT_METHOD,
        options=STATIC,
    )
    methods: EnumProperty(
        name="Methods",
        description="Acceleration methods to build, trace and compare",
        items=METHOD_FLAGS,
        default=set(COMPARED_METHODS),
        options={"ENUM_FLAG"},
    )
    samples: IntProperty(
        name="Samples",
        description="Rays through each pixel; one ray goes through the pixel's centre, more are jittered",
        default=1,
        min=1,
        soft_max=1024,
        max=1 << 20,
    )
    threads: IntProperty(
        name="Threads",
        description="Threads that build and trace; 0 uses all cores",
        default=0,
        min=0,
        max=1024,
        options=STATIC,
    )
    expected_rays: FloatProperty(
        name="Mrays Ahead",
        description="Rays the accelerator is built for, in millions; 0 expects the rays of one frame. "
        "With more rays to come, the hybrids spend more time on the build",
        default=0.0,
        min=0.0,
        soft_max=10_000.0,
        max=1.0e9,
        options=STATIC,
    )
    seed: IntProperty(
        name="Seed",
        description="Seed of the sample rays and of the jitter; the same seed gives the same image",
        default=0,
        min=0,
    )
    max_bounces: IntProperty(
        name="Max Bounces",
        description="Most mirror reflections a ray follows; 0 follows none",
        default=4,
        min=0,
        soft_max=32,
        max=1024,
    )
    cost_pass: BoolProperty(
        name="Cost Pass",
        description="Render the pass Cost: traversal steps of each pixel's primary rays, counted in a second run "
        "that no time in the results includes",
        default=True,
        options=STATIC,
    )
    overlay: PointerProperty(type=ESPALIER_PG_overlay, name="Overlay", description="What is drawn over the 3D viewport")


SCENE: Any = bpy.types.Scene
CLASSES = (ESPALIER_PG_overlay, ESPALIER_PG_settings)


def register() -> None:
    """Register the property groups and `scene.espalier`."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    SCENE.espalier = PointerProperty(type=ESPALIER_PG_settings, name="Espalier", description="Settings of Espalier")


def unregister() -> None:
    """Remove `scene.espalier` and unregister the property groups."""
    del SCENE.espalier
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
