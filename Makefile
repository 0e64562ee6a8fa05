# make demo   the main job, live: a node process and a replay process that talk DDS on this host
# make test   lint, types and tests
# make docs   the site, in docs/_build/html, warnings as errors
# make bench  every benchmark; the rotor's beside ROSS, which gets an environment of its own
# Each makes .venv first if it is missing or older than setup.py. PYTHON=... chooses the interpreter.

SHELL := /bin/sh
.DELETE_ON_ERROR:
.PHONY: demo test docs bench clean

# Several BLAS threads make the small solves of this package slower, not faster.
export OMP_NUM_THREADS := 1
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
# A sourced ROS of another Python would hide what .venv holds.
unexport PYTHONPATH AMENT_PREFIX_PATH
# Tests start hundreds of processes: what all of them import is compiled once.
unexport PYTHONDONTWRITEBYTECODE

# By files: what one test of a file has built the next ones share.
SPREAD := --numprocesses auto --maxprocesses 4 --dist loadfile

BIN := .venv/bin
INSTALLED := .venv/.installed
DOCUMENTED := .venv/.documented
ROSS := .ross/.installed
INSTALL := -m pip install --quiet --disable-pip-version-check
FITS := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))

demo: $(INSTALLED)
	$(BIN)/rotorsoil demo -o demo_output --force

test: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -c 'import amqtt, rerun'  # without them tests are skipped: here they are installed
	$(BIN)/python -m pytest $(SPREAD)

docs: $(DOCUMENTED)
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs docs/_build/html
	@echo 'docs/_build/html/index.html'

bench: $(INSTALLED) $(ROSS)
	ROSS_PYTHON=.ross/bin/python $(BIN)/python -m benchmarks

clean:
	rm -rf .venv .ross .lowest build demo_output dist docs/_build docs/api install log *.egg-info \
	  .mypy_cache .pytest_cache .ruff_cache

$(INSTALLED): setup.py
	@for python in $(PYTHON) python3 python3.13 python3.12 python3.11; do \
	  if $$python -c '$(FITS)' 2>/dev/null; then chosen=$$python; break; fi; \
	done; \
	if [ -z "$$chosen" ]; then \
	  echo 'make: needs Python 3.11, 3.12 or 3.13 with venv (Debian, Ubuntu: python3-venv)' >&2; \
	  exit 1; \
	fi; \
	echo "installing into .venv with $$($$chosen --version): some minutes, once"; \
	$$chosen -m venv --clear .venv
	$(BIN)/python $(INSTALL) -e '.[broker,ros,test,viewer]'
	@touch $@

$(DOCUMENTED): $(INSTALLED)
	$(BIN)/python $(INSTALL) -e '.[docs]'
	@touch $@

$(ROSS): $(INSTALLED)
	$(BIN)/python -m venv --clear .ross
	.ross/bin/python $(INSTALL) '.[bench]'
	@touch $@
