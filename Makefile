# Needs Python 3.11 or newer, make and a package index; `make image` needs a container engine too.
# Everything is installed from the lock files, by hash, into .venv.

VENV  := .venv
BIN   := $(VENV)/bin
PIP   := $(BIN)/python -m pip --quiet --disable-pip-version-check
IMAGE ?= shift-mesh
BASE  ?= python:3.11-slim-bookworm
PYTEST_WORKERS ?= 2

.DEFAULT_GOAL := help
.PHONY: help setup setup-dev up test lint bench campaign-suspend image lock clean

help:           ## This list
	@sed -nE 's/^([a-z][a-z-]*):[^#]*## (.*)/make \1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 14

setup: $(VENV)/.project                 ## Virtual environment in .venv; seconds when nothing changed
setup-dev: $(VENV)/.project $(VENV)/.dev

up: setup                               ## The whole mesh with a simulated person, at http://127.0.0.1:8080
	@$(BIN)/shift-mesh up --demo $(ARGS)

test: setup-dev                         ## All tests in two processes; PYTEST_ARGS="-k name" for some
	@if version=$$(docker version --format '{{.Server.Version}}' 2>/dev/null); then \
	    echo "Tests with containers: run, on Docker $$version."; \
	elif [ "$$CI" = true ]; then \
	    echo "Tests with containers: no engine answers, and with CI=true that is a failure."; \
	else \
	    echo "Tests with containers: left out, since no engine answers."; \
	fi
	@$(BIN)/python -m pytest --numprocesses $(PYTEST_WORKERS) --dist loadscope $(PYTEST_ARGS)

lint: setup-dev                         ## ruff, mypy, and who may import whom
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

bench: setup-dev                        ## Each program in benchmarks/
	@set -e; for program in $(wildcard benchmarks/[a-z]*.py); do \
	    echo "== $$program"; $(BIN)/python "$$program"; \
	done

campaign-suspend: setup-dev             ## Each process suspended under traffic, for half an hour; ARGS="--times 2"
	@$(BIN)/python tests/support/suspension.py $(ARGS)

image:                                  ## The container image; IMAGE=name, BASE=another Python 3.11+
	docker build --tag $(IMAGE) --build-arg BASE=$(BASE) --file deploy/Dockerfile .

# The lock files hold every version and hash, for each platform and for Python 3.11 and up.
# "fewest": one numpy for every Python, as a seed must give the same numbers everywhere.
UV := $(shell command -v uv || echo build/uv/bin/uv)
COMPILE = $(UV) pip compile pyproject.toml --quiet --universal --python-version 3.11 \
    --fork-strategy fewest --generate-hashes --no-emit-index-url --no-annotate \
    --custom-compile-command "make lock"

lock: | $(UV)                           ## Make requirements*.lock anew; LOCK_ARGS=--upgrade for newer versions
	$(COMPILE) $(LOCK_ARGS) --group dev --output-file requirements-dev.lock
	$(COMPILE) $(LOCK_ARGS) --constraints requirements-dev.lock --output-file requirements.lock
	$(COMPILE) $(LOCK_ARGS) --extra export --extra analysis \
	    --constraints requirements-dev.lock --output-file requirements-analysis.lock
	$(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	    --no-annotate --custom-compile-command "make lock" $(LOCK_ARGS) \
	    --constraints requirements-dev.lock --group pyproject.toml:build --output-file requirements-build.lock

build/uv/bin/uv: | $(BIN)/pip
	@$(BIN)/python -m venv build/uv
	@build/uv/bin/python -m pip --quiet --disable-pip-version-check install uv

clean:                                  ## Take away .venv, caches and builds; recordings stay
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find schemas services tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

# --- what `setup` is made of; a stamp file is newer than what it was made from ---

$(BIN)/pip:
	@set -e; found=; \
	for python in $(or $(PYTHON),python3.11 python3.12 python3.13 python3 python); do \
	    if "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	        found=$$python; break; \
	    fi; \
	done; \
	if [ -z "$$found" ]; then \
	    echo "Python 3.11 or newer is needed: $(if $(PYTHON),$(PYTHON) is not one,none was found). make setup PYTHON=/path/to/python3" >&2; \
	    exit 1; \
	fi; \
	if ! "$$found" -c 'import ensurepip, venv' 2>/dev/null; then \
	    echo "$$found comes without venv. On Debian and Ubuntu: apt install python3-venv" >&2; \
	    exit 1; \
	fi; \
	echo "Making $(VENV) with $$("$$found" --version)."; \
	"$$found" -m venv $(VENV)

# requirements.lock is what the services need, and what the image has. The analysis of recordings needs more.
$(VENV)/.locked: requirements-analysis.lock requirements-build.lock | $(BIN)/pip
	@$(PIP) install --require-hashes --no-deps -r requirements-analysis.lock -r requirements-build.lock
	@touch $@

$(VENV)/.project: $(VENV)/.locked pyproject.toml
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.dev: $(VENV)/.locked requirements-dev.lock
	@$(PIP) install --require-hashes --no-deps -r requirements-dev.lock
	@touch $@
