PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/pytest -n 2 --dist worksteal
# Without the checks of types and shapes at run time, which all other tests have.
UNCHECKED := --jaxtyping-packages=

.PHONY: demo quick capabilities test rest test-all lowest project-files clean
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
test: quick capabilities

capabilities: .venv/installed-for-tests
	$(PYTEST) -m "not quick and not thorough" --durations=20 tests

# The other laws, steps and statistics, and all pages, without checks of types at run time: fits take two
# thirds of the time. Then notebooks under the compiler's own options, as a library user has them: all other
# tests run under those of the command and without the compiler's optimiser.
rest: .venv/installed-for-tests
	$(PYTEST) $(UNCHECKED) -m thorough --durations=20 tests
	XLA_FLAGS= $(PYTEST) --nbmake --nbmake-timeout=600 notebooks

# Everything.
test-all: test rest

# The lowest versions that pyproject.toml claims: the quick tests, the laws and fits.
lowest: .venv-lowest/installed
	.venv-lowest/bin/pytest -m quick tests
	.venv-lowest/bin/pytest -m "not quick and not thorough" tests/test_laws.py tests/test_fit.py

.venv-lowest/installed: pyproject.toml constraints-lowest.txt
	$(PYTHON) -m venv --clear .venv-lowest
	.venv-lowest/bin/python -m pip install --quiet --constraint constraints-lowest.txt --editable '.[test]'
	touch $@

# The files that only a code host or a packager reads, each checked by its own linter.
project-files: .venv-project/installed
	.venv-project/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	.venv-project/bin/zizmor --offline --pedantic .github/workflows
	.venv-project/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	.venv-project/bin/check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	.venv-project/bin/check-jsonschema --builtin-schema vendor.github-issue-forms \
		$(filter-out %/config.yml,$(wildcard .github/ISSUE_TEMPLATE/*.yml))
	.venv-project/bin/pre-commit validate-config
	.venv-project/bin/validate-pyproject pyproject.toml
	.venv-project/bin/python -m build --quiet --outdir .venv-project/dist
	.venv-project/bin/twine check --strict .venv-project/dist/*

.venv-project/installed: Makefile
	$(PYTHON) -m venv --clear .venv-project
	.venv-project/bin/python -m pip install --quiet check-jsonschema zizmor pre-commit validate-pyproject build twine
	touch $@

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	touch $@

.venv/installed-for-tests: .venv/installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[test]'
	touch $@

clean:
	rm -rf .venv .venv-lowest .venv-project demo
