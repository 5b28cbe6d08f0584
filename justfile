# Every recipe is a plain cargo line; `just` is a convenience, not a need.

# Types only.
check:
    cargo check --workspace --all-targets

# Every test.
test:
    cargo test --workspace

# The properties on new random values, ten times as many. PROPTEST_RNG_SEED of what is printed makes a failure again.
properties seed=`date +%s`:
    @echo "PROPTEST_RNG_SEED={{seed}}"
    PROPTEST_RNG_SEED={{seed}} PROPTEST_CASES=2560 cargo test --workspace --lib --test protocol --test units --test equations_language --test inference --test identifiability

# Coverage and false alarms over many draws of the noise: minutes, not part of `just test`.
battery:
    cargo test --release -p starlings-coordinator --test tube_twin -- --ignored --nocapture
    cargo test --release --test coarctation -- --ignored --nocapture
    cargo test --release -p starlings-coordinator --test explain_null -- --ignored --nocapture

# Coverage at default settings, warnings of wrong models, false alarms: the tables of docs/coverage.md. COVERAGE_SEEDS draws, 40 by default.
coverage:
    cargo test --release -p starlings-coordinator --test coverage -- --ignored --nocapture --test-threads 1

# How often the two intervals hold the truth: the table of docs/intervals.md, about a quarter of an hour. INTERVALS_TWINS: twins of a row.
intervals:
    cargo test --release -p starlings-coordinator --test intervals -- --ignored --nocapture --test-threads 1
    cargo test --release -p starlings-estimators --lib alternatives -- --ignored --nocapture

# The reconstruction of the Lorenz system from twelve million points.
inference:
    cargo test --release -p starlings-estimators --test inference -- --ignored --nocapture

# Damage of the plate, torques and scenarios of the nozzle over many draws of the noise: the tables of docs/structures.md; the plate's diagnosis.
diagnostics:
    cargo test --release -p starlings-structures --test plate_search -- --ignored --nocapture
    cargo test --release -p starlings-estimators --test nozzle -- --ignored --nocapture
    cargo test --release --test diagnose_examples -- --ignored

# Every system, effect and noise level of docs/battery.md: about an hour. BATTERY_SYSTEMS, BATTERY_KINDS, BATTERY_EFFECTS, BATTERY_NOISE, BATTERY_CORRELATION, BATTERY_SEEDS, BATTERY_THREADS choose; STARLINGS_WRITE_PAGES draws docs/pictures/battery-reliability.svg.
explain-battery:
    cargo test --release -p starlings-coordinator --test explain_battery -- --ignored --nocapture the_whole

# Faults of the place in running studies, and docs/faults.md: minutes. Needs what .ci/solvers installs, and mounts in a namespace of its own.
faults:
    PATH="$PWD/target/solvers/bin:$PATH" STARLINGS_WRITE_PAGES=1 cargo test --test faults -- --ignored --nocapture

# A thousand faults in running studies on three workers, and docs/chaos.md: ten minutes. CHAOS_FAULTS, STARLINGS_CHAOS_SEED choose, CHAOS_AT_A_TIME studies
# at a time. Needs namespaces (`unshare`, `ip`) and the Python package in target/solvers (.ci/solvers).
chaos:
    STARLINGS_WRITE_PAGES=1 cargo test --test chaos -- --ignored --nocapture

# How well the time left that is told agrees with the truth, on three examples. Minutes, on a quiet machine.
time-left:
    cargo test --release --test time_left -- --ignored --nocapture

# The same cycles through Starlings and through what others use, and the table of docs/fleet.md: a quarter of an hour on a quiet machine.
peers:
    python3 benches/peers/compare.py --write

# A thousand connected workers and 16 384 runs in one batch: what docs/scale.md speaks of.
scale:
    cargo bench --workspace --bench scale

# Workers under a real Slurm of four nodes on this machine: a node killed, a coordinator requeued, a pool that follows the work. Minutes; needs root, installs slurm-wlm and
# munge where they are missing.
slurm:
    .ci/slurm test

# The manifests for Kubernetes, strictly against its published schemas; installs the validator and kubectl into target/kubernetes.
kubernetes:
    .ci/kubernetes

# Reports and the live page in a headless Chromium, clicked through; pictures in target/pages, and those of docs/ made again.
pages:
    .ci/pages --docs

