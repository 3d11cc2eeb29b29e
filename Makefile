# The commands of volprep; `make` alone prints them. Each first sets up what it needs and what is missing: system
# packages, a .venv with the versions of constraints.txt, the native core. These steps run side by side, and what is there
# already is not done again.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help combinations demo test test-long lint docs bench papers levels-study mutants fuzz fuzz-c fuzz-native fuzz-readers sanitize phantoms strangers tampers wheel always

# Real scans, where they lie beside the checkout. Tests that need them are skipped if this is empty.
VOLPREP_TEST_DATA ?= $(abspath $(wildcard ../shared/data))
export VOLPREP_TEST_DATA

# The stamps lie in .venv, so that they go with it. A .venv whose Python does not run (another machine, another
# version manager) loses them, and is then made anew.
STAMPS := .venv/stamps
$(shell .venv/bin/python -c '' 2>/dev/null || rm -rf $(STAMPS))
VENV := $(STAMPS)/venv
BUILD := $(STAMPS)/build
CORE := $(STAMPS)/core
EXTRAS := $(STAMPS)/extras
TEST := $(STAMPS)/test
LINT := $(STAMPS)/lint
DOCS := $(STAMPS)/docs
BENCH := $(STAMPS)/bench
WHEEL := $(STAMPS)/wheel
NATIVE := $(STAMPS)/native
TOOLS := build/system/tools
DRIVER := build/system/driver
CXX_FILES := $(shell find volprep/native formats/native formats/apps -name '*.[ch]pp') $(wildcard formats/c/*.[ch] tests/c/*.c tests/c/*.cpp)

# Steps of one command run side by side; several commands run one after the other.
ifeq ($(words $(MAKECMDGOALS)),1)
MAKEFLAGS += --jobs=3
endif
# The demo needs no browser and no OpenVDB.
ifeq ($(MAKECMDGOALS),demo)
NEEDED := python compiler
endif

help:
	@echo "make demo    a real brain scan becomes two validated packages, with report and pictures (out/)"
	@echo "make test    all tests; ARGS='-k mosaic' passes arguments to pytest"
	@echo "make test-long  tests at full length: damaged files, killed builds, a lie in every field, orders of every layout"
	@echo "make lint    ruff, mypy, clang-format (C++ and GLSL), Biome, codespell"
	@echo "make docs    the documentation as a site, from the pages of this folder (out/docs/index.html)"
	@echo "make bench   kernels and import against their peers; writes bench.json; ARGS=import measures one"
	@echo "make papers  tables and curves of the papers, measured on this driver (out/papers); ARGS='thesis --quick' passes arguments"
	@echo "make mutants plants bugs and says who finds each: tests, validate, its witness (out/mutants); ARGS='srgb' takes one"
	@echo "make levels-study  what coarse levels keep: every phantom and scan, level and filter (out/levels-study); ARGS='--only vessels' passes arguments"
	@echo "make fuzz    reads damaged files of every kind for five minutes; ARGS='--seconds 60 --seed 1' passes arguments"
	@echo "make fuzz-native  the native readers alone, with sanitizers and libFuzzer; ARGS='--seconds 1800' passes arguments"
	@echo "make fuzz-c       damaged packages for formats/c/volpkg.h, with sanitizers; ARGS='--count 1000 --seed 1' passes arguments"
	@echo "make fuzz-readers damaged packages for the readers in Python, JavaScript and C, which must agree; ARGS='--count 1000 --seed 1'"
	@echo "make tampers      a lie in every field of the manifest of packages of every kind, found or listed as harmless"
	@echo "make strangers    builds 278 scans that others published, and makes a table and sheets of first pictures (out/strangers)"
	@echo "make combinations builds, validates and witnesses every pair of features; table in out/combinations; ARGS=--triples takes hours"
	@echo "make phantoms     builds and validates phantoms of combined features; table, reports and a sheet (out/phantoms)"
	@echo "make sanitize     tests of native code against a build with AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make wheel        a wheel with everything native inside, and an sdist (dist/); built twice they are the same bytes"

demo: $(NATIVE) $(CORE) $(DRIVER)
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
	.venv/bin/python -m tests.benchmarks $(ARGS)

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

combinations: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.combinations $(ARGS)

phantoms: $(NATIVE) $(TEST)
	.venv/bin/python -m tests.phantoms $(ARGS)

sanitize: $(NATIVE) $(TEST)
	@tools/sanitize.sh $(ARGS)

wheel: $(TOOLS) $(WHEEL)
	@tools/wheel.sh

# Looks each time; the file becomes newer when something was installed.
$(TOOLS): always
	@tools/system_packages.sh $@ $(NEEDED)

# After the tools: apt does one thing at a time.
$(DRIVER): $(TOOLS) always
	@tools/system_packages.sh $@ gles mesa

# Needs no tools where there is a Python already.
$(VENV): | $(if $(wildcard $(VENV)),,$(if $(shell tools/find_python.sh),,$(TOOLS)))
	@tools/step.sh venv "making .venv (usually 10 s)" tools/make_venv.sh
	@mkdir -p $(@D) && touch $@

# One installation after the other, as pip wants it, beside the compiler.
$(BUILD): constraints.txt pyproject.toml $(VENV)
	@tools/install.sh "5 s" build
	@touch $@

$(CORE): $(BUILD)
	@tools/install.sh "40 s" core validate
	@touch $@

$(EXTRAS): $(CORE)
	@tools/install.sh "15 s" batch zarr convex
	@touch $@

$(TEST): $(EXTRAS)
	@tools/install.sh "60 s" $(@F)
	@touch $@

$(LINT) $(BENCH): $(TEST)
	@tools/install.sh "15 s" $(@F)
	@touch $@

$(DOCS): $(EXTRAS)
	@tools/install.sh "15 s" $(@F)
	@touch $@

$(WHEEL): $(CORE)
	@tools/install.sh "5 s" $(@F)
	@touch $@

# Not isolated, so that the build takes the pinned versions and compiles only what changed.
$(NATIVE): $(BUILD) $(TOOLS) CMakeLists.txt $(wildcard tools/cmake/*) $(shell find volprep/native formats/native -type f)
	@tools/step.sh native "compiling the native core (usually 80 s on two cores)" .venv/bin/pip install --no-build-isolation --no-deps --editable .
	@touch $@
