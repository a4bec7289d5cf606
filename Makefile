# The tasks of the project; `make` alone lists them. Everything runs in .venv, which is made when first needed.
#
#   make test ARGS="-k orbit"     passes ARGS on to pytest
#   make test PYTHON=python3.12   makes .venv with another interpreter

PYTHON ?=
ARGS ?=
export PYTHON

python := .venv/bin/python

.PHONY: help demo test test-slow check lint types format bench docs clean demo-venv dev-venv

help:  ## list the tasks
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

demo: demo-venv  ## a short tour, from a fresh clone in under a minute
	@PATH="$$PWD/.venv/bin:$$PATH" bash examples/demo.sh

test: dev-venv  ## the tests and the examples in docstrings, without the slow ones
	@.ci/tools
	@$(python) -m pytest -n 2 -m "not slow" $(ARGS)

test-slow: dev-venv  ## all tests, the slow ones too
	@.ci/tools
	@$(python) -m pytest -n 2 --timeout 1800 $(ARGS)

check: lint types test  ## all that must hold before a commit: lint, types, test

lint: dev-venv  ## ruff: rules and layout
	@$(python) -m ruff check .
	@$(python) -m ruff format --check .

types: dev-venv  ## mypy --strict on both packages
	@$(python) -m mypy

format: dev-venv  ## put all files into the layout that lint asks for
	@$(python) -m ruff check --select I --fix .
	@$(python) -m ruff format .

bench: dev-venv  ## ratios to other programs, also into docs/benchmarks.md; ARGS="--quick" or ARGS="--only exact"
	@.ci/bootstrap peers
	@$(python) benchmarks/run.py $(ARGS)

docs:  ## say where the documentation is
	@echo "The documentation is plain Markdown, to be read as it is; nothing is built:"
	@for file in README.md CONTRIBUTING.md CHANGELOG.md docs/*.md; do \
	    [ ! -e "$$file" ] || echo "  $$file"; \
	done

clean:  ## remove .venv, caches and build leftovers
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks .demo docs/_build
	@find . -path ./.git -prune -o -type d -name __pycache__ -exec rm -rf {} +

demo-venv:
	@.ci/bootstrap demo

dev-venv:
	@.ci/bootstrap dev
