//! Random scenes, parameters, heads and gazes through the frame renderer, by every technique: pictures of radiance, bounded energy and
//! memory, and nothing that stays behind.

use glam::{Quat, Vec3};
use macula::frame::{FrameInput, FrameRenderer};
use macula::gaze::{GazeRay, GazeSample};
use macula::gpu::layout::{Photon, PhotonPath, VisiblePoint};
use macula::image::LinearImage;
use macula::params::Params;
use macula::scene::bvh::SceneCaster;
use macula::technique::{REGISTRY, TechniqueEntry};
use macula::view::{Fov, Pose, View};
use proptest::prelude::*;

use crate::alone;
use crate::energy_bound::radiance_bound_w_m2_sr;
use crate::knobs::any_params;
use crate::maker::{EYE_FORMAT, eye_target, gpu, mean};
use crate::runner::hold;
use crate::scenes::{RandomScene, any_scene};

/// A frame's head and eyes.
#[derive(Clone, Debug)]
struct RandomFrame {
    time_ns: i64,
    place: Vec3,
    turn: [f32; 2],
    fov: [f32; 4],
    gaze: Option<Vec3>,
}

fn frame() -> impl Strategy<Value = RandomFrame> {
    let place = prop::array::uniform3(-1.0..1.0f32).prop_map(Vec3::from_array);
    let angle = || prop_oneof![5 => 0.01..1.5f32, 1 => -1.5..0.0f32, 1 => Just(f32::NAN)];
    let gaze = prop::array::uniform3(-2.0..2.0f32).prop_map(Vec3::from_array);
    let gaze = prop_oneof![4 => gaze, 1 => Just(Vec3::NAN)];
    (
        prop_oneof![4 => 0..10_000_000_000i64, 1 => any::<i64>()],
        place,
        prop::array::uniform2(-1.0..1.0f32),
        [angle(), angle(), angle(), angle()],
        prop::option::of(gaze),
    )
        .prop_map(|(time_ns, place, turn, fov, gaze)| RandomFrame {
            time_ns,
            place,
            turn,
            fov,
            gaze,
        })
}

impl RandomFrame {
    fn input(&self, index: u32) -> FrameInput {
        let [yaw, pitch] = self.turn;
        let local_from_head = Pose {
            orientation: Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch),
            position_m: self.place,
        };
        let [left, right, up, down] = self.fov;
        let eye = |x: f32| View {
            pose: local_from_head.compose(Pose {
                position_m: x * Vec3::X,
                ..Pose::IDENTITY
            }),
            fov: Fov {
                left_rad: -left,
                right_rad: right,
                up_rad: up,
                down_rad: -down,
            },
        };
        let ray = |dir| GazeRay::new(Vec3::ZERO, dir);
        FrameInput {
            index,
            display_time_ns: self.time_ns,
            scene_time_s: self.time_ns as f64 * 1e-9,
            local_from_head,
            local_from_eye: [eye(-0.03), eye(0.03)],
            gaze: self
                .gaze
                .map(|dir| GazeSample::combined(self.time_ns, ray(dir))),
        }
    }
}

/// How much brighter than the brightest radiance a small picture of few photons may be in the mean: an estimate that is right on
/// average is so by a factor k with a chance below 1/k.
const NOISE_FACTOR: f64 = 1e3;

/// What a picture breaks, if anything.
fn soundness(image: &LinearImage, bound: Option<f64>) -> Result<(), String> {
    let values = image.rgb.as_flattened();
    if let Some(wrong) = values.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        return Err(format!("{wrong} is no radiance"));
    }
    let brightest = mean(image).into_iter().fold(0.0, f64::max);
    match bound {
        Some(bound) if brightest > NOISE_FACTOR * bound => Err(format!(
            "a mean of {brightest}, where {bound} is the brightest radiance"
        )),
        _ => Ok(()),
    }
}

