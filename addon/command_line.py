"""The command `espalier`: in a shell, and as `blender --command espalier`. It imports without bpy.

Exit status: 0 done, 1 where `study --check` found something slower, 2 for input, options or a folder that cannot be
used (one line on stderr says why), 130 for Ctrl C. Any other end is a bug, and shows its traceback.
"""

import argparse
import contextlib
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import catalogue, input_kinds, native
from .arguments import UsageError, count, resolution, some_of
from .images import write_png
from .methods import COMPARED_METHODS, METHOD_NAMES
from .outputs import OutputFolder
from .study import command as study_command
from .terminal import ProgressLine, heeding_ctrl_c, own_streams

USAGE_STATUS, INTERRUPTED_STATUS = 2, 130


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message[0].upper()}{message[1:]}: see '{self.prog} --help'")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and give its exit status. arguments None: the shell's."""
    try:
        options = _parser().parse_args(sys.argv[1:] if arguments is None else list(arguments))
        return int(options.run(options))
    except SystemExit as ended:  # argparse's way to end after --help, which must not end Blender
        return int(ended.code or 0)
    except KeyboardInterrupt:
        print("espalier: interrupted", file=sys.stderr)
        return INTERRUPTED_STATUS
    except _expected_errors() as error:
        print(f"espalier: {error}", file=sys.stderr)
        return USAGE_STATUS


def console() -> NoReturn:
    """The command as a shell starts it: `main`, and out of the process.

    A plain exit takes the bpy module apart, which can hang, and tells of memory it did not free.
    """
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    if "bpy" in sys.modules:
        shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
    os._exit(status)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="espalier", description="Trace a scene through BVH, uniform grid and hybrids of both.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)
    compare = commands.add_parser("compare", help="compare acceleration methods, and Cycles, on one frame")
    compare.set_defaults(run=_compare)
    compare.add_argument("input", metavar="INPUT", help="a .blend, a mesh (.ply .obj .stl .glb), or a scene's name")
    known = ",".join(METHOD_NAMES)
    methods = some_of("method", METHOD_NAMES)
    compare.add_argument("--methods", type=methods, default=COMPARED_METHODS, help=f"some of {known}")
    compare.add_argument("--resolution", type=resolution, metavar="WxH", help="a .blend's own, else 1000x1000")
    compare.add_argument("--samples", type=count(1, 1 << 20), default=1, metavar="N", help="rays a pixel (1)")
    compare.add_argument("--threads", type=count(0, 1024), default=0, metavar="N", help="0, the default: all cores")
    compare.add_argument("--cycles", action=argparse.BooleanOptionalAction, default=True, help="render with Cycles too")
    compare.add_argument("--frame", type=count(-1048574, 1048574), metavar="N", help="frame of a .blend")
    compare.add_argument("--out", type=Path, metavar="DIR", help="where pictures and report go (out/NAME)")
    study = commands.add_parser("study", help="measure methods over many scenes, and report it in one page")
    study.set_defaults(run=lambda options: study_command.run(options, _blender))
    study_command.add_arguments(study)
    scenes = commands.add_parser("scenes", help="list the scenes of the catalogue")
    scenes.set_defaults(run=_list_scenes)
    return parser


def _list_scenes(_options: argparse.Namespace) -> int:
    width = max(map(len, catalogue.names()))
    for entry in catalogue.module().ENTRIES:
        print(f"{entry.name.ljust(width)}  {entry.purpose}")
    return 0


def _compare(options: argparse.Namespace) -> int:
    input_kinds.check(options.input)
    folder = options.out or Path("out") / Path(options.input).stem
    with OutputFolder(folder) as outputs, own_streams() as (stdout, stderr), _blender():
        outcome, notes = _trace(options, ProgressLine(stdout, stderr))
        outputs.publish(_writers(outcome))
        stdout.write(f"\n{outcome.report.table()}")
        stdout.writelines(f"Note: {note}\n" for note in notes)
        stdout.write(f"\nPictures and report: {folder}\n")
    return 0


def _trace(options: argparse.Namespace, line: ProgressLine) -> tuple[Any, list[str]]:
    """The outcome of the comparison, and notes on what was added to the scene or left out of it."""
    from . import compare, inputs
    from .run import Options

    try:
        line.update(0.0, f"Open {options.input}")
        opened = inputs.open_input(
            options.input,
            options.frame,
            options.resolution,
            lambda progress: line.update(progress, f"Download {options.input}"),
        )
        settings = compare.Settings(
            methods=options.methods,
            options=Options(samples=options.samples, threads=options.threads),
            resolution=opened.resolution,
            cycles=options.cycles,
        )
        outcome = compare.run(opened.scene, settings, progress=line.update)
    finally:
        line.close()
    return outcome, [*opened.notes, *outcome.notes]


def _writers(outcome: Any) -> dict[str, Any]:
    """What writes each file, by its name."""
    pictures = {"espalier.png": outcome.espalier}
    if outcome.cycles is not None:
        pictures |= {
            "compare.png": outcome.picture,
            "cycles.png": outcome.cycles,
            "difference.png": outcome.difference,
        }
    writers = {name: lambda path, picture=picture: write_png(path, picture) for name, picture in pictures.items()}
    return writers | {"report.json": lambda path: path.write_text(outcome.report.json(), encoding="utf-8")}


@contextlib.contextmanager
def _blender() -> Iterator[None]:
    """Blender with the add-on registered, which the bpy module alone has not, and Ctrl C as Python knows it."""
    try:
        import bpy
    except ImportError as error:
        raise UsageError(
            f"Blender's Python module cannot be loaded ({error}): pip install bpy, or use blender --command espalier"
        ) from error
    from . import register as register_addon
    from . import unregister as unregister_addon

    registered_here = not hasattr(bpy.types.Scene, "espalier")
    if registered_here:
        register_addon()
    try:
        with heeding_ctrl_c():
            yield
    finally:
        if registered_here:
            unregister_addon()


def _expected_errors() -> tuple[type[Exception], ...]:
    """Errors whose message tells the user what to do: the add-on's, the core's and the catalogue's."""
    return (*native.expected_errors(), catalogue.module("errors").SceneCatalogueError)


_handle: Any = None


def register() -> None:
    """Offer `blender --command espalier`."""
    import bpy

    global _handle
    _handle = bpy.utils.register_cli_command("espalier", main)


def unregister() -> None:
    """Take the command away."""
    import bpy

    global _handle
    bpy.utils.unregister_cli_command(_handle)
    _handle = None
