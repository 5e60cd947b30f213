PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/pytest -n 2 --dist loadfile

.PHONY: demo quick test rest test-all clean
.DELETE_ON_ERROR:

# What most people look at first: a report on the recordings in data/.
demo: .venv/installed
	$(BIN)/python -m impactjax fit data/*.csv --out demo --force

# Language, types, and all that needs no simulation: while you write.
quick: .venv/installed-for-tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright
	$(PYTEST) -m quick tests

# What a change must pass: every capability, with two or three laws.
test: quick
	$(PYTEST) -m "not quick and not thorough" --durations=20 tests

# The other laws, steps and statistics; then pages and notebooks under the compiler's own options, as a
# library user has them: all other tests run under those of the command, twice as quick to compile.
rest: .venv/installed-for-tests
	$(PYTEST) -m thorough --durations=20 --ignore tests/test_docs.py tests
	XLA_FLAGS= $(PYTEST) --nbmake --nbmake-timeout=600 tests/test_docs.py notebooks

# Everything.
test-all: test rest

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	touch $@

.venv/installed-for-tests: .venv/installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[test]'
	touch $@

clean:
	rm -rf .venv demo
