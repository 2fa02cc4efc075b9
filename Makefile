# make demo    install, render two scenes, track them with three trackers, write report.html
# make test    install and run the tests
# make validate  long statistics, nightly: tests/validation and the tests marked slow
# make lint    ruff and mypy
# make bench   speeds, one `name: value unit` a line
# make docs    rewrite the generated tables of the documents (make pictures: the pictures too, by chromium)
# make oracles other implementations of metrics, IMM and JPDA, and loaders of data sets, in .venv-oracles
# make peers   other people's trackers, of one target and of many, in an environment of their own, .venv-peers
# make clean   remove what was generated (the environment .venv stays)

# The first interpreter that runs: a shim on PATH may stand for a version that is not installed.
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	if $$p -c "" >/dev/null 2>&1; then echo $$p; break; fi; done)
JOBS ?= 2
VENV := .venv
PEERS := .venv-peers
ORACLES := .venv-oracles
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# The tests start hundreds of processes: where an environment forbids to keep bytecode, each compiles all anew.
export PYTHONDONTWRITEBYTECODE :=
# Each worker, and each process that it starts, has one core: numpy's library would keep threads for every core, which
# wait for work by turning, a tenth of a second of each process.
test validate: export OPENBLAS_NUM_THREADS ?= 1
TESTS := $(BIN)/python -m pytest -n $(JOBS) --dist worksteal

.PHONY: demo test validate lint bench docs pictures peers oracles install clean

demo: $(INSTALLED)
	$(BIN)/irsim render sky -o recordings/sky.mcap
	$(BIN)/irsim render ground -o recordings/ground.mcap
	@rm -f recordings/demo.db
	$(BIN)/irtrack bench sky ground --trackers grey_pf,template,kalman --seeds 6 --jobs $(JOBS) --results recordings/demo.db
	$(BIN)/irtrack report recordings/demo.db -o report.html

test: $(INSTALLED)
	@$(TESTS) -m "not slow" --ignore tests/validation

validate: $(INSTALLED)
	@$(TESTS) -m slow --ignore tests/validation
	@$(TESTS) tests/validation

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(INSTALLED)
	@PYTHONPATH=tests/support $(BIN)/python tests/bench/bench.py

docs: $(INSTALLED)
	$(BIN)/python docs/generate.py

pictures: docs demo
	$(BIN)/python docs/pictures.py

# OpenCV's contrib wheel owns the same files as the plain one, which `trackers` needs: side by side they break each other.
# A package that needs torch is as one without a wheel.
peers:
	@$(PEERS)/bin/python -c "" 2>/dev/null || "$(PYTHON)" -m venv --clear $(PEERS)
	@echo "torch<0" > $(PEERS)/without.txt
	@for each in trackers norfair-enough motpy stonesoup dlib-bin; do \
		$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check -c $(PEERS)/without.txt $$each >/dev/null 2>&1 \
		|| echo "without $$each: it does not install for this Python without torch" >&2; done
	@$(PEERS)/bin/python -m pip uninstall --quiet --disable-pip-version-check --yes opencv-python 2>/dev/null || true
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check numpy
	$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "opencv-contrib-python-headless>=4.10"
	@$(PEERS)/bin/python irtrack/external/server.py
	@$(PEERS)/bin/python irtrack/external/many_server.py

# pyirstdmetrics alone: scikit-image brings all that it needs.
oracles: $(INSTALLED)
	@$(ORACLES)/bin/python -c "" 2>/dev/null || "$(PYTHON)" -m venv --clear $(ORACLES)
	$(ORACLES)/bin/python -m pip install --quiet --disable-pip-version-check trackeval scikit-image filterpy stonesoup scikit-learn
	$(ORACLES)/bin/python -m pip install --quiet --disable-pip-version-check pycocotools supervision rosbags rerun-sdk opencv-python-headless
	$(ORACLES)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps pyirstdmetrics
	$(BIN)/python -m pytest tests/validation/test_oracles.py tests/validation/test_dataset_loaders.py

install: $(INSTALLED)

$(INSTALLED): pyproject.toml hatch_build.py $(wildcard irsim/_native/*.[ch] irtrack/_native/*.[ch])
	@test -n "$(PYTHON)" || { echo "irtrack needs Python 3.11 or newer and found none: make PYTHON=/path/to/python" >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11) and f"irtrack needs Python 3.11 or newer; $(PYTHON) is {sys.version.split()[0]}: make PYTHON=/path/to/python")'
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make environments (on Debian and Ubuntu: apt install python3-venv)" >&2; exit 1; }
	@$(BIN)/python -c "" 2>/dev/null || "$(PYTHON)" -m venv --clear $(VENV)
	@echo "installing into $(VENV) (once, about half a minute)"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

clean:
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis report.html
	rm -f */_native/_kernels*.so */_native/_kernels*.pyd $(INSTALLED)
	rm -f recordings/*.mcap recordings/*.db recordings/*.db-* *.mcap *.db
	find irsim irtrack tests -name __pycache__ -type d -prune -exec rm -rf {} +
