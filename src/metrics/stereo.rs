//! Stereo disagreement: what the two eyes are shown differently beyond what the scene makes them see differently.
//!
//! Noise and bias of their own in each eye are seen as rivalry. Without depth no pixel of one eye can be matched with the surface point
//! of the other, but the eyes themselves match by retina: what lies in one direction from the left eye's gaze is fused with what lies in the
//! same direction from the right eye's. So each eye's error against its own reference, which has parallax in it already, is averaged over
//! blocks of 8x8 pixels, and the errors of the two eyes at the same direction from their gaze are set against each other. Where the gaze is
//! not known, the same place in both pictures stands in for it (looking far away through equal fields of view).
//!
//! Limits: the turn from one gaze to the other is the smallest one, so cyclotorsion is left out; directions that one of the pictures does
//! not show are left out; rivalry finer than a block is not seen.

use glam::{DQuat, DVec3, Vec2};
use serde::Serialize;

use super::block::{self, BLOCK_SIDE};
use super::error::ImagePair;
use super::region::{ByRegion, EccentricityLimits, EyeView, eccentricity_rad};
use super::temporal::{mean, mean_of_all};

/// One eye's picture, its reference and, if it is known, where it looked.
#[derive(Clone, Copy, Debug)]
pub struct Eye<'a> {
    /// Picture and reference.
    pub pair: ImagePair<'a>,
    /// Field of view and gaze.
    pub view: Option<EyeView>,
}

/// How far the errors of the two eyes differ, over blocks of 8x8 pixels. The units are the pictures' (W/(m² sr) and its square).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Disagreement {
    /// Pairs of blocks compared.
    pub blocks: usize,
    /// Mean square of the left eye's error less the right eye's.
    pub disagreement_mse: f64,
    /// Mean square of the error of a block, over both eyes.
    pub block_mse: f64,
    /// `disagreement_mse` as a share of the two eyes' mean squares together: 0 where the eyes err alike, 1 where their errors have nothing
    /// to do with each other, 2 where they are opposed. `None` where there is no error.
    pub disagreement_share: Option<f64>,
    /// What the noise of the references, independent in the two eyes, adds to `disagreement_mse`; where their standard error is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_disagreement_mse: Option<f64>,
    /// For R, G and B, the left eye's mean over the right eye's, divided by the same of the references: 1 where no eye is brighter than it
    /// should be beside the other. `None` where a mean is not above zero.
    pub left_right_ratio: [Option<f64>; 3],
}

/// One block as both eyes see it: means of the pictures, of the references, and their variance.
struct BlockPair {
    candidate: [[f32; 3]; 2],
    reference: [[f32; 3]; 2],
    reference_variance: Option<f64>,
    eccentricity_rad: Option<f64>,
}

/// The disagreement of left and right eye, of the whole picture and, where both views are known, by region within `limits`. The two pictures
/// of an eye have one size; those of the two eyes may differ.
pub fn disagreement(eyes: [Eye; 2], limits: EccentricityLimits) -> ByRegion<Disagreement> {
    let [left, _] = eyes;
    let (columns, rows) = (
        left.pair.width / BLOCK_SIDE,
        left.pair.candidate.len() / left.pair.width / BLOCK_SIDE,
    );
    let pairs: Vec<BlockPair> = (0..columns * rows)
        .filter_map(|block| {
            let corner = [block % columns, block / columns].map(|at| at * BLOCK_SIDE);
            block_pair(eyes, corner)
        })
        .collect();
    ByRegion::of(
        pairs.len(),
        |pair| Some(limits.region(pairs[pair].eccentricity_rad?)),
        |numbers| {
            of_blocks(&Vec::from_iter(
                numbers.iter().map(|&number| &pairs[number]),
            ))
        },
    )
}

impl Disagreement {
    /// The mean over frames; that of the references' own disagreement is known if it is known of all. `None` for none.
    pub fn mean(frames: &[Self]) -> Option<Self> {
        let each = |figure: fn(&Self) -> f64| mean(frames.iter().map(figure));
        let (disagreement_mse, block_mse) = (
            each(|frame| frame.disagreement_mse)?,
            each(|frame| frame.block_mse)?,
        );
        Some(Self {
            blocks: frames.iter().map(|frame| frame.blocks).sum(),
            disagreement_mse,
            block_mse,
            disagreement_share: share(disagreement_mse, block_mse),
            reference_disagreement_mse: mean_of_all(
                frames.iter().map(|frame| frame.reference_disagreement_mse),
            ),
            left_right_ratio: std::array::from_fn(|channel| {
                mean(
                    frames
                        .iter()
                        .filter_map(|frame| frame.left_right_ratio[channel]),
                )
            }),
        })
    }
}

fn share(disagreement_mse: f64, block_mse: f64) -> Option<f64> {
    (block_mse > 0.0).then(|| disagreement_mse / (2.0 * block_mse))
}

