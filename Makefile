# The daily commands of Florence BT. `make` alone lists them.

PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest
PARALLEL = -n $(WORKERS) --dist loadgroup
# More than cores, at least on two: a good part of the tests over ROS waits most of its time.
WORKERS ?= 3
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-all unit ros check format manual trials bench figures mutants colour lock clean

help: ## list the commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## make .venv with everything in it, or bring it up to date
	@$(PYTHON) tools/setup.py

demo: ## run the demonstration in the simulated flat (ARGS="--help" for its options)
	@$(PYTHON) tools/setup.py demo
	$(BIN)/florence demo $(ARGS)

test: setup ## run every test that needs no hardware, and a part of the sweeps over seeds and inputs
	$(PYTEST) $(PARALLEL) -m "not sweep" $(ARGS)

test-all: setup ## run every test that needs no hardware, with all seeds and inputs
	$(PYTEST) $(PARALLEL) --hypothesis-profile=all $(ARGS)

unit: WORKERS = 2
unit: setup ## run the tests that start no ROS and no whole missions
	$(PYTEST) $(PARALLEL) -m "not ros and not slow and not sweep" tests/unit packages $(ARGS)

ros: setup ## run the tests that start ROS nodes
	$(PYTEST) $(PARALLEL) -m "ros and not sweep" $(ARGS)

check: setup ## check format, style, types and the direction of imports
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: setup ## format the code and repair what the linter can repair
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

manual: setup ## build the manual as a site in build/manual; broken links fail
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet $(ARGS)
	@echo "open build/manual/index.html"

trials: setup ## run goto_user in homes with people of all kinds; hours, ends and goes on (ARGS="--runs 2" for less)
	$(BIN)/florence sweep experiments/goto_user.yaml $(ARGS)

bench: setup ## run the benchmarks
	$(PYTEST) benchmarks --benchmark-only $(ARGS)

figures: setup ## list which tables of figures are old; ONLY=people (a page, a table, all) makes them again
	$(BIN)/python -m tools.figures $(if $(ONLY),--only "$(ONLY)") $(ARGS)

mutants: setup ## list small changes of the code that no test notices; FILES=... of these, CHANGED=main of lines changed since
	$(BIN)/python -m tools.mutants $(if $(CHANGED),--changed $(CHANGED)) $(FILES) $(ARGS)

colour: setup ## install the network of the colour detector, 144 MB (ARGS=--photographs: what its tests look at, too)
	$(BIN)/python tools/colour_network $(ARGS)

lock: ## choose the newest versions that fit and pin them (PYTHON must be a Python 3.11)
	$(PYTHON) tools/setup.py lock

clean: ## remove .venv and everything that was built
	rm -rf .venv build dist install log *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache .benchmarks
