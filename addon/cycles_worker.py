"""The script of the second Blender (see `cycles`): renders a copy of the scene with Cycles and develops pictures.

It stands alone, as Blender runs it: `blender --python cycles_worker.py -- JOB.json`, or with the bpy module
`python -P cycles_worker.py -- JOB.json`. The job names the copy and a folder. Where it asks to render, the folder gets
`cycles.npy` (h, w, 4) float32 scene-linear, and `timing.json`; and for each NAME in `develop` it gets the array
`NAME.npy` as the scene's view transform shows it, as `NAME.display.npy` (h, w, 3) uint8.
"""

import contextlib
import json
import os
import re
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import Any

import bpy
import numpy as np

PROGRESS = "espalier-progress"
"""Begins the lines that tell progress: this word, 0..1, and what is going on."""


def main(job_path: str) -> None:
    """Do the job, as described above."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    job = json.loads(Path(job_path).read_text(encoding="utf-8"))
    folder = Path(job["folder"])
    _tell(0.0, "load")
    bpy.ops.wm.open_mainfile(filepath=job["blend"], load_ui=False, use_scripts=job["use_scripts"])
    scene = bpy.data.scenes[job["scene"]]
    if job["render"]:
        configure(scene, job)
        timing = render(scene, folder / "cycles.exr")
        np.save(folder / "cycles.npy", _pixels(folder / "cycles.exr", scene_linear=True))
        (folder / "timing.json").write_text(json.dumps(timing), encoding="utf-8")
    for name in job["develop"]:
        _tell(1.0, "develop")
        develop(scene, folder, name)


def configure(scene: "bpy.types.Scene", job: dict[str, Any]) -> None:
    """Cycles on the CPU, exactly as many samples, nothing after the tracer: no denoiser, compositor or strips."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = job["resolution"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", job["threads"]
    for name in ("use_border", "use_multiview", "use_compositing", "use_sequencer", "use_persistent_data", "use_stamp"):
        setattr(render, name, False)
    render.use_single_layer = render.film_transparent = render.use_freestyle = False
    for layer in scene.view_layers:
        layer.use = layer.name == job["view_layer"]
    cycles.device, cycles.samples, cycles.time_limit = "CPU", job["samples"], 0.0
    for name in ("use_denoising", "use_adaptive_sampling", "use_sample_subset"):
        if hasattr(cycles, name):
            setattr(cycles, name, False)
    cycles.use_layer_samples = "IGNORE"


def render(scene: "bpy.types.Scene", path: Path) -> dict[str, float]:
    """Render to a 32-bit OpenEXR and give seconds of synchronisation (with the build of the BVH) and of rendering.

    The clock starts when Cycles begins to synchronise: evaluating the scene before is Blender's work, and no part of
    an export either. Samples begin when the scene is on the device.
    """
    started = time.perf_counter()
    events: dict[str, float] = {}

    def on_stats(text: object, *_rest: object) -> None:
        now = time.perf_counter()
        events.setdefault("sync", now)
        sample = re.search(r"Sample (\d+)/(\d+)", str(text))
        building = re.search(r"Building BVH (\d+)%", str(text))
        if sample:
            events.setdefault("sample", now)
            _tell(0.3 + 0.7 * int(sample[1]) / max(int(sample[2]), 1), f"sample {sample[1]} of {sample[2]}")
        elif building:
            _tell(0.1 + 0.2 * int(building[1]) / 100, "build BVH")
        elif "Finished" in str(text):
            events["finished"] = now
        elif "sample" not in events:
            _tell(0.05, "synchronise")

    _save_as(scene, "OPEN_EXR", "RGBA", "32")
    scene.render.image_settings.exr_codec = "NONE"
    scene.render.filepath, scene.render.use_file_extension = str(path), False
    bpy.app.handlers.render_stats.append(on_stats)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    finished = events.get("finished", time.perf_counter())
    sync = events.get("sync", started)
    sample = events.get("sample", finished)
    return {"sync_s": sample - sync, "render_s": finished - sample, "total_s": finished - sync}


def develop(scene: "bpy.types.Scene", folder: Path, name: str) -> None:
    """Bring `NAME.npy`, (h, w, 4) scene-linear, through the scene's view transform as Blender saves a render."""
    pixels = np.load(folder / f"{name}.npy")
    pixels[..., 3] = 1.0
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).reshape(-1))
    _save_as(scene, "PNG", "RGB", "8")
    scene.render.dither_intensity = 0.0
    path = folder / f"{name}.png"
    image.save_render(str(path), scene=scene)
    shown = _pixels(path, scene_linear=False)[..., :3]
    np.save(folder / f"{name}.display.npy", (shown * 255.0).round().astype(np.uint8))


def _save_as(scene: "bpy.types.Scene", file_format: str, mode: str, depth: str) -> None:
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0 and later
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = file_format, mode, depth
    settings.color_management = "FOLLOW_SCENE"


def _pixels(path: Path, *, scene_linear: bool) -> "np.ndarray[Any, Any]":
    """(h, w, 4) float32 of an image file: scene-linear, or the numbers in the file over 255."""
    image = bpy.data.images.load(str(path))
    if not scene_linear:
        image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)


def _tell(progress: float, what: str) -> None:
    print(PROGRESS, f"{progress:.3f}", what, flush=True)


def _end_with_parent() -> None:
    """The parent holds the other end of stdin: when it is gone, nobody waits for this render."""
    while os.read(0, 1024):
        pass
    os._exit(1)


if __name__ == "__main__":
    status = 1
    try:
        main(sys.argv[sys.argv.index("--") + 1])
        status = 0
    except BaseException:  # noqa: BLE001 - shown, and told by the status
        with contextlib.suppress(OSError):  # nobody reads it where the parent is gone
            traceback.print_exc()
            sys.stderr.flush()
    finally:
        os._exit(status)  # a plain exit takes bpy apart, which can hang, and waits for the thread that reads stdin
