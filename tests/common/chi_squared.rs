//! Pearson's test of counts against what a density predicts.

/// Where a test fails: by chance one in 30 000 does (significance 3.2e-5).
pub const SIGMAS: f64 = 4.0;

/// How many standard deviations a chi-squared statistic lies above its mean (Wilson and Hilferty, 1931).
pub fn sigmas(observed: &[f64], expected: &[f64]) -> f64 {
    // Bins with few expected counts are taken together.
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut rest_observed, mut rest_expected) = (0.0, 0.0);
    for (o, e) in observed.iter().zip(expected) {
        if *e < 5.0 {
            rest_observed += o;
            rest_expected += e;
        } else {
            statistic += (o - e).powi(2) / e;
            bins += 1.0;
        }
    }
    if rest_expected > 5.0 {
        statistic += (rest_observed - rest_expected).powi(2) / rest_expected;
        bins += 1.0;
    }
    let freedom: f64 = bins - 1.0;
    let spread = 2.0 / (9.0 * freedom);
    ((statistic / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}
