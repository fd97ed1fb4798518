# make demo and make test start from nothing but git, make, python3 and python3-venv.
# PYTHON=python3.12 and VENV=somewhere choose another interpreter and another folder. What is installed
# are the versions of constraints.txt; CONSTRAINTS= takes the newest.

PYTHON ?= python3
VENV ?= .venv

FLOORS ?= .venv-floors
RELEASE ?= .venv-release
TOOLS ?= .venv-tools
NEWEST ?= .venv-newest
RESOLVED ?= .venv-resolved
CONSTRAINTS ?= constraints.txt
CORE := tests/cli tests/db tests/exchange tests/fragility tests/hazards tests/motions tests/plots \
  tests/rockmasses tests/solver

BIN := $(VENV)/bin
RUN := $(BIN)/python -m
PIP := $(RUN) pip install --quiet --disable-pip-version-check $(CONSTRAINTS:%=--constraint %)

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo test lint types docs unit newest constraints floors release-check interoperability format cli-reference wheel clean

help:  ## this list
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /\1\t/' | expand -t 16

demo: $(VENV)/.installed-demo  ## from recorded earthquakes to a failure probability, in one go
	$(BIN)/rbfrag demo

test: lint types docs unit  ## every check: style, types, documentation, tests

lint: $(VENV)/.installed-dev  ## style, and the workflow of continuous integration
	$(RUN) ruff check .
	$(RUN) ruff format --check .
	$(BIN)/zizmor --offline --quiet --no-progress .github/workflows

types: $(VENV)/.installed-dev  ## static types
	$(RUN) mypy
	$(RUN) mypy examples

# -E: an unchanged page whose warning stopped the last build would pass this one.
docs: $(VENV)/.installed-dev  ## the documentation, into docs/_build/html
	$(BIN)/python docs/generate_cli_reference.py --check
	$(BIN)/python docs/generate_data_dictionary.py --check
	$(BIN)/python docs/generate_gallery.py --check
	$(BIN)/python docs/locate_rules.py --check
	$(BIN)/python docs/draw_architecture.py --check
	$(BIN)/python docs/measure_structure.py --check
	$(RUN) sphinx -E -W --keep-going -q -b html docs docs/_build/html

# The folder of matplotlib's settings is given because HOME may not be writable.
unit: $(VENV)/.installed-dev  ## the tests alone, one process a core
	MPLCONFIGDIR="$$(cd $(VENV) && pwd)/matplotlib" $(RUN) pytest -n auto

# To be run now and then, say once a week: a failure is a release of a dependency that breaks something.
newest:  ## every check with the newest versions instead of those of constraints.txt
	test ! -f $(NEWEST)/pyvenv.cfg || rm -rf $(NEWEST)
	$(MAKE) --no-print-directory VENV=$(NEWEST) CONSTRAINTS= test

