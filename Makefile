# navapp: two commands for a stranger, `make tutorial` and `make test`.

PYTHON ?= python3
UV     ?= $(shell command -v uv 2>/dev/null)
VENV   := .venv
BIN    := $(VENV)/bin
PEERS  := .venv-peers
STAMP  := $(VENV)/.stamp-$(shell cat pyproject.toml constraints.txt | cksum | cut -d' ' -f1)

# Without the bytecode, made once (bytecode), every worker would compile all tests again.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest
# Compiled code does not check its indices: kernels run again with the check, and with a cache of
# their own, because the cache does not know about that switch. Most of the time goes into
# compiling: quickly rather than well, and each kernel once, in one worker; a test that is the first
# to ask for many kernels waits for all of them.
KERNELS := $(shell find navapp sim_devices drivers calibration -name '*kernels.py' | sort)
CHECKED_CACHE := $(VENV)/numba-boundscheck-$(shell cat $(KERNELS) | cksum | cut -d' ' -f1)
CHECKED := NUMBA_BOUNDSCHECK=1 NUMBA_OPT=1 \
    NUMBA_CACHE_DIR=$(CHECKED_CACHE) \
    $(PYTEST) -q -n 1 --timeout 900 --every-kernel
# Every kernel is run by one of them at least: --every-kernel sees to it.
KERNEL_FILES = $(shell grep -rl --include='test_*.py' 'mark\.kernel' tests)
# What last passed with the check: kernels, those who call them or divide their rows, their tests
# with what these use, and the compiler.
CHECKED_RECORD := tests/kernels.checked
CALLERS = navapp/geometry/bands.py \
    $(shell grep -rl --include='*.py' 'kernels import' navapp sim_devices drivers calibration)
TEST_HELPERS = $(shell find tests -name '*.py' ! -name 'test_*' ! -path 'tests/bench/*' ! -path 'tests/ui/*')
CHECKED_SUM = $(shell cat $(sort $(KERNELS) $(CALLERS) $(KERNEL_FILES) $(TEST_HELPERS)) \
    constraints.txt | cksum | cut -d' ' -f1)
KERNEL_TESTS := tests/geometry/test_zbuffer.py tests/geometry/test_masks.py \
    tests/registration --ignore tests/registration/test_register.py \
    tests/sim_devices/test_raster_kernels.py tests/sim_devices/test_shading_kernels.py tests/sim_devices/test_renderer.py \
    tests/sim_devices/test_sensor.py tests/sim_devices/test_sheet.py tests/geometry/test_resampling.py \
    tests/stereo tests/tracking/test_agreement.py tests/tracking/test_edge_kernels.py \
    tests/tracking/test_outline_kernels.py tests/overlay/test_blend_kernels.py tests/preop/test_aspects.py \
    tests/calibration/targets/test_detection.py tests/calibration/targets/test_mark_kernels.py

# The window's libraries: SDL draws into nothing without them. Then screens for the tests.
SYSTEM_DEPS := python3-venv libgl1 libegl1 libgomp1 libusb-1.0-0 tmux \
    libx11-6 libxext6 libxrandr2 libxcursor1 libxi6 libxss1 libxfixes3 \
    xvfb xserver-xorg-core xserver-xorg-video-dummy x11-xserver-utils \
    libxcb-randr0 libxcb-render0 libxcb-shm0 libxcb-xfixes0

.PHONY: run tutorial window test test-all checked-kernels check setup bench peers peers-visp bench-peers system-deps clean help

help:           ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

run: setup      ## the application on the simulated rig
	@echo "new here: make tutorial; with a display in a half-silvered mirror: $(BIN)/navapp run --mirror"
	@$(BIN)/navapp run

tutorial: setup  ## four steps on simulated devices: room, calibration, plan, navigation
	@$(BIN)/navapp tutorial

window: setup   ## the application, with its picture in a window of the desktop
	@$(BIN)/navapp run --window

test: setup  ## style, types, import rules and the tests: about four minutes
	@$(MAKE) --no-print-directory -j2 --output-sync=line check bytecode kernels-if-changed tests

test-all: setup check bytecode  ## the release gate: as test, with every case of every test
	$(PYTEST) -n 4 --dist loadgroup --release
	$(CHECKED) --release $(KERNEL_TESTS) $(KERNEL_FILES)

.PHONY: bytecode kernels-if-changed tests style
bytecode: setup
	@$(PYTEST) -q --collect-only --release >/dev/null

checked-kernels: setup  ## kernels with checked indices; remembers, for make test, that they passed
	@rm -rf $(filter-out $(CHECKED_CACHE),$(wildcard $(VENV)/numba-boundscheck*))
	$(CHECKED) -m kernel $(KERNEL_FILES)
	@echo "$(CHECKED_SUM) by make checked-kernels; to be committed with the kernels" > $(CHECKED_RECORD)

