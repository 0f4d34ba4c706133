"""Write hits.json anew: how many rays of each class hit, by our reference method, over every defined scene.

Run it after a scene, a camera or the rays have changed on purpose; `make bench` holds every method to it, and compares
every ray with Embree besides.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import definitions
import harness

REFERENCE = "bvh-sah"


def main(names: list[str]) -> None:
    """Count the hits of the named scenes, or of all, and keep the rest of the file."""
    defined = definitions.load()
    traced = [name for name, entry in defined.classes.items() if entry["kind"] in {"batch", "single"}]
    classes = [entry | {"methods": [REFERENCE]} for entry in defined.choose_classes(traced)]
    answers = json.loads(definitions.HITS.read_text(encoding="utf-8")) if definitions.HITS.exists() else {}
    binary, directory = harness.build(), Path("out/bench")
    for scene in defined.choose_scenes(names):
        rows = harness.run(binary, "hits", defined.plan(scene, classes, directory), directory / f"{scene.name}.json")
        answers[scene.name] = {row["class"]: row["hits"] for row in rows}
        print(scene.name, answers[scene.name], flush=True)
    ordered = {name: answers[name] for name in defined.scenes if name in answers}
    definitions.HITS.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
