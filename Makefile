# Two commands, on a machine with a Rust toolchain and nothing else: `make demo` and `make test`. GNU make.
# Each installs what is missing first (scripts/setup, which says what it does).

target_folder := $(or $(CARGO_TARGET_DIR),target)

.PHONY: help demo test bench assets setup

help: ## Show this list
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 14

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

bench: setup ## Measure the kernels against native code, side by side
	cargo bench --locked --bench kernels

assets: setup ## Write the bundled scenes anew from their generator
	cargo run --locked --example make_scenes

setup: ## Install what is missing: a C linker, the Vulkan loader, a software driver where there is no other
	@scripts/setup
