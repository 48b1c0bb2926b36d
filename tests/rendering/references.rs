//! Pictures against the references of an unrelated renderer, where they lie beside the checkout.

use std::path::PathBuf;

use macula::image::{LinearImage, exr};
use macula::metrics::{self, Comparison, error::ImagePair};
use macula::scene::Scene;

use crate::maker::{Recipe, bundled, largest_relative_difference, mean, means_agree, reduced};
use crate::shared::shared;

/// Pixels of the references across.
const REFERENCE_SIDE: u32 = 256;

/// A shared scene and its reference with as many pixels as the tests render.
fn scene_and_reference(name: &str, side: u32) -> Option<(PathBuf, LinearImage)> {
    let scene = shared(&format!("scenes/glb/{name}.glb"))?;
    let reference = exr::read(&shared(&format!("scenes/refs/{name}.exr"))?).unwrap();
    Some((scene, reduced(&reference, REFERENCE_SIDE / side)))
}

fn compare(candidate: &LinearImage, reference: &LinearImage) -> Comparison {
    let pair = ImagePair {
        width: candidate.width as usize,
        candidate: &candidate.rgb,
        reference: &reference.rgb,
        reference_standard_error: None,
    };
    metrics::compare(pair, None).unwrap()
}

fn scaled(image: &LinearImage, factor: f32) -> LinearImage {
    let rgb = image.rgb.iter().map(|p| p.map(|x| factor * x)).collect();
    LinearImage {
        rgb,
        ..image.clone()
    }
}

#[test]
fn each_kind_of_light_has_its_reference_s_radiance_in_the_mean_and_in_every_block() {
    for name in ["j-point", "j-spot", "j-directional", "j-area"] {
        let Some((scene, reference)) = scene_and_reference(name, 64) else {
            return;
        };
        let recipe = Recipe::new("pm-direct").passes(16).set("photon.count", "0");
        let image = recipe.render(&scene).image;
        // Blocks of 8x8 pixels of the reference.
        let verdict = |image: &LinearImage| {
            means_agree(mean(image), mean(&reference), 0.01)?;
            let blocks = [image, &reference].map(|picture| reduced(picture, 2));
            let worst = largest_relative_difference(&blocks[0], &blocks[1], 0.1);
            let report = || format!("a block is {worst} off");
            (worst <= 0.01).then_some(()).ok_or_else(report)
        };
        verdict(&image).unwrap_or_else(|e| panic!("{name}: {e}"));
        let is_noticed = verdict(&scaled(&image, 1.02)).is_err();
        assert!(is_noticed, "{name}: a picture 2% brighter is noticed");
    }
}

#[test]
fn a_diffuse_cornell_box_agrees_with_its_reference() {
    let Some((scene, reference)) = scene_and_reference("a-cornell-diffuse", 128) else {
        return;
    };
    let recipe = Recipe::new("pm-direct")
        .size(128, 128)
        .passes(8)
        .set("photon.count", "100000");
    let image = recipe.render(&scene).image;
    let verdict = |image: &LinearImage| {
        means_agree(mean(image), mean(&reference), 0.01)?;
        let relmse = compare(image, &reference).whole.unwrap().error.relmse;
        let report = || format!("relative MSE {relmse}");
        (relmse <= 0.01).then_some(()).ok_or_else(report)
    };
    verdict(&image).unwrap();
    // The same room without its indirect light.
    let direct_only = recipe.set("photon.count", "0").render(&scene).image;
    assert!(verdict(&direct_only).is_err());
    assert!(verdict(&scaled(&image, 1.02)).is_err());
}

#[test]
fn all_light_from_photons_has_the_reference_s_mean() {
    let Some((scene, reference)) = scene_and_reference("a-cornell-diffuse", 64) else {
        return;
    };
    let recipe = Recipe::new("pm").passes(4).set("photon.count", "100000");
    let image = recipe.render(&scene).image;
    means_agree(mean(&image), mean(&reference), 0.02).unwrap();
    assert!(means_agree(mean(&scaled(&image, 1.04)), mean(&reference), 0.02).is_err());
}