/// Bytes that the device may hold for a small scene and picture: 80 for each photon that the map may hold, paths and photons of a
/// batch, visible points, both grids' cells (2^22), and what does not depend on parameters.
fn memory_limit_bytes(params: &Params, pixels: u64) -> u64 {
    const PHOTON_BYTES: u64 = 80;
    const CELL_BYTES: u64 = 4 << 22;
    const REST_BYTES: u64 = 32 << 20;
    let photon = &params.photon;
    let batch = u64::from(
        photon
            .batch
            .min(photon.count.div_ceil(8).max(photon.count.clamp(64, 4096))),
    );
    let stored = (f64::from(photon.count) * f64::from(photon.stored_per_path)) as u64;
    let path_bytes = (2 * size_of::<PhotonPath>() + size_of::<Photon>() + 8) as u64;
    let pixel_bytes = (2 * size_of::<VisiblePoint>() + 64) as u64;
    stored.max(2 * batch) * PHOTON_BYTES
        + batch * path_bytes
        + pixels * pixel_bytes
        + CELL_BYTES
        + REST_BYTES
}

/// Bytes that buffers and textures take on the device; `None` where it does not say.
fn device_bytes() -> Option<u64> {
    let report = gpu().device.generate_allocator_report()?;
    Some(report.total_allocated_bytes)
}

#[derive(Clone, Debug)]
struct Session {
    technique: usize,
    scene: RandomScene,
    params: Params,
    size: [u32; 2],
    frames: Vec<RandomFrame>,
}

fn session() -> impl Strategy<Value = Session> {
    let technique = 0..REGISTRY.len();
    let frames = prop::collection::vec(frame(), 1..4);
    (
        technique,
        any_scene(),
        any_params(),
        [1..=24u32, 1..=24u32],
        frames,
    )
        .prop_map(|(technique, scene, params, size, frames)| Session {
            technique,
            scene,
            params,
            size,
            frames,
        })
}

impl Session {
    fn entry(&self) -> &'static TechniqueEntry {
        &REGISTRY[self.technique]
    }

    /// Renders every frame, while the device held `before` bytes at the start, and looks at all that comes of it.
    fn play(&self, before: u64) -> Result<(), String> {
        let scene = self.scene.load();
        let caster = SceneCaster::new(&scene);
        let bound = radiance_bound_w_m2_sr(&scene);
        let renderer = FrameRenderer::new(
            gpu(),
            &scene,
            &caster,
            &self.params,
            self.entry(),
            self.size,
            EYE_FORMAT,
        );
        let mut renderer = renderer.map_err(|error| error.to_string())?;
        let targets = [(); 2].map(|()| eye_target(self.size));
        for (index, frame) in self.frames.iter().enumerate() {
            let outcome = renderer.render(&frame.input(index as u32), &targets);
            let outcome = outcome.map_err(|error| error.to_string())?;
            for dir in outcome.gaze_dir_in_eye {
                if !dir.is_normalized() {
                    return Err(format!("an eye looks along {dir}"));
                }
            }
            for image in renderer.images() {
                let image = image.read(gpu()).map_err(|error| error.to_string())?;
                soundness(&image, bound)?;
            }
        }
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let limit = memory_limit_bytes(&self.params, pixels);
        match device_bytes().map(|bytes| bytes.saturating_sub(before)) {
            Some(held) if held > limit => {
                Err(format!("{held} bytes are held, {limit} is the limit"))
            }
            _ => Ok(()),
        }
    }
}

#[test]
fn every_picture_is_one_of_radiance_within_bounds_of_energy_and_memory() {
    let _alone = alone();
    gpu().wait("the start").unwrap();
    let before = device_bytes().unwrap_or(0);
    if before == 0 && device_bytes().is_none() {
        println!("this device does not say what memory it holds: the limit is not checked");
    }
    hold(
        "sessions of one to three frames for two eyes",
        100,
        session(),
        |session| {
            session.play(before)?;
            gpu().wait("the end").unwrap();
            let left = device_bytes().unwrap_or(0).saturating_sub(before);
            (left < 1 << 20)
                .then_some(())
                .ok_or_else(|| format!("{left} bytes stay behind"))
        },
    );
}

#[test]
fn a_picture_that_is_no_picture_of_radiance_is_noticed() {
    let with = |value: f32| LinearImage {
        width: 2,
        height: 1,
        rgb: vec![[1.0; 3], [1.0, value, 1.0]],
    };
    assert_eq!(soundness(&with(1.0), Some(1.0)), Ok(()));
    for value in [f32::NAN, f32::INFINITY, -1e-9, 1e5] {
        assert!(soundness(&with(value), Some(1.0)).is_err(), "{value}");
    }
}
