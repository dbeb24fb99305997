# Two commands do it all on a fresh machine with Python 3.10+ and make: `make demo`, `make test`.
PYTHON ?= python3
VENV ?= .venv
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
else
BIN := $(VENV)/bin
endif
STAMP := $(VENV)/.installed

.PHONY: demo test interop lint guard bench fuzz mutants clean help

help:
	@echo "make demo     the workshop's button lights its LED, on the virtual board"
	@echo "make test     every test"
	@echo "make interop  against Debian's real ROS 1, which it installs (needs apt-get and root)"
	@echo "make lint     ruff and mypy"
	@echo "make guard    whether it has become slower"
	@echo "make bench    the benchmarks"
	@echo "make fuzz     ten minutes of anything at all, sent to a master"
	@echo "make mutants  small faults in graph/, wire/ and the journal: which ones no test notices"
	@echo "make clean    remove what the above made"

demo: $(STAMP)
	@$(BIN)/minirospy demo

test: $(STAMP)
	@$(BIN)/python -m pytest -n 2 --dist worksteal --ignore=tests/interop

interop: $(STAMP)
	@sh tests/interop/install_ros.sh
	@$(BIN)/python -m pytest -n 2 --dist worksteal tests/interop

guard: $(STAMP)
	@$(BIN)/python benchmarks/guard.py

bench: $(STAMP)
	@$(BIN)/python benchmarks/run.py
	@$(BIN)/python benchmarks/messages.py

fuzz: $(STAMP)
	@$(BIN)/python tests/fuzz.py

lint: $(STAMP)
	@$(BIN)/python -m ruff check .
	@$(BIN)/python -m ruff format --check .
	@$(BIN)/python -m mypy

mutants: $(STAMP)
	@$(BIN)/python tests/mutants.py

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis

# Made again when the project file or a definition changes; an interrupted install leaves no stamp.
$(STAMP): pyproject.toml $(wildcard hatch_build.py minirospy/idl/*.py msgs/*/*/* msgs/*/package.xml)
	@$(PYTHON) -c "import sys; v = sys.version_info; v >= (3, 10) or sys.exit('minirospy needs Python 3.10 or newer, this is %d.%d: make PYTHON=python3.x' % v[:2])"
	@echo "Making the environment $(VENV) ..."
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[dev]"
	@$(PYTHON) -c "open('$(STAMP)', 'w').close()"
