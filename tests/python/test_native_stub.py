"""The stub that type checkers read tells the truth about the module, and help() tells people as much."""

import re
import subprocess
import sys
from pathlib import Path

import espalier_rt as rt
import numpy as np
import pytest
from rays_and_meshes import METHODS

COMPILED = "espalier_rt.espalier_rt"
"""The compiled file inside the package: all of it is named by the package, whose stub describes it."""


def test_the_stub_matches_the_module(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed"
    allowed.write_text(COMPILED)
    command = [sys.executable, "-m", "mypy.stubtest", "espalier_rt", "--allowlist", str(allowed)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_says_that_it_is_typed() -> None:
    assert rt.__file__ is not None
    assert (Path(rt.__file__).parent / "py.typed").is_file()


def test_everything_public_has_a_docstring() -> None:
    bare = [name for name in rt.__all__ if name not in ("MISS", "__version__") and not getattr(rt, name).__doc__]
    for kind in (rt.Job, rt.Mesh, rt.Hits, rt.Accelerator, rt.Cells, rt.Scene, rt.Camera, rt.Render):
        bare += [f"{kind.__name__}.{name}" for name in vars(kind) if name[0] != "_" and not vars(kind)[name].__doc__]
    assert bare == []


@pytest.mark.parametrize("method", METHODS)
def test_default_settings_build_what_no_settings_build(method: str) -> None:
    settings = rt.default_config(method)
    assert {"seed", "expected_rays", "leaf_size"} <= settings.keys()
    mesh = rt.Mesh(np.eye(3, dtype=np.float32), [[0, 1, 2]])
    given, left_out = rt.Accelerator.build(mesh, method, settings), rt.Accelerator.build(mesh, method)
    assert given.census()["bytes"] == left_out.census()["bytes"]
    assert given.method == method


@pytest.mark.parametrize(
    ("method", "config", "message"),
    [
        ("bvh", None, f"there is no method 'bvh'; choose one of: {re.escape(', '.join(rt.methods()))}"),
        ("grid", {"sah_bins": 8}, "grid has no setting 'sah_bins'; it has: seed"),
        ("grid", {1: 2}, "grid has no setting '1'"),
        ("grid", 7, "config must be a mapping"),
        ("grid", {"seed": -1}, "seed must be a whole number, 0 or more; got -1"),
        ("grid", {"seed": 1.5}, r"seed must be a whole number, 0 or more; got 1\.5"),
        ("grid", {"leaf_size": True}, "leaf_size must be a whole number"),
        ("grid", {"leaf_size": 9}, "leaf_size is 9; it must be from 1 to 8"),
        ("grid", {"grid_density": "dense"}, "grid_density must be a number; got 'dense'"),
        ("grid", {"grid_density": float("nan")}, "grid_density is NaN; it must be from"),
        ("hybrid-sampled", {"sample_least": 2**40}, "sample_least must be a whole number"),
    ],
)
def test_unusable_settings_say_what_is_wrong(method: str, config: object, message: str) -> None:
    mesh = rt.Mesh(np.eye(3, dtype=np.float32), [[0, 1, 2]])
    with pytest.raises(rt.ConfigError, match=message):
        rt.Accelerator.build(mesh, method, config)


@pytest.mark.parametrize("threads", [-1, 1025])
def test_a_number_of_threads_that_cannot_be_is_refused(threads: int) -> None:
    mesh = rt.Mesh(np.eye(3, dtype=np.float32), [[0, 1, 2]])
    message = f"threads is {threads}; it must be from 0"
    with pytest.raises(rt.ConfigError, match=message):
        rt.Accelerator.build(mesh, threads=threads)
    with pytest.raises(rt.ConfigError, match=message):
        rt.Accelerator.build(mesh).closest(np.zeros((1, 3)), np.ones((1, 3)), threads=threads)
