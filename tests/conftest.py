"""Lets every test import `espalier` and `espalier_scenes` from this checkout, wherever installed copies may be."""

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = {"espalier": ROOT / "addon", "espalier_scenes": ROOT / "scenes"}


def _load_package(name: str, folder: Path) -> None:
    """Import `folder` as the package `name`."""
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


for package, room in FOLDERS.items():
    if package not in sys.modules:
        _load_package(package, room)
