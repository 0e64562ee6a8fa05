# make demo   the main job, live: a node process and a replay process that talk DDS on this host
# make test   lint, types and tests
# Both make .venv first if it is missing or older than setup.py. PYTHON=... chooses the interpreter.

SHELL := /bin/sh
.DELETE_ON_ERROR:
.PHONY: demo test bench clean

# Several BLAS threads make the small solves of this package slower, not faster.
export OMP_NUM_THREADS := 1
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
# A sourced ROS of another Python would hide what .venv holds.
unexport PYTHONPATH AMENT_PREFIX_PATH

BIN := .venv/bin
INSTALLED := .venv/.installed
FITS := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))

demo: $(INSTALLED)
	$(BIN)/rotorsoil demo -o demo_output --force

test: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m pytest

bench: $(INSTALLED)
	$(BIN)/python -m benchmarks

clean:
	rm -rf .venv build demo_output dist install log *.egg-info .mypy_cache .pytest_cache .ruff_cache

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
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test,viewer]'
	@touch $@
