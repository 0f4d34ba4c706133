"""`make bench-interfaces`: rays per second through what a Python or Blender user calls, and what the numpy call adds.

Closest hits of primary rays on one thread: espalier_rt over numpy arrays, embreex, mathutils.bvhtree.BVHTree and
scene.ray_cast, these two one ray at a call. What the numpy call adds is the difference between espalier_rt and
`native`, the harness's call of the same core in Rust. Writes out/interfaces.json.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import definitions
import espalier_rt
import harness
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

Array = NDArray[np.float32]
Trace = Callable[[Array, Array], Any]
"""Traces rays from (n, 3) origins along (n, 3) directions."""

SCENES = ("bunny2", "dragon")
METHOD = "bvh-sah"
ONE_BY_ONE = 20_000
"""Rays given to interfaces that take one at a call: every so many-th of the image."""


def main() -> None:
    """Measure every interface over every scene, print and write."""
    defined = definitions.load()
    names = os.environ.get("SCENES", "").split() or list(SCENES)
    binary = harness.build()
    harness.pin(1)
    rows = [row for scene in defined.choose_scenes(names) for row in measure(defined, scene, binary)]
    Path("out").mkdir(exist_ok=True)
    Path("out/interfaces.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")


def measure(defined: definitions.Definitions, scene: definitions.Scene, binary: Path) -> list[dict[str, Any]]:
    """A row for every interface, best of five rounds, in turns."""
    vertices, triangles = scene.mesh()
    origins, directions, native = _rays(defined, scene, binary)
    some = slice(None, None, max(1, len(origins) // ONE_BY_ONE))
    tracers: dict[str, tuple[Trace, slice]] = {
        "espalier_rt": (_espalier(vertices, triangles), slice(None)),
        "embreex": (_embreex(vertices, triangles), slice(None)),
        "BVHTree.ray_cast": (_tree(vertices, triangles), some),
        "scene.ray_cast": (_scene(vertices, triangles), some),
    }
    best = dict.fromkeys(tracers, float("inf"))
    for _ in range(5):
        for name, (trace, part) in tracers.items():
            start = time.process_time()
            trace(origins[part], directions[part])
            best[name] = min(best[name], time.process_time() - start)
    rates = {"native": native} | {name: len(origins[part]) / best[name] for name, (_, part) in tracers.items()}
    print(f"{scene.name}: " + ", ".join(f"{name} {rate / 1e6:.3f} Mrays/s" for name, rate in rates.items()), flush=True)
    return [{"scene": scene.name, "interface": name, "rays_per_second": rate} for name, rate in rates.items()]


def _rays(defined: definitions.Definitions, scene: definitions.Scene, binary: Path) -> tuple[Array, Array, float]:
    """(n, 3) origins and directions of the primary rays, and how many a second the harness traces from Rust."""
    directory = Path("out/bench")
    classes = [entry | {"methods": [METHOD]} for entry in defined.choose_classes(["primary"])]
    plan, file = defined.plan(scene, classes, directory), directory / f"{scene.name}.rays"
    (row,) = harness.run(binary, "rays", plan, directory / f"{scene.name}.json", "primary", file)
    rays = np.fromfile(file, "<f4").reshape(8, -1)
    return np.ascontiguousarray(rays[:3].T), np.ascontiguousarray(rays[3:6].T), row["rays_per_second"]


def _espalier(vertices: Array, triangles: NDArray[np.uint32]) -> Trace:
    mesh = espalier_rt.Mesh(vertices, triangles)
    accelerator = espalier_rt.Accelerator.build(mesh, METHOD)
    return lambda origins, directions: accelerator.closest(origins, directions, threads=1)


def _embreex(vertices: Array, triangles: NDArray[np.uint32]) -> Trace:
    scene = EmbreeScene()
    TriangleMesh(scene, vertices[triangles])
    return lambda origins, directions: scene.run(origins, directions, output=1)


def _tree(vertices: Array, triangles: NDArray[np.uint32]) -> Trace:
    tree = BVHTree.FromPolygons(vertices.tolist(), triangles.tolist(), all_triangles=True)

    def trace(origins: Array, directions: Array) -> None:
        for origin, direction in zip(origins, directions, strict=True):
            tree.ray_cast(Vector(origin), Vector(direction))

    return trace


def _scene(vertices: Array, triangles: NDArray[np.uint32]) -> Trace:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Bench")
    mesh.from_pydata(vertices.tolist(), [], triangles.tolist())
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("Bench", mesh))
    depsgraph = bpy.context.evaluated_depsgraph_get()

    def trace(origins: Array, directions: Array) -> None:
        for origin, direction in zip(origins, directions, strict=True):
            scene.ray_cast(depsgraph, Vector(origin), Vector(direction))

    return trace


if __name__ == "__main__":
    main()
