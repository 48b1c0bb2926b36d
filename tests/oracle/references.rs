//! The oracle's pictures against those of an unrelated renderer and against closed forms, within the noise of both.

use macula::image::{LinearImage, exr};
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;

use crate::maker::{Recipe, gpu, reduced};
use crate::shared::shared;

/// Pictures of other random numbers, from which the noise of their mean is told.
const PICTURES: u32 = 10;
/// Pixels across; each is a block of 8 x 8 of the reference's.
const SIDE: u32 = 32;

/// Grey values of some pictures: the mean over them, over either half of them, and the square of the mean's standard error.
struct Measured {
    mean: Vec<f64>,
    halves: [Vec<f64>; 2],
    variance: Vec<f64>,
}

/// The mean of the channels, whose noise is much the same.
fn values(image: &LinearImage) -> Vec<f64> {
    let grey = |p: &[f32; 3]| p.iter().map(|x| f64::from(*x)).sum::<f64>() / 3.0;
    image.rgb.iter().map(grey).collect()
}

fn mean_of(pictures: &[Vec<f64>]) -> Vec<f64> {
    let sum = |i: usize| pictures.iter().map(|picture| picture[i]).sum::<f64>();
    let channels = 0..pictures[0].len();
    channels.map(|i| sum(i) / pictures.len() as f64).collect()
}

fn measure(scene: &Scene) -> Measured {
    let picture = |seed: u32| {
        let recipe = Recipe::new("path").size(SIDE, SIDE);
        let recipe = recipe.set("path.samples", "16");
        let recipe = recipe.set("random.seed", &seed.to_string());
        values(&recipe.render_scene(scene).image)
    };
    let pictures: Vec<Vec<f64>> = (1..=PICTURES).map(picture).collect();
    let mean = mean_of(&pictures);
    let count = f64::from(PICTURES);
    let variance = mean.iter().enumerate().map(|(i, mean)| {
        let squares = pictures.iter().map(|picture| (picture[i] - mean).powi(2));
        squares.sum::<f64>() / (count * (count - 1.0))
    });
    let (first, second) = pictures.split_at(pictures.len() / 2);
    Measured {
        variance: variance.collect(),
        halves: [mean_of(first), mean_of(second)],
        mean,
    }
}

/// Standard deviations between the means of the whole picture.
fn sigmas_of_mean(measured: &Measured, reference: &[f64], variance: &[f64], scale: f64) -> f64 {
    let off = |i: usize| scale * measured.mean[i] - reference[i];
    let noise = |i: usize| measured.variance[i] + variance[i];
    let all = 0..reference.len();
    all.clone().map(off).sum::<f64>() / all.map(noise).sum::<f64>().sqrt().max(1e-12)
}

/// Standard deviations by which pixels differ more than noise lets them. The noises of the halves do not know each other: the product
/// of their differences from the reference is, in the mean, the square of what is truly off, and the reference's own variance.
fn sigmas_of_structure(measured: &Measured, reference: &[f64], variance: &[f64]) -> f64 {
    let [a, b] = &measured.halves;
    let floor = 0.1 * reference.iter().sum::<f64>() / reference.len() as f64;
    let excess: Vec<f64> = (0..reference.len())
        .map(|i| {
            let product = (a[i] - reference[i]) * (b[i] - reference[i]) - variance[i];
            product / (reference[i].powi(2) + floor.powi(2))
        })
        .collect();
    let count = excess.len() as f64;
    let mean = excess.iter().sum::<f64>() / count;
    let spread = excess.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    // Pixels that are exact leave rounding alone.
    mean / (spread.sqrt() / count).max(1e-9)
}

#[test]
fn the_oracle_agrees_with_every_reference_within_its_noise() {
    for name in [
        "a-cornell-diffuse",
        "b-cornell-caustic",
        "c-furnace-box",
        "c-furnace-sphere",
        "f-glossy",
        "g-thin-wall",
        "g-thin-wall-dim",
        "j-point",
        "j-spot",
        "j-directional",
        "j-area",
    ] {
        let folder = |kind: &str| shared(&format!("scenes/{kind}"));
        let [Some(scene), Some(reference), Some(error)] = [
            folder(&format!("glb/{name}.glb")),
            folder(&format!("refs/{name}.exr")),
            folder(&format!("refs/{name}.se.exr")),
        ] else {
            return;
        };
        let measured = measure(&Scene::load(&scene).unwrap());
        let reference = exr::read(&reference).unwrap();
        let side = reference.width / SIDE;
        // A mean of n pixels has the n-th part of the mean of their variances. Closed forms are known to 1e-5.
        let mut error = exr::read(&error).unwrap();
        for p in &mut error.rgb {
            *p = [p.iter().sum::<f32>() / 3.0; 3].map(|x| x * x);
        }
        let pixels = f64::from(side * side);
        let reference = values(&reduced(&reference, side));
        let variance: Vec<f64> = values(&reduced(&error, side))
            .iter()
            .zip(&reference)
            .map(|(variance, exact)| variance / pixels + (1e-5 * exact).powi(2))
            .collect();
        let mean = sigmas_of_mean(&measured, &reference, &variance, 1.0);
        let structure = sigmas_of_structure(&measured, &reference, &variance);
        println!("{name}: mean {mean:.2}, structure {structure:.2} standard deviations off");
        assert!(mean.abs() < 4.0, "{name}: mean {mean}");
        assert!(structure < 4.0, "{name}: structure {structure}");

        let brighter = sigmas_of_mean(&measured, &reference, &variance, 1.05);
        assert!(brighter > 4.0, "{name}: 5 % more light, {brighter}");
        // As much light as before, but nearly a third of it in the wrong half.
        let mut lopsided = reference.clone();
        for (i, value) in lopsided.iter_mut().enumerate() {
            let is_left = i as u32 % SIDE < SIDE / 2;
            *value *= if is_left { 1.3 } else { 0.7 };
        }
        let lopsided = sigmas_of_structure(&measured, &lopsided, &variance);
        assert!(lopsided > 4.0, "{name}: lopsided light, {lopsided}");
    }
}

