# The commands of volprep; `make` alone prints them. Each first sets up what is missing: system packages, a .venv
# with the versions of constraints.txt, the native core. What is there already is not done again.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help demo test test-long lint docs bench papers levels-study mutants fuzz fuzz-c fuzz-native fuzz-readers sanitize strangers tampers wheel system

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
DOCS := $(STAMPS)/docs
BENCH := $(STAMPS)/bench
WHEEL := $(STAMPS)/wheel
NATIVE := $(STAMPS)/native
CXX_FILES := $(shell find volprep/native formats/native -name '*.[ch]pp') $(wildcard formats/c/*.[ch] tests/c/*.c)

help:
	@echo "make demo    a real brain scan becomes two validated packages, with report and pictures (out/)"
	@echo "make test    all tests; ARGS='-k mosaic' passes arguments to pytest"
	@echo "make test-long  tests at full length: damaged files, killed builds, a lie in every field, orders of every layout"
	@echo "make lint    ruff, mypy, clang-format (C++ and GLSL), Biome, codespell"
	@echo "make docs    the documentation as a site, from the pages of this folder (out/docs/index.html)"
	@echo "make bench   kernels and import against their peers; writes bench.json"
	@echo "make papers  tables and curves of the papers, measured on this driver (out/papers); ARGS='thesis --quick' passes arguments"
	@echo "make mutants plants bugs and says who finds each: tests, validate, its witness (out/mutants); ARGS='srgb' takes one"
	@echo "make levels-study  what coarse levels keep: every phantom and scan, level and filter (out/levels-study); ARGS='--only vessels' passes arguments"
	@echo "make fuzz    reads damaged files of every kind for five minutes; ARGS='--seconds 60 --seed 1' passes arguments"
	@echo "make fuzz-native  the native readers alone, with sanitizers and libFuzzer; ARGS='--seconds 1800' passes arguments"
	@echo "make fuzz-c       damaged packages for formats/c/volpkg.h, with sanitizers; ARGS='--count 1000 --seed 1' passes arguments"
	@echo "make fuzz-readers damaged packages for the readers in Python, JavaScript and C, which must agree; ARGS='--count 1000 --seed 1'"
	@echo "make tampers      a lie in every field of the manifest of packages of every kind, found or listed as harmless"
	@echo "make strangers    builds 278 scans that others published, and makes a table and sheets of first pictures (out/strangers)"
	@echo "make sanitize     tests of native code against a build with AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make wheel        a wheel with everything native inside, and an sdist (dist/); built twice they are the same bytes"

demo: $(NATIVE)
	.venv/bin/python tools/demo.py

test: $(NATIVE) $(TEST)
	.venv/bin/python -m pytest -n auto --dist worksteal --durations=10 $(ARGS)

test-long: $(NATIVE) $(TEST)
	VOLPREP_LONG=1 .venv/bin/python -m pytest -m 'long or longer' -n auto --dist worksteal --durations=10 $(ARGS)

lint: $(NATIVE) $(TEST) $(LINT)
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	@echo ".venv/bin/clang-format --dry-run -Werror ($(words $(CXX_FILES)) files of C and C++)"
	@.venv/bin/clang-format --dry-run -Werror $(CXX_FILES)
	.venv/bin/python tools/glsl_format.py
	tools/javascript.sh
	git ls-files -z | grep -zvE '\.(png|gz|nii)$$' | xargs -0 .venv/bin/codespell

docs: $(NATIVE) $(DOCS)
	.venv/bin/python tools/docs_site.py

bench: $(NATIVE) $(BENCH)
	.venv/bin/python -m tests.benchmarks

papers: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.papers $(ARGS)

mutants: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.mutants $(ARGS)

levels-study: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.levels_study $(ARGS)

fuzz: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.robustness.fuzz $(ARGS)

fuzz-native: $(NATIVE) $(TEST)
	@tools/fuzz_native.sh $(ARGS)

fuzz-c: $(NATIVE) $(TEST)
	@tools/fuzz_c.sh $(ARGS)

fuzz-readers: $(NATIVE) $(TEST)
	.venv/bin/python tests/support/readers_compare.py out/fuzz-readers $(ARGS)

tampers: $(NATIVE) $(TEST)
	VOLPREP_LONG=1 .venv/bin/python -m pytest -n auto tests/validation/test_every_field.py tests/validation/test_tampered.py $(ARGS)

strangers: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.strangers $(ARGS)

sanitize: $(NATIVE) $(TEST)
	@tools/sanitize.sh $(ARGS)

wheel: $(CORE) $(WHEEL)
	@tools/wheel.sh

system:
	@tools/system_packages.sh

$(CORE): constraints.txt pyproject.toml | system
	@tools/install.sh core validate batch zarr convex build
	@mkdir -p $(@D) && touch $@

$(TEST) $(LINT) $(DOCS) $(BENCH) $(WHEEL): $(CORE)
	@tools/install.sh $(@F)
	@touch $@

# Not isolated, so that the build takes the pinned versions and compiles only what changed.
$(NATIVE): $(CORE) CMakeLists.txt $(wildcard tools/cmake/*) $(shell find volprep/native formats/native -type f)
	@tools/step.sh native "building the native core" .venv/bin/pip install --no-build-isolation --no-deps --editable .
	@touch $@
