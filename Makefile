# make demo    install what is missing, build, simulate a cantilever and compare it with theory
# make test    ctest and pytest, without the slow tests
# make help    the rest
#
# PYTHON=/path/to/python3 chooses the interpreter that .venv is made from (default: the system's).

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?=
VENV := $(CURDIR)/.venv
STAMPS := .venv/stamps
BUILD := build/make
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
TEST_JOBS ?= $(shell n=$(JOBS); echo $$((n < 8 ? n : 8)))

export PATH := $(VENV)/bin:$(PATH)
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(JOBS)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport PYTHONPATH PYTHONHOME
# Packages are installed without bytecode. Python must keep what it compiles, or each process compiles torch or VTK anew.
unexport PYTHONDONTWRITEBYTECODE
# One at a time, also with `make --jobs`. Python compiles modules when it first imports them; most never are.
PIP_INSTALL := flock $(VENV) python -m pip install --quiet --no-compile --constraint constraints.txt
requirements = $$(python tools/requirements.py $(1))

CXX_SOURCES := $(wildcard cpp/*/*.hpp cpp/*/*.cpp python/bindings/*.hpp python/bindings/*.cpp)
CXX_TESTS := $(wildcard tests/cpp/*.hpp tests/cpp/*.cpp tests/cpp/*/*.hpp tests/cpp/*/*.cpp benchmarks/*.cpp)
CMAKE_FILES := CMakeLists.txt cpp/CMakeLists.txt $(wildcard cpp/*/CMakeLists.txt) python/bindings/CMakeLists.txt
PYTHON_SOURCES := $(shell find python/withe -name '*.py' -o -name '*.pyi' -o -name '*.pt' -o -name '*.json' -o -name py.typed)
# Folders too: a deleted file is a change.
SOURCE_FOLDERS := $(wildcard cpp/*/) $(shell find python/withe -type d -not -name __pycache__)

.PHONY: help demo view gallery learn test test-all ctest-build ctest ctest-baseline pytest asan tsan asan-python bench docs wheel wheels lint format format-check prose types stubs stub-check \
    tidy tidy-changed clean distclean

help:
	@echo "make demo          install what is missing, build, simulate a cantilever, compare with theory"
	@echo "make view          install what pictures, films and notebooks need"
	@echo "make gallery       a dozen short films into out/gallery (about 10 minutes); NAME=reef makes one"
	@echo "make learn         install torch, gymnasium and stable-baselines3, for withe.learning"
	@echo "make test          tests in C++ and Python, without the slow ones (about 5 minutes on two cores)"
	@echo "make test-all      all tests, slow ones too"
	@echo "make pytest        all tests in Python; TESTS=\"tests/physics -k knot\" runs some"
	@echo "make ctest-baseline  that the engine runs on machines without AVX: compiled files, C++ tests, qemu-user"
	@echo "make asan          C++ tests under the address and undefined-behaviour sanitizers"
	@echo "make tsan          C++ tests of what runs in threads under the thread sanitizer"
	@echo "make asan-python   random sequences of calls through Python under them; SEQUENCES=1000 SEED=7 runs others"
	@echo "make wheel         dist/*.whl for machines without compiler"
	@echo "make wheels        the same for each of Python 3.11 to 3.14 that is installed"
	@echo "make bench         all benchmarks (about an hour); NAME=work_precision runs one"
	@echo "make docs          the documentation, into out/docs; NOTEBOOKS=off does not execute the notebooks"
	@echo "make lint          ruff; make format applies formatters, make format-check only looks"
	@echo "make prose         house style of the prose on lines that changed since BASE="
	@echo "make types         mypy --strict"
	@echo "make stubs         regenerate the stubs of the compiled module (make stub-check compares)"
	@echo "make tidy          clang-tidy over every C++ file; make tidy-changed over those changed since BASE="
	@echo "make clean         remove build, dist and out; make distclean also .venv"

# --- set-up; every stamp is a step that need not be repeated -----------------------------------------------

$(STAMPS)/venv: tools/install_system_packages.sh tools/find_python.sh
	@tools/install_system_packages.sh
	@base="$(PYTHON)"; base="$${base:-$$(tools/find_python.sh)}"; \
	    echo "Making .venv with $$base ($$("$$base" --version))"; rm -rf .venv; "$$base" -m venv .venv
	@mkdir -p $(@D) && touch $@

$(STAMPS)/build_tools: $(STAMPS)/venv pyproject.toml constraints.txt tools/requirements.py
	@echo "Installing build tools, NumPy, SciPy and matplotlib into .venv"
	@$(PIP_INSTALL) $(call requirements,build runtime) matplotlib
	@touch $@

$(STAMPS)/view_tools: $(STAMPS)/build_tools
	@echo "Installing what pictures, films and notebooks need into .venv"
	@$(PIP_INSTALL) $(call requirements,view) jupyterlab
	@touch $@

$(STAMPS)/test_tools: $(STAMPS)/build_tools
	@echo "Installing what the tests need into .venv"
	@$(PIP_INSTALL) $(call requirements,test)
	@touch $@

$(STAMPS)/learn_tools: $(STAMPS)/build_tools
	@echo "Installing torch, gymnasium and stable-baselines3 into .venv"
	@$(PIP_INSTALL) $(call requirements,learn)
	@touch $@

$(STAMPS)/dev_tools: $(STAMPS)/test_tools
	@echo "Installing developers' tools into .venv"
	@$(PIP_INSTALL) $(call requirements,dev)
	@touch $@

$(STAMPS)/bench_tools: $(STAMPS)/build_tools
	@echo "Installing what the benchmarks compare with into .venv"
	@$(PIP_INSTALL) $(call requirements,bench view vision) rich
	@touch $@

$(STAMPS)/doc_tools: $(STAMPS)/build_tools
	@echo "Installing what the documentation needs into .venv"
	@$(PIP_INSTALL) $(call requirements,docs)
	@touch $@

$(STAMPS)/notebook_tools: $(STAMPS)/build_tools
	@echo "Installing what the notebooks need into .venv"
	@$(PIP_INSTALL) $(call requirements,notebooks)
	@touch $@

# One build folder serves the installed module and the C++ tests, so the engine is compiled once. UNITY=ON compiles some
# files of a room as one, which is quicker where all are compiled and slower where one changed.
UNITY ?=
$(STAMPS)/installed: $(STAMPS)/build_tools $(CXX_SOURCES) $(CMAKE_FILES) $(PYTHON_SOURCES) $(SOURCE_FOLDERS) README.md
	@echo "Building and installing withe (the first time takes some minutes)"
	@python -m pip install --quiet --no-build-isolation --no-deps --force-reinstall \
	    --config-settings=build-dir=$(BUILD) --config-settings=cmake.define.WITHE_PRECOMPILE_HEADERS=ON \
	    $(if $(UNITY),--config-settings=cmake.define.CMAKE_UNITY_BUILD=$(UNITY)) .
	@touch $@

# --- use ----------------------------------------------------------------------------------------------------

demo: $(STAMPS)/installed
	@mkdir -p out
	@python examples/cantilever.py

view: $(STAMPS)/installed $(STAMPS)/view_tools
	@python tools/check_view.py

gallery: $(STAMPS)/installed $(STAMPS)/view_tools
	@$(PIP_INSTALL) $(call requirements,vision)
	@python examples/gallery.py $(NAME)

learn: $(STAMPS)/installed $(STAMPS)/learn_tools

test: TESTS = $(IN_PARALLEL) -m "not slow"
test: ctest pytest

test-all: ctest pytest

# With the C++ benchmarks, where what they measure with is installed, so that they go on compiling.
GOOGLE_BENCHMARK := $(if $(wildcard /usr/include/benchmark/benchmark.h /usr/local/include/benchmark/benchmark.h),ON,OFF)

ctest-build: $(STAMPS)/installed
	@cmake -S . -B $(BUILD) -DWITHE_BUILD_TESTS=ON -DWITHE_BUILD_BENCHMARKS=$(GOOGLE_BENCHMARK) >build/configure.log || { cat build/configure.log; exit 1; }
	@cmake --build $(BUILD)

ctest: ctest-build
	@ctest --test-dir $(BUILD) --output-on-failure --no-tests=error --parallel $(JOBS) --progress

# What only runs on newer machines must not be run on older ones. Compiled files have no such instructions outside the
# kernels for AVX2, the engine's tests pass without these kernels, and on an emulated first x86-64 the engine chooses so.
# Emulated arithmetic is slow: there, tests that repeat much of it are left to the run before.
ROOMS_WITH_KERNELS := integrators contact steps solvers assembly elasticity elastica forces model geometry common
REPEATING := Equations.*:Contact.Matrix*:Candidates.*:*FrictionJacobian.*:*Forces.AdjointIs*:*Forces.MatrixIs*:*ReportsSingular*:*RefusesEntries*:*AgreesWithDense*:UnsymmetricSolvers.*:*Derivatives*
EMULATED := $(filter-out forces elastica,$(ROOMS_WITH_KERNELS))
ctest-baseline: ctest-build
	@command -v qemu-x86_64 >/dev/null || { echo "make ctest-baseline needs qemu-x86_64: apt-get install qemu-user"; exit 1; }
	@python tools/baseline_check.py $(BUILD)
	@printf '%s\n' $(ROOMS_WITH_KERNELS) | xargs -P $(JOBS) -I ROOM \
	    env WITHE_SIMD=baseline $(BUILD)/tests/cpp/test_ROOM --gtest_brief=1
	@printf '%s\n' $(EMULATED) | xargs -P $(JOBS) -I ROOM \
	    qemu-x86_64 -cpu qemu64 $(BUILD)/tests/cpp/test_ROOM --gtest_brief=1 --gtest_filter='-$(REPEATING)'

# Each worker has a core: threads of NumPy's and torch's matrices would only wait for each other.
IN_PARALLEL := --numprocesses $(TEST_JOBS) --dist worksteal

pytest: $(STAMPS)/installed $(STAMPS)/test_tools
	@OMP_NUM_THREADS=1 python -m pytest $(or $(TESTS),$(IN_PARALLEL))

asan: $(STAMPS)/build_tools
	@cmake --preset asan-ubsan
	@cmake --build --preset asan-ubsan
	@ctest --preset asan-ubsan --parallel $(JOBS)

# What threads share: the pool of workers and batches.
tsan: $(STAMPS)/build_tools
	@cmake --preset tsan
	@cmake --build build/tsan --target test_common test_solvers test_world
	@build/tsan/tests/cpp/test_common --gtest_brief=1 --gtest_filter='WorkerPool.*'
	@build/tsan/tests/cpp/test_solvers --gtest_brief=1 --gtest_filter='SolverThreads.*'
	@build/tsan/tests/cpp/test_world --gtest_brief=1 --gtest_filter='Batch.*'

# The interpreter is not built for them, so the sanitizer's library must be loaded first; pybind11's exceptions need the
# C++ library beside it. Python's own allocator would hide what runs past the end of small objects.
SEQUENCES ?= 400
SEED ?= 1
asan-python: $(STAMPS)/build_tools
	@cmake --preset asan-python -DPython_EXECUTABLE=$(VENV)/bin/python
	@cmake --build --preset asan-python
	@tools/asan_python.sh build/asan-python tests/python/random_sequences.py $(SEQUENCES) $(SEED) --jobs $(JOBS)

bench: $(STAMPS)/installed $(STAMPS)/bench_tools
	@python benchmarks $(NAME)

# The environment variable NOTEBOOKS tells docs/conf.py whether to execute the notebooks.
docs: $(STAMPS)/installed $(STAMPS)/doc_tools $(if $(filter off,$(NOTEBOOKS)),,$(STAMPS)/notebook_tools)
	@python -m sphinx --jobs $(JOBS) --quiet --fail-on-warning --keep-going docs out/docs
	@echo "Open out/docs/index.html"

wheel: $(STAMPS)/dev_tools
	@python tools/make_wheel.py

wheels: $(STAMPS)/dev_tools
	@python tools/make_wheel.py --all

# --- quality ------------------------------------------------------------------------------------------------

CXX_FILES = $(CXX_SOURCES) $(CXX_TESTS)

lint: $(STAMPS)/dev_tools
	@ruff check .

format: $(STAMPS)/dev_tools
	@ruff check --fix --exit-zero --quiet .
	@ruff format .
	@clang-format -i $(CXX_FILES)

format-check: $(STAMPS)/dev_tools
	@ruff format --check .
	@clang-format --dry-run --Werror $(CXX_FILES)

prose: $(STAMPS)/venv
	@python tools/prose_lint.py --changed $(BASE)

types: $(STAMPS)/dev_tools
	@mypy

stubs: $(STAMPS)/installed $(STAMPS)/dev_tools
	@tools/stubs.sh

stub-check: $(STAMPS)/installed $(STAMPS)/dev_tools
	@tools/stubs.sh --check

# Nothing is compiled: clang-tidy needs the commands only. There are none for what options leave out.
tidy: $(STAMPS)/dev_tools
	@cmake --preset tidy
	@printf '%s\0' $(filter-out tests/cpp/cholmod_comparison.cpp benchmarks/%,$(filter %.cpp,$(CXX_FILES))) | xargs -0 -n 1 -P $(JOBS) clang-tidy --quiet -p build/tidy

tidy-changed: $(STAMPS)/dev_tools
	@cmake --preset tidy >/dev/null
	@tools/tidy_changed.sh build/tidy $(BASE)

clean:
	rm -rf build dist out

distclean: clean
	rm -rf .venv
