# The commands of volprep; `make` alone prints them. Each first sets up what is missing: system packages, a .venv
# with the versions of constraints.txt, the native core. What is there already is not done again.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help demo test lint bench papers fuzz fuzz-c fuzz-native sanitize wheel system

# Real scans, where they lie beside the checkout. Tests that need them are skipped if this is empty.
VOLPREP_TEST_DATA ?= $(abspath $(wildcard ../shared/data))
export VOLPREP_TEST_DATA

# The stamps lie in .venv, so that they go with it. A .venv whose Python does not run (another machine, another
# version manager) loses them, and is then made anew.
STAMPS := .venv/stamps
$(shell .venv/bin/python -c '' 2>/dev/null || rm -rf $(STAMPS))
CORE := $(STAMPS)/core
TEST := $(STAMPS)/test
LINT := $(STAMPS)/lint
BENCH := $(STAMPS)/bench
WHEEL := $(STAMPS)/wheel
NATIVE := $(STAMPS)/native
CXX_FILES := $(shell find volprep/native -name '*.[ch]pp') $(wildcard formats/c/*.[ch] tests/c/*.c)

help:
	@echo "make demo    a real brain scan becomes two validated packages, with report and pictures (out/)"
	@echo "make test    all tests; ARGS='-k mosaic' passes arguments to pytest"
	@echo "make lint    ruff, mypy, clang-format"
	@echo "make bench   kernels and import against their peers; writes bench.json"
	@echo "make papers  tables and curves of the papers, measured on this driver (out/papers); ARGS='thesis --quick' passes arguments"
	@echo "make fuzz    reads damaged files of every kind for five minutes; ARGS='--seconds 60 --seed 1' passes arguments"
	@echo "make fuzz-native  the native readers alone, with sanitizers and libFuzzer; ARGS='--seconds 1800' passes arguments"
	@echo "make fuzz-c       damaged packages for formats/c/volpkg.h, with sanitizers; ARGS='--count 1000 --seed 1' passes arguments"
	@echo "make sanitize     tests of native code against a build with AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make wheel        a wheel with everything native inside, and an sdist (dist/); built twice they are the same bytes"

demo: $(NATIVE)
	.venv/bin/python tools/demo.py

test: $(NATIVE) $(TEST)
	.venv/bin/python -m pytest -n auto --dist worksteal $(ARGS)

lint: $(NATIVE) $(TEST) $(LINT)
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	.venv/bin/clang-format --dry-run -Werror $(CXX_FILES)

bench: $(NATIVE) $(BENCH)
	.venv/bin/python -m tests.benchmarks

papers: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.papers $(ARGS)

fuzz: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.robustness.fuzz $(ARGS)

fuzz-native: $(NATIVE) $(TEST)
	@tools/fuzz_native.sh $(ARGS)

fuzz-c: $(NATIVE) $(TEST)
	@tools/fuzz_c.sh $(ARGS)

sanitize: $(NATIVE) $(TEST)
	@tools/sanitize.sh $(ARGS)

wheel: $(CORE) $(WHEEL)
	@tools/wheel.sh

system:
	@tools/system_packages.sh

$(CORE): constraints.txt pyproject.toml | system
	@tools/install.sh core build
	@mkdir -p $(@D) && touch $@

$(TEST) $(LINT) $(BENCH) $(WHEEL): $(CORE)
	@tools/install.sh $(@F)
	@touch $@

# Not isolated, so that the build takes the pinned versions and compiles only what changed.
$(NATIVE): $(CORE) $(shell find volprep/native -type f)
	@tools/step.sh native "building the native core" .venv/bin/pip install --no-build-isolation --no-deps --editable .
	@touch $@
