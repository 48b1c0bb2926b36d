//! The edge-avoiding filter takes noise away and leaves light, textures and edges where they are.

use glam::Vec3;
use macula::image::LinearImage;
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;

use crate::maker::{Recipe, Stage, bundled, gpu, lambert, mean, means_agree};

const SIZE: u32 = 64;

fn recipe(levels: &str) -> Recipe {
    Recipe::new("path-filtered")
        .size(SIZE, SIZE)
        .set("filter.path_levels", levels)
        .set("direct.shadow_rays", "16")
}

/// Pictures of one scene, each of one pass, with random numbers of their own.
fn pictures(recipe: &Recipe, scene: &Scene, count: u32) -> Vec<LinearImage> {
    let loaded = LoadedScene::new(gpu(), scene.clone()).unwrap();
    let mut still = recipe.still(&loaded);
    let picture = |_| {
        still.start_over();
        still.add_pass().unwrap();
        still.read().unwrap()
    };
    (0..count).map(picture).collect()
}

/// The mean of pictures, and the mean square of what a single one differs from it by.
fn mean_and_noise(pictures: &[LinearImage]) -> (LinearImage, f64) {
    let count = pictures.len() as f32;
    let mut mean = pictures[0].clone();
    for (at, value) in mean.rgb.as_flattened_mut().iter_mut().enumerate() {
        let values = pictures.iter().map(|p| p.rgb.as_flattened()[at]);
        *value = values.sum::<f32>() / count;
    }
    let differences = pictures.iter().flat_map(|picture| {
        let pairs = picture
            .rgb
            .as_flattened()
            .iter()
            .zip(mean.rgb.as_flattened());
        pairs.map(|(x, m)| f64::from(x - m).powi(2))
    });
    let noise = differences.sum::<f64>() / f64::from(count - 1.0) / f64::from(SIZE * SIZE * 3);
    (mean, noise)
}

#[test]
fn filtered_pictures_are_as_bright_and_less_noisy() {
    let scene = Scene::load(&bundled("cornell.glb")).unwrap();
    let [plain, filtered] =
        ["0", "3"].map(|levels| mean_and_noise(&pictures(&recipe(levels), &scene, 12)));
    means_agree(mean(&filtered.0), mean(&plain.0), 0.01).unwrap();
    println!("noise {} before, {} after", plain.1, filtered.1);
    assert!(filtered.1 < 0.7 * plain.1, "{} and {}", plain.1, filtered.1);
    let brighter = mean(&plain.0).map(|x| 1.03 * x);
    assert!(means_agree(mean(&filtered.0), brighter, 0.01).is_err());
}

/// A floor of two colours under a wall that reflects onto it; the camera looks straight down at the seam.
fn seam(left: [f32; 3], right: [f32; 3]) -> Scene {
    let corner = Vec3::new(-2.0, 0.0, 2.0);
    Stage::new(Vec3::new(0.0, 1.5, 0.01), Vec3::ZERO)
        .quad(corner, 2.0 * Vec3::X, -4.0 * Vec3::Z, lambert(left))
        .quad(
            corner + 2.0 * Vec3::X,
            2.0 * Vec3::X,
            -4.0 * Vec3::Z,
            lambert(right),
        )
        .quad(
            Vec3::new(-2.0, 0.0, -2.0),
            4.0 * Vec3::X,
            3.0 * Vec3::Y,
            lambert([0.8; 3]),
        )
        .point_light(Vec3::new(0.0, 2.0, 1.0), 5.0)
        .load()
}

/// The mean of a column of pixels.
fn column(image: &LinearImage, x: u32) -> [f64; 3] {
    let rows = (SIZE / 4..3 * SIZE / 4).map(|y| image.rgb[(y * SIZE + x) as usize]);
    let sum = rows.fold([0.0; 3], |sum, rgb| {
        [0, 1, 2].map(|c| sum[c] + f64::from(rgb[c]))
    });
    sum.map(|x| x / f64::from(SIZE / 2))
}

#[test]
fn colours_keep_their_seam_and_a_channel_that_one_lacks_stays_as_it_is_in_the_other() {
    let scene = seam([0.8, 0.0, 0.0], [0.8; 3]);
    let [plain, filtered] =
        ["0", "4"].map(|levels| mean_and_noise(&pictures(&recipe(levels), &scene, 16)).0);
    let green = |x: u32| column(&plain, x)[1];
    let seam = (1..SIZE).find(|x| (green(x - 1) > 0.0) != (green(*x) > 0.0));
    let seam = seam.expect("both colours are seen");
    let (white, red) = match green(seam - 2) > 0.0 {
        true => (seam - 2, seam + 1),
        false => (seam + 1, seam - 2),
    };
    means_agree(column(&filtered, white), column(&plain, white), 0.03).unwrap();
    let [plain_red, filtered_red] = [&plain, &filtered].map(|image| column(image, red));
    assert!((filtered_red[0] / plain_red[0] - 1.0).abs() < 0.03);
    // Without a division by the albedo half of the other side's green would be here.
    assert!(filtered_red[1] < 1e-4 && column(&filtered, white)[1] > 0.1);
}

#[test]
fn an_edge_across_a_pixel_stays_smooth() {
    // A step seen from above: light falls on both its floors.
    let scene = Stage::new(Vec3::new(0.013, 2.0, 0.011), Vec3::ZERO)
        .cuboid(
            Vec3::new(-0.5, 0.1, 0.0),
            Vec3::new(0.5, 0.1, 2.0),
            lambert([0.7; 3]),
        )
        .quad(
            Vec3::new(-2.0, 0.0, 2.0),
            4.0 * Vec3::X,
            -4.0 * Vec3::Z,
            lambert([0.7; 3]),
        )
        .quad(
            Vec3::new(-1.0, 0.0, -1.0),
            2.0 * Vec3::X,
            2.0 * Vec3::Y,
            lambert([0.8; 3]),
        )
        .point_light(Vec3::new(0.4, 1.5, 0.5), 5.0)
        .load();
    let [plain, filtered] =
        ["0", "3"].map(|levels| mean_and_noise(&pictures(&recipe(levels), &scene, 24)).0);
    let worst = (0..SIZE)
        .map(|x| {
            let (plain, filtered) = (column(&plain, x), column(&filtered, x));
            (filtered[0] / plain[0] - 1.0).abs()
        })
        .fold(0.0, f64::max);
    // The filter blurs what reaches into the corner under the step.
    assert!(worst < 0.08, "a column differs by {worst}");
}
