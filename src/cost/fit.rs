//! What the points say together: which ones nothing beats, and how fast error falls with time.

use serde::Serialize;

use super::point::Point;

/// The points that no other beats in time and error at once, by rising time: the Pareto front.
pub fn front<'a>(points: impl IntoIterator<Item = &'a Point>) -> Vec<&'a Point> {
    let mut points: Vec<&Point> = points.into_iter().collect();
    points.sort_by(|a, b| {
        let by_time = a.frame_ms().total_cmp(&b.frame_ms());
        by_time.then(a.relmse().total_cmp(&b.relmse()))
    });
    let mut least = f64::INFINITY;
    points.retain(|point| {
        let is_better = point.relmse() < least;
        least = least.min(point.relmse());
        is_better
    });
    points
}

/// Student's t that leaves 2.5 % on each side, for 1 degree of freedom and more; beyond them 2 is near enough.
const T_QUANTILES: [f64; 12] = [
    12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18,
];

/// Error as a power of time: `relmse = scale * ms^-exponent`, least squares on logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerLaw {
    /// How fast the error falls: 1 where noise alone is left and all time goes into paths.
    pub exponent: f64,
    /// The error at 1 ms.
    pub scale: f64,
    /// The share of the scatter of the logarithms of the errors that it explains, 0 to 1.
    pub r_squared: f64,
    /// Points that it is drawn from.
    pub points: usize,
    /// The shortest of their times, milliseconds.
    pub from_ms: f64,
    /// The longest, milliseconds.
    pub to_ms: f64,
    /// How many times the time half the error costs, at least and at most: the 95 % interval of the slope. Infinite (`null` in JSON) where
    /// the flatter slope does not fall.
    pub price_range: [f64; 2],
}

impl PowerLaw {
    /// Through points (milliseconds, error); `None` for fewer than three, for times that are all one, or where error does not fall.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points.iter().map(|(ms, e)| (ms.ln(), e.ln())).collect();
        let count = logs.len() as f64;
        if logs.len() < 3 || logs.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
            return None;
        }
        let mean_x = logs.iter().map(|(x, _)| x).sum::<f64>() / count;
        let mean_y = logs.iter().map(|(_, y)| y).sum::<f64>() / count;
        let sum = |of: fn(f64, f64) -> f64| -> f64 {
            let parts = logs.iter().map(|(x, y)| of(x - mean_x, y - mean_y));
            parts.sum()
        };
        let (xx, xy, yy) = (sum(|x, _| x * x), sum(|x, y| x * y), sum(|_, y| y * y));
        let slope = xy / xx;
        if !slope.is_finite() || slope >= 0.0 {
            return None;
        }
        let times = || points.iter().map(|(ms, _)| *ms);
        let freedom = points.len() - 2;
        let quantile = T_QUANTILES.get(freedom - 1).copied().unwrap_or(2.0);
        let unexplained = (yy - xy * xy / xx).max(0.0);
        let standard_error = (unexplained / (count - 2.0) / xx).sqrt();
        Some(Self {
            price_range: [1.0, -1.0].map(|side| price(quantile * side * standard_error - slope)),
            exponent: -slope,
            scale: (mean_y - slope * mean_x).exp(),
            r_squared: xy * xy / (xx * yy),
            points: points.len(),
            from_ms: times().fold(f64::INFINITY, f64::min),
            to_ms: times().fold(0.0, f64::max),
        })
    }

    /// Through the front of some points.
    pub fn of_front(front: &[&Point]) -> Option<Self> {
        let points: Vec<(f64, f64)> = front
            .iter()
            .map(|point| (point.frame_ms(), point.relmse()))
            .collect();
        Self::fit(&points)
    }

    /// How many times the time half the error costs.
    pub fn price_of_half(&self) -> f64 {
        price(self.exponent)
    }
}

/// How many times the time half the error costs where error falls with this power of time; infinite where it does not fall.
pub fn price(exponent: f64) -> f64 {
    match exponent > 0.0 {
        true => 2f64.powf(1.0 / exponent),
        false => f64::INFINITY,
    }
}

/// The time at which a front reaches an error, milliseconds, straight between its points on logarithmic axes; `None` beyond its ends.
pub fn time_at(front: &[&Point], relmse: f64) -> Option<f64> {
    front.windows(2).find_map(|pair| {
        let [(x0, y0), (x1, y1)] =
            [pair[0], pair[1]].map(|point| (point.frame_ms().ln(), point.relmse().ln()));
        let share = (y0 - relmse.ln()) / (y0 - y1);
        (0.0..=1.0)
            .contains(&share)
            .then(|| (x0 + share * (x1 - x0)).exp())
    })
}