fn of_blocks(pairs: &[&BlockPair]) -> Option<Disagreement> {
    let error = |pair: &BlockPair, eye: usize, channel: usize| {
        f64::from(pair.candidate[eye][channel]) - f64::from(pair.reference[eye][channel])
    };
    let mean_of = |value: &dyn Fn(&BlockPair, usize) -> f64| {
        mean(
            pairs
                .iter()
                .flat_map(|pair| (0..3).map(|channel| value(pair, channel))),
        )
    };
    let disagreement_mse =
        mean_of(&|pair, channel| (error(pair, 0, channel) - error(pair, 1, channel)).powi(2))?;
    let block_mse = mean_of(&|pair, channel| {
        0.5 * (error(pair, 0, channel).powi(2) + error(pair, 1, channel).powi(2))
    })?;
    let left_right_ratio = |channel: usize| {
        let sum = |values: fn(&BlockPair) -> &[[f32; 3]; 2], eye: usize| -> f64 {
            pairs
                .iter()
                .map(|pair| f64::from(values(pair)[eye][channel]))
                .sum()
        };
        let candidate = |eye| sum(|pair| &pair.candidate, eye);
        let reference = |eye| sum(|pair| &pair.reference, eye);
        let sums = [candidate(0), candidate(1), reference(0), reference(1)];
        let is_lit = sums.iter().all(|&sum| sum > 0.0);
        is_lit.then(|| sums[0] / sums[1] / (sums[2] / sums[3]))
    };
    Some(Disagreement {
        blocks: pairs.len(),
        disagreement_mse,
        block_mse,
        disagreement_share: share(disagreement_mse, block_mse),
        reference_disagreement_mse: mean(pairs.iter().filter_map(|pair| pair.reference_variance)),
        left_right_ratio: std::array::from_fn(left_right_ratio),
    })
}

/// The left eye's block with this top left corner, and the right eye's block in the same direction from its gaze.
fn block_pair([left, right]: [Eye; 2], corner: [usize; 2]) -> Option<BlockPair> {
    let half = BLOCK_SIDE as f32 / 2.0;
    let center = Vec2::from_array(corner.map(|at| at as f32 + half));
    let center_uv = center / size(left.pair);
    let views = left.view.zip(right.view);
    let right_uv = match views {
        Some((left, right)) => matching_uv(left, right, center_uv)?,
        None => center_uv,
    };
    let right_corner = (right_uv * size(right.pair) - half).round();
    if right_corner.min_element() < 0.0 {
        return None;
    }
    let pixels = [
        block::block_pixels(left.pair, corner)?,
        block::block_pixels(right.pair, right_corner.to_array().map(|at| at as usize))?,
    ];
    let pairs = [left.pair, right.pair];
    let means = |rgb: [&[[f32; 3]]; 2]| [0, 1].map(|eye| block::mean_rgb(rgb[eye], &pixels[eye]));
    let variance = |eye: usize| -> Option<f64> {
        let standard_error = pairs[eye].reference_standard_error?;
        let of_mean = block::standard_error_of_mean(standard_error, &pixels[eye]);
        mean(of_mean.map(|x| f64::from(x).powi(2)))
    };
    Some(BlockPair {
        candidate: means(pairs.map(|pair| pair.candidate)),
        reference: means(pairs.map(|pair| pair.reference)),
        reference_variance: variance(0)
            .zip(variance(1))
            .map(|(left, right)| left + right),
        eccentricity_rad: views.map(|(left, _)| {
            let dir = left.fov.dir_in_view(center_uv).as_dvec3();
            eccentricity_rad(dir, left.gaze_dir_in_view)
        }),
    })
}

fn size(pair: ImagePair) -> Vec2 {
    Vec2::new(
        pair.width as f32,
        (pair.candidate.len() / pair.width) as f32,
    )
}

