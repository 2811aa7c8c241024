# Two commands on a fresh machine with Python 3.11+ and make: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUNTIME := $(VENV)/.runtime
DEV := $(VENV)/.dev
# Modules are byte-compiled when they are first imported: compiling every package would triple the time of the set-up.
# Also where the environment forbids it, as images of containers do: without, each start of a process takes twice as long.
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
# uv needs a quarter of pip's processor time.  It asks the index that pip is set to; where it cannot be had or fails, pip installs.
INSTALL = index=$${PIP_INDEX_URL:-$$($(PIP) config get global.index-url 2>/dev/null)}; \
	$(BIN)/uv pip install --quiet --python $(BIN)/python $${index:+--default-index "$$index"} $(1) 2>/dev/null || \
	$(PIP) install --no-compile $(1)
PYTEST := $(BIN)/python -m pytest
PARALLEL := -n auto --dist loadfile
# One worker more than processors: most of the core tests and half of the nightly ones wait for processes.
WAITING = -n $$($(BIN)/python -c 'import os; print((os.cpu_count() or 1) + 1)') --dist loadfile
NIGHTLY = $(WAITING) --hypothesis-profile nightly
# A test belongs to the last tier of its marks: unit (no mark), slow, core, nightly.
UNIT := not slow and not core and not nightly
FAST := not core and not nightly
CORE := core and not nightly

# With no target: the list of targets.
.DEFAULT_GOAL := help
.PHONY: help demo test checked tested tested-nightly test-unit test-core test-nightly coverage check format compile docs benchmark evaluate priors postures sbom lock clean

help:
	@echo "make demo        set up $(VENV) and run the demo; open http://127.0.0.1:8080"
	@echo "make test        lint, types, unit tests and slow tests"
	@echo "make test-unit   unit tests only"
	@echo "make test-core   each service as a process, the page in a browser, containers, the wheel"
	@echo "make test-nightly everything there is"
	@echo "make coverage    lines and branches that each tier reaches"
	@echo "make check       lint, format and types"
	@echo "make format      format the code and apply the linter's fixes"
	@echo "make docs        build the documentation into build/site"
	@echo "make benchmark   time functions; 'make evaluate' measures accuracy, latency and robustness (hours; QUICK=1: minutes)"
	@echo "make priors      train the motion priors again; 'make postures' the posture models"
	@echo "make sbom        write the bill of materials build/sbom.cdx.json; 'make lock' the pinned versions of deploy/requirements.txt"
	@echo "make clean       delete $(VENV), caches and build/"

demo: $(RUNTIME)
	$(BIN)/zenocap demo $(ARGS)

# The checks use what the tests leave of the processors; their result comes last.
test: $(RUNTIME)
	@$(MAKE) --no-print-directory -j2 compile $(DEV) ARGS=
	@$(MAKE) --no-print-directory -j2 checked tested; status=$$?; cat build/check.log; exit $$status

checked:
	@mkdir -p build && $(MAKE) --no-print-directory check >build/check.log 2>&1

tested:
	$(PYTEST) -m "$(FAST)" $(PARALLEL) $(ARGS)

test-unit: $(DEV)
	$(PYTEST) -m "$(UNIT)" $(PARALLEL) $(ARGS)

test-core: $(DEV)
	$(PYTEST) -m "$(CORE)" $(WAITING) $(ARGS)

# The checks, one process after another, run beside the tests; what they find is shown at once.
test-nightly: $(RUNTIME)
	@$(MAKE) --no-print-directory -j2 compile docs ARGS=
	@$(MAKE) --no-print-directory -j2 check tested-nightly

# Some run by themselves after the others.  Status 5: ARGS choose none of the tests.
tested-nightly:
	@$(PYTEST) -m "not alone" $(NIGHTLY) --durations=25 $(ARGS); others=$$?; \
	$(PYTEST) -m alone --hypothesis-profile nightly --durations=25 $(ARGS); alone=$$?; \
	[ $$others -eq 0 -o $$others -eq 5 ] && [ $$alone -eq 0 -o $$alone -eq 5 ]

coverage: $(DEV)
	$(BIN)/python -m tests.measures.coverage $(ARGS)

check: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(DEV)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# While the development tools are installed: from the checkout itself, since its entry among the packages is replaced then.
compile: $(RUNTIME)
	@PYTHONPATH=$(CURDIR) $(BIN)/python -P -m zenocap warmup >/dev/null

docs: $(DEV)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet $(ARGS)

benchmark: $(DEV)
	$(PYTEST) --benchmark-only --benchmark-columns=min,median,rounds benchmarks/micro $(ARGS)

evaluate: $(DEV)
	$(BIN)/python -m benchmarks all $(if $(QUICK),--small) $(ARGS)

priors: $(DEV)
	$(BIN)/python -m zenocap.tools.teach.dataset.build_priors $(ARGS)

postures: $(DEV)
	$(BIN)/python -m zenocap.tools.teach.dataset.build_postures $(ARGS)

sbom: $(DEV)
	$(BIN)/python -m zenocap.tools.operate.supply_chain.bill_of_materials $(ARGS)

lock: $(DEV)
	$(BIN)/python -m zenocap.tools.operate.supply_chain.lock $(ARGS)

$(RUNTIME): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "zenocap needs Python 3.11 or newer; set PYTHON=..." >&2; exit 2; }
	@echo "Setting up $(VENV) (once) ..."
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) install --no-compile uv 2>/dev/null || true
	@$(call INSTALL,--editable .)
	@touch $@

$(DEV): $(RUNTIME)
	@echo "Installing development tools into $(VENV) (once) ..."
	@$(call INSTALL,--editable '.[dev]')
	@touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find common services simulation tools tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
