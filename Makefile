# Needs make and Python 3.11 or later; everything else goes into .venv.
PYTHON ?= python3
# The oldest promised numpy, scipy and numba have wheels for Python 3.11 only.
PYTHON_OLDEST ?= $(PYTHON)

VENV := .venv
OLDEST := .venv-oldest
PY := $(VENV)/bin/python
PACKAGES := epv_env identification controllers training
SIDE_BY_SIDE := --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder

MAKEFLAGS += --no-print-directory
# The environments come without bytecode: each of the many processes would compile what it imports anew.
export PYTHONDONTWRITEBYTECODE :=
.DEFAULT_GOAL := help
.PHONY: help venv train test test-slow test-oldest bench studies docs lint check format wheel clean

help: ## list the targets
	@sed -n 's/^\([a-z][a-z%-]*\):.*## /\1	/p' Makefile | while IFS='	' read -r name text; do \
		printf '%-12s %s\n' "$$name" "$$text"; done

venv: $(VENV)/.installed ## create .venv with the pinned packages and this project

# An environment whose installation was interrupted has no stamp of its step: pip goes on with it.
$(VENV)/.made: requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or later is needed")'
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

# Training needs a part of the lock, which takes half the time.
# Python compiles what it imports; to compile all packages takes as long as to install them.
$(VENV)/.training: $(VENV)/.made pyproject.toml
	$(PY) -m pip install --no-compile -c requirements.lock -e '.[training,render]'
	@touch $@

$(VENV)/.installed: $(VENV)/.training
	$(PY) -m pip install --no-compile -r requirements.lock
	@touch $@

$(OLDEST)/.locked: requirements-oldest.lock
	@$(PYTHON_OLDEST) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11) and "Python 3.11 is needed: set PYTHON_OLDEST")'
	$(PYTHON_OLDEST) -m venv --clear $(OLDEST)
	$(OLDEST)/bin/python -m pip install --no-compile -r requirements-oldest.lock
	@touch $@

$(OLDEST)/.installed: $(OLDEST)/.locked pyproject.toml
	$(OLDEST)/bin/python -m pip install --no-deps -e .
	@touch $@

train: $(VENV)/.training ## train the PPO controller; options in ARGS="..."
	$(PY) training/train_ppo.py $(ARGS)

# The matrices are small: threads of the linear algebra and of torch would only wait for each other.
test: $(VENV)/.installed ## run the tests, files side by side; options in ARGS="..."
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(PY) -m pytest $(SIDE_BY_SIDE) -m "not slow" $(ARGS)

test-slow: ## run those of studies, other libraries and simulated devices
	@$(MAKE) test ARGS='-m slow'

# Its own numba cache: the two numba versions would overwrite each other's files.
test-oldest: $(OLDEST)/.installed ## run the plant and environment tests on the oldest core packages
	NUMBA_CACHE_DIR=$(CURDIR)/$(OLDEST)/numba-cache \
		$(OLDEST)/bin/python -m pytest $(SIDE_BY_SIDE) tests/common tests/plant tests/env -m "not training and not slow"

bench: $(VENV)/.installed ## measure speed and memory beside peers (ten minutes)
	$(PY) -m tests.benchmarks $(ARGS)

studies: $(VENV)/.installed ## measure again what the code has left behind, cheapest first; it resumes
	$(PY) -m docs.studies.freshness $(ARGS)

study-%: $(VENV)/.installed ## run a study of docs/studies, such as study-comparison
	$(PY) -m docs.studies.$*.study $(ARGS)

.PHONY: docs # a folder has the same name
docs: $(VENV)/.installed ## build the documentation into site/ (strict: broken links and undocumented names fail)
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict $(ARGS)

lint: $(VENV)/.installed ## check format, style and types
	$(PY) -m ruff format --check .
	$(PY) -m ruff check .
	$(PY) -m pyright

check: lint test ## lint, then test

format: $(VENV)/.installed ## format the code and fix what ruff can fix
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

wheel: $(VENV)/.installed ## build the wheel into dist/
	$(PY) -m pip wheel --no-deps -w dist .

clean: ## remove build outputs and caches (the environments stay)
	rm -rf build dist .pytest_cache .ruff_cache .hypothesis $(OLDEST)/numba-cache
	find $(PACKAGES) tests -name __pycache__ -prune -exec rm -rf {} +
