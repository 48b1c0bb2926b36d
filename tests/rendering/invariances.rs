//! What must not change a picture, or change it in a known way.

use glam::Vec3;
use macula::image::LinearImage;
use macula::metrics::{self, error::ImagePair};
use macula::scene::Scene;

use crate::maker::{
    Recipe, Stage, glowing, lambert, largest_relative_difference, mean, means_agree, mirror,
    reduced,
};
use crate::shared::shared;

/// A corner of two walls and a floor under a point light.
fn corner(intensity_w_sr: f32) -> Scene {
    Stage::new(Vec3::new(1.5, 1.2, 1.5), Vec3::new(0.3, 0.3, 0.3))
        .quad(Vec3::ZERO, 2.0 * Vec3::Z, 2.0 * Vec3::X, lambert([0.8; 3]))
        .quad(
            Vec3::ZERO,
            2.0 * Vec3::Y,
            2.0 * Vec3::Z,
            lambert([0.8, 0.2, 0.1]),
        )
        .quad(
            Vec3::ZERO,
            2.0 * Vec3::X,
            2.0 * Vec3::Y,
            lambert([0.1, 0.2, 0.8]),
        )
        .point_light(Vec3::new(0.9, 1.4, 0.8), intensity_w_sr)
        .load()
}

#[test]
fn twice_the_light_is_twice_the_radiance_in_every_pixel() {
    for technique in ["pm-direct", "pm"] {
        let recipe = Recipe::new(technique).size(32, 32);
        let [once, twice] = [1.0, 2.0].map(|i| recipe.render_scene(&corner(i)).image);
        let doubled = LinearImage {
            rgb: once.rgb.iter().map(|p| p.map(|x| 2.0 * x)).collect(),
            ..once.clone()
        };
        let worst = largest_relative_difference(&twice, &doubled, 1e-3);
        assert!(worst < 1e-4, "{technique}: {worst}");
        assert!(mean(&once)[0] > 0.0);
        assert!(largest_relative_difference(&twice, &once, 1e-3) > 0.9);
    }
}

/// Three glowing panels of different colour, place and size, seen or mirrored, at x = 3.
fn panels(stage: Stage) -> Stage {
    let panel = |stage: Stage, y: f32, z: f32, side: f32, radiance| {
        let (u, v) = (side * Vec3::Z, side * Vec3::Y);
        stage.quad(Vec3::new(3.0, y, z), u, v, glowing(radiance))
    };
    let stage = panel(stage, -0.9, -1.1, 0.8, [1.0, 0.1, 0.1]);
    let stage = panel(stage, 0.1, -0.2, 0.5, [0.1, 0.9, 0.2]);
    panel(stage, -0.7, 0.4, 0.6, [0.2, 0.3, 2.0])
}

#[test]
fn a_mirror_shows_what_the_mirrored_eye_sees_the_wrong_way_round() {
    let recipe = Recipe::new("pm-direct").passes(8).set("photon.count", "0");
    let eye = Vec3::new(2.0, 0.0, 0.0);
    let mirrored_eye = Vec3::new(-2.0, 0.0, 0.0);
    let glass = |stage: Stage| {
        let corner = Vec3::new(0.0, -4.0, -4.0);
        stage.quad(corner, 8.0 * Vec3::Y, 8.0 * Vec3::Z, mirror())
    };
    let in_mirror = glass(panels(Stage::new(eye, Vec3::ZERO))).load();
    let straight = panels(Stage::new(mirrored_eye, Vec3::ZERO)).load();
    let in_mirror = recipe.render_scene(&in_mirror).image;
    let straight = recipe.render_scene(&straight).image;
    let rows = straight.rgb.chunks(straight.width as usize);
    let turned = LinearImage {
        rgb: rows.flat_map(|row| row.iter().rev().copied()).collect(),
        ..straight.clone()
    };
    // Blocks average over where samples fall in the pixels of an edge.
    let agree = |a: &LinearImage, b: &LinearImage| {
        largest_relative_difference(&reduced(a, 8), &reduced(b, 8), 0.5)
    };
    assert!(mean(&straight).iter().all(|x| *x > 0.002));
    assert!(
        agree(&in_mirror, &turned) < 0.03,
        "{}",
        agree(&in_mirror, &turned)
    );
    assert!(
        agree(&in_mirror, &straight) > 0.3,
        "the way round is noticed"
    );
}

#[test]
fn a_room_far_away_tiny_huge_or_under_nodes_looks_the_same() {
    let Some(plain_path) = shared("scenes/glb/a-cornell-diffuse.glb") else {
        return;
    };
    let recipe = Recipe::new("pm-direct").set("photon.count", "50000");
    let plain = recipe.render(&plain_path).image;
    let relmse = |image: &LinearImage| {
        let pair = ImagePair {
            width: plain.width as usize,
            candidate: &image.rgb,
            reference: &plain.rgb,
            reference_standard_error: None,
        };
        metrics::compare(pair, None).unwrap().block8.unwrap().relmse
    };
    let other_seed = recipe.clone().set("random.seed", "2").render(&plain_path);
    let noise = relmse(&other_seed.image);
    let verdict = |image: &LinearImage| {
        means_agree(mean(image), mean(&plain), 0.01)?;
        let relmse = relmse(image);
        let report = || format!("relative MSE of blocks {relmse}, where noise makes {noise}");
        (relmse < 2.0 * noise).then_some(()).ok_or_else(report)
    };
    for name in ["h-far-baked", "h-far-node", "h-small", "h-large", "h-nodes"] {
        let Some(path) = shared(&format!("scenes/glb/{name}.glb")) else {
            return;
        };
        let image = recipe.render(&path).image;
        verdict(&image).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    let Some(other) = shared("scenes/glb/b-cornell-caustic.glb") else {
        return;
    };
    assert!(verdict(&recipe.render(&other).image).is_err());
}
