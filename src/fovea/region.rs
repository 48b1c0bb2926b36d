//! Eccentricity as a true angle, and the regions that it makes: cones around the gaze, which are conics on the image.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::view::Fov;

/// Angle between two directions of one space, radians: 0 to π. Exact for tiny angles, where an arc cosine is not; the
/// lengths of the vectors don't matter.
pub fn eccentricity_rad(dir: Vec3, gaze_dir: Vec3) -> f32 {
    dir.cross(gaze_dir).length().atan2(dir.dot(gaze_dir))
}

/// Part of the field of view, by eccentricity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Region {
    /// Around the gaze, where the eye resolves most.
    Fovea,
    /// The ring in which the fovea's picture goes over into the periphery's.
    Transition,
    /// All the rest.
    Periphery,
}

/// Where the regions end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regions {
    /// Half-angle of the fovea's cone, radians; 0 to π/2. Default 9.78° (Foveated Photon Mapping, section 4: e_f).
    pub fovea_radius_rad: f32,
    /// Half-angle of the transition's outer cone, radians; not less than the fovea's. Default 14.78°: the paper states none,
    /// so 5° around the fovea.
    pub transition_radius_rad: f32,
}

impl Default for Regions {
    fn default() -> Self {
        Self {
            fovea_radius_rad: 9.78_f32.to_radians(),
            transition_radius_rad: 14.78_f32.to_radians(),
        }
    }
}

impl Regions {
    /// Both cones wider by an angle, radians, e.g. while the gaze is unsure.
    pub fn widened(self, by_rad: f32) -> Self {
        Self {
            fovea_radius_rad: self.fovea_radius_rad + by_rad,
            transition_radius_rad: self.transition_radius_rad + by_rad,
        }
    }

    /// The region at an eccentricity, radians. A border belongs to the inner region.
    pub fn region(&self, eccentricity_rad: f32) -> Region {
        if eccentricity_rad <= self.fovea_radius_rad {
            Region::Fovea
        } else if eccentricity_rad <= self.transition_radius_rad {
            Region::Transition
        } else {
            Region::Periphery
        }
    }

    /// Weight of the periphery's picture at an eccentricity, radians: 0 in the fovea, 1 in the periphery, smooth between
    /// (Foveated Photon Mapping, Eq. 6, with angles for pixels, clamped, and with zero slope at both ends, so that no seam
    /// shows). A step where the transition has no width.
    pub fn blend(&self, eccentricity_rad: f32) -> f32 {
        let width_rad = self.transition_radius_rad - self.fovea_radius_rad;
        if width_rad <= 0.0 {
            return f32::from(u8::from(eccentricity_rad > self.fovea_radius_rad));
        }
        let linear = ((eccentricity_rad - self.fovea_radius_rad) / width_rad).clamp(0.0, 1.0);
        linear * linear * (3.0 - 2.0 * linear)
    }
}

/// Straight pieces that an outline is made of.
const OUTLINE_PIECES: usize = 180;

/// Nearest that an outline's direction may come to the image plane's horizon before it is cut; far outside every image.
const HORIZON: f32 = 0.01;

/// The outline of the cone of half-angle `radius_rad` around `gaze_dir` (unit, view space) on the image of `fov`: polylines of
/// image points ((0,0) top left, (1,1) bottom right), cut at the image's border. Whole cones come back as one closed line;
/// none may be left.
pub fn outline(fov: &Fov, gaze_dir: Vec3, radius_rad: f32) -> Vec<Vec<Vec2>> {
    let Some(axis) = gaze_dir.try_normalize() else {
        return Vec::new();
    };
    if !fov.is_valid() || !radius_rad.is_finite() {
        return Vec::new();
    }
    let (side, up) = axis.any_orthonormal_pair();
    let (sin_radius, cos_radius) = radius_rad.sin_cos();
    let rim = |piece: usize| {
        let (sin, cos) = (TAU * (piece % OUTLINE_PIECES) as f32 / OUTLINE_PIECES as f32).sin_cos();
        axis * cos_radius + (side * cos + up * sin) * sin_radius
    };
    let mut lines: Vec<Vec<Vec2>> = Vec::new();
    for piece in 0..OUTLINE_PIECES {
        let Some((from, to)) = visible_piece(fov, rim(piece), rim(piece + 1)) else {
            continue;
        };
        match lines.last_mut() {
            Some(line) if line.last() == Some(&from) => line.push(to),
            _ => lines.push(vec![from, to]),
        }
    }
    join_ends(&mut lines);
    lines
}

