"""Settings and results of Espalier, kept on the scene as `scene.espalier`."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .methods import DEFAULT_METHOD, METHOD_NAMES, METHODS

METHOD_ITEMS = [(method.name, method.label, method.description, index) for index, method in enumerate(METHODS)]
METHOD_FLAGS = [(method.name, method.label, method.description, 1 << index) for index, method in enumerate(METHODS)]
STATIC: set[str] = set()
"""Property options of a setting that cannot be animated."""


class ESPALIER_PG_result(bpy.types.PropertyGroup):
    """One row of the results table. Counts are floats because Blender's integers end at 2^31."""

    method: StringProperty(name="Method", description="Native name of the acceleration method, or 'cycles'")
    build_ms: FloatProperty(name="Build", description="Time to build the accelerator, in milliseconds", min=0.0)
    trace_s: FloatProperty(name="Trace", description="Time to trace all rays of the frame, in seconds", min=0.0)
    mrays_per_s: FloatProperty(name="Mrays/s", description="Million rays traced per second", min=0.0)
    bytes: FloatProperty(name="Memory", description="Memory of the accelerator, in bytes", min=0.0)
    nodes: FloatProperty(name="Nodes", description="Number of branches and leaves of the tree", min=0.0)
    grids: FloatProperty(name="Grids", description="Number of uniform grids in the tree", min=0.0)
    cells: FloatProperty(name="Cells", description="Number of grid cells, empty ones included", min=0.0)


class ESPALIER_PG_settings(bpy.types.PropertyGroup):
    """How Espalier traces this scene, what its overlay draws, and the results of the last run."""

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
        default=set(METHOD_NAMES),
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
        name="Expected Rays",
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
    overlay_show: BoolProperty(
        name="Show Cells",
        description="Draw the boxes of the accelerator last built over the 3D viewport",
        default=False,
        options=STATIC,
    )
    overlay_branches: BoolProperty(
        name="Branches", description="Draw the boxes of inner nodes", default=False, options=STATIC
    )
    overlay_leaves: BoolProperty(
        name="Leaves", description="Draw the boxes of nodes that hold triangles", default=True, options=STATIC
    )
    overlay_grids: BoolProperty(
        name="Grids", description="Draw the outer boxes of uniform grids", default=True, options=STATIC
    )
    overlay_cells: BoolProperty(
        name="Grid Cells", description="Draw the cells of uniform grids", default=True, options=STATIC
    )
    overlay_depth_min: IntProperty(
        name="Depth Min",
        description="Least depth in the tree of boxes to draw; the root has depth 0",
        default=0,
        min=0,
        max=65535,
        soft_max=64,
        options=STATIC,
    )
    overlay_depth_max: IntProperty(
        name="Depth Max",
        description="Greatest depth in the tree of boxes to draw; the root has depth 0",
        default=64,
        min=0,
        max=65535,
        soft_max=64,
        options=STATIC,
    )
    overlay_occupied_only: BoolProperty(
        name="Occupied Only", description="Leave out boxes that hold no triangle", default=True, options=STATIC
    )
    overlay_opacity: FloatProperty(
        name="Opacity",
        description="Opacity of the boxes",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=STATIC,
    )
    overlay_max_boxes: IntProperty(
        name="Max Boxes",
        description="Most boxes to draw; beyond it the deepest are left out",
        default=100_000,
        min=1,
        soft_max=1_000_000,
        max=10_000_000,
        options=STATIC,
    )
    results: CollectionProperty(
        type=ESPALIER_PG_result, name="Results", description="One row for each method of the last run"
    )
    results_index: IntProperty(
        name="Result", description="Selected row of the results table", default=0, min=0, options=STATIC
    )


CLASSES = (ESPALIER_PG_result, ESPALIER_PG_settings)


def register() -> None:
    """Register the property groups and `scene.espalier`."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.espalier = PointerProperty(
        type=ESPALIER_PG_settings, name="Espalier", description="Settings and results of Espalier"
    )


def unregister() -> None:
    """Remove `scene.espalier` and unregister the property groups."""
    del bpy.types.Scene.espalier
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
