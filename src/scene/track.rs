//! One animated property: keys over time and the interpolation between them (glTF 2.0, appendix C).

use glam::{DQuat, DVec3};

use super::node::normalized;

/// Values that change over time.
#[derive(Clone, Debug)]
pub(super) struct Track<T> {
    /// Times of the keys, seconds, ascending; at least one.
    times_s: Vec<f64>,
    keys: Keys<T>,
}

/// Values at the keys, and what lies between them.
#[derive(Clone, Debug)]
pub(super) enum Keys<T> {
    /// Jumps at each key.
    Step(Vec<T>),
    /// Straight lines; great arcs for rotations.
    Linear(Vec<T>),
    /// In-tangent, value and out-tangent of a cubic Hermite spline; tangents per second.
    CubicSpline(Vec<[T; 3]>),
}

impl<T> Keys<T> {
    fn len(&self) -> usize {
        match self {
            Self::Step(values) | Self::Linear(values) => values.len(),
            Self::CubicSpline(values) => values.len(),
        }
    }
}

/// A value that a track can hold.
pub(super) trait Interpolate: Copy {
    /// The value `t` of the way from `self` to `to`.
    fn toward(self, to: Self, t: f64) -> Self;
    /// The weighted sum of four values, made a valid value again.
    fn blend(values: [Self; 4], weights: [f64; 4]) -> Self;
}

impl Interpolate for DVec3 {
    fn toward(self, to: Self, t: f64) -> Self {
        self.lerp(to, t)
    }

    fn blend(values: [Self; 4], weights: [f64; 4]) -> Self {
        values.iter().zip(weights).map(|(v, w)| *v * w).sum()
    }
}

impl Interpolate for DQuat {
    fn toward(self, to: Self, t: f64) -> Self {
        self.slerp(to, t)
    }

    fn blend(values: [Self; 4], weights: [f64; 4]) -> Self {
        let mut sum = DQuat::from_array([0.0; 4]);
        for (value, weight) in values.into_iter().zip(weights) {
            sum += value * weight;
        }
        normalized(sum).unwrap_or(values[0])
    }
}

impl<T: Interpolate> Track<T> {
    /// A track, or `None` if there is no key, there are not as many values as times, or time runs backwards.
    pub fn new(times_s: Vec<f64>, keys: Keys<T>) -> Option<Self> {
        let is_ascending = times_s.is_sorted() && times_s.first().is_some_and(|t| *t >= 0.0);
        (is_ascending && times_s.len() == keys.len()).then_some(Self { times_s, keys })
    }

    /// Time of the last key, seconds.
    pub fn end_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(0.0)
    }

    /// The value at a finite time; before the first and after the last key it stands still.
    pub fn at(&self, time_s: f64) -> T {
        let last = self.times_s.len() - 1;
        let next = self.times_s.partition_point(|key_s| *key_s <= time_s);
        let (from, to) = (next.saturating_sub(1), next.min(last));
        let (from_s, to_s) = (self.times_s[from], self.times_s[to]);
        // The two are equal outside of the keys, where both are the same key.
        let t = if to_s > from_s {
            (time_s - from_s) / (to_s - from_s)
        } else {
            0.0
        };
        match &self.keys {
            Keys::Step(values) => values[from],
            Keys::Linear(values) if from == to => values[from],
            Keys::Linear(values) => values[from].toward(values[to], t),
            Keys::CubicSpline(values) => {
                let (t2, t3, step_s) = (t * t, t * t * t, to_s - from_s);
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    step_s * (t3 - 2.0 * t2 + t),
                    -2.0 * t3 + 3.0 * t2,
                    step_s * (t3 - t2),
                ];
                let [_, value, out_tangent] = values[from];
                let [in_tangent, next_value, _] = values[to];
                T::blend([value, out_tangent, next_value, in_tangent], weights)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    fn line(keys: fn(Vec<DVec3>) -> Keys<DVec3>) -> Track<DVec3> {
        let values = vec![DVec3::ZERO, DVec3::X * 2.0, DVec3::X * 6.0];
        Track::new(vec![1.0, 2.0, 4.0], keys(values)).unwrap()
    }

    #[test]
    fn linear_keys_are_joined_by_straight_lines_and_held_outside() {
        let track = line(Keys::Linear);
        for (time_s, x) in [(0.0, 0.0), (1.5, 1.0), (2.0, 2.0), (3.0, 4.0), (9.0, 6.0)] {
            assert!((track.at(time_s).x - x).abs() < 1e-12, "at {time_s}");
        }
    }

    #[test]
    fn step_keys_jump_at_the_key_itself() {
        let track = line(Keys::Step);
        for (time_s, x) in [
            (0.0, 0.0),
            (1.999, 0.0),
            (2.0, 2.0),
            (3.999, 2.0),
            (4.0, 6.0),
        ] {
            assert_eq!(track.at(time_s).x, x, "at {time_s}");
        }
    }

    #[test]
    fn a_cubic_spline_reproduces_a_cubic() {
        // x = s³ over unequal steps: Hermite interpolation of a cubic with its true derivatives is exact.
        let times_s = vec![0.0, 1.0, 3.0];
        let key = |s: f64| {
            let slope = DVec3::X * 3.0 * s * s;
            [slope, DVec3::X * s * s * s, slope]
        };
        let keys = Keys::CubicSpline(times_s.iter().map(|s| key(*s)).collect());
        let track = Track::new(times_s, keys).unwrap();
        for time_s in [0.0, 0.25, 0.5, 1.0, 1.7, 2.9, 3.0] {
            let expected = time_s * time_s * time_s;
            assert!((track.at(time_s).x - expected).abs() < 1e-12, "at {time_s}");
        }
    }

    #[test]
    fn rotations_turn_evenly_along_the_shorter_arc() {
        let quarter = DQuat::from_rotation_y(FRAC_PI_2);
        for to in [quarter, -quarter] {
            let keys = Keys::Linear(vec![DQuat::IDENTITY, to]);
            let halfway = Track::new(vec![0.0, 2.0], keys).unwrap().at(1.0);
            let expected = DQuat::from_rotation_y(FRAC_PI_4);
            assert!(halfway.dot(expected).abs() > 1.0 - 1e-12);
        }
    }

    #[test]
    fn two_keys_at_one_time_jump_instead_of_dividing_by_zero() {
        let keys = Keys::Linear(vec![DVec3::ZERO, DVec3::X, DVec3::X * 5.0, DVec3::X * 5.0]);
        let track = Track::new(vec![0.0, 1.0, 1.0, 2.0], keys).unwrap();
        assert!((track.at(0.5).x - 0.5).abs() < 1e-12);
        assert_eq!(track.at(1.0).x, 5.0);
    }

    #[test]
    fn time_that_runs_backwards_is_refused() {
        let keys = || Keys::Linear(vec![DVec3::ZERO, DVec3::X]);
        assert!(Track::new(vec![1.0, 0.0], keys()).is_none());
        assert!(Track::new(vec![-1.0, 0.0], keys()).is_none());
        assert!(Track::new(vec![0.0], keys()).is_none());
        assert!(Track::new(vec![0.0, 1.0], keys()).is_some());
    }
}
