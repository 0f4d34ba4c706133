"""Makes the extension's zip from this checkout: `package.py dist/espalier-VERSION.zip`.

Blender wants the package flat beside its manifest, while here its parts have rooms of their own; so they are copied
together into dist/stage, and Blender's own tool, which the bpy wheel carries, validates and packs them.
"""

import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STAGE = ROOT / "dist" / "stage"
WHEELS = ROOT / "dist" / "wheels"
PLATFORMS = {
    r"manylinux.*_x86_64$": "linux-x64",
    r"manylinux.*_aarch64$": "linux-arm64",
    r"macosx.*_arm64$": "macos-arm64",
    r"macosx.*_x86_64$": "macos-x64",
    r"win_amd64$": "windows-x64",
    r"win_arm64$": "windows-arm64",
}
"""Blender's name of a platform, by the platform tag of a wheel."""


def platform_of(wheel: Path) -> str:
    """Blender's name of the platform that `wheel` was built for; SystemExit where Blender has none."""
    tag = wheel.stem.rsplit("-", 1)[-1]
    for pattern, platform in PLATFORMS.items():
        if re.search(pattern, tag):
            return platform
    sys.exit(f"package.py: {wheel.name}: Blender has no platform for the tag {tag}")


def manifest(wheels: list[Path]) -> str:
    """The manifest's text, with the platforms and wheels that are really there."""
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    platforms = ", ".join(f'"{platform_of(wheel)}"' for wheel in wheels)
    files = ", ".join(f'"./wheels/{wheel.name}"' for wheel in wheels)
    text = re.sub(r"(?m)^platforms = .*$", f"platforms = [{platforms}]", text)
    return re.sub(r"(?m)^wheels = .*$", f"wheels = [{files}]", text)


def stage() -> None:
    """Copy what the extension consists of into STAGE, as Blender wants it."""
    wheels = sorted(WHEELS.glob("*.whl"))
    if not wheels:
        sys.exit(f"package.py: no wheel in {WHEELS}: run `make package`")
    shutil.rmtree(STAGE, ignore_errors=True)
    compiled = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "addon", STAGE, ignore=compiled)
    shutil.copytree(ROOT / "scenes", STAGE / "scenes", ignore=compiled)
    shutil.copytree(WHEELS, STAGE / "wheels")
    shutil.copy(ROOT / "LICENSE", STAGE)
    (STAGE / "blender_manifest.toml").write_text(manifest(wheels), encoding="utf-8")


def blender_extension(*arguments: str) -> None:
    """Run Blender's own extension tool as a plain script, which needs no bpy; SystemExit where it refuses."""
    spec = find_spec("bpy")
    if spec is None or spec.origin is None:
        sys.exit("package.py: bpy, which carries Blender's extension tool, is not installed: run `make package`")
    (tool,) = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    status = subprocess.run([sys.executable, tool, *arguments]).returncode
    if status != 0:
        sys.exit(status)


def main() -> None:
    archive = Path(sys.argv[1]).resolve()
    for former in archive.parent.glob("espalier-*.zip"):
        former.unlink()
    stage()
    blender_extension("validate", str(STAGE))
    blender_extension("build", "--source-dir", str(STAGE), "--output-filepath", str(archive))
    blender_extension("validate", str(archive))


main()