/// Where the right eye sees the direction from its gaze in which the left eye sees `left_uv`.
fn matching_uv(left: EyeView, right: EyeView, left_uv: Vec2) -> Option<Vec2> {
    let unit = |dir: DVec3| dir.try_normalize();
    let right_from_left =
        DQuat::from_rotation_arc(unit(left.gaze_dir_in_view)?, unit(right.gaze_dir_in_view)?);
    let dir = right_from_left * left.fov.dir_in_view(left_uv).as_dvec3();
    right.fov.project(dir.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Fov;

    const SIDE: usize = 32;
    const LIMITS: EccentricityLimits = EccentricityLimits {
        fovea_rad: 0.1,
        transition_rad: 0.2,
    };

    fn flat(value: f32) -> Vec<[f32; 3]> {
        vec![[value; 3]; SIDE * SIDE]
    }

    fn eye<'a>(candidate: &'a [[f32; 3]], reference: &'a [[f32; 3]]) -> Eye<'a> {
        Eye {
            pair: ImagePair {
                width: SIDE,
                candidate,
                reference,
                reference_standard_error: None,
            },
            view: None,
        }
    }

    fn whole(left: Eye, right: Eye) -> Disagreement {
        disagreement([left, right], LIMITS).whole.unwrap()
    }

    #[test]
    fn errors_that_both_eyes_share_are_no_disagreement() {
        let (right_answer, bright) = (flat(1.0), flat(1.5));
        let alike = whole(eye(&bright, &right_answer), eye(&bright, &right_answer));
        assert_eq!((alike.disagreement_mse, alike.block_mse), (0.0, 0.25));
        assert_eq!(alike.disagreement_share, Some(0.0));
        assert_eq!(alike.left_right_ratio, [Some(1.0); 3]);
        // Parallax is in the references: pictures that differ but are right do not disagree.
        let parallax = whole(eye(&bright, &bright), eye(&right_answer, &right_answer));
        assert_eq!(
            (parallax.disagreement_mse, parallax.disagreement_share),
            (0.0, None)
        );
    }

    #[test]
    fn a_bias_in_one_eye_is_its_square_and_an_opposed_one_four_times_that() {
        let (dim, right_answer, bright) = (flat(0.5), flat(1.0), flat(1.5));
        let one = whole(
            eye(&bright, &right_answer),
            eye(&right_answer, &right_answer),
        );
        assert_eq!(
            (one.disagreement_mse, one.disagreement_share),
            (0.25, Some(1.0))
        );
        assert_eq!(one.left_right_ratio, [Some(1.5); 3]);
        let opposed = whole(eye(&bright, &right_answer), eye(&dim, &right_answer));
        assert_eq!(
            (opposed.disagreement_mse, opposed.disagreement_share),
            (1.0, Some(2.0))
        );
        assert_eq!(opposed.blocks, 16);
    }

    #[test]
    fn noise_finer_than_a_block_is_averaged_away_and_the_references_own_noise_is_said() {
        let reference = flat(1.0);
        let noise = |i: usize| {
            if (i + i / SIDE).is_multiple_of(2) {
                0.5
            } else {
                -0.5
            }
        };
        let noisy: Vec<_> = (0..SIDE * SIDE).map(|i| [1.0 + noise(i); 3]).collect();
        assert!(
            whole(eye(&noisy, &reference), eye(&reference, &reference)).disagreement_mse < 1e-12
        );
        let standard_error = flat(0.8);
        let mut sure = eye(&reference, &reference);
        sure.pair.reference_standard_error = Some(&standard_error);
        let said = whole(sure, sure).reference_disagreement_mse.unwrap();
        assert!((said - 2.0 * 0.64 / 64.0).abs() < 1e-8, "{said}");
        assert_eq!(
            whole(sure, eye(&reference, &reference)).reference_disagreement_mse,
            None
        );
    }

    #[test]
    fn errors_meet_where_they_fall_on_the_two_retinas() {
        // Both eyes err in the one block they look at. The views are asymmetric, so that it lies at different places of the pictures.
        let reference = flat(1.0);
        let spot = |column: usize| {
            let mut picture = reference.clone();
            for row in 8..16 {
                picture[row * SIDE + column..][..BLOCK_SIDE].fill([2.0; 3]);
            }
            picture
        };
        let view = |offset: f32, column: usize| {
            let slope = |uv: f32| (2.0 * uv - 1.0 + offset).atan();
            let fov = Fov {
                left_rad: slope(0.0),
                right_rad: slope(1.0),
                up_rad: 0.8,
                down_rad: -0.8,
            };
            let center = Vec2::new(column as f32 + 4.0, 12.0) / SIDE as f32;
            EyeView {
                fov,
                gaze_dir_in_view: fov.dir_in_view(center).as_dvec3(),
            }
        };
        let (left, right) = (spot(16), spot(8));
        let with = |picture, view| Eye {
            view,
            ..eye(picture, &reference)
        };
        let seen = disagreement(
            [
                with(&left, Some(view(-0.25, 16))),
                with(&right, Some(view(0.25, 8))),
            ],
            LIMITS,
        );
        assert_eq!(seen.fovea.unwrap().disagreement_mse, 0.0);
        // The same pictures by place disagree: the check sees where the eyes look.
        let by_place = disagreement([with(&left, None), with(&right, None)], LIMITS);
        assert!(by_place.whole.unwrap().disagreement_mse > 0.1);
        assert_eq!(by_place.fovea, None);
    }

    #[test]
    fn directions_that_one_eye_does_not_see_are_left_out() {
        let reference = flat(1.0);
        let view = |azimuth: f64| EyeView {
            fov: Fov::symmetric(1.0, 1.0),
            gaze_dir_in_view: DVec3::new(azimuth.sin(), 0.0, -azimuth.cos()),
        };
        let blocks = |azimuth| {
            let looking = |azimuth| Eye {
                view: Some(view(azimuth)),
                ..eye(&reference, &reference)
            };
            let whole = disagreement([looking(0.0), looking(azimuth)], LIMITS).whole;
            whole.map_or(0, |whole| whole.blocks)
        };
        assert_eq!(blocks(0.0), 16);
        for aside in [-0.3, 0.3] {
            // By hand: of the four columns the two that stay inside after the turn.
            assert_eq!(blocks(aside), 8, "looking {aside} aside");
        }
        assert_eq!(blocks(2.0), 0);
    }
}
