# Espalier's commands; `make` alone lists them. They need Python 3.11, Rust and make; the rest goes into .venv.

PYTHON     ?= $(shell command -v python3.11 || command -v python3)
INPUT      ?= suzanne
RESOLUTION ?= 1000x1000
OUT        ?= out/demo

BIN        := .venv/bin
CARGO      := cd native && cargo
NATIVE     := $(shell find native -name target -prune -o -type f -print)
EXTENSION  := $(shell find addon scenes -name __pycache__ -prune -o -type f -print) blender_manifest.toml LICENSE
PORTABLE   := $(if $(filter Linux,$(shell uname)),--zig --compatibility manylinux_2_28)
VERSION    := $(shell sed -n 's/^version = "\(.*\)"/\1/p' blender_manifest.toml)
ZIP        := dist/espalier-$(VERSION).zip

.PHONY: help demo study test test-native test-addon test-aarch64 check check-native check-addon format bench bench-instructions bench-interfaces bench-growth bench-threads bench-grids bench-paper package clean
.DELETE_ON_ERROR:

help: ## List these commands
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-18s %s\n", $$1, $$2 }' Makefile

demo: .venv/ready ## Trace a scene with every method and with Cycles: make demo [INPUT=file-or-scene-name]
	$(BIN)/espalier compare "$(INPUT)" --resolution $(RESOLUTION) --cycles --out $(OUT)

study: .venv/ready ## Measure every method on the paper's scenes: make study [INPUTS="dragon city"], report in out/study
	$(BIN)/espalier study $(INPUTS)

test: test-native test-addon ## Run every test that needs no installed Blender

test-native: ## Run the Rust tests alone
	$(CARGO) test --workspace

test-addon: .venv/ready $(ZIP) ## Run the Python tests alone
	$(BIN)/pytest tests/headless
	$(BIN)/pytest tests/python

test-aarch64: ## Run the core's tests compiled for aarch64, in an emulator: needs that target, its gcc and qemu-user
	$(CARGO) test -p espalier-core --target aarch64-unknown-linux-gnu \
	  --config 'target.aarch64-unknown-linux-gnu.linker = "aarch64-linux-gnu-gcc"' \
	  --config 'target.aarch64-unknown-linux-gnu.runner = ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]'

check: check-native check-addon ## Check form, lints and types of Rust and Python

check-native:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets -- -D warnings

check-addon: .venv/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: .venv/tools ## Put Rust and Python into the form that `make check` wants
	$(CARGO) fmt --all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: .venv/ready ## Measure against Embree: make bench [SCENES=...] [CLASSES=...] [MODELS=folder] [THREADS=1] [ISA=avx2|avx512] [RECORD=1]
	$(BIN)/python tests/bench/run.py

bench-instructions: .venv/ready ## Count the instructions of fixed small cases with valgrind, against the record [RECORD=1]
	$(BIN)/python tests/bench/instructions.py

bench-interfaces: .venv/ready ## Measure what Python and Blender users call: embreex, BVHTree, scene.ray_cast [SCENES=...]
	$(BIN)/python tests/bench/interfaces.py

bench-growth: .venv/ready ## Measure build time and memory per triangle, 100 thousand to 20 million triangles [METHODS=...] [RECORD=1]
	$(BIN)/python tests/bench/scaling.py growth

bench-threads: .venv/ready ## Measure two threads against one, building and tracing [SCENES=...] [METHODS=...] [RECORD=1]
	$(BIN)/python tests/bench/scaling.py threads

bench-grids: .venv/ready ## Measure when a grid beats a hierarchy, by content, length and batches of rays [SCENES=...] [RECORD=1]
	$(BIN)/python tests/bench/grids.py

bench-paper: .venv/ready ## Measure the paper's comparison in its setting, one ray at a time [SCENES=...] [METHODS=...] [RECORD=1]
	$(BIN)/python tests/bench/paper.py

bench-totals: .venv/ready ## Measure build and trace together, the hybrid against other methods [SCENES=...] [METHODS=...] [RECORD=1]
	$(BIN)/python tests/bench/scaling.py totals

package: $(ZIP) ## Make the extension's zip in dist/, as Blender installs it

clean: ## Remove everything that these commands made
	rm -rf .venv dist out native/target

.venv/tools: .ci/requirements.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11) and "Espalier needs Python 3.11; set PYTHON=...")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -r .ci/requirements.txt
	touch $@

.venv/wheel: .venv/tools $(NATIVE)
	rm -rf dist/wheels
	. $(BIN)/activate && maturin build --release --manifest-path native/python/Cargo.toml $(PORTABLE) --out dist/wheels
	touch $@

.venv/ready: .venv/wheel pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall dist/wheels/*.whl
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

$(ZIP): .venv/wheel .ci/package.py $(EXTENSION)
	$(BIN)/python .ci/package.py $@
