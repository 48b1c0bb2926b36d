//! What pixels keep of their light from frame to frame: a fixation grows sharper, and no light is kept that is no longer true.

use glam::Vec3;
use macula::frame::{FrameInput, FrameRenderer};
use macula::gaze::{GazeRay, GazeSample};
use macula::image::LinearImage;
use macula::params::Params;
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::technique::{self, Statistics};
use macula::view::{Fov, Pose, View};

use crate::maker::{Recipe, bundled, eye_target, gpu};

const SIDE: u32 = 48;
const FRAME_NS: i64 = 11_111_111;

/// A frame of a head at `position_m` in the play space, looking straight ahead.
fn input(index: u32, position_m: Vec3) -> FrameInput {
    let display_time_ns = 1_000_000_000 + i64::from(index) * FRAME_NS;
    let at = |x: f32| View {
        pose: Pose {
            position_m: position_m + x * Vec3::X,
            ..Pose::IDENTITY
        },
        fov: Fov::symmetric(0.6, 0.6),
    };
    let ray = GazeRay::new(Vec3::ZERO, Vec3::NEG_Z);
    FrameInput {
        index,
        display_time_ns,
        scene_time_s: 0.0,
        local_from_head: Pose {
            position_m,
            ..Pose::IDENTITY
        },
        local_from_eye: [at(-0.03), at(0.03)],
        gaze: Some(GazeSample::combined(display_time_ns - 8_000_000, ray)),
    }
}

fn params(kept_samples: &str) -> Params {
    let mut params = Params::default();
    let settings = [
        ("photon.count", "5000"),
        ("record.count", "1024"),
        ("fovea.radius_deg", "90"),
        ("fovea.transition_deg", "95"),
        ("temporal.kept_samples", kept_samples),
    ];
    for (key, value) in settings {
        params.set(key, value).unwrap();
    }
    params
}

/// The left eye's pictures of a head's way, and what was counted.
fn frames(scene: &Scene, params: &Params, way: &[Vec3]) -> Vec<(LinearImage, Statistics)> {
    let caster = SceneCaster::new(scene);
    let entry = technique::find("fpm").unwrap();
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let size = [SIDE; 2];
    let mut renderer =
        FrameRenderer::new(gpu(), scene, &caster, params, entry, size, format).unwrap();
    let targets = [(); 2].map(|()| eye_target(size));
    let render = |(index, position_m): (usize, &Vec3)| {
        let outcome = renderer
            .render(&input(index as u32, *position_m), &targets)
            .unwrap();
        (
            renderer.images()[0].read(gpu()).unwrap(),
            outcome.statistics,
        )
    };
    way.iter().enumerate().map(render).collect()
}

fn count(statistics: &Statistics, name: &str) -> f64 {
    let found = statistics.counts.iter().find(|(known, _)| *known == name);
    found.unwrap_or_else(|| panic!("no {name}")).1
}

/// The mean of squared relative differences.
fn error(image: &LinearImage, truth: &LinearImage) -> f64 {
    let pairs = image
        .rgb
        .as_flattened()
        .iter()
        .zip(truth.rgb.as_flattened());
    let floor = 0.01;
    let squares = pairs.map(|(x, t)| f64::from((x - t) / (t + floor)).powi(2));
    squares.sum::<f64>() / image.rgb.as_flattened().len() as f64
}

#[test]
fn a_fixation_grows_sharper() {
    let scene = Scene::load(&bundled("room.glb")).unwrap();
    let still = [Vec3::ZERO; 17];
    let truth = {
        // The mean of many frames of another seed, each lit from scratch.
        let mut others = params("0");
        others.set("random.seed", "77").unwrap();
        others.set("filter.path_levels", "0").unwrap();
        others.set("fovea.samples", "16").unwrap();
        let pictures = frames(&scene, &others, &[Vec3::ZERO; 24]);
        let mut mean = pictures[0].0.clone();
        for (at, value) in mean.rgb.as_flattened_mut().iter_mut().enumerate() {
            let values = pictures.iter().map(|(p, _)| p.rgb.as_flattened()[at]);
            *value = values.sum::<f32>() / pictures.len() as f32;
        }
        mean
    };
    let kept = frames(&scene, &params("64"), &still);
    let fresh = frames(&scene, &params("0"), &still);
    for index in [0, 1, 2, 4, 8, 16] {
        let statistics = &kept[index].1;
        println!(
            "frame {index}: {:.5} with kept light, {:.5} without; {} of {} pixels, {} samples",
            error(&kept[index].0, &truth),
            error(&fresh[index].0, &truth),
            count(statistics, "pixels_with_kept_light"),
            count(statistics, "pixels_keeping_light"),
            count(statistics, "samples_kept"),
        );
    }
}
