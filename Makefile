# The tasks of the project; `make` alone lists them. Everything runs in .venv, which is made when first needed.
#
#   make test ARGS="-k orbit"     passes ARGS on to pytest
#   make test PYTHON=python3.12   makes .venv with another interpreter

PYTHON ?=
ARGS ?=
export PYTHON
# Tests start hundreds of processes; none of them is to compile what another has compiled.
unexport PYTHONDONTWRITEBYTECODE

python := .venv/bin/python

.PHONY: help demo test test-slow check lint types format bench docs docs-links pictures clean demo-venv dev-venv

help:  ## list the tasks
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

demo: demo-venv  ## a short tour, from a fresh clone in under a minute
	@PATH="$$PWD/.venv/bin:$$PATH" bash examples/demo.sh

test: dev-venv  ## the tests and the examples in docstrings, without the slow ones
	@.ci/tools
	@$(python) -m pytest -n 2 -m "not slow" $(ARGS)

test-slow: dev-venv  ## all tests, the slow ones too
	@.ci/tools
	@$(python) -m pytest -n 2 --timeout 1800 --hypothesis-profile=thorough $(ARGS)

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

docs: dev-venv  ## the documentation as pages, in docs/_build/html
	@rm -rf docs/_build/html docs/_build/trees
	@$(python) -m sphinx -b html -q -n -W --keep-going -d docs/_build/trees docs docs/_build/html
	@$(python) docs/_ext/check_pages.py docs/_build/html
	@echo "docs/_build/html/index.html"

pictures: dev-venv  ## the pictures of the documentation again, by the commands they carry
	@PATH="$$PWD/.venv/bin:$$PATH" $(python) docs/_ext/redraw.py docs/pictures/*.png docs/pictures/*.svg

docs-links: dev-venv  ## do the links of the documentation to other sites work? Needs the network
	@$(python) -m sphinx -b linkcheck -q -d docs/_build/trees-links docs docs/_build/links

clean:  ## remove .venv, caches and build leftovers
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks .demo docs/_build
	@find . -path ./.git -prune -o -type d -name __pycache__ -exec rm -rf {} +

demo-venv:
	@.ci/bootstrap demo

dev-venv:
	@.ci/bootstrap dev
