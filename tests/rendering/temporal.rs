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

use crate::maker::{Recipe, Stage, bundled, eye_target, glowing, gpu, lambert};

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
        ("fovea.radius_deg", "12"),
        ("fovea.transition_deg", "15"),
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

/// The same away from edges, which every frame smooths by its own samples alone.
fn error_inside(image: &LinearImage, truth: &LinearImage) -> f64 {
    let side = SIDE as usize;
    let red = |x: usize, y: usize| truth.rgb[y * side + x][0];
    let is_inside = |x: usize, y: usize| {
        let around = (0..9).map(|n| red(x + n % 3 - 1, y + n / 3 - 1));
        let (low, high) = around.fold((f32::MAX, 0f32), |(l, h), v| (l.min(v), h.max(v)));
        high < 1.15 * low
    };
    let places = (1..side - 1).flat_map(|y| (1..side - 1).map(move |x| (x, y)));
    let inside = Vec::from_iter(places.filter(|(x, y)| is_inside(*x, *y)));
    let of = |image: &LinearImage| LinearImage {
        width: inside.len() as u32,
        height: 1,
        rgb: inside
            .iter()
            .map(|(x, y)| image.rgb[y * side + x])
            .collect(),
    };
    assert!(inside.len() > side * side / 2);
    error(&of(image), &of(truth))
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

/// A corner of a room with a block in it, lit by a lamp: all of it diffuse, and nothing moves.
fn corner() -> Scene {
    let side = 3.0;
    let floor = Vec3::new(-1.5, 0.0, 1.5);
    Stage::new(Vec3::new(0.0, 1.0, 1.4), Vec3::new(0.0, 0.6, -1.0))
        .quad(floor, side * Vec3::X, -side * Vec3::Z, lambert([0.7; 3]))
        .quad(
            floor - side * Vec3::Z,
            side * Vec3::X,
            side * Vec3::Y,
            lambert([0.6, 0.6, 0.3]),
        )
        .quad(
            floor,
            -side * Vec3::Z,
            side * Vec3::Y,
            lambert([0.7, 0.2, 0.2]),
        )
        .cuboid(
            Vec3::new(0.2, 0.3, -0.6),
            Vec3::splat(0.3),
            lambert([0.5; 3]),
        )
        .quad(
            Vec3::new(-0.3, 1.8, -0.8),
            0.6 * Vec3::X,
            0.6 * Vec3::Z,
            glowing([15.0; 3]),
        )
        .load()
}

/// What the frames come to without noise: the mean of many, each lit from scratch and not filtered.
fn truth(scene: &Scene, place: Vec3) -> LinearImage {
    let mut settings = params("0");
    let set = [
        ("random.seed", "77"),
        ("filter.path_levels", "0"),
        ("fovea.samples", "16"),
        ("fovea.transition_samples", "16"),
        ("fovea.periphery_samples", "16"),
        ("indirect.paths", "2"),
    ];
    for (key, value) in set {
        settings.set(key, value).unwrap();
    }
    let pictures = frames(scene, &settings, &[place; 24]);
    let mut mean = pictures[0].0.clone();
    for (at, value) in mean.rgb.as_flattened_mut().iter_mut().enumerate() {
        let values = pictures.iter().map(|(p, _)| p.rgb.as_flattened()[at]);
        *value = values.sum::<f32>() / pictures.len() as f32;
    }
    mean
}

#[test]
fn a_fixation_grows_sharper_down_to_the_filter_s_blur() {
    let scene = corner();
    let truth = truth(&scene, Vec3::ZERO);
    let still = [Vec3::ZERO; 17];
    let [kept, fresh] = ["256", "0"].map(|samples| frames(&scene, &params(samples), &still));
    let mean_error = |frames: &[(LinearImage, Statistics)]| {
        let errors = frames.iter().map(|(image, _)| error_inside(image, &truth));
        errors.sum::<f64>() / frames.len() as f64
    };
    for (kept, fresh) in kept.iter().zip(&fresh).step_by(4) {
        let (kept, fresh) = (
            error_inside(&kept.0, &truth),
            error_inside(&fresh.0, &truth),
        );
        println!("{kept:.6} with kept light, {fresh:.6} without");
    }
    let (first, last) = (mean_error(&fresh), mean_error(&kept[14..]));
    assert!(
        last < 0.5 * first,
        "{first} from scratch, {last} at the end"
    );

    let last = &kept[16].1;
    let reused = count(last, "pixels_with_kept_light") / count(last, "pixels_keeping_light");
    assert!(
        reused > 0.9,
        "{reused} of the pixels found their light again"
    );
    // In the fovea one sample more in each frame, outside it one in four frames, less what edges lost.
    let samples = |index: usize| count(&kept[index].1, "samples_kept");
    let pixels = count(last, "pixels_keeping_light");
    let gained = (samples(16) - samples(8)) / 8.0 / pixels;
    assert!(
        (0.25..1.1).contains(&gained),
        "{gained} samples a pixel and frame"
    );
}

#[test]
fn no_pixel_keeps_more_than_it_may_however_long_and_wild_the_session() {
    let scene = corner();
    let way: Vec<Vec3> = (0..40)
        .map(|index| {
            let turn = index as f32;
            0.3 * Vec3::new(
                (0.7 * turn).sin(),
                0.2 * (1.3 * turn).cos(),
                (0.4 * turn).sin(),
            )
        })
        .collect();
    let kept = frames(&scene, &params("16"), &way);
    for (image, statistics) in &kept {
        let samples = count(statistics, "samples_kept");
        let pixels = count(statistics, "pixels_keeping_light");
        // What is kept and what is new: 16, and 4 where a pixel is lit anew, 1 where it is not.
        assert!(samples <= 17.5 * pixels, "{samples} in {pixels} pixels");
        assert!(
            image
                .rgb
                .as_flattened()
                .iter()
                .all(|x| x.is_finite() && *x >= 0.0)
        );
    }
    let found: f64 = kept
        .iter()
        .map(|(_, s)| count(s, "pixels_with_kept_light"))
        .sum();
    assert!(found > 0.0);
}

#[test]
fn a_moving_head_sees_what_it_would_see_without_kept_light() {
    let scene = corner();
    let way: Vec<Vec3> = (0..12)
        .map(|index| 0.008 * index as f32 * Vec3::X)
        .collect();
    let truth = truth(&scene, way[11]);
    let mean = |image: &LinearImage| {
        let values = image.rgb.as_flattened();
        values.iter().map(|x| f64::from(*x)).sum::<f64>() / values.len() as f64
    };
    let [kept, fresh] = ["64", "0"].map(|samples| frames(&scene, &params(samples), &way));
    let (last, scratch) = (&kept[11].0, &fresh[11].0);
    let ratio = mean(last) / mean(&truth);
    assert!((ratio - 1.0).abs() < 0.01, "{ratio} of what is there");
    let (with, without) = (error(last, &truth), error(scratch, &truth));
    println!("moving: {with:.5} with kept light, {without:.5} without");
    assert!(with < 1.5 * without);
    // Control: light of the frame at the other end of the way is not taken for it.
    assert!(error(&fresh[0].0, &truth) > 3.0 * with);
}

#[test]
fn pictures_of_render_keep_nothing() {
    let picture = Recipe::new("fpm").size(16, 16).passes(2);
    let picture = picture.render(&bundled("furnace.glb"));
    let names = picture.statistics.counts.iter().map(|(name, _)| *name);
    assert!(!Vec::from_iter(names).contains(&"samples_kept"));
}
