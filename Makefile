PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
GPU_VENV := .venv-gpu

.PHONY: help demo test test-docs test-slow test-study soak test-gpu-compile test-gpu lint bench docs dist clean

help:  ## Show what there is to make
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-16s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/installed  ## Repeat the paper's Cliff Walking experiment, with figures, into demo/
	$(BIN)/qbumpers reproduce cliff-walking --out demo

test: $(VENV)/installed-dev  ## Run the tests, some minutes
	$(BIN)/pytest -m "not slow and not documentation and not study and not gpu and not gpu_compile" -n 2 --dist worksteal

test-docs: $(VENV)/installed-dev  ## Run what the pages and examples show, and compare what they print
	$(BIN)/pytest -m "documentation and not slow" -n 2 --dist worksteal

test-slow: $(VENV)/installed-dev  ## Run the longer checks
	$(BIN)/pytest -m slow -n 2 --dist worksteal

test-study: $(VENV)/installed-dev  ## Play in a real browser, and record in PostgreSQL
	.ci/install_browser
	.ci/install_postgresql
	$(BIN)/pytest -m study tests/play tests/study

soak: $(VENV)/installed-dev  ## Play for 30 minutes while connections, servers and the database fail
	.ci/install_postgresql
	$(BIN)/python -m tests.play.soak --minutes 30

# In an environment of their own: the compiler for cards needs an older NumPy.
test-gpu-compile: $(GPU_VENV)/installed  ## Compile for a graphics card, and simulate one: needs none
	$(GPU_VENV)/bin/pytest -m gpu_compile tests/simulation/cuda
	NUMBA_ENABLE_CUDASIM=1 NUMBA_DISABLE_JIT=1 $(GPU_VENV)/bin/pytest -m gpu_compile tests/simulation/cuda

test-gpu: $(GPU_VENV)/installed  ## Hold a graphics card to the processor, skipped if there is none
	$(GPU_VENV)/bin/pytest -rs -m gpu tests/simulation/cuda

lint: $(VENV)/installed-dev $(VENV)/installed-docs  ## Check style, types and which way imports point
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

bench: $(VENV)/installed-dev  ## Measure speed, as ratios to named baselines
	$(BIN)/python benchmarks/run.py

docs: $(VENV)/installed-docs  ## Build the documentation into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

dist: $(VENV)/installed-dist  ## Build the distributions into dist/, check them, and try every Python here
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/twine check --strict dist/*
	$(BIN)/python .ci/try_dist.py dist

clean:  ## Remove what make made
	rm -rf $(VENV) $(GPU_VENV) .browser demo site dist

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

$(VENV)/installed-%: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$*]'
	touch $@ $(VENV)/installed

$(GPU_VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(VENV)/bin/python -m venv $(GPU_VENV)
	$(GPU_VENV)/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev-gpu]'
	touch $@
