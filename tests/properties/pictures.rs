//! Random scenes, parameters, heads and gazes through the frame renderer, by every technique: pictures of radiance, bounded energy and
//! memory, and nothing that stays behind.

use std::cell::Cell;

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
use crate::runner::{hold, require};
use crate::scenes::{RandomScene, any_furnace, any_scene};

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

/// Pictures of one view, of other random numbers each, whose mean is held to the bound of energy.
const PICTURES: u32 = 6;
/// Standard errors, as the pictures' own spread tells them, that their mean may lie above the bound. Whatever makes the spread wide, a
/// few photons that carry nearly all light, makes the error large too: of six pictures with all light in one, the mean is one error.
const STANDARD_ERRORS: f64 = 6.0;
/// The share of the bound that blur may add: where a gather's disc is cut, its estimate is right on average over the disc only.
const BIAS: f64 = 0.05;

/// What a picture breaks, if anything.
fn soundness(image: &LinearImage) -> Result<(), String> {
    let values = image.rgb.as_flattened();
    match values.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        Some(wrong) => Err(format!("{wrong} is no radiance")),
        None => Ok(()),
    }
}

/// Whether the mean over pictures of one view, each given by its channels' means, is within the bound, its own noise allowed for.
fn boundedness(means: &[[f64; 3]], bound: f64) -> Result<(), String> {
    let count = means.len() as f64;
    for channel in 0..3 {
        let of = || means.iter().map(|mean| mean[channel]);
        let mean = of().sum::<f64>() / count;
        let squares = of().map(|x| (x - mean).powi(2)).sum::<f64>();
        let error = (squares / (count * (count - 1.0))).sqrt();
        require(
            mean <= (1.0 + BIAS) * bound + STANDARD_ERRORS * error,
            format!("a mean of {mean} +- {error}, where {bound} is the brightest radiance"),
        )?;
    }
    Ok(())
}

/// How many views had a bound, and of how many the same pictures three times as bright would have been noticed.
#[derive(Default)]
struct Bounded {
    views: Cell<u32>,
    tight: Cell<u32>,
}

impl Bounded {
    /// Says what there was since it last said so.
    fn tell(&self, what: &str) -> [u32; 2] {
        let [views, tight] = [&self.views, &self.tight].map(Cell::take);
        println!("{what}: {views} views have a bound; three times the light breaks it in {tight}");
        [views, tight]
    }

    /// Counts a view, and looks whether light that is three times as bright would be noticed in it.
    fn count(&self, means: &[[f64; 3]], bound: f64) {
        let brighter: Vec<_> = means.iter().map(|mean| mean.map(|x| 3.0 * x)).collect();
        self.views.set(self.views.get() + 1);
        let is_noticed = boundedness(&brighter, bound).is_err();
        self.tight.set(self.tight.get() + u32::from(is_noticed));
    }
}

