# `make` sets the machine up, builds and runs; `make test` sets up and passes all tests.
CARGO ?= cargo
AFTERLIGHT = $(or $(CARGO_TARGET_DIR),target)/debug/afterlight
DEMO ?= demo

.PHONY: run build setup test stability lint doc peers bench bench-relight bench-passes bench-plate weights accuracy trials demo-interview screenshots clean-demo

run: build
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then \
		$(AFTERLIGHT) demo $(DEMO) --prepare && exec $(AFTERLIGHT) studio $(DEMO)/project; \
	else \
		exec $(AFTERLIGHT) demo $(DEMO); \
	fi

build: setup
	$(CARGO) build --locked

# What the system lacks: a Vulkan loader with a software adapter, the libraries of a window, ffmpeg.
setup:
	@sh tools/setup.sh

# Passes all tests of all crates, and says at the end which were skipped and why. AFTERLIGHT_REQUIRED names, with
# commas between, what must not be missing: shared data, gpu, gpu f16, gpu clock, ffmpeg, python, mediapipe, amx, small
# disk, pfspanoramic, prlimit, blender, openjd, slurm.
test: setup
	@out="$${CARGO_TARGET_DIR:-target}"; mkdir -p "$$out"; out=$$(cd "$$out" && pwd); \
		: >"$$out/skipped.txt"; : >"$$out/stability.txt"; \
		AFTERLIGHT_SKIPPED="$$out/skipped.txt" AFTERLIGHT_STABILITY="$$out/stability.txt" \
		AFTERLIGHT_PYTHON="$${AFTERLIGHT_PYTHON-$(PYTHON)}" AFTERLIGHT_OPENJD="$${AFTERLIGHT_OPENJD-$(OPENJD)}" \
		$(CARGO) test --locked --workspace --no-fail-fast; \
		code=$$?; awk -f tests/support/skipped.awk "$$out/skipped.txt"; exit $$code

# The hard cases that the tests show, one line each: passes all tests and writes docs/stability.md.
stability: test
	$(CARGO) run --locked -q -p afterlight-test-support --bin stability "$${CARGO_TARGET_DIR:-target}/stability.txt" >docs/stability.md.new
	mv docs/stability.md.new docs/stability.md

# The tests run in sessions without a folder of their own too: Mesa's driver then prints an error each time.
test bench bench-relight bench-passes bench-plate: export XDG_RUNTIME_DIR ?= $(CURDIR)/target

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

doc:
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps

# An environment with PyTorch, which the network is compared with and raced against; kept until the requirements
# change. Pip's own settings choose where it comes from; a build for the CPU suffices.
PEERS = $(or $(CARGO_TARGET_DIR),target)/peers
PYTHON = $(abspath $(wildcard $(PEERS)/bin/python))

peers:
	@cmp -s tests/peers/requirements.txt $(PEERS)/requirements.txt || { \
		python3 -m venv --clear $(PEERS) && \
		$(PEERS)/bin/pip install -r tests/peers/requirements.txt && \
		cp tests/peers/requirements.txt $(PEERS)/requirements.txt; }

# The reference implementation of Open Job Description, which runs a farm's job in the tests.
ENGINE = $(or $(CARGO_TARGET_DIR),target)/openjd
OPENJD = $(abspath $(wildcard $(ENGINE)/bin/openjd))
FARM_FOLDER ?= $(or $(CARGO_TARGET_DIR),target)/farm

.PHONY: openjd farm
openjd:
	@cmp -s tests/openjd/requirements.txt $(ENGINE)/requirements.txt || { \
		python3 -m venv --clear $(ENGINE) && \
		$(ENGINE)/bin/pip install -r tests/openjd/requirements.txt && \
		cp tests/openjd/requirements.txt $(ENGINE)/requirements.txt; }

# Measures what a frame takes on this machine, alone on it, and writes the tables of docs/farm.md: some ten minutes. The
# projects that it measures are made once.
farm: build
	$(CARGO) run --locked -q -p afterlight-rates -- $(AFTERLIGHT) $(FARM_FOLDER) docs/farm.md

# The network's speed and memory, and PyTorch's where it is there. BENCH="--size 128" makes it short.
bench:
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) bench --locked --profile dev --bench network -- $(BENCH)

# The sum of lamps beside what the memory allows, NumPy and PyTorch.
bench-relight:
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) bench --locked --profile dev --bench relight -- $(BENCH)

