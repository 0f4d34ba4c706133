"""`make bench-instructions`: count the instructions of small fixed cases with valgrind's callgrind, against the record.

A count is that of one repetition: two runs that differ by one repetition are subtracted, so that reading, building and
making rays cancel. valgrind knows no AVX-512, so what runs is the AVX2 path. RECORD=1 writes the record anew.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import definitions
import harness
import record

FILE = record.FOLDER / "instructions.json"
OUT = Path("out/bench")


def main() -> int:
    """Count, print, compare or record; 1 where a case has become worse or valgrind is missing."""
    if shutil.which("valgrind") is None:
        print("bench: counting instructions needs valgrind: install it with the system's packages", file=sys.stderr)
        return 1
    defined = definitions.load()
    counts = count(defined)
    if os.environ.get("RECORD") == "1":
        record.FOLDER.mkdir(exist_ok=True)
        about = record.header(argparse.Namespace(isa="avx2", threads=1))
        FILE.write_text(json.dumps({"about": about, "counts": counts}, indent=1) + "\n", encoding="utf-8")
    known = json.loads(FILE.read_text(encoding="utf-8"))["counts"] if FILE.exists() else {}
    worse = False
    for case, value in counts.items():
        before = known.get(case)
        change = value / before - 1 if before else 0.0
        worse |= change > defined.instructions["tolerance"]
        print(f"{case:<28} {value:>14,} instructions  " + (f"{change:+.2%}" if before else "not recorded yet"))
    return int(worse)


def count(defined: definitions.Definitions) -> dict[str, int]:
    """Instructions of one repetition of every case and method."""
    chosen = defined.instructions
    classes = defined.choose_classes(chosen["cases"])
    scene = defined.choose_scenes([chosen["scene"]])[0]
    plan = defined.plan(scene, classes, OUT, resolution=chosen["resolution"])
    file, binary = OUT / "instructions.json", harness.build()
    file.write_text(json.dumps(plan), encoding="utf-8")
    cases = [(entry["name"], method) for entry in classes for method in entry["methods"]]
    return {" ".join(case): _run(binary, file, *case, 2) - _run(binary, file, *case, 1) for case in cases}


def _run(binary: Path, file: Path, name: str, method: str, repeats: int) -> int:
    """All instructions of a run."""
    profile = OUT / "callgrind.out"
    tool = ["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={profile}"]
    subprocess.run([*tool, binary, "work", file, name, method, str(repeats)], check=True, stderr=subprocess.DEVNULL)
    found = re.search(r"^(?:summary|totals): (\d+)", profile.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise harness.NativeError(f"callgrind wrote no total to '{profile}'")
    return int(found[1])


if __name__ == "__main__":
    sys.exit(main())
