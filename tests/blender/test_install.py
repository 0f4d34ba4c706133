"""The zip, installed without a network: the extension is there, is whole, and goes without a trace."""

from pathlib import Path

from .blender import Blender

NATIVE = "import espalier_rt; print('native', espalier_rt.__file__, espalier_rt.methods())"


def test_native_module_is_the_wheel_of_the_zip(blender: Blender) -> None:
    printed = blender.run("--background", "--python-exit-code", "1", "--python-expr", NATIVE).stdout
    (line,) = [line for line in printed.splitlines() if line.startswith("native ")]
    assert Path(line.split()[1]).is_relative_to(blender.resources / "extensions")
    assert "hybrid-sampled" in line


def test_disable_and_enable_leave_nothing_behind(blender: Blender) -> None:
    assert "lifecycle ok" in blender.script("lifecycle.py")


def test_register_and_unregister_print_nothing_on_stderr(blender: Blender, tmp_path: Path) -> None:
    """Blender itself prints some lines there on every start; the extension adds none."""
    without = Blender(blender.command, tmp_path)
    quit_at_once = ("--background", "--python-expr", "import bpy; bpy.ops.wm.quit_blender()")
    assert _messages(blender.run(*quit_at_once).stderr) == _messages(without.run(*quit_at_once).stderr)


def _messages(stderr: str) -> list[str]:
    """Lines without the time that newer Blenders put before them."""
    return [line.split(" ", 1)[-1].strip() for line in stderr.splitlines()]
