"""The catalogue: every scene by name, with its purpose and how it is made. Importing it needs no bpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from . import city, cornell, forest, models, room, soups, sponza, stadium, studio
from .errors import SceneCatalogueError, UnknownSceneError
from .geometry import Mesh, box, placement
from .stage import Stage, Surface

if TYPE_CHECKING:
    import bpy

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Entry:
    """A named scene. `make(seed, progress)` gives its stage; progress runs over 0..1 while a model is downloaded."""

    name: str
    purpose: str
    make: Callable[[int, Progress], Stage]
    finish: Callable[[bpy.types.Scene], None] | None = None
    """Adds to the built scene what only Blender can make; such a scene has no `mesh`."""

    def stage(self, seed: int = 0, progress: Progress = lambda _: None) -> Stage:
        """The scene as data. Raises SceneCatalogueError where a model is missing or broken."""
        return self.make(seed, progress)

    def mesh(self, seed: int = 0) -> Mesh:
        """All triangles of the scene, instances written out. Raises SceneCatalogueError where it needs Blender."""
        if self.finish is not None:
            raise SceneCatalogueError(f"Scene '{self.name}' exists only in Blender: build it there")
        return self.stage(seed).mesh()

    def build(self, scene: bpy.types.Scene, seed: int = 0, progress: Progress = lambda _: None) -> None:
        """Add the scene's objects, lights, camera and world to a Blender scene. Raises as `stage`."""
        from . import blender

        blender.build(self.stage(seed, progress), scene)
        if self.finish is not None:
            self.finish(scene)


def names() -> list[str]:
    """Names of all scenes, the generated ones first."""
    return [entry.name for entry in ENTRIES]


def find(name: str) -> Entry:
    """The scene of that name. Raises UnknownSceneError, which lists the names."""
    entry = next((entry for entry in ENTRIES if entry.name == name), None)
    if entry is None:
        raise UnknownSceneError(name, names())
    return entry


def _generated(name: str, purpose: str, stage: Callable[[int], Stage]) -> Entry:
    return Entry(name, purpose, lambda seed, _: stage(seed))


def _model(model: models.Model) -> Entry:
    return Entry(
        model.name,
        model.purpose,
        lambda _, progress: studio.model_stage(models.load(model, progress), model.up, model.turn),
    )


def _suzanne_stage(seed: int) -> Stage:
    return studio.stage([], box((-1.15, -0.8, 0.0), (1.15, 0.8, 1.85))[0])


def _add_suzanne(scene: bpy.types.Scene) -> None:
    from . import blender

    blender.add_suzanne(scene, Surface("Monkey", (0.8, 0.36, 0.12), roughness=0.5), placement((0, 0, 0.86), 0.25, 0.87))


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "suzanne",
        "Modifiers: Blender's monkey under four levels of subdivision, beside a mirror",
        lambda seed, _: _suzanne_stage(seed),
        _add_suzanne,
    ),
    _generated("teapot_stadium", "Uneven detail: a small dense teapot in a huge stadium", stadium.stage),
    _generated("forest", "Instances: few meshes many times, thin overlapping leaves", forest.stage),
    _generated("city", "Axis-aligned walls, large and small triangles, much empty space", city.stage),
    _generated("triangle_soup", "Small triangles spread evenly: the best case of a uniform grid", soups.soup_stage),
    _generated("thin_triangles", "Long thin triangles that overlap: boxes fit them badly", soups.thin_stage),
    _generated("cornell_box", "Few large triangles and a mirror: the least a build can cost", cornell.stage),
    _generated("scan_room", "A closed room with a dense scan: every ray hits, most triangles in one place", room.stage),
    Entry(
        "sponza", "Architecture with textures: Crytek's Sponza, a wide range of sizes", lambda _seed, _: sponza.stage()
    ),
    *(_model(model) for model in models.MODELS),
)
