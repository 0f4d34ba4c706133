"""Lets every test import the package `espalier` from this checkout, wherever an installed copy may be."""

import importlib.util
import sys
from pathlib import Path

ADDON = Path(__file__).resolve().parent.parent / "addon"


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


if "espalier" not in sys.modules:
    _load_package("espalier", ADDON)