# One wheel of program and package in target/wheels, and what a user does with it in an empty environment.
wheel:
    .ci/wheel

# Everything of a release in target/release-files: wheel, source distribution, programs with completions and pages of the manual, components,
# licences, checksums. Half an hour on two cores.
release:
    .ci/release

# The pages of docs/ as a book in target/book, every link followed. Installs mdBook into target/tools where it is missing.
book:
    .ci/book

# The figures of docs/gallery.md: every example run, and its overview drawn.
gallery:
    cargo build --release
    .ci/gallery
    STARLINGS_WRITE_PAGES=1 cargo test --test book the_gallery

# The numbers and commands that pages show: written again from what the program says.
write-pages:
    STARLINGS_WRITE_PAGES=1 cargo test --test book --test mistakes --test readme

# The image without a registry: its root file system around the debug build, the pig's aorta run in it by chroot as its user, and the image
# where buildah is there. Needs root.
container:
    cargo build --workspace
    .ci/container

# Every fuzz target until it has had FUZZ_SECONDS of processor time, 600 by default, and the table of docs/fuzzing.md (cargo install cargo-fuzz; a
# stable compiler is told to take the fuzzer's flags).
fuzz:
    fuzz/run.py --write

# Deaths of coordinators and workers, timed: resume with ten thousand runs, workers back, losses noticed, none where all are busy. A
# quarter of an hour; DEATHS_MINUTES shortens the last.
deaths:
    cargo test --release -p starlings-coordinator --test arrivals -- --ignored --nocapture
    cargo test --release --test coordinator_death -- --ignored --nocapture
    cargo test --release -p starlings-fleet --test noticing -- --ignored --nocapture --test-threads 1

# The example with a state of 8 MB, in every way in which its states can travel: the same bytes.
large-states:
    cargo test --release --test large_states -- --ignored --nocapture

# Pieces of states in a bucket, with the feature s3, against a server of its own; installs that into target/s3.
s3:
    .ci/s3

# A solver in Python with a state of 256 MB: the posterior of a small one, and what coordinator, workers and solvers hold. Needs .ci/solvers and
# six gigabytes of memory.
largest-states:
    cargo test --release --test largest_states -- --ignored --nocapture

# The scheme of openBF on finer and finer grids against `artery-1d`: what lies between both is openBF's grid.
openbf-grid:
    cargo test --release -p starlings-draft --test openbf_grid -- --include-ignored

# What large states cost: 22 states of 8 MB both ways on every way, four of 256 MB in 256 MB of memory, and through a shared folder. A minute;
# needs 5 GB in the folder for temporary files.
states:
    cargo bench -p starlings-fleet --bench states -- --large
    cargo bench -p starlings-fleet --bench states -- --shared --large

# The examples of docs/extending.md: applied to a copy, built and tested.
extending:
    .ci/extending

# Formatting and lints, warnings are errors.
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings

# Format in place.
fmt:
    cargo fmt --all

# API documentation, warnings are errors.
doc $RUSTDOCFLAGS="-D warnings":
    cargo doc --workspace --no-deps

# What the live page costs a study of short runs, in turns with the same study without it: two minutes on a quiet machine.
live-bench:
    cargo build --release
    python3 benches/live_page.py

# Seconds and memory of `infer` for a long recording, with one worker and with two.
infer-bench:
    cargo bench -p starlings-sums --bench file_blocks
    cargo build --release
    benches/infer.sh

# Micro-benchmarks and the fleet benchmark.
bench:
    cargo bench --bench analysis
    cargo bench -p starlings-estimators --bench inference
    cargo bench --bench tube
    cargo bench --bench solver
    cargo bench --bench memory
    cargo bench --bench fleet -- --json

# Licences, advisories, bans and sources (cargo install cargo-deny).
deny:
    cargo deny check

# The main example.
run:
    cargo run --release -- run examples/pig-aorta/study.toml

# Check every example's study and data without estimating.
examples:
    cargo run --release -- check examples/pig-aorta/study.toml
    cargo run --release -- check examples/pig-aorta-joint/study.toml
    cargo run --release -- check examples/rcr/study.toml
    cargo run --release -- check examples/oscillator/study.toml
    cargo run --release -- check examples/fsi-tube/study.toml