# Minutes of compiling, beside the tests, unless the same kernels have passed before.
kernels-if-changed: setup bytecode
	@if grep -qs '^$(CHECKED_SUM) ' $(CHECKED_RECORD); then \
	    echo "kernels: as they last passed with checked indices"; \
	else $(MAKE) checked-kernels; fi

# With +, line by line as they come. More workers than cores: one runs the tests that wait. They
# begin beside types, which take one core for a minute.
tests: style bytecode
	+$(PYTEST) -n 3 --dist loadgroup

check: style    ## style, types, import rules
	$(BIN)/mypy
	$(BIN)/lint-imports

style: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

# A command of many lines, of which a filter tells few; it fails as the command does.
told = { $(1) || touch $(VENV)/.failed; } | $(2); \
    if test -e $(VENV)/.failed; then rm $(VENV)/.failed; exit 1; fi
ITSELF := -e '.[test,oak]'
FEW_OF_UV  := awk '!/^ [-+~] /'
FEW_OF_PIP := awk '/^Collecting/ && ++n % 20 == 0 { print "  " n " packages looked up" } \
    /^Installing collected/ { print "  unpacking " NF - 3 " packages" } { fflush() }'

setup: $(STAMP)  ## .venv with pinned packages, kernels compiled

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo "navapp needs Python 3.11 or newer; set PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || \
	    { echo "a system package is missing; run: make system-deps"; exit 1; }
	@test -x $(BIN)/python && $(BIN)/python -m pip --version >/dev/null 2>&1 || \
	    { rm -rf $(VENV); $(PYTHON) -m venv $(VENV); }
	@echo "1 of 2: installing the pinned packages into $(VENV) (once, some minutes)"
ifneq ($(UV),)
	@$(call told,$(UV) pip install --python $(BIN)/python -c constraints.txt $(ITSELF) 2>&1,$(FEW_OF_UV))
else
	@$(call told,$(BIN)/python -m pip install --progress-bar off --disable-pip-version-check \
	    -c constraints.txt $(ITSELF),$(FEW_OF_PIP))
endif
	@echo "2 of 2: compiling the kernels (once, some minutes)"
	@printf '' > $(VENV)/empty.toml
	@# Until the bone is followed: what is compiled later stops the first session for seconds.
	@echo "  those of the simulated session"
	@$(BIN)/navapp --config $(VENV)/empty.toml run --headless --frames 14 >/dev/null
	@echo "  those of the display in the mirror"
	@$(BIN)/navapp --config $(VENV)/empty.toml run --headless --mirror --frames 14 >/dev/null
	@echo "  those of pictures in terminals"
	@$(BIN)/python -c 'from navapp.ui.pictures.graphics import compile_encoders as c; c()'
	@rm -f $(VENV)/.stamp-* && touch $@

bench: setup    ## accuracy on recorded operations (data in NAVAPP_DATA)
	@$(BIN)/python -m tests.bench.recorded_accuracy

# The peers' wheel excludes the plain OpenCV: it has an environment of its own.
peers:          ## .venv-peers: other people's trackers, for `navapp evaluate --peers`
	@test -x $(PEERS)/bin/python || $(PYTHON) -m venv $(PEERS)
	@$(PEERS)/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	    opencv-contrib-python-headless==5.0.0.93 small_gicp==1.0.1 open3d-cpu \
	    numpy numba scipy pydantic platformdirs fast-simplification

peers-visp: peers  ## another one: ViSP's tracker (Debian's libvisp-dev)
	@pkg-config --exists visp || { echo "ViSP is missing: apt-get install libvisp-dev"; exit 1; }
	g++ -O2 -std=c++17 tests/bench/visp/surface_tracker.cpp -o $(PEERS)/bin/visp_surface_tracker \
	    $$(pkg-config --cflags visp) -lvisp_mbt -lvisp_klt -lvisp_core

bench-peers: setup peers  ## stereo beside OpenCV's contributed filters, registration beside Open3D, GICP
	@$(PEERS)/bin/python -m tests.bench.stereo_speed
	@$(PEERS)/bin/python -m tests.bench.occlusion_speed
	@$(PEERS)/bin/python -m tests.bench.line_speed --frames 30
	@$(PEERS)/bin/python -m tests.bench.registration --speed --seeds 10

system-deps:    ## Debian packages for everything beyond the simulated session
	apt-get update -qq
	apt-get install -y --no-install-recommends $(SYSTEM_DEPS)

clean:          ## remove what was installed and built here
	rm -rf $(VENV) $(PEERS) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
