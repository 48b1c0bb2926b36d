//! Runs a property over random inputs, counts the cases that really ran, and tells how a failure comes about again.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestError, TestRunner};

/// Cases of all properties so far.
static CASES: AtomicU64 = AtomicU64::new(0);

/// What `PROPTEST_CASES` is when nobody sets it.
const USUAL: u32 = 256;

/// How a property is run.
fn config(cases: u32) -> Config {
    let asked = Config::default();
    let is_long = asked.cases > USUAL;
    let seed = match asked.rng_seed {
        RngSeed::Fixed(seed) => seed,
        // A change is never refused by chance: only the long run draws new numbers.
        RngSeed::Random if !is_long => 1,
        RngSeed::Random => {
            let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
            since.map_or(1, |since| since.as_secs())
        }
    };
    Config {
        cases: (u64::from(cases) * u64::from(asked.cases) / u64::from(USUAL)) as u32,
        rng_seed: RngSeed::Fixed(seed),
        // Failures are kept as tests of their own, with names.
        failure_persistence: None,
        max_shrink_iters: 2000,
        // Milliseconds: a picture takes long, and its smallest input is not worth an hour.
        max_shrink_time: 120_000,
        max_global_rejects: 1_000_000,
        ..asked
    }
}

/// Holds a property against `cases` random inputs, and as many times more as `PROPTEST_CASES` is more than 256.
#[track_caller]
pub fn hold<S: Strategy>(
    name: &str,
    cases: u32,
    inputs: S,
    property: impl Fn(S::Value) -> Result<(), String>,
) {
    let config = config(cases);
    let seed = config.rng_seed;
    match outcome(config, inputs, property) {
        Ok(ran) => {
            let all = CASES.fetch_add(ran, Ordering::Relaxed) + ran;
            println!("{name}: {ran} cases, seed {seed} ({all} cases of all properties so far)");
        }
        Err(failure) => panic!("{name}: {failure}\nagain with PROPTEST_RNG_SEED={seed}"),
    }
}

/// What is wrong where a condition does not hold.
pub fn require(holds: bool, what: impl Into<String>) -> Result<(), String> {
    holds.then_some(()).ok_or_else(|| what.into())
}

/// How many cases ran, or the smallest input found that breaks the property.
fn outcome<S: Strategy>(
    config: Config,
    inputs: S,
    property: impl Fn(S::Value) -> Result<(), String>,
) -> Result<u64, String> {
    let ran = AtomicU64::new(0);
    let result = TestRunner::new(config).run(&inputs, |input| {
        ran.fetch_add(1, Ordering::Relaxed);
        property(input).map_err(TestCaseError::fail)
    });
    match result {
        Ok(()) => Ok(ran.into_inner()),
        Err(TestError::Fail(reason, input)) => Err(format!("{reason}, for {input:#?}")),
        Err(TestError::Abort(reason)) => Err(format!("no inputs: {reason}")),
    }
}

#[test]
fn a_property_that_does_not_hold_is_found_and_its_smallest_input_told() {
    let of_small_numbers = |number: u32| (number < 100).then_some(()).ok_or("large".to_owned());
    let failure = outcome(config(2000), 0..100_000u32, of_small_numbers).unwrap_err();
    assert!(failure.contains("for 100"), "{failure}");
    let panics = outcome(config(20), 0..10u32, |_| panic!("as a product might"));
    assert!(panics.unwrap_err().contains("as a product might"));
    assert_eq!(
        outcome(Config::with_cases(20), 0..10u32, |_| Ok(())),
        Ok(20)
    );
}