#[test]
fn a_caustic_and_a_mirror_have_the_reference_s_mean() {
    let Some((scene, reference)) = scene_and_reference("b-cornell-caustic", 64) else {
        return;
    };
    let recipe = Recipe::new("pm-direct")
        .passes(4)
        .set("photon.count", "100000");
    let image = recipe.render(&scene).image;
    means_agree(mean(&image), mean(&reference), 0.02).unwrap();
    let direct_only = recipe.set("photon.count", "0").render(&scene).image;
    assert!(means_agree(mean(&direct_only), mean(&reference), 0.02).is_err());
}

#[test]
fn well_known_scenes_have_their_references_means() {
    for (name, (width, height), tolerance) in [
        ("living-room", (160, 90), 0.03),
        ("veach-bidir", (160, 160), 0.05),
    ] {
        let [Some(path), Some(reference)] = ["glb", "exr"].map(|kind| {
            let folder = if kind == "exr" { "refs" } else { kind };
            shared(&format!("scenes/public/{folder}/{name}.{kind}"))
        }) else {
            return;
        };
        let reference = exr::read(&reference).unwrap();
        let scene = Scene::load(&path).unwrap();
        let recipe = Recipe::new("pm-direct")
            .size(width, height)
            .passes(3)
            .set("photon.count", "400000");
        let means = |depth_max: &str| {
            let recipe = recipe.clone().set("photon.depth_max", depth_max);
            mean(&recipe.render_scene(&scene).image)
        };
        means_agree(means("64"), mean(&reference), tolerance)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let short = means_agree(means("3"), mean(&reference), tolerance);
        assert!(
            short.is_err(),
            "{name}: paths of three surfaces are noticed"
        );
    }
}

#[test]
fn photon_mapping_has_the_oracle_s_mean_in_the_bundled_scenes() {
    for name in ["cornell", "furnace", "room", "gallery"] {
        let scene = Scene::load(&bundled(&format!("{name}.glb"))).unwrap();
        let truths: Vec<[f64; 3]> = (1..=4)
            .map(|seed| {
                let recipe = Recipe::new("path").size(32, 32).passes(4);
                let recipe = recipe.set("path.samples", "48");
                let recipe = recipe.set("path.caustic_photons", "200000");
                let recipe = recipe.set("random.seed", &seed.to_string());
                mean(&recipe.render_scene(&scene).image)
            })
            .collect();
        let truth = [0, 1, 2].map(|c| truths.iter().map(|m| m[c]).sum::<f64>() / 4.0);
        // The standard error of the truth's mean, as a share of it.
        let noise = |c: usize| {
            let squares = truths.iter().map(|m| (m[c] - truth[c]).powi(2));
            (squares.sum::<f64>() / 12.0).sqrt() / truth[c]
        };
        let noise = (0..3).map(noise).fold(0.0, f64::max);
        println!(
            "{name}: the oracle's mean is known to {:.2} %",
            100.0 * noise
        );
        let few = [
            ("photon.count", "100000"),
            ("gather.photons_per_estimate", "12"),
        ];
        let many = [("indirect.paths", "16"), ("aimed.count", "100000")];
        let judged = [
            ("pm-direct", 0.01, few),
            ("pm", 0.02, few),
            ("fpm", 0.01, many),
        ];
        for (technique, tolerance, settings) in judged {
            let recipe = Recipe::new(technique).size(32, 32).passes(6);
            let recipe = settings
                .iter()
                .fold(recipe, |recipe, (key, value)| recipe.set(key, value));
            let image = recipe.render_scene(&scene).image;
            let tolerance = tolerance + 4.0 * noise;
            let ratios = [0, 1, 2].map(|c| mean(&image)[c] / truth[c]);
            println!("{name}, {technique}: {ratios:.4?} of the oracle");
            means_agree(mean(&image), truth, tolerance)
                .unwrap_or_else(|e| panic!("{name}, {technique}: {e}"));
            let brighter = mean(&scaled(&image, (1.0 + 3.0 * tolerance) as f32));
            assert!(means_agree(brighter, truth, tolerance).is_err());
        }
    }
}
