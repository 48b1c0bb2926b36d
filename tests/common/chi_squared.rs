//! Pearson's test of counts against what a density predicts.

/// Where a test fails: by chance one in 30 000 does (significance 3.2e-5).
pub const SIGMAS: f64 = 4.0;

/// The chance of a false alarm that [`SIGMAS`] stand for.
const SIGNIFICANCE: f64 = 3.2e-5;
/// Counts that may lie in bins where a density predicts none, as a share of all: a border that f32 moves by an ulp (6e-8 of a direction's
/// unit length, over the some ten borders that a curved edge of a density crosses), and slivers of bins between the points of a quadrature.
const ROUNDING: f64 = 1e-5;

/// How many standard deviations a chi-squared statistic lies above its mean (Wilson and Hilferty, 1931); infinite where more is counted in
/// bins of few or no expected counts than chance and rounding put there.
pub fn sigmas(observed: &[f64], expected: &[f64]) -> f64 {
    // Bins with few expected counts are taken together.
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut rest_observed, mut rest_expected) = (0.0, 0.0);
    for (o, e) in observed.iter().zip(expected) {
        if *e < 5.0 {
            rest_observed += o;
            rest_expected += e.max(0.0);
        } else {
            statistic += (o - e).powi(2) / e;
            bins += 1.0;
        }
    }
    if rest_expected > 5.0 {
        statistic += (rest_observed - rest_expected).powi(2) / rest_expected;
        bins += 1.0;
    } else {
        let slack = ROUNDING * observed.iter().sum::<f64>();
        if chance_of_at_least(rest_observed, rest_expected + slack) < SIGNIFICANCE {
            return f64::INFINITY;
        }
    }
    let freedom: f64 = bins - 1.0;
    let spread = 2.0 / (9.0 * freedom);
    ((statistic / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// The chance that `count` or more of rare events happen where `expected` do on average (Poisson).
fn chance_of_at_least(count: f64, expected: f64) -> f64 {
    let (mut term, mut fewer, mut k) = ((-expected).exp(), 0.0, 0.0);
    while k < count {
        fewer += term;
        k += 1.0;
        term *= expected / k;
    }
    1.0 - fewer
}
