//! The columns of a replay's `frames.csv` that tell, for each eye, its field of view and where it looked.

use glam::DVec3;

use crate::metrics::region::EyeView;
use crate::view::Fov;

/// The two eyes as files and columns name them.
pub const EYE_NAMES: [&str; 2] = ["left", "right"];
const FIGURES: [&str; 6] = [
    "gaze_azimuth_deg",
    "gaze_elevation_deg",
    "fov_left_deg",
    "fov_right_deg",
    "fov_up_deg",
    "fov_down_deg",
];

/// To the right and up of straight ahead, degrees, of a unit direction.
pub fn angles_deg(dir_in_view: DVec3) -> [f64; 2] {
    [
        dir_in_view.x.atan2(-dir_in_view.z).to_degrees(),
        dir_in_view.y.clamp(-1.0, 1.0).asin().to_degrees(),
    ]
}

/// The unit direction that [`angles_deg`] names so.
pub fn dir_in_view([azimuth_deg, elevation_deg]: [f64; 2]) -> DVec3 {
    let (sin_azimuth, cos_azimuth) = azimuth_deg.to_radians().sin_cos();
    let (sin_elevation, cos_elevation) = elevation_deg.to_radians().sin_cos();
    DVec3::new(
        sin_azimuth * cos_elevation,
        sin_elevation,
        -cos_azimuth * cos_elevation,
    )
}

/// The columns of an eye (0 left, 1 right): `left_gaze_azimuth_deg` and so on.
pub fn names(eye: usize) -> [String; 6] {
    FIGURES.map(|figure| format!("{}_{figure}", EYE_NAMES[eye]))
}

/// Their values, in the order of [`names`].
pub fn values(view: EyeView) -> [f64; 6] {
    let [azimuth_deg, elevation_deg] = angles_deg(view.gaze_dir_in_view);
    let Fov {
        left_rad,
        right_rad,
        up_rad,
        down_rad,
    } = view.fov;
    let [left, right, up, down] =
        [left_rad, right_rad, up_rad, down_rad].map(|angle| f64::from(angle).to_degrees());
    [azimuth_deg, elevation_deg, left, right, up, down]
}

/// The view that such values tell; `None` if they are no view.
pub fn view([azimuth_deg, elevation_deg, left, right, up, down]: [f64; 6]) -> Option<EyeView> {
    let [left_rad, right_rad, up_rad, down_rad] =
        [left, right, up, down].map(|angle| angle.to_radians() as f32);
    let fov = Fov {
        left_rad,
        right_rad,
        up_rad,
        down_rad,
    };
    let gaze_dir_in_view = dir_in_view([azimuth_deg, elevation_deg]);
    (fov.is_valid() && gaze_dir_in_view.is_finite()).then_some(EyeView {
        fov,
        gaze_dir_in_view,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_survives_its_columns() {
        let written = EyeView {
            fov: Fov {
                left_rad: -0.9,
                right_rad: 0.7,
                up_rad: 0.8,
                down_rad: -0.85,
            },
            gaze_dir_in_view: dir_in_view([-12.0, 7.5]),
        };
        let read = view(values(written)).unwrap();
        assert!(read.gaze_dir_in_view.distance(written.gaze_dir_in_view) < 1e-12);
        assert!((read.fov.left_rad - written.fov.left_rad).abs() < 1e-6);
        assert!((read.fov.down_rad - written.fov.down_rad).abs() < 1e-6);
        assert_eq!(names(1)[0], "right_gaze_azimuth_deg");
        let mut turned = values(written);
        turned.swap(2, 3);
        assert_eq!(view(turned), None);
        assert_eq!(view([f64::NAN; 6]), None);
    }
}
