# The two commands to know are `make demo` and `make test`; each makes the virtual environment when it is missing.
# VENV= chooses where it is, PYTHON= what it is made with.

VENV ?= .venv
# 3.11 is the newest Python with a pybullet wheel. Asked to run, not only found: version managers leave empty shims.
PYTHON ?= $(shell python3.11 -c 'print("python3.11")' 2>/dev/null || echo python3)
BIN := $(VENV)/bin
STAMP := $(VENV)/.neurosym-installed
SRC := neurosym domains planners learned_priors tests examples $(wildcard benchmarks)
OUT ?= out/compare-soma
FUZZ_SECONDS ?= 3600

.PHONY: help setup demo readme reproduce results test fuzz check bench docs clean constraints

help:
	@echo "make demo       compare planners and priors on the 120 test cubes (table, results.csv, iterations.png)"
	@echo "make reproduce  every experiment of the paper, quick scale (up to 15 minutes each), then make results"
	@echo "make results    docs/results.md and its figures, from the last runs of make reproduce"
	@echo "make test       the whole test suite"
	@echo "make docs       the site in site/, links checked, without the network"
	@echo "make fuzz       broken documents, and random assemblies against brute force (FUZZ_SECONDS=$(FUZZ_SECONDS))"
	@echo "make check      ruff, mypy --strict, import-linter"
	@echo "make bench      the benchmarks"
	@echo "make setup      only make the virtual environment (VENV=$(VENV) PYTHON=$(PYTHON))"
	@echo "make clean      remove what the above made, the virtual environment excepted"

setup: $(STAMP)

# Editing what is to be installed installs it again; an environment that exists is kept and brought up to date.
$(STAMP): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null || { echo "No $(PYTHON) here. Install Python 3.11, or name another: PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Expected Python 3.11 or later; $(PYTHON) is $$($(PYTHON) --version). Name another: PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
		echo "Note: $$($(PYTHON) --version) has no pybullet wheel, so pybullet will be compiled: that needs a C++ compiler and takes minutes. With python3.11 installed it would not."
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: $(STAMP)
	$(BIN)/neurosym compare soma --problems test --out $(OUT)

# The README's table, from the last `make demo`: between the two marks everything is replaced.
readme: demo
	sed -i -e '/<!-- table:begin/,/<!-- table:end/{//!d}' -e '/<!-- table:begin/r $(OUT)/results.md' README.md

# A run that was killed goes on where it was.
EXPERIMENTS := tower tower-easy tower-by-sequence unseen variable soma soma-published scrabble
reproduce: $(STAMP)
	@for name in $(EXPERIMENTS); do $(BIN)/neurosym reproduce $$name > /dev/null || exit 1; done
	@$(MAKE) results

results: $(STAMP)
	$(BIN)/neurosym results $(addprefix out/reproduce-,$(EXPERIMENTS)) --to docs/results.md

# Two processes, one thread each: numerical libraries that start threads of their own on a shared machine crawl.
test: $(STAMP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2

fuzz: $(STAMP)
	OMP_NUM_THREADS=1 PYTHONPATH=tests/fuzz $(BIN)/python tests/fuzz/run.py $(FUZZ_SECONDS)

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy --strict
	$(BIN)/lint-imports

# Strict: a link that leads nowhere, or a name without a docstring to show, ends it.
docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

bench: $(STAMP)
	@for file in benchmarks/*.py; do echo "== $$file"; NEUROSYM_KEEP=0 OMP_NUM_THREADS=1 $(BIN)/python $$file || exit 1; done

# What is installed now becomes what is pinned. GPU libraries follow from torch and are left to it.
constraints: $(STAMP)
	{ head -1 constraints.txt; $(BIN)/python -m pip freeze --exclude-editable | grep -vE '^(nvidia|cuda|triton|#)'; } > constraints.tmp
	mv constraints.tmp constraints.txt

clean:
	rm -rf out dist build site .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find $(SRC) -name __pycache__ -prune -exec rm -rf {} +
