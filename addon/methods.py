"""The acceleration methods: their native names, labels and descriptions. No bpy."""

from collections.abc import Callable
from typing import NamedTuple


class Method(NamedTuple):
    """One way of building an accelerator. `name` is the native name, the same in properties, reports and commands."""

    name: str
    label: str
    description: str


METHODS: tuple[Method, ...] = (
    Method(
        "bvh-median",
        "BVH (Median Split)",
        "Bounding volume hierarchy split at the median triangle, the axis cycling through X, Y and Z",
    ),
    Method(
        "bvh-median+reinsert",
        "BVH (Median Split, Reinserted)",
        "BVH (Median Split) whose subtrees are then moved to where they make boxes smaller",
    ),
    Method(
        "bvh-sah", "BVH (SAH)", "Bounding volume hierarchy split where the surface area heuristic expects least work"
    ),
    Method(
        "bvh-sah+reinsert",
        "BVH (SAH, Reinserted)",
        "BVH (SAH) whose subtrees are then moved to where they make boxes smaller",
    ),
    Method(
        "sbvh",
        "BVH (Spatial Splits)",
        "Surface area heuristic that cuts triangles where boxes would overlap: slow to build, fast to trace",
    ),
    Method(
        "sbvh+reinsert",
        "BVH (Spatial Splits, Reinserted)",
        "BVH (Spatial Splits) whose subtrees are then moved to where they make boxes smaller",
    ),
    Method(
        "ploc",
        "BVH (Locally Ordered)",
        "Bounding volume hierarchy from the triangles up, nearest neighbours joined first",
    ),
    Method(
        "ploc+reinsert",
        "BVH (Locally Ordered, Reinserted)",
        "BVH (Locally Ordered) whose subtrees are then moved to where they make boxes smaller",
    ),
    Method(
        "bvh-clusters",
        "BVH (Clusters)",
        "Surface area heuristic over clusters of up to four triangles: half the time to build, nearly as good to trace",
    ),
    Method("lbvh", "Linear BVH", "Bounding volume hierarchy along a space-filling curve: the fastest to build"),
    Method("grid", "Uniform Grid", "One uniform grid of cells over the whole scene"),
    Method("grid-two-level", "Two-Level Grid", "A coarse grid whose cells are grids, as fine as their triangles ask"),
    Method("grid-irregular", "Irregular Grid", "A grid whose cells are merged where that is cheaper"),
    Method("grid-tetrahedral", "Tetrahedral Grid", "As many tetrahedra of equal volume as the uniform grid has cells"),
    Method(
        "hapala",
        "Tested Grid",
        "A uniform grid that is tested with sample rays, and replaced by a hierarchy where the rays to come pay for it",
    ),
    Method(
        "fellner",
        "Nested (Cost)",
        "Hierarchy whose nodes become grids, and their cells hierarchies or grids again, by ratios of surface areas",
    ),
    Method(
        "hybrid-sampled",
        "Hybrid (Sampled)",
        "Bounding volume hierarchy whose evenly filled nodes, found with sample rays, become uniform grids",
    ),
    Method(
        "hybrid-sequential",
        "Hybrid (Sequential)",
        "Hybrid (Sampled) with as many sample rays through each node as it takes to be certain of the verdict",
    ),
    Method(
        "hybrid",
        "Hybrid",
        "Lazy cells of a grid, a quick hierarchy, or one with grids where they pay, as the expected rays favour",
    ),
)

COMPARED_METHODS = ("bvh-median", "bvh-sah", "grid", "hybrid-sampled", "hybrid")
"""What is compared where nobody chooses: the paper's methods, and those that answer it."""

METHOD_NAMES: tuple[str, ...] = tuple(method.name for method in METHODS)
DEFAULT_METHOD = "hybrid"


HYBRIDS = ("hybrid", "hapala", "fellner")
GROUPS: dict[str, Callable[[str], bool]] = {
    "Hierarchies": lambda name: not name.startswith(("grid", *HYBRIDS)),
    "Grids": lambda name: name.startswith("grid"),
    "Hybrids": lambda name: name.startswith(HYBRIDS),
}
"""Which methods stand together in lists, by heading."""


def label(name: str) -> str:
    """The label of a method's native name; a name that is no method is its own label."""
    return next((method.label for method in METHODS if method.name == name), name)
