//! `macula inspect`: the numbers that it prints are those of the file.

use std::path::Path;

use macula::cli::inspect::Inspection;
use macula::params::Params;
use macula::scene::Scene;
use serde_json::json;

use super::motion::turning;
use super::shared::shared;
use super::triangle_on;

fn inspect(path: &Path) -> Inspection {
    Inspection::of(path, &Scene::load(path).unwrap(), &Params::default())
}

#[test]
fn an_inspection_sums_up_the_living_room() {
    let Some(path) = shared("scenes/public/glb/living-room.glb") else {
        return;
    };
    let inspection = inspect(&path);
    assert_eq!(inspection.geometry.static_triangles, 787_188);
    assert_eq!(
        inspection.materials.len(),
        15,
        "without the default one, which nothing uses"
    );
    let [lamp] = &inspection.lights[..] else {
        panic!("one lamp, not {:?}", inspection.lights)
    };
    // The table gives the sphere that the lamp approximates with 0.5 % less area.
    let sphere_m2 = 4.0 * std::f64::consts::PI * 0.164157_f64.powi(2);
    let ratio = lamp.area_m2.unwrap() / sphere_m2;
    assert!((0.99..1.0).contains(&ratio), "{ratio}");
    assert_eq!((lamp.kind, lamp.unit), ("area", "W/(m2 sr)"));
    assert!((lamp.emission[0] - 112.79886).abs() < 1e-4);
    let text = inspection.to_text();
    for part in [
        "787 188 static",
        "Lamp",
        "smooth dielectric",
        "512x359",
        "29.39",
    ] {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}

#[test]
fn an_inspection_tells_what_moves_and_in_which_unit_lights_shine() {
    let inspection = inspect(&turning().save().path);
    assert_eq!(inspection.animation.objects, ["spinner"]);
    assert_eq!(inspection.animation.duration_s, 2.0);
    assert_eq!(inspection.geometry.moving_triangles, 1);
    assert!(inspection.lights[0].is_moving && inspection.cameras[0].is_moving);
    assert_eq!(inspection.lights[0].unit, "W/sr");
    let json = serde_json::to_value(&inspection).unwrap();
    assert_eq!(json["geometry"]["size_m"], json!([3.0, 1.0, 0.0]));
    assert_eq!(json["effects"].as_array().unwrap().len(), 18);
}

#[test]
fn an_empty_scene_is_inspected_without_infinities() {
    let mut glb = triangle_on(json!({}));
    glb.json["meshes"] = json!([]);
    let inspection = inspect(&glb.save().path);
    assert_eq!(inspection.geometry.size_m, [0.0; 3]);
    assert_eq!(inspection.warnings, ["there is no triangle to see"]);
    assert!(!inspection.to_text().contains("inf"));
}