#[test]
fn no_light_leaks_into_the_dark_room() {
    let Some(path) = shared("scenes/glb/g-thin-wall-dark.glb") else {
        return;
    };
    let measured = measure(&Scene::load(&path).unwrap());
    assert!(measured.mean.iter().all(|value| *value == 0.0));
}

/// Pixels of the reference to one of the oracle's picture, along each side.
const BLOCK: u32 = 10;
/// Standard errors that a mean may be off; as they are drawn from 8 to 14 pictures, one run in 200 to 700 is by chance.
const STANDARD_ERRORS: f64 = 4.0;
/// The share of blocks left out of a comparison: those of which the reference itself is least sure. They hold its few outliers,
/// most of them too bright: the oracle is not asked to have them too.
const TRIMMED: f64 = 0.02;

#[test]
fn the_oracle_agrees_with_the_public_scenes_means_within_noise() {
    // Name, longest path (the reference of the living room stops there), paths a pixel, photons and pictures.
    for (name, depth_max, samples, photons, pictures) in [
        ("water-caustic", "0", "128", "100000", 14),
        ("veach-bidir", "0", "64", "0", 8),
        ("living-room", "64", "64", "0", 8),
    ] {
        let folder =
            |folder: &str, end: &str| shared(&format!("scenes/public/{folder}/{name}.{end}"));
        let [Some(scene), Some(reference), Some(error)] = [
            folder("glb", "glb"),
            folder("refs", "exr"),
            folder("refs", "se.exr"),
        ] else {
            return;
        };
        let [reference, mut error] = [reference, error].map(|path| exr::read(&path).unwrap());
        let loaded = LoadedScene::new(gpu(), Scene::load(&scene).unwrap()).unwrap();
        let recipe = Recipe::new("path").size(reference.width / BLOCK, reference.height / BLOCK);
        let recipe = recipe
            .set("path.samples", samples)
            .set("path.depth_max", depth_max);
        let mut still = recipe.set("path.caustic_photons", photons).still(&loaded);
        // The noises of the channels of a pixel are much the same, those of pixels are not.
        for p in &mut error.rgb {
            *p = [(p.iter().sum::<f32>() / 3.0).powi(2); 3];
        }
        let [reference, variance] = [reference, error].map(|image| values(&reduced(&image, BLOCK)));
        let mut order: Vec<usize> = (0..reference.len()).collect();
        order.sort_by(|a, b| variance[*a].total_cmp(&variance[*b]));
        order.truncate(((1.0 - TRIMMED) * reference.len() as f64) as usize);
        let sum = |of: &[f64]| order.iter().map(|i| of[*i]).sum::<f64>();
        let exact = sum(&reference);
        let ratios: Vec<f64> = (0..pictures)
            .map(|_| {
                still.start_over();
                still.add_pass().unwrap();
                sum(&values(&still.read().unwrap())) / exact
            })
            .collect();
        let count = ratios.len() as f64;
        let ratio = ratios.iter().sum::<f64>() / count;
        // Of whole pictures, as photons make the noises of their pixels alike.
        let squares = ratios.iter().map(|x| (x - ratio).powi(2)).sum::<f64>();
        let of_reference = (sum(&variance) / f64::from(BLOCK * BLOCK)).sqrt() / exact;
        let noise = (squares / (count * (count - 1.0)))
            .sqrt()
            .hypot(of_reference);
        println!("{name}: {ratio:.4} of the reference's mean, +- {noise:.4}");
        let is_off = |ratio: f64| (ratio - 1.0).abs() > STANDARD_ERRORS * noise;
        assert!(!is_off(ratio), "{name}: {ratio} +- {noise}");
        // Controls: the noise leaves an error of so much no room.
        assert!(
            is_off(1.1 * ratio) && is_off(0.9 * ratio),
            "{name}: {noise}"
        );
    }
}
