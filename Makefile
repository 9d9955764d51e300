# Every target sets up what it needs: a virtual environment in .venv, made by $(PYTHON), with
# the package as editable install. Needs Python 3.11 or newer with its venv module.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# Stamps: another interpreter makes a new environment, a changed pyproject.toml a new install.
MADE := $(VENV)/made-by-$(subst /,_,$(PYTHON))
PLAIN := $(VENV)/plainly-installed
INSTALLED := $(VENV)/installed
GROUPS := $(VENV)/pip-knows-groups
TORCH := $(VENV)/torch-installed
TOOLS := $(VENV)/tools-installed
DOCS := $(VENV)/docs-installed

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test test-torch lint types wheel docs screenshots benchmarks clean

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 12

demo: $(PLAIN) ## Blur, recover and compare a known picture; results in demo/
	OMP_NUM_THREADS=1 $(BIN)/crfdeblur demo -o demo

test: $(INSTALLED) ## Run the tests on all cores (options in PYTEST_ARGS)
	@.ci/display
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --numprocesses auto --dist loadfile $(PYTEST_ARGS)

test-torch: $(TORCH) ## Run the tests that need torch
	@.ci/display
	$(BIN)/python -c 'import torch'
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m torch $(PYTEST_ARGS)

lint: $(TOOLS) ## Check style and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(TOOLS) ## Check the types
	$(BIN)/mypy

wheel: $(TOOLS) ## Build the source archive and, from it, the wheel; results in dist/
	rm -rf dist
	$(BIN)/python -m build

docs: $(DOCS) ## Build the documentation; results in build/docs/
	$(BIN)/mkdocs build --strict --site-dir build/docs

screenshots: $(INSTALLED) ## Take the pictures of the napari pages again, on a virtual screen
	@.ci/display
	xvfb-run -a -s "-screen 0 1600x1000x24" $(BIN)/python docs/screenshots.py

benchmarks: $(INSTALLED) ## Run every benchmark and print its table
	@set -e; for script in benchmarks/[a-z]*.py; do \
	  echo "$(BIN)/python $$script"; $(BIN)/python "$$script"; done

clean: ## Remove the environment and everything that was built
	rm -rf $(VENV) build dist demo .mypy_cache .pytest_cache .ruff_cache
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

$(MADE):
	@command -v $(PYTHON) >/dev/null || { \
	  echo "$(PYTHON) is missing: install Python 3.11 or newer, or give its name," \
	    "as in: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	  "$(PYTHON) is too old: give Python 3.11 or newer, as in: make PYTHON=python3.12")'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  test "$$(id -u)" = 0 && command -v apt-get >/dev/null && apt-get update && \
	  DEBIAN_FRONTEND=noninteractive apt-get install -y $(notdir $(PYTHON))-venv; } || { \
	  echo "$(PYTHON) has no venv module: install it first, on Debian and Ubuntu with" \
	    "'apt-get install $(notdir $(PYTHON))-venv' as root" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

# The version is part of what is installed, so that its file counts, too.
$(PLAIN) $(INSTALLED): $(MADE) pyproject.toml src/napari_crfdeblur/_version.py

# Compiling all that is installed takes longer than the demo, which imports little of it. The
# setting, unlike the option, also reaches the environment in which pip builds; 0 means: do not.
$(PLAIN):
	PIP_NO_COMPILE=0 $(BIN)/python -m pip install --no-warn-conflicts --editable .
	@touch $@

$(INSTALLED):
	$(BIN)/python -m pip install --editable '.[test]'
	@touch $(PLAIN) $@

# Dependency groups came with pip 25.1; older Pythons bring an older pip.
$(GROUPS): $(MADE)
	$(BIN)/python -m pip install --upgrade 'pip>=25.1'
	@touch $@

$(TORCH): $(INSTALLED) $(GROUPS)
	$(BIN)/python -m pip install --group torch
	@touch $@

$(TOOLS): $(INSTALLED) $(GROUPS)
	$(BIN)/python -m pip install --group dev
	@touch $@

$(DOCS): $(INSTALLED)
	$(BIN)/python -m pip install --editable '.[docs]'
	@touch $@
