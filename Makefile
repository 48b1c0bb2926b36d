# Two commands, on a machine with a Rust toolchain and nothing else: `make demo` and `make test`. GNU make.
# Each installs what is missing first (scripts/setup, which says what it does).

target_folder := $(or $(CARGO_TARGET_DIR),target)

.PHONY: help demo test test-long fuzz bench assets setup

help: ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 16

demo: setup ## Replay the bundled session on the simulated headset and write a report; needs no headset and no GPU
	cargo build --release --locked --workspace
	$(target_folder)/release/macula demo --force

test: ## Run every check: format, lints, tests, documentation
	@scripts/setup --for-tests
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	cargo build --workspace --locked
	cargo test --workspace --locked -- --show-output
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

test-long: setup ## Hold the properties against more than 100 000 random cases, then fuzz for ten minutes a target; about an hour
	PROPTEST_CASES=5120 cargo test --locked --test properties -- --show-output
	$(MAKE) fuzz fuzz_seconds=600

fuzz_seconds := 60
fuzz_targets := gltf_scene session_reader parameter_file

# Without a sanitizer: it looks for what safe Rust can't do, and makes the build long.
fuzz: ## Fuzz what reads files from outside, a minute a target (fuzz_seconds=60); needs cargo-fuzz
	@if ! cargo fuzz --version >/dev/null 2>&1; then \
		echo "SKIPPED: no fuzzing; 'cargo install cargo-fuzz' brings what it needs" >&2; \
	else \
		for target in $(fuzz_targets); do \
			mkdir -p fuzz/corpus/$$target && \
			cargo fuzz run --dev --sanitizer none $$target fuzz/corpus/$$target fuzz/seeds/$$target -- \
				-max_total_time=$(fuzz_seconds) -max_len=16384 -timeout=20 || exit 1; \
		done; \
	fi

bench: setup ## Measure the kernels against native code, side by side
	cargo bench --locked --bench kernels

assets: setup ## Write the bundled scenes anew from their generator
	cargo run --locked --example make_scenes

setup: ## Install what is missing: a C linker, the Vulkan loader, a software driver where there is no other
	@scripts/setup
