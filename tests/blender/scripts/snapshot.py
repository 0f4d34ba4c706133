"""Everything of a scene that an operation must leave as it was, as plain values to compare."""

from typing import Any

import bpy

PARTS = (
    "render",
    "render.image_settings",
    "cycles",
    "view_settings",
    "display_settings",
    "sequencer_colorspace_settings",
)


def values(thing: Any) -> dict[str, Any]:
    """The writable plain properties of an RNA thing, by name."""
    found: dict[str, Any] = {}
    for prop in thing.bl_rna.properties:
        if prop.is_readonly or prop.type in {"POINTER", "COLLECTION"}:
            continue
        value = getattr(thing, prop.identifier)
        if getattr(prop, "is_array", False):
            value = list(value)
        found[prop.identifier] = sorted(value) if isinstance(value, set) else value
    return found


def take(scene: bpy.types.Scene) -> dict[str, Any]:
    """The scene's settings, selection, modes and data-block counts; images are left out, as a comparison adds one."""
    parts = {path: values(scene.path_resolve(path)) for path in PARTS if _has(scene, path)}
    objects = {
        thing.name: [thing.select_get(), thing.mode, thing.hide_render, thing.hide_get(), list(thing.location)]
        for thing in scene.objects
    }
    counts = {name: len(getattr(bpy.data, name)) for name in ("objects", "meshes", "materials", "scenes", "cameras")}
    active = bpy.context.view_layer.objects.active
    return {
        "scene": values(scene),
        "parts": parts,
        "objects": objects,
        "counts": counts,
        "active": active and active.name,
        "camera": scene.camera and scene.camera.name,
        "saved": [bpy.data.filepath, bpy.data.is_dirty],
    }


def _has(scene: bpy.types.Scene, path: str) -> bool:
    return hasattr(scene, path.split(".")[0])
