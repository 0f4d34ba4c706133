"""Walks what renders in a view layer, and gathers meshes with their instances, and lights."""

from collections.abc import Mapping, Sequence
from typing import Any

import bpy
from mathutils import Matrix

from ..scene_data import LightData
from .flatten import Placement
from .lights import read_light
from .materials import Materials
from .meshes import LocalMesh, read_mesh
from .notes import Notes

UNSUPPORTED = {
    "CURVES": "hair curves",
    "POINTCLOUD": "a point cloud",
    "VOLUME": "a volume",
    "GPENCIL": "a Grease Pencil drawing",
    "GREASEPENCIL": "a Grease Pencil drawing",
}


class Objects:
    """Meshes, each read once with all its instances, and lights of a render depsgraph."""

    def __init__(
        self, depsgraph: bpy.types.Depsgraph, materials: Materials, notes: Notes, moved: Mapping[int, Matrix]
    ) -> None:
        self.lights: list[LightData] = []
        self._materials = materials
        self._notes = notes
        self._moved = moved
        self._override: Any = depsgraph.view_layer.material_override
        self._placements: dict[int, Placement | None] = {}
        self._known: dict[tuple[int, int], tuple[Placement | None, tuple[int, ...]]] = {}
        for instance in depsgraph.object_instances:
            if instance.show_self:
                self._visit(instance)

    @property
    def placements(self) -> list[Placement]:
        """One for each mesh that has faces, in the order of the depsgraph."""
        return [placement for placement in self._placements.values() if placement is not None]

    def _visit(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Curves, text, surfaces and metaballs come twice, as themselves and as a mesh: only the mesh is taken."""
        thing: Any = instance.object
        kind = thing.type
        if kind == "MESH":
            self._mesh(thing, instance)
        elif kind == "LIGHT":
            self.lights.append(read_light(thing.data, self._matrix(instance), thing.name, self._notes))
        elif kind in UNSUPPORTED:
            self._notes.add(f"Object '{thing.name}' is {UNSUPPORTED[kind]} and is left out")

    def _mesh(self, thing: Any, instance: Any) -> None:
        """Add an instance of a mesh. An object is known by its original, as instances have passing objects."""
        mesh = thing.data
        key = (mesh.as_pointer(), thing.original.as_pointer())
        known = self._known.get(key)
        if known is None:
            slots = self._slots(thing)
            known = self._known[key] = (self._placement(thing, mesh, slots), slots)
        placement, slots = known
        if placement is not None:
            placement.add(self._matrix(instance), slots)

    def _placement(self, thing: Any, mesh: Any, slots: tuple[int, ...]) -> Placement | None:
        """The mesh, read the first time it comes up; None where it has no face."""
        key = mesh.as_pointer()
        if key not in self._placements:
            uv_maps = [self._materials.uv_maps.get(index, "") for index in slots]
            local = _read_edited(thing, uv_maps) if mesh.is_editmode else read_mesh(mesh, uv_maps)
            self._placements[key] = None if local is None else Placement(local)
        return self._placements[key]

    def _matrix(self, instance: Any) -> Matrix:
        """Local to world; the iterator reuses its own matrix, so this is a copy."""
        if not self._moved or (instance.is_instance and instance.parent != instance.object):
            return instance.matrix_world.copy()
        return self._moved.get(instance.object.original.as_pointer(), instance.matrix_world).copy()

    def _slots(self, thing: Any) -> tuple[int, ...]:
        """Material of every slot of an object, at least one."""
        self._note_ignored(thing)
        materials = [self._override or slot.material for slot in thing.material_slots] or [self._override]
        return tuple(self._materials.index(material) for material in materials)

    def _note_ignored(self, thing: Any) -> None:
        """Note what an object asks for and a trace does not do."""
        if thing.is_holdout or thing.is_shadow_catcher:
            self._notes.add(f"Object '{thing.name}': holdout and shadow catcher are ignored; it is traced as it is")
        visibility = (thing.visible_camera, thing.visible_diffuse, thing.visible_glossy, thing.visible_shadow)
        if not all(visibility):
            self._notes.add(f"Object '{thing.name}': ray visibility is ignored; every ray sees it")
        if any(
            system.settings.type == "HAIR" and system.settings.render_type == "PATH"
            for system in thing.particle_systems
        ):
            self._notes.add(f"Object '{thing.name}': hair particles are left out")


def _read_edited(thing: Any, uv_maps: Sequence[str]) -> LocalMesh | None:
    """The mesh of an object in edit mode, whose arrays are empty until Blender converts its edits."""
    try:
        return read_mesh(thing.to_mesh(), uv_maps)
    finally:
        thing.to_mesh_clear()


def note_collections(view_layer: bpy.types.ViewLayer, notes: Notes) -> None:
    """Note collections of a view layer that are holdouts or indirect only, which a trace shows as they are."""
    waiting = [view_layer.layer_collection]
    while waiting:
        layer = waiting.pop()
        waiting.extend(layer.children)
        if not layer.exclude and (layer.holdout or layer.indirect_only):
            notes.add(f"Collection '{layer.name}': holdout and indirect only are ignored; it is traced as it is")
