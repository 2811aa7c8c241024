# Two commands on a fresh machine with Python 3.11+ and make: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
STAMP := $(VENV)/.installed

EVALUATIONS := bodies postures clips matchings scorer stages hull latency logging damage kills replay_timing hybrid recognition animator load

.PHONY: demo test check benchmark evaluate priors postures clean

demo: $(STAMP)
	$(VENV)/bin/zenocap demo $(ARGS)

test: $(STAMP) check
	$(VENV)/bin/python -m pytest $(ARGS)

check: $(STAMP)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy

benchmark: $(STAMP)
	$(VENV)/bin/python -m pytest --benchmark-only --benchmark-columns=min,median,rounds $(ARGS)

evaluate: $(STAMP)
	@for name in $(EVALUATIONS); do $(VENV)/bin/python -m tests.evaluation.$$name || exit 1; done

priors: $(STAMP)
	$(VENV)/bin/python -m services.tracker.prior.ship $(ARGS)

postures: $(STAMP)
	$(VENV)/bin/python -m services.takes.act.ship $(ARGS)

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "zenocap needs Python 3.11 or newer; set PYTHON=..." >&2; exit 2; }
	@echo "Setting up $(VENV) (once) ..."
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	$(VENV)/bin/zenocap warmup
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
