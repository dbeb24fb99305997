# Two commands do everything on a fresh machine with Python 3.10+ and make: `make demo`, `make test`.
PYTHON ?= python3
VENV ?= .venv
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
else
BIN := $(VENV)/bin
endif
# minirospy alone, its generated modules, and the packages for tests and checks.
PROGRAMS := $(VENV)/.programs
OVERLAY := $(VENV)/.overlay
STAMP := $(VENV)/.installed
READY := $(STAMP) $(OVERLAY)

# As on a user's machine: processes keep what they compile, which makes thousands of them start faster, and buffer their output.
unexport PYTHONDONTWRITEBYTECODE PYTHONUNBUFFERED

# Written by processes that collect half of the tests each. They leave the compiled tests and the constants that hypothesis
# finds in modules, which each of the four processes that run the tests would otherwise make for itself.
COMPILED := $(VENV)/.compiled-core $(VENV)/.compiled-rest
COMPILED_CORE := tests/core tests/ros tests/web

# What needs no process of its own, and the first messages and calls between nodes: under a minute on two cores.
CHECKED := tests/core/graph tests/core/wire tests/core/idl tests/introspect tests/overlay \
  tests/runtime/master/test_master.py tests/runtime/node/test_topics.py tests/runtime/node/test_services.py \
  tests/test_architecture.py tests/test_layers.py tests/base/test_names.py tests/base/test_times.py tests/base/test_clock.py \
  tests/base/test_environment.py tests/base/test_escape.py tests/base/test_private_files.py tests/board/test_scanner.py

.PHONY: demo check test interop ros2 ros2-core windows pythons lint guard bench fuzz mutants site release clean help

help:
	@echo "make demo     install minirospy into .venv, show the workshop's button and LED on the virtual board"
	@echo "make check    the fast tests, lint and types: under a minute"
	@echo "make test     install what the tests need, run every test: some minutes"
	@echo "make interop  test against Debian's real ROS 1, which it installs (needs apt-get and root)"
	@echo "make windows  test on Windows' CPython by Wine, which it installs (needs apt-get and root)"
	@echo "make pythons  run the fast tests on every Python found, with -X dev"
	@echo "make ros2     test the bridge to ROS 2 against real ROS 2, which it installs from PyPI"
	@echo "make ros2-core  the same without the peers over Zenoh, whose installation takes minutes"
	@echo "make lint     check style (ruff) and types (mypy); the page by eslint and tsc if node is installed"
	@echo "make guard    fail if a message, a call or the start of a node costs much more than plain sockets, a plain ring or a plain Python"
	@echo "make bench    run the benchmarks"
	@echo "make fuzz     send random requests to a master and the bridge, random files to the readers, ten minutes each"
	@echo "make mutants  put small faults into core/graph/, core/wire/, the journal and access; list those that no test notices"
	@echo "make site     write the documentation as a site to build/site"
	@echo "make release  build sdist and wheel into dist/, check them, try the wheel on every Python found"
	@echo "make clean    remove the environment and all that was generated"

# A second make sees that the installation has just written the overlay.
demo: $(PROGRAMS)
	@$(MAKE) --silent --no-print-directory $(OVERLAY)
	@$(BIN)/minirospy demo

check: lint
	@$(BIN)/python -m pytest -q -n 2 --dist worksteal $(CHECKED)

test: $(READY)
	@$(MAKE) --silent --no-print-directory -j 2 $(COMPILED)
	@$(BIN)/python -m pytest -n 4 --dist worksteal --ignore=tests/interop --ignore=tests/windows

interop: $(READY)
	@sh tests/interop/install_ros.sh
	@$(BIN)/python -m pip install -q foxglove-sdk || echo "foxglove-sdk cannot be installed: its server is not compared"
	@$(BIN)/python -m pytest -n 3 --dist worksteal tests/interop --ignore=tests/interop/test_interop_ros2.py
	@$(BIN)/python -m pip install -q tree-sitter tree-sitter-powershell || echo "the grammar of PowerShell cannot be installed"
	@$(BIN)/python -m pytest -n 2 -k "zsh or fish or shellcheck or grammar" tests/workspace

# The environment is kept in build/windows; tests that need no Unix run in there, too.
WINDOWS_TESTS := tests/core/wire tests/core/graph tests/core/idl/test_parse.py tests/base/test_child_lifetime.py tests/base/test_signal_dispatch.py \
  tests/base/test_names.py tests/base/test_times.py tests/base/test_clock.py tests/base/test_environment.py tests/base/test_open_files.py tests/board \
  tests/runtime/node/test_topics.py