/// The last line goes on in the first one where the rim's count starts.
fn join_ends(lines: &mut Vec<Vec<Vec2>>) {
    let goes_on = match lines.as_slice() {
        [first, .., last] => first.first() == last.last(),
        _ => false,
    };
    if goes_on && let Some(mut last) = lines.pop() {
        last.extend_from_slice(&lines[0][1..]);
        lines[0] = last;
    }
}

/// The part of the piece between two directions that is ahead and within the image.
fn visible_piece(fov: &Fov, from: Vec3, to: Vec3) -> Option<(Vec2, Vec2)> {
    let ahead = |dir: Vec3| dir.z <= -HORIZON;
    let at_horizon = || from.lerp(to, (-HORIZON - from.z) / (to.z - from.z));
    let (from, to) = match (ahead(from), ahead(to)) {
        (true, true) => (from, to),
        (true, false) => (from, at_horizon()),
        (false, true) => (at_horizon(), to),
        (false, false) => return None,
    };
    clip_to_image(fov.project(from)?, fov.project(to)?)
}

/// The part of a segment within \[0,1\]² (Liang and Barsky 1984).
fn clip_to_image(from: Vec2, to: Vec2) -> Option<(Vec2, Vec2)> {
    let step = to - from;
    let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
    for axis in 0..2 {
        if step[axis] == 0.0 {
            if !(0.0..=1.0).contains(&from[axis]) {
                return None;
            }
            continue;
        }
        let (at_zero, at_one) = (-from[axis] / step[axis], (1.0 - from[axis]) / step[axis]);
        enter = enter.max(at_zero.min(at_one));
        leave = leave.min(at_zero.max(at_one));
    }
    // Ends that are not cut stay exactly what they are, so that neighbouring pieces meet.
    let start = if enter > 0.0 {
        from + enter * step
    } else {
        from
    };
    let end = if leave < 1.0 { from + leave * step } else { to };
    (enter < leave).then_some((start, end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direction(azimuth_deg: f32) -> Vec3 {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        Vec3::new(sin, 0.0, -cos)
    }

    #[test]
    fn eccentricity_is_the_true_angle_even_when_tiny() {
        for deg in [0.0, 1e-4, 0.01, 9.78, 90.0, 179.99] {
            let angle_deg = eccentricity_rad(direction(deg), Vec3::NEG_Z).to_degrees();
            assert!((angle_deg - deg).abs() <= 1e-5 * deg, "{deg}: {angle_deg}");
        }
        assert_eq!(eccentricity_rad(3.0 * Vec3::NEG_Z, Vec3::NEG_Z), 0.0);
    }

    #[test]
    fn thirty_degrees_off_axis_the_foveal_cone_reaches_48_percent_farther_outward() {
        let reach = |gaze_deg: f32| {
            let slope = |deg: f32| deg.to_radians().tan();
            slope(gaze_deg + 9.78) - slope(gaze_deg)
        };
        let stretch = reach(30.0) / reach(0.0);
        assert!((stretch - 1.48).abs() < 0.005, "{stretch}");
        // The outline on the image says the same.
        let fov = Fov::symmetric(100_f32.to_radians(), 1.0);
        let rightmost = |gaze_deg: f32| {
            let line = outline(&fov, direction(gaze_deg), 9.78_f32.to_radians()).concat();
            let gaze = fov.project(direction(gaze_deg)).unwrap();
            line.iter()
                .map(|point| point.x - gaze.x)
                .fold(0.0, f32::max)
        };
        let drawn = rightmost(30.0) / rightmost(0.0);
        assert!((drawn - stretch).abs() < 0.01, "{drawn}");
    }

    #[test]
    fn the_regions_meet_at_their_radii_and_the_blend_has_no_seam() {
        let regions = Regions::default();
        let at = |deg: f32| {
            (
                regions.region(deg.to_radians()),
                regions.blend(deg.to_radians()),
            )
        };
        assert_eq!(at(0.0), (Region::Fovea, 0.0));
        assert_eq!(at(9.77), (Region::Fovea, 0.0));
        assert_eq!(at(9.79).0, Region::Transition);
        assert!((at(12.28).1 - 0.5).abs() < 1e-3);
        assert_eq!(at(14.79), (Region::Periphery, 1.0));
        assert_eq!(at(180.0), (Region::Periphery, 1.0));
        let blends: Vec<f32> = (0..2000)
            .map(|i| regions.blend((i as f32 * 0.01).to_radians()))
            .collect();
        assert!(
            blends
                .windows(2)
                .all(|pair| (0.0..0.004).contains(&(pair[1] - pair[0])))
        );
    }

    #[test]
    fn a_transition_without_width_is_a_step_and_no_nan() {
        let regions = Regions {
            transition_radius_rad: Regions::default().fovea_radius_rad,
            ..Regions::default()
        };
        assert_eq!(regions.blend(regions.fovea_radius_rad), 0.0);
        assert_eq!(regions.blend(regions.fovea_radius_rad + 1e-3), 1.0);
    }

    #[test]
    fn widening_moves_both_radii() {
        let wide = Regions::default().widened(0.1);
        assert!((wide.fovea_radius_rad - Regions::default().fovea_radius_rad - 0.1).abs() < 1e-6);
        assert!(
            (wide.transition_radius_rad - Regions::default().transition_radius_rad - 0.1).abs()
                < 1e-6
        );
    }

    #[test]
    fn a_cone_inside_the_image_is_one_closed_line_at_its_angle() {
        let fov = Fov {
            left_rad: -0.9,
            right_rad: 0.7,
            up_rad: 0.8,
            down_rad: -0.85,
        };
        let gaze = direction(10.0);
        let lines = outline(&fov, gaze, 0.2);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        for &point in &lines[0] {
            let angle = eccentricity_rad(fov.dir_in_view(point), gaze);
            assert!((angle - 0.2).abs() < 1e-3, "{angle}");
        }
    }

    #[test]
    fn a_cone_across_the_border_is_cut_there_and_one_behind_the_eye_is_not_drawn() {
        let fov = Fov::symmetric(1.0, 1.0);
        let cut = outline(&fov, direction(28.0), 0.2);
        assert_eq!(cut.len(), 1);
        let ends = [cut[0][0], cut[0][cut[0].len() - 1]];
        assert!(
            ends.iter().all(|end| (end.x - 1.0).abs() < 1e-4),
            "{ends:?}"
        );
        assert!(outline(&fov, direction(180.0), 0.2).is_empty());
        assert!(outline(&fov, Vec3::NAN, 0.2).is_empty());
        assert!(outline(&fov, Vec3::ZERO, 0.2).is_empty());
    }

    proptest! {
        #[test]
        fn every_outline_point_lies_on_the_image_and_on_the_cone(
            azimuth_deg in -180.0_f32..180.0, radius_rad in 0.01_f32..1.5,
        ) {
            let fov = Fov::symmetric(1.7, 1.1);
            let gaze = direction(azimuth_deg);
            for &point in outline(&fov, gaze, radius_rad).iter().flatten() {
                prop_assert!(point.cmpge(Vec2::splat(-1e-4)).all() && point.cmple(Vec2::splat(1.0001)).all());
                let angle = eccentricity_rad(fov.dir_in_view(point), gaze);
                prop_assert!((angle - radius_rad).abs() < 5e-3, "{} for {}", angle, radius_rad);
            }
        }
    }
}
