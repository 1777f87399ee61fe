# `make demo` and `make test` set everything up by themselves, in .venv; nothing else is touched.
PYTHON ?= python3
BIN := .venv/bin
# What the long tests draw from; `make test-all SEED=NUMBER` draws the same again.
SEED ?= $(shell date +%s)
DEMO := runs/demo-$(shell date +%Y%m%d-%H%M%S)

# Tests start hundreds of processes: each would compile the whole program again where this is set.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test test-all check mutants paper clean runtime dev

help: ## list the targets
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-10s %s\n", $$1, $$2}' Makefile

demo: runtime ## set up, push a box 2 m with the real drivers over wire emulators, replay it bit for bit
	$(BIN)/push run emulated --distance-m 2 --out $(DEMO)
	$(BIN)/push replay $(DEMO)/run.mcap

test: dev ## set up, check style, types and import rules, run all tests but the long ones
	@# The tests are compiled while mypy runs: otherwise both workers do it, each for itself.
	@$(BIN)/python -m pytest -q --collect-only >/dev/null 2>&1 & compiling=$$!; \
	$(MAKE) --no-print-directory check; found=$$?; wait $$compiling; exit $$found
	$(BIN)/python -m pytest -q -n 2 --dist loadfile

test-all: check ## the same with the long tests
	$(BIN)/python -m pytest -q -n 2 --dist loadfile -m "not hardware" --measure-all \
		--hypothesis-profile=anew --hypothesis-seed=$(SEED)

check: dev ## ruff, mypy strict and the import contracts, no tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

mutants: dev ## change the code one place at a time and list what no test notices (SINCE=<commit>: changed lines only)
	$(BIN)/python -m tools.dev.mutants $(if $(SINCE),--since $(SINCE))

paper: dev ## run the shipped studies and the paper's sweep, and write the tables in docs that come of them anew
	$(BIN)/python -m tools.dev.paper --out studies/paper-$(shell git rev-parse --short HEAD)

clean: ## remove the environment and all caches (runs/ stays)
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .mutants
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

dev: ## set up with everything that tests and studies need

runtime dev:
	@command -v $(PYTHON) >/dev/null || { echo "set-up: no $(PYTHON) here: run \`sudo apt install python3 python3-venv\`" >&2; exit 2; }
	@$(PYTHON) tools/bootstrap.py $@