# Resolved with the oldest Python that is supported, as what runs there runs on the newer ones, too.
constraints:  ## write constraints.txt anew: the newest versions on Python 3.11, PYTHON=python3.11
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || { \
	  echo "constraints.txt is resolved with Python 3.11:  make PYTHON=python3.11 constraints" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(RESOLVED)
	$(RESOLVED)/bin/python -m pip install --quiet --disable-pip-version-check '.[dev,samples]'
	{ echo "# Written by: make constraints"; $(RESOLVED)/bin/python -m pip list \
	  --disable-pip-version-check --format freeze --exclude rbfrag --exclude pip --exclude setuptools; \
	  } > constraints.txt

# Not part of .ci/run, which stays below 25 minutes. Warnings of old libraries about each other are none of ours.
floors:  ## the core of the tests with the lowest versions that are allowed
	$(PYTHON) -m venv --clear $(FLOORS)
	$(PYTHON) benchmarks/floors.py > $(FLOORS)/floors.txt
	$(FLOORS)/bin/python -m pip install --quiet --disable-pip-version-check \
	  --constraint $(FLOORS)/floors.txt \
	  '.[plot,postgres,parquet,gis,excel,mseed,dask,mesh,service]' pytest pytest-xdist hypothesis httpx2
	MPLCONFIGDIR="$$(cd $(FLOORS) && pwd)/matplotlib" $(FLOORS)/bin/python -m pytest \
	  -o filterwarnings=default --disable-warnings -n auto $(CORE)

# Not part of .ci/run either: ten minutes of installing. Uploading is then one command: twine upload dist/*.whl dist/*.tar.gz
release-check:  ## is the last commit fit for a package index: distributions, files, versions, licences, bare environments
	$(PYTHON) -m venv --clear $(RELEASE)
	$(RELEASE)/bin/python -m pip install --quiet --disable-pip-version-check $$($(PYTHON) -c \
	  "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['optional-dependencies']['release'])")
	$(RELEASE)/bin/python -m benchmarks.release_check --python $(PYTHON)

# Nor part of .ci/run: it installs other people's programs. The engine asks for GDAL, which needs a compiler and its
# library, and does without it in these jobs: all else that it asks for is installed.
interoperability: $(VENV)/.installed-dev  ## the OpenQuake engine and pelicun run on exports: their failures beside our own
	$(PYTHON) -m venv --clear $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps openquake-engine
	$(TOOLS)/bin/python -c "from importlib.metadata import requires; print(*(each for each in \
	  requires('openquake-engine') if not each.startswith('gdal')), 'pelicun', sep='\n')" > $(TOOLS)/needed.txt
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check -r $(TOOLS)/needed.txt
	$(RUN) benchmarks.interoperability $(TOOLS)/bin/python

format: $(VENV)/.installed-dev  ## put the source in the style that lint asks for
	$(RUN) ruff check --fix .
	$(RUN) ruff format .

cli-reference: $(VENV)/.installed-dev  ## write anew what is generated: commands, data dictionary, gallery, figure of the packages
	$(BIN)/python docs/generate_cli_reference.py
	$(BIN)/python docs/generate_data_dictionary.py
	$(BIN)/python docs/generate_gallery.py
	$(BIN)/python docs/locate_rules.py
	$(BIN)/python docs/draw_architecture.py
	$(BIN)/python docs/measure_structure.py --write

wheel: $(VENV)/.installed-dev  ## the wheel, into dist/
	$(RUN) pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .

clean:  ## remove what make made
	test ! -f $(VENV)/pyvenv.cfg || rm -rf $(VENV)
	rm -rf docs/_build build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find rbfrag tests docs -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.installed-demo: pyproject.toml $(CONSTRAINTS) | $(VENV)/.made
	@echo "installing rbfrag[plot,samples,excel,service] into $(VENV) ..."
	@$(PIP) --editable '.[plot,samples,excel,service]'
	@touch $@

$(VENV)/.installed-dev: pyproject.toml $(CONSTRAINTS) | $(VENV)/.made
	@echo "installing rbfrag[dev,samples] into $(VENV) ..."
	@$(PIP) --editable '.[dev,samples]'
	@touch $@

$(VENV)/.made:
	@command -v $(PYTHON) >/dev/null 2>&1 || { \
	  echo "$(PYTHON) is missing. On Debian or Ubuntu:  sudo apt install python3 python3-venv" >&2; \
	  exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "$$($(PYTHON) --version) is too old: rbfrag needs Python 3.11 or newer." >&2; \
	  echo "Debian 12 and Ubuntu 24.04 have it:  sudo apt install python3 python3-venv" >&2; \
	  echo "Where another one is installed, name it:  make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; \
	  exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "$(PYTHON) cannot make virtual environments. On Debian or Ubuntu:  sudo apt install" \
	    "$$($(PYTHON) -c 'import sys; print("python3-venv" if sys.argv[1] == "python3" else \
	    "python%d.%d-venv" % sys.version_info[:2])' $(notdir $(PYTHON)))" >&2; \
	  exit 1; }
	@$(PYTHON) -m venv $(VENV)
	@touch $@
