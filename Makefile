# cnc-shape: `make demo` and `make test` do all the set-up themselves; Python >= 3.11 and make are enough.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help demo papers test slow lint bench clean

help:
	@echo "make demo    simulate the bundled sample and write its report"
	@echo "make papers  run the papers again: docs/papers, their pages and figures"
	@echo "make test    run the test suite, but for its slow lane"
	@echo "make slow    run the slow lane: long real programs"
	@echo "make lint    ruff, pyright, import-linter"
	@echo "make bench   measure against named peers"
	@echo "make clean   remove the virtual environment and what runs left behind"

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "cnc-shape needs Python 3.11 or newer; name one with make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip

$(VENV)/.run: $(BIN)/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.test: $(BIN)/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@ $(VENV)/.run

$(VENV)/.bench: $(VENV)/.test
	$(BIN)/python -m pip install --quiet --editable '.[bench]'
	@touch $@

demo: $(VENV)/.run
	$(BIN)/cnc-shape simulate --report

papers: $(VENV)/.run
	$(BIN)/cnc-shape reproduce --output docs/papers --figures svg --force

test: $(VENV)/.test
	$(BIN)/python -m pytest $(PYTEST_ARGS)

slow: $(VENV)/.test
	$(BIN)/python -m pytest -m slow $(PYTEST_ARGS)

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/table.py $(BENCH_ARGS)

clean:
	rm -rf $(VENV) cnc-shape-runs build dist .pytest_cache .ruff_cache .hypothesis .import_linter_cache
