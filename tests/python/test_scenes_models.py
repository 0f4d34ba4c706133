"""Models: read, written, found in a folder, or downloaded whole and checked, or not kept at all."""

import gzip
import threading
from collections.abc import Iterator
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from espalier_scenes import catalogue, models
from espalier_scenes.errors import (
    BrokenModelError,
    ChecksumError,
    DownloadError,
    ModelMissingError,
    UnknownSceneError,
)
from espalier_scenes.geometry import icosphere, mesh
from espalier_scenes.ply import read_ply, read_ply_data, write_ply

SPHERE = icosphere(2)
ASCII = b"""ply
format ascii 1.0
comment with what scanners add
element vertex 4
property float x
property float y
property float z
property float confidence
element face 2
property list uchar int vertex_index
end_header
0 0 0 1
1 0 0 1
1 1 0.25 1
0 1 0 1
3 0 1 2
3 0 2 3
"""


class Archive:
    """A server on this machine that answers each path with bytes, at `cut` ending early."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.cut: int | None = None
        self.requests = 0
        archive = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                archive.requests += 1
                body = archive.files.get(self.path)
                if body is None:
                    self.send_error(404, "Not Found")
                    return
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body[: archive.cut])

            def log_message(self, *_: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()


@pytest.fixture
def archive() -> Iterator[Archive]:
    served = Archive()
    yield served
    served.server.shutdown()
    served.server.server_close()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of models and an empty cache; the path is the cache's."""
    monkeypatch.setenv("ESPALIER_MODELS", str(tmp_path / "models"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    return models.cache_folder()


def model(url: str | None) -> models.Model:
    return models.Model("ball", "A sphere", len(SPHERE[1]), models.digest(SPHERE), url)


def packed_sphere(folder: Path) -> bytes:
    write_ply(folder / "ball.ply", SPHERE)
    return gzip.compress((folder / "ball.ply").read_bytes())


def test_ply_survives_writing_and_reading(tmp_path: Path) -> None:
    write_ply(tmp_path / "ball.ply", SPHERE, ("a comment",))
    vertices, triangles = read_ply(tmp_path / "ball.ply")
    assert np.array_equal(vertices, SPHERE[0])
    assert np.array_equal(triangles, SPHERE[1])


def test_ascii_and_big_endian_ply_read_alike(tmp_path: Path) -> None:
    (tmp_path / "text.ply").write_bytes(ASCII)
    header = ASCII[: ASCII.index(b"end_header\n") + 11].replace(b"ascii", b"binary_big_endian")
    rows = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [1, 1, 0.25, 1], [0, 1, 0, 1]], ">f4").tobytes()
    faces = b"".join(b"\x03" + np.array(face, ">i4").tobytes() for face in ([0, 1, 2], [0, 2, 3]))
    (tmp_path / "big.ply").write_bytes(header + rows + faces)
    for name in ("text.ply", "big.ply"):
        vertices, triangles = read_ply(tmp_path / name)
        assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0.25], [0, 1, 0]]
        assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_other_columns_are_read_too(tmp_path: Path) -> None:
    text = ASCII.replace(b"vertex_index\n", b"vertex_index\nproperty uchar material\n")
    text = text.replace(b"3 0 1 2", b"3 0 1 2 7").replace(b"3 0 2 3", b"3 0 2 3 8")
    (tmp_path / "text.ply").write_bytes(text)
    header = text[: text.index(b"end_header\n") + 11].replace(b"ascii", b"binary_little_endian")
    rows = np.array([[0, 0, 0, 4], [1, 0, 0, 3], [1, 1, 0.25, 2], [0, 1, 0, 1]], "<f4").tobytes()
    faces = b"".join(
        b"\x03" + np.array(face, "<i4").tobytes() + bytes([material])
        for face, material in (((0, 1, 2), 7), ((0, 2, 3), 8))
    )
    (tmp_path / "binary.ply").write_bytes(header + rows + faces)
    for name, confidence in (("text.ply", [1, 1, 1, 1]), ("binary.ply", [4, 3, 2, 1])):
        data = read_ply_data(tmp_path / name)
        assert data.vertex["confidence"].tolist() == confidence
        assert data.face["material"].tolist() == [7, 8]
        assert data.corners.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty", b""),
        ("html", b"<html>not found</html>"),
        ("endless header", b"ply\n" + b"comment x\n" * 20_000),
        ("cut short", ASCII[:-20]),
        ("quads", ASCII.replace(b"3 0 1 2", b"4 0 1 2 3")),
        ("index beyond the vertices", ASCII.replace(b"3 0 2 3", b"3 0 2 9")),
        ("negative index", ASCII.replace(b"3 0 2 3", b"3 0 2 -1")),
        ("words for numbers", ASCII.replace(b"0.25", b"high")),
        ("no format", ASCII.replace(b"format ascii 1.0\n", b"")),
        ("binary, cut short", ASCII.replace(b"ascii", b"binary_little_endian")),
    ],
)
def test_broken_ply_is_named(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / f"{name}.ply"
    path.write_bytes(content)
    with pytest.raises(BrokenModelError, match=r"\.ply cannot be read"):
        read_ply(path)


def test_a_model_in_the_folder_is_not_downloaded(cache: Path, archive: Archive, tmp_path: Path) -> None:
    models.folder().mkdir()
    write_ply(models.folder() / "ball.ply", SPHERE)
    assert models.locate(model(f"{archive.url}/ball.ply.gz")) == models.folder() / "ball.ply"
    assert archive.requests == 0


def test_a_download_is_converted_checked_and_kept(cache: Path, archive: Archive, tmp_path: Path) -> None:
    archive.files["/ball.ply.gz"] = packed_sphere(tmp_path)
    told: list[float] = []
    found = models.load(model(f"{archive.url}/ball.ply.gz"), told.append)
    assert models.digest(found) == models.digest(SPHERE)
    assert told[-1] == 1.0
    assert [path.name for path in cache.iterdir()] == ["ball.ply"]
    models.load(model(f"{archive.url}/ball.ply.gz"))
    assert archive.requests == 1


@pytest.mark.parametrize("name", ["other.ply", "page.ply", "page.ply.gz"])
def test_a_wrong_download_is_named_and_not_kept(cache: Path, archive: Archive, tmp_path: Path, name: str) -> None:
    write_ply(tmp_path / "other.ply", mesh(SPHERE[0] * 2, SPHERE[1]))
    archive.files["/other.ply"] = (tmp_path / "other.ply").read_bytes()
    archive.files["/page.ply"] = archive.files["/page.ply.gz"] = b"<html>moved</html>"
    with pytest.raises(ChecksumError, match="does not give the model expected"):
        models.locate(model(f"{archive.url}/{name}"))
    assert not cache.exists()


def test_a_download_that_ends_early_is_named_and_not_kept(cache: Path, archive: Archive, tmp_path: Path) -> None:
    archive.files["/ball.ply.gz"] = packed_sphere(tmp_path)
    archive.cut = 100
    with pytest.raises(DownloadError, match="ended after 100 of"):
        models.locate(model(f"{archive.url}/ball.ply.gz"))
    assert not cache.exists()


def test_without_the_file_or_the_network_the_error_says_what_to_do(cache: Path, archive: Archive) -> None:
    with pytest.raises(DownloadError, match=r"Not Found.*ESPALIER_MODELS"):
        models.locate(model(f"{archive.url}/nothing.ply"))
    archive.server.shutdown()
    archive.server.server_close()
    with pytest.raises(DownloadError, match=r"cannot be downloaded.*ESPALIER_MODELS"):
        models.locate(model(f"{archive.url}/ball.ply"))


def test_a_model_of_no_archive_names_the_folder(cache: Path) -> None:
    with pytest.raises(ModelMissingError, match=r"ESPALIER_MODELS to a folder with ball\.ply"):
        models.locate(replace(model(None), url=None))


def test_sponza_is_named_where_it_is_missing(cache: Path) -> None:
    with pytest.raises(ModelMissingError, match="sponza_crytek"):
        catalogue.find("sponza").stage()


def test_the_catalogue_names_the_papers_models_and_knows_no_other() -> None:
    paper = {"bunny1", "bunny2", "horse1_sub", "horse2", "goldfish1_sub", "goldfish2_sub", "dragon"}
    assert paper <= set(catalogue.names())
    assert len(set(catalogue.names())) == len(catalogue.names())
    with pytest.raises(UnknownSceneError, match="No scene is named 'bunny': choose one of suzanne, "):
        catalogue.find("bunny")


FILES = sorted(models.folder().glob("*.ply"))


@pytest.mark.skipif(not FILES, reason="no folder of models: set ESPALIER_MODELS")
@pytest.mark.parametrize("known", models.MODELS, ids=lambda known: known.name)
def test_the_models_in_the_folder_are_the_pinned_ones(known: models.Model) -> None:
    path = models.folder() / f"{known.name}.ply"
    if path not in FILES:
        pytest.skip(f"{known.name} is not in the folder")
    found = read_ply(path)
    assert len(found[1]) == known.triangles
    assert models.digest(found) == known.sha256
