"""The benchmarks' definitions and expected answers, and the plans that the native harness reads."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import espalier_scenes
from espalier_scenes.models import folder
from espalier_scenes.ply import read_ply
from espalier_scenes.soups import triangle_soup

FILE = Path(__file__).with_name("definitions.toml")
HITS = Path(__file__).with_name("hits.json")

BLOCKS = 8
"""Blocks of a soup's cube along each axis."""

Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]


class DefinitionError(Exception):
    """A scene, class or value that the benchmarks do not know."""


@dataclass(frozen=True)
class Scene:
    """A scene: a model's file or an entry of the catalogue, its camera, and the hits expected of each class."""

    name: str
    camera: dict[str, Any]
    catalogue: str | None = None
    path: Path | None = None
    hits: dict[str, int] = field(default_factory=dict)

    def mesh(self) -> Mesh:
        """(n, 3) vertices and (m, 3) triangles. Raises SceneCatalogueError or OSError where they cannot be had."""
        return espalier_scenes.find(self.catalogue).mesh() if self.catalogue else read_ply(self.path)

    def write(self, directory: Path) -> dict[str, Any]:
        """Write the arrays as raw numbers, and return the plan's part that says where they are."""
        vertices, triangles = self.mesh()
        directory.mkdir(parents=True, exist_ok=True)
        files = {"vertices": directory / f"{self.name}.vertices", "triangles": directory / f"{self.name}.triangles"}
        np.ascontiguousarray(vertices, "<f4").tofile(files["vertices"])
        np.ascontiguousarray(triangles, "<u4").tofile(files["triangles"])
        return {"name": self.name, "camera": self.camera} | {kind: str(path) for kind, path in files.items()}


@dataclass(frozen=True)
class Soup(Scene):
    """A scene of single triangles: `filled` is the share of the cube's blocks that hold some."""

    triangles: int = 0
    edge: float = 0.0
    filled: float = 1.0

    def mesh(self) -> Mesh:
        """(3n, 3) vertices and (n, 3) triangles, spread over the cube -1..1."""
        vertices, triangles = triangle_soup(count=self.triangles, size=self.edge)
        blocks = np.arange(BLOCKS**3)
        random = np.random.default_rng(1)
        filled = random.choice(blocks, round(self.filled * len(blocks)), replace=False)
        if len(filled) == len(blocks):
            return vertices, triangles
        offsets = vertices.reshape(-1, 3, 3) - vertices.reshape(-1, 3, 3).mean(axis=1, keepdims=True)
        corner = np.stack(np.unravel_index(random.choice(filled, self.triangles), (BLOCKS,) * 3), axis=-1)
        centers = 2 * (corner + random.uniform(size=(self.triangles, 3))) / BLOCKS - 1
        return (centers[:, None] + offsets).reshape(-1, 3).astype(np.float32), triangles


@dataclass(frozen=True)
class Definitions:
    """All of definitions.toml; `scenes` in the order in which they are listed there."""

    resolution: int
    seed: int
    rounds: int
    seconds: float
    camera: dict[str, Any]
    classes: dict[str, dict[str, Any]]
    scenes: dict[str, Scene]
    instructions: dict[str, Any]
    grids: dict[str, Any]
    paper: dict[str, Any]
    soups: dict[str, Soup]

    def choose_classes(self, names: Iterable[str]) -> list[dict[str, Any]]:
        """The plan's classes: those named, or all. Raises DefinitionError."""
        names = list(names) or list(self.classes)
        _check("class", names, self.classes)
        return [{"name": name} | {k: v for k, v in self.classes[name].items() if k != "figure"} for name in names]

    def choose_scenes(self, names: Iterable[str], models: Path | None = None) -> list[Scene]:
        """The scenes named, or all; with `models`, every .ply in that folder is one. Raises DefinitionError."""
        known = self.scenes
        if models is not None:
            paths = sorted(models.glob("*.ply"))
            if not paths:
                raise DefinitionError(f"there is no .ply in '{models}'")
            known = {path.stem: self._model(path) for path in paths}
        names = list(names) or list(known)
        _check("scene", names, known)
        return [known[name] for name in names]

    def _model(self, path: Path) -> Scene:
        """A file, looked at as the scene of its name is, and checked against its hits where it is that scene's own."""
        if path.stem not in self.scenes:
            return Scene(path.stem, self.camera, path=path)
        scene = self.scenes[path.stem]
        return Scene(path.stem, scene.camera, path=path, hits=scene.hits if scene.path == path.resolve() else {})

    def plan(self, scene: Scene, classes: list[dict[str, Any]], directory: Path, **settings: Any) -> dict[str, Any]:
        """The plan for one scene, whose arrays are written to `directory`; `settings` go before what is defined."""
        common = {"resolution": self.resolution, "rounds": self.rounds, "seconds": self.seconds}
        common |= {"library": None, "isa": None, "threads": 1} | settings
        return common | {"scene": scene.write(directory) | {"seed": self.seed}, "classes": classes}


def load() -> Definitions:
    """Read the definitions and the answers."""
    table = tomllib.loads(FILE.read_text(encoding="utf-8"))
    answers = json.loads(HITS.read_text(encoding="utf-8")) if HITS.exists() else {}
    models = folder()
    for name, entry in table["scenes"].items():
        camera = table["camera"] | entry.pop("camera", {})
        path = None if "catalogue" in entry else (models / f"{name}.ply").resolve()
        table["scenes"][name] = Scene(name, camera, path=path, hits=answers.get(name, {}), **entry)
    table["soups"] = {name: Soup(name, table["camera"], **entry) for name, entry in table["soups"].items()}
    return Definitions(**table)


def _check(kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    known = list(known)
    for name in names:
        if name not in known:
            raise DefinitionError(f"there is no {kind} '{name}'; choose from: {' '.join(known)}")