# Every pass beside what memory allows. BENCH="--software" includes a GPU that is none.
bench-passes:
	$(CARGO) bench --locked --profile dev --bench passes -- $(BENCH)

# Light that multiplies the plate: its time beside a copy of the plate, and on shoots with a truth, SHOOTS="DIR DIR", how
# near each way to bring light to the plate comes.
bench-plate:
	$(CARGO) bench --locked --profile dev --bench plate -- $(addprefix --shoot ,$(SHOOTS)) $(BENCH)

# How near the kinds of weights come to the truth: writes docs/weights.md in some minutes.
weights:
	$(CARGO) run --locked -p afterlight-weights

# Measures shoots with a truth and writes docs/accuracy.md with all its tables, plots and pictures. BUDGET is the minutes by
# the clock for everything: the next run goes on where this one ended, and the page says what is missing. MINUTES is those of
# training for the base. LADDER=no measures nothing and writes the page with what is there.
BUDGET ?= 90
accuracy: build
	AFTERLIGHT_PYTHON=$${AFTERLIGHT_PYTHON-$(PYTHON)} \
		$(CARGO) run --locked -p afterlight-accuracy -- --budget $(BUDGET) --program $(AFTERLIGHT) \
		$(addprefix --shoot ,$(SHOOTS)) $(addprefix --minutes ,$(MINUTES)) $(if $(filter no,$(LADDER)),--no-ladder)

# Measures predictions on shoots unlike each other, before any training and after MINUTES of it (such as 1,3,10), and writes
# docs/panel.md. SHOOTS adds shoots with a truth: SHOOTS="person=DIR other=DIR".
.PHONY: panel
panel: build
	$(CARGO) run --locked -q -p afterlight-panel -- --program $(AFTERLIGHT) $(addprefix --shoot ,$(SHOOTS)) $(addprefix --minutes ,$(MINUTES))

# Calibrates shoots drawn at random and writes docs/robustness.md with how right, and how honest, that was. A run that was
# stopped goes on; FRESH=1 calibrates again, FRESH=shoots makes the shoots again too. Some twenty seconds for each of the
# TRIALS, two of them for the calibration; NETWORKS=8 also trains two networks on each of the first eight shoots, some
# ten minutes each. Shoots below seed FIRST are for developing.
FIRST ?= 101
TRIALS ?= 200
NETWORKS ?= 0
trials: $(if $(filter-out 0,$(NETWORKS)),build)
	$(CARGO) run --locked -p afterlight-trials -- --first $(FIRST) --trials $(TRIALS) --networks $(NETWORKS) \
		--program $(AFTERLIGHT) $(if $(filter shoots,$(FRESH)),--fresh-shoots,$(if $(FRESH),--fresh))

# Traces the demo's interview, which comes with the program: some minutes. The stage's test says when it has to be made again.
demo-interview: build setup
	rm -rf target/interview assets/interview
	mkdir -p assets/interview
	$(AFTERLIGHT) stage target/interview --size 128 --frames 24 --plate 540x960
	for frame in target/interview/interview/*.png; do \
		name=$$(basename $$frame .png); \
		ffmpeg -loglevel error -y -i $$frame -q:v 2 -pix_fmt yuvj444p assets/interview/$$name.jpg || exit 1; \
		cp target/interview/interview_masks/$$name.png assets/interview/ || exit 1; \
	done

# Cuts the start page's picture out of the demo's relit frames.
.PHONY: welcome
welcome:
	ffmpeg -loglevel error -y -i docs/relit.jpg -vf crop=2160:600:0:60,scale=1440:400:flags=area -map_metadata -1 \
		-fflags +bitexact -flags:v +bitexact -q:v 4 assets/welcome/interview.jpg

# What others install: a .deb, a tarball and the notes of this version, in target/package. Takes half an hour.
.PHONY: package test-package
package: setup
	@CARGO=$(CARGO) tools/package.sh

# Installs the packages on a fresh Debian, without Rust, and uses the program there. As root; SUITE=trixie chooses.
test-package:
	tools/test_package.sh

# The pictures of docs/guide.md, taken of a real window on the demo's project.
screenshots: build
	$(AFTERLIGHT) demo $(DEMO) --prepare
	tools/screenshots.sh $(AFTERLIGHT) $(DEMO)/project

clean-demo:
	rm -rf $(DEMO)
