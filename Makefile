# `make` sets up the machine, builds and runs; `make test` sets up and runs all tests.
CARGO ?= cargo
AFTERLIGHT = $(or $(CARGO_TARGET_DIR),target)/debug/afterlight
DEMO ?= demo

.PHONY: run build setup test stability lint doc peers bench bench-relight bench-passes bench-plate bench-transfer weights accuracy trials demo-interview screenshots clean-demo

run: build
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then \
		$(AFTERLIGHT) demo $(DEMO) --prepare && exec $(AFTERLIGHT) studio $(DEMO)/project; \
	else \
		exec $(AFTERLIGHT) demo $(DEMO); \
	fi

build: setup
	$(CARGO) build --locked

# Missing system packages: a Vulkan loader with a software adapter, window libraries, ffmpeg.
setup:
	@sh tools/setup.sh

# Runs all tests of all crates, and lists skipped tests with their reasons at the end. AFTERLIGHT_REQUIRED is a
# comma-separated list of needs that must not be missing: shared data, gpu, gpu f16, gpu clock, ffmpeg, python, mediapipe, bf16, small
# disk, pfspanoramic, prlimit, blender, openjd, slurm.
test: setup
	@out="$${CARGO_TARGET_DIR:-target}"; mkdir -p "$$out"; out=$$(cd "$$out" && pwd); \
		: >"$$out/skipped.txt"; : >"$$out/stability.txt"; \
		AFTERLIGHT_SKIPPED="$$out/skipped.txt" AFTERLIGHT_STABILITY="$$out/stability.txt" \
		AFTERLIGHT_PYTHON="$${AFTERLIGHT_PYTHON-$(PYTHON)}" AFTERLIGHT_OPENJD="$${AFTERLIGHT_OPENJD-$(OPENJD)}" \
		$(CARGO) test --locked --workspace --no-fail-fast; \
		code=$$?; awk -f tests/support/skipped.awk "$$out/skipped.txt"; exit $$code

# Runs all tests and writes docs/stability.md: the hard cases shown by the tests, one line each.
stability: test
	$(CARGO) run --locked -q -p afterlight-test-support --bin stability "$${CARGO_TARGET_DIR:-target}/stability.txt" >docs/stability.md.new
	mv docs/stability.md.new docs/stability.md

# For sessions without a runtime folder, where Mesa's driver prints an error each time.
test bench bench-relight bench-passes bench-plate bench-transfer: export XDG_RUNTIME_DIR ?= $(CURDIR)/target

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

doc:
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps

# Python environment with PyTorch, for comparing and racing the network; kept until the requirements change.
# Pip's own settings choose the source; a CPU build is enough.
PEERS = $(or $(CARGO_TARGET_DIR),target)/peers
PYTHON = $(abspath $(wildcard $(PEERS)/bin/python))

peers:
	@cmp -s tests/peers/requirements.txt $(PEERS)/requirements.txt || { \
		python3 -m venv --clear $(PEERS) && \
		$(PEERS)/bin/pip install -r tests/peers/requirements.txt && \
		cp tests/peers/requirements.txt $(PEERS)/requirements.txt; }

# Reference implementation of Open Job Description, which runs farm jobs in the tests.
ENGINE = $(or $(CARGO_TARGET_DIR),target)/openjd
OPENJD = $(abspath $(wildcard $(ENGINE)/bin/openjd))
FARM_FOLDER ?= $(or $(CARGO_TARGET_DIR),target)/farm

.PHONY: openjd farm
openjd:
	@cmp -s tests/openjd/requirements.txt $(ENGINE)/requirements.txt || { \
		python3 -m venv --clear $(ENGINE) && \
		$(ENGINE)/bin/pip install -r tests/openjd/requirements.txt && \
		cp tests/openjd/requirements.txt $(ENGINE)/requirements.txt; }

# Measures the time per frame on this otherwise idle machine and writes the tables of docs/farm.md: some ten minutes.
# The measured projects are made once.
farm: build
	$(CARGO) run --locked -q -p afterlight-rates -- $(AFTERLIGHT) $(FARM_FOLDER) docs/farm.md

# Speed and memory of the network, and of PyTorch if installed. BENCH="--size 128" is short.
bench:
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) bench --locked --profile dev --bench network -- $(BENCH)

# The sum of lamps against the memory limit, NumPy and PyTorch.
bench-relight:
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) bench --locked --profile dev --bench relight -- $(BENCH)