windows: $(READY)
	@sh tests/windows/install_wine.sh
	@$(BIN)/python tests/windows/windows.py setup
	@$(BIN)/python -m pytest tests/windows
	@$(BIN)/python tests/windows/windows.py test $(WINDOWS_TESTS)

# The tests of the sources' structure are left out: their result does not depend on the Python.
pythons: $(READY)
	@$(BIN)/python tools/pythons.py $(PYTHONS) -- $(filter-out tests/test_architecture.py tests/test_layers.py,$(CHECKED))

# Without the peers over Zenoh, whose installation takes minutes.
ros2-core: $(READY)
	@$(BIN)/python -m tests.interop.install_ros2
	@$(BIN)/python -m pytest tests/interop/test_interop_ros2.py

ros2: $(READY)
	@$(BIN)/python -m tests.interop.install_ros2
	@$(BIN)/python -m tests.interop.install_zenoh_peers
	@$(BIN)/python -m pytest tests/interop/test_interop_ros2.py tests/interop/test_interop_ros2_zenoh.py

guard: $(READY)
	@$(BIN)/python benchmarks/guard.py

bench: $(READY)
	@$(BIN)/python benchmarks/run.py
	@$(BIN)/python benchmarks/messages.py

fuzz: $(READY)
	@$(BIN)/python tests/fuzz.py
	@$(BIN)/python tests/fuzz_bridge.py
	@$(BIN)/python tests/fuzz_readers.py

lint: $(READY)
	@$(BIN)/python -m ruff check .
	@$(BIN)/python -m ruff format --check .
	@$(BIN)/python -m mypy
	@$(BIN)/python tools/check_page.py

mutants: $(READY)
	@$(BIN)/python tests/mutants.py

site: $(READY)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[docs]"
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --clean

release: $(READY)
	@$(BIN)/python -m pip install -q twine
	@$(BIN)/python tools/release.py

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis

# Made again when the project file or a definition changes; an interrupted install leaves no stamp. Modules are compiled when
# they are first imported: most of them never are.
$(PROGRAMS): pyproject.toml $(wildcard hatch_build.py minirospy/cli/registry.py minirospy/cli/windows.py minirospy/core/idl/*.py msgs/*/*/* msgs/*/package.xml)
	@$(PYTHON) -c "import sys; v = sys.version_info; v >= (3, 10) or sys.exit('minirospy needs Python 3.10 or newer, this is %d.%d: make PYTHON=python3.x (docs/install.md)' % v[:2])"
	@echo "Making the environment $(VENV) ..."
	@$(PYTHON) -m venv $(VENV)
	@echo "Installing minirospy and its libraries ..."
	@$(BIN)/python -m pip install --disable-pip-version-check --no-compile --editable .
	@$(PYTHON) -c "open('$(PROGRAMS)', 'w').close(); open('$(OVERLAY)', 'w').close()"

# minirospy[dev] is the installed one: only the packages of the extra are added.
$(STAMP): $(PROGRAMS)
	@echo "Installing what the tests and checks need into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile "minirospy[dev]"
	@$(PYTHON) -c "open('$(STAMP)', 'w').close()"

# The run of the tests reports what cannot be collected.
COLLECT := PYTEST_ADDOPTS= $(BIN)/python -m pytest -p no:terminal -o addopts=--import-mode=importlib --collect-only
$(VENV)/.compiled-core: | $(READY)
	@$(COLLECT) $(COMPILED_CORE) || :
	@$(PYTHON) -c "open('$@', 'w').close()"

$(VENV)/.compiled-rest: | $(READY)
	@$(COLLECT) --ignore=tests/interop --ignore=tests/windows $(COMPILED_CORE:%=--ignore=%) || :
	@$(PYTHON) -c "open('$@', 'w').close()"

# Written again when a module that programs import changes what it offers.
$(OVERLAY): $(PROGRAMS) $(wildcard minirospy/ros/*.py minirospy/ros/*.json minirospy/ros/*/*/*.py minirospy/ros/*/*/*/*.py minirospy/workspace/elsewhere.py)
	@$(BIN)/python -m minirospy.ros.overlay_modules
	@$(PYTHON) -c "open('$(OVERLAY)', 'w').close()"