/// The error that a front reaches in a time, as [`time_at`].
pub fn error_at(front: &[&Point], ms: f64) -> Option<f64> {
    front.windows(2).find_map(|pair| {
        let [(x0, y0), (x1, y1)] =
            [pair[0], pair[1]].map(|point| (point.frame_ms().ln(), point.relmse().ln()));
        let share = (ms.ln() - x0) / (x1 - x0);
        (0.0..=1.0)
            .contains(&share)
            .then(|| (y0 + share * (y1 - y0)).exp())
    })
}

/// The techniques of some points, in the order in which they appear.
pub fn techniques(points: &[Point]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for point in points {
        if !names.contains(&point.technique.as_str()) {
            names.push(&point.technique);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::point::tests::point;
    use super::*;

    #[test]
    fn an_exact_power_law_is_recovered_and_its_price_told() {
        let law = |ms: f64| 3.0 * ms.powf(-0.7);
        let points: Vec<_> = [5.0, 20.0, 90.0, 400.0].map(|ms| (ms, law(ms))).to_vec();
        let fit = PowerLaw::fit(&points).unwrap();
        assert!((fit.exponent - 0.7).abs() < 1e-9 && (fit.scale - 3.0).abs() < 1e-9);
        assert!((fit.r_squared - 1.0).abs() < 1e-9);
        assert!((fit.price_of_half() - 2f64.powf(1.0 / 0.7)).abs() < 1e-9);
        assert_eq!((fit.from_ms, fit.to_ms, fit.points), (5.0, 400.0, 4));
        assert!(
            fit.price_range
                .map(|price| (price - fit.price_of_half()).abs() < 1e-6)
                == [true; 2]
        );
        let mut scattered = points.clone();
        scattered[1].1 *= 1.2;
        let fit = PowerLaw::fit(&scattered).unwrap();
        let [least, most] = fit.price_range;
        assert!(
            least < fit.price_of_half() && most > fit.price_of_half() && most < 12.0,
            "{fit:?}"
        );
        let mut bent = points;
        bent[3].1 *= 10.0;
        assert!(PowerLaw::fit(&bent).is_none_or(|fit| fit.r_squared < 0.9));
    }

    #[test]
    fn no_law_is_drawn_from_two_points_one_time_or_errors_that_rise() {
        assert_eq!(PowerLaw::fit(&[(1.0, 1.0), (2.0, 0.5)]), None);
        assert_eq!(PowerLaw::fit(&[(1.0, 1.0), (1.0, 0.5), (1.0, 0.2)]), None);
        assert_eq!(PowerLaw::fit(&[(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]), None);
    }

    #[test]
    fn the_time_at_an_error_lies_on_the_line_between_two_points() {
        let points = [point("pm", 10.0, 0.1, 0.0), point("pm", 1000.0, 0.001, 0.0)];
        let front = front(&points);
        assert!((time_at(&front, 0.01).unwrap() - 100.0).abs() < 1e-9);
        assert_eq!(time_at(&front, 0.2), None);
        assert_eq!(time_at(&front, 0.0005), None);
        assert!((error_at(&front, 100.0).unwrap() - 0.01).abs() < 1e-9);
        assert_eq!(
            (error_at(&front, 5.0), error_at(&front, 2000.0)),
            (None, None)
        );
    }

    proptest! {
        #[test]
        fn nothing_beats_the_front_and_it_beats_all_the_rest(
            pairs in prop::collection::vec((1.0..1000.0, 1e-4..1.0), 1..40)
        ) {
            let points: Vec<Point> = pairs.iter().map(|&(ms, e)| point("pm", ms, e, 0.5)).collect();
            let front = front(&points);
            let beats = |a: &Point, b: &Point| {
                a.frame_ms() <= b.frame_ms() && a.relmse() <= b.relmse() && a.key != b.key
            };
            prop_assert!(!front.is_empty());
            for on_front in &front {
                prop_assert!(!points.iter().any(|point| beats(point, on_front)));
            }
            for point in &points {
                let is_on = front.iter().any(|other| other.key == point.key);
                prop_assert!(is_on || front.iter().any(|other| beats(other, point)));
            }
        }
    }
}