# Every pass against the memory limit. BENCH="--software" also accepts a software GPU.
bench-passes:
	$(CARGO) bench --locked --profile dev --bench passes -- $(BENCH)

# Light that multiplies the plate: its time against a copy of the plate, and, on shoots with a truth, SHOOTS="DIR DIR",
# the accuracy of each way to transfer light to the plate.
bench-plate:
	$(CARGO) bench --locked --profile dev --bench plate -- $(addprefix --shoot ,$(SHOOTS)) $(BENCH)

# A frame's OLATs by transfer, and a dense flow beside OpenCV's.
bench-transfer:
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) bench --locked --profile dev --bench transfer -- $(BENCH)

# Accuracy of the kinds of weights: writes docs/weights.md in some minutes.
weights:
	$(CARGO) run --locked -p afterlight-weights

# Measures shoots with a truth and writes docs/accuracy.md with all its tables, plots and pictures. BUDGET limits the run in
# minutes: the next run continues, and the page lists what is missing. MINUTES sets the training time of the base.
# LADDER=no measures nothing and writes the page from earlier results.
BUDGET ?= 90
accuracy: build
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) run --locked -p afterlight-accuracy -- --budget $(BUDGET) --program $(AFTERLIGHT) \
		$(addprefix --shoot ,$(SHOOTS)) $(addprefix --minutes ,$(MINUTES)) $(if $(filter no,$(LADDER)),--no-ladder)

# Measures predictions on dissimilar shoots, before training and after MINUTES of it (such as 1,3,10), and writes
# docs/panel.md. SHOOTS adds shoots with a truth: SHOOTS="person=DIR other=DIR".
.PHONY: panel
panel: build
	$(CARGO) run --locked -q -p afterlight-panel -- --program $(AFTERLIGHT) $(addprefix --shoot ,$(SHOOTS)) $(addprefix --minutes ,$(MINUTES))

# Calibrates random shoots and writes docs/robustness.md with the errors and the coverage of the stated intervals. A stopped
# run continues; FRESH=1 calibrates again, FRESH=shoots makes the shoots again too. Some twenty seconds for each of the
# TRIALS, two of them for the calibration; NETWORKS=8 also trains two networks on each of the first eight shoots, some
# ten minutes each; FAULTS=100 checks each of the first hundred as it is, and with a fault in its files. Seeds below
# FIRST are reserved for development.
FIRST ?= 101
TRIALS ?= 200
NETWORKS ?= 0
FAULTS ?= 0
trials: $(if $(filter-out 0,$(NETWORKS)),build)
	$(CARGO) run --locked -p afterlight-trials -- --first $(FIRST) --trials $(TRIALS) --networks $(NETWORKS) --faults $(FAULTS) \
		--program $(AFTERLIGHT) $(if $(filter shoots,$(FRESH)),--fresh-shoots,$(if $(FRESH),--fresh))

# Traces the demo's interview, which comes with the program: some minutes. A test of the stage fails when it is out of date.
demo-interview: build setup
	rm -rf target/interview assets/interview
	mkdir -p assets/interview
	$(AFTERLIGHT) stage target/interview --size 128 --frames 24 --plate 540x960
	for frame in target/interview/interview/*.png; do \
		name=$$(basename $$frame .png); \
		ffmpeg -loglevel error -y -i $$frame -q:v 2 -pix_fmt yuvj444p assets/interview/$$name.jpg || exit 1; \
		cp target/interview/interview_masks/$$name.png assets/interview/ || exit 1; \
	done

# Crops the start page's picture from the demo's relit frames.
.PHONY: welcome
welcome:
	ffmpeg -loglevel error -y -i docs/relit.jpg -vf crop=2160:600:0:60,scale=1440:400:flags=area -map_metadata -1 \
		-fflags +bitexact -flags:v +bitexact -q:v 4 assets/welcome/interview.jpg

# Release files in target/package: a .deb, a tarball and the release notes. Takes half an hour.
.PHONY: package test-package
package: setup
	@CARGO=$(CARGO) tools/package.sh

# Installs the packages on a fresh Debian without Rust, and uses the program there. Needs root; SUITE=trixie sets the release.
test-package:
	tools/test_package.sh

# Screenshots for docs/guide.md, of a real window on the demo's project.
screenshots: build
	$(AFTERLIGHT) demo $(DEMO) --prepare
	tools/screenshots.sh $(AFTERLIGHT) $(DEMO)/project

clean-demo:
	rm -rf $(DEMO)