/// Bytes that the device may hold for a small scene and picture: 80 for each photon that the map may hold, paths and photons of a
/// batch, the same for aimed ones, records laid out as photons, visible points and what the filter and both eyes keep of them, four grids'
/// cells (2^21 each), and what does not depend on parameters.
fn memory_limit_bytes(params: &Params, pixels: u64) -> u64 {
    const PHOTON_BYTES: u64 = 80;
    const CELL_BYTES: u64 = 4 * (4 << 21);
    const REST_BYTES: u64 = 32 << 20;
    let photon = &params.photon;
    let path_bytes = (2 * size_of::<PhotonPath>() + size_of::<Photon>() + 8) as u64;
    let map_bytes = |count: u32| {
        let wanted = count.div_ceil(8).max(count.clamp(64, 4096));
        let batch = u64::from(photon.batch.min(wanted));
        let stored = (f64::from(count) * f64::from(photon.stored_per_path)) as u64;
        stored.max(2 * batch) * PHOTON_BYTES + batch * path_bytes
    };
    // Thirteen vectors a slot for the filter, four a pixel for either side of either eye.
    let pixel_bytes = (2 * size_of::<VisiblePoint>() + 64 + 2 * 13 * 16 + 4 * 4 * 16 + 4) as u64;
    map_bytes(photon.count)
        + map_bytes(params.aimed.count)
        + u64::from(params.record.count) * PHOTON_BYTES
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

fn session(scene: impl Strategy<Value = RandomScene>) -> impl Strategy<Value = Session> {
    let technique = 0..REGISTRY.len();
    let frames = prop::collection::vec(frame(), 1..4);
    (
        technique,
        scene,
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

/// Sessions whose eyes see a glowing room from inside: wherever they look, light comes. Discs take photons of their own surface only: a user
/// may let them take those of other walls, and has pictures that are too bright.
fn session_in_a_room() -> impl Strategy<Value = Session> {
    session(any_furnace()).prop_map(|mut session| {
        let usual = Params::default();
        session.params.viewer = usual.viewer;
        session.params.gather.normal_cos_min = usual.gather.normal_cos_min;
        session.params.gather.flatness = usual.gather.flatness;
        for angle in session.frames.iter_mut().flat_map(|frame| &mut frame.fov) {
            // Neither negative nor not a number.
            *angle = angle.abs().max(0.01);
        }
        session
    })
}

impl Session {
    fn entry(&self) -> &'static TechniqueEntry {
        &REGISTRY[self.technique]
    }

    /// Renders a frame, the last one again with other random numbers where there are no more; the channels' means, by eye.
    fn render(
        &self,
        renderer: &mut FrameRenderer<'_>,
        index: u32,
    ) -> Result<[[f64; 3]; 2], String> {
        let frame = &self.frames[(index as usize).min(self.frames.len() - 1)];
        let targets = [(); 2].map(|()| eye_target(self.size));
        let outcome = renderer.render(&frame.input(index), &targets);
        let outcome = outcome.map_err(|error| error.to_string())?;
        for dir in outcome.gaze_dir_in_eye {
            require(dir.is_normalized(), format!("an eye looks along {dir}"))?;
        }
        let mut means = [[0.0; 3]; 2];
        for (image, means) in renderer.images().iter().zip(&mut means) {
            let image = image.read(gpu()).map_err(|error| error.to_string())?;
            soundness(&image)?;
            *means = mean(&image);
        }
        Ok(means)
    }

    /// Renders every frame, while the device held `before` bytes at the start, and looks at all that comes of it.
    fn play(&self, before: u64, bounded: &Bounded) -> Result<(), String> {
        let scene = self.scene.load();
        let caster = SceneCaster::new(&scene);
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
        let mut last = [[0.0; 3]; 2];
        let mut index = 0;
        while (index as usize) < self.frames.len() {
            last = self.render(&mut renderer, index)?;
            index += 1;
        }
        // Nothing in a random scene moves, and parameters put the head anywhere.
        if let Some(bound) = radiance_bound_w_m2_sr(&scene, 0.0, None) {
            let mut views = last.map(|means| vec![means]);
            while views[0].len() < PICTURES as usize {
                let means = self.render(&mut renderer, index)?;
                index += 1;
                views
                    .iter_mut()
                    .zip(means)
                    .for_each(|(view, means)| view.push(means));
            }
            for view in &views {
                boundedness(view, bound)?;
                bounded.count(view, bound);
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
    let bounded = Bounded::default();
    let is_sound = |session: Session| {
        session.play(before, &bounded)?;
        gpu().wait("the end").unwrap();
        let left = device_bytes().unwrap_or(0).saturating_sub(before);
        require(left < 1 << 20, format!("{left} bytes stay behind"))
    };
    let what = "sessions of one to three frames for two eyes";
    hold(what, 70, session(any_scene()), is_sound);
    bounded.tell(what);
    let what = "sessions in a glowing room";
    hold(what, 30, session_in_a_room(), is_sound);
    let [views, tight] = bounded.tell(what);
    assert!(4 * tight > views, "{tight} of {views} bounds say something");
}

#[test]
fn a_picture_that_is_no_picture_of_radiance_is_noticed() {
    let with = |value: f32| LinearImage {
        width: 2,
        height: 1,
        rgb: vec![[1.0; 3], [1.0, value, 1.0]],
    };
    assert_eq!(soundness(&with(1.0)), Ok(()));
    for value in [f32::NAN, f32::INFINITY, -1e-9] {
        assert!(soundness(&with(value)).is_err(), "{value}");
    }
}

#[test]
fn pictures_brighter_than_lights_and_surfaces_allow_are_noticed() {
    let means = [0.98, 1.0, 1.01, 1.02, 0.99, 1.0].map(|mean| [0.5, mean, 0.0]);
    assert_eq!(boundedness(&means, 1.0), Ok(()));
    assert!(boundedness(&means, 0.9).is_err());
    // All light in one picture of six says nothing, whatever the bound.
    let mut rare = [[0.0; 3]; PICTURES as usize];
    rare[2] = [1e3; 3];
    assert_eq!(boundedness(&rare, 1.0), Ok(()));
}
