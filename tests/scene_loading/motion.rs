//! Lights, cameras and objects: where they are, and how they move.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;
use macula::scene::PunctualKind;
use serde_json::json;

use super::glb::Glb;
use super::{assert_near, load, triangle_on};

#[test]
fn lights_keep_their_units_and_shine_along_their_node() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "name": "key", "color": [1.0, 0.5, 0.25], "intensity": 8.0, "range": 12.0,
         "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.4}},
        {"type": "point", "intensity": -1.0},
        {"type": "directional"},
    ]}});
    let light = |index: usize| json!({"KHR_lights_punctual": {"light": index}});
    let down = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
    glb.root(json!({"extensions": light(0), "rotation": down, "scale": [5.0, 5.0, 5.0], "translation": [0.5, 2.5, 0.0]}));
    glb.root(json!({"extensions": light(1)}));
    glb.root(json!({"name": "sun", "extensions": light(2)}));
    let scene = load(&glb);
    assert_eq!(scene.lights.len(), 2, "a negative light is left out");
    let [key, sun] = &scene.lights[..] else {
        unreachable!()
    };
    assert_eq!(key.name, "key");
    assert_eq!(
        key.intensity,
        Vec3::new(8.0, 4.0, 2.0),
        "a scale does not change it"
    );
    assert_near(key.direction, Vec3::NEG_Y);
    assert_near(key.position, Vec3::new(0.0, 2.0, 0.0));
    assert_eq!(key.range_m, 12.0);
    let expected = PunctualKind::Spot {
        inner_cone_rad: 0.1,
        outer_cone_rad: 0.4,
    };
    assert_eq!(key.kind, expected);
    assert_eq!((sun.name.as_str(), sun.intensity), ("sun", Vec3::ONE));
    assert_near(sun.direction, Vec3::NEG_Z);
    assert!(sun.range_m.is_infinite());
}

#[test]
fn a_camera_under_a_scaled_and_mirrored_node_is_upright_and_rigid() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    glb.root(json!({"camera": 0, "name": "eye", "scale": [-3.0, 0.5, 2.0], "translation": [0.5, 0.5, 4.0]}));
    let scene = load(&glb);
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "eye");
    assert_near(camera.pose.position_m, Vec3::new(0.0, 0.0, 4.0));
    assert_near(camera.pose.orientation * Vec3::NEG_Z, Vec3::NEG_Z);
    assert_near(camera.pose.orientation * Vec3::Y, Vec3::Y);
    assert!((camera.pose.orientation.length() - 1.0).abs() < 1e-6);
}

/// A parent that turns a quarter about +Y in 2 s, with a triangle, a light and a camera under it.
pub fn turning() -> Glb {
    let mut glb = Glb::new();
    let mesh = glb.triangle();
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    glb.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    let child = glb.push(
        "nodes",
        json!({
            "name": "spinner", "mesh": mesh, "camera": 0, "translation": [2.0, 0.0, 0.0],
            "extensions": {"KHR_lights_punctual": {"light": 0}},
        }),
    );
    let parent = glb.root(json!({"children": [child]}));
    let end = [0.0, FRAC_PI_4.sin(), 0.0, FRAC_PI_4.cos()];
    glb.animate(
        parent,
        "rotation",
        "LINEAR",
        &[0.0, 2.0],
        &[[0.0, 0.0, 0.0, 1.0], end],
    );
    glb.root(json!({"mesh": mesh}));
    glb
}

#[test]
fn an_animated_ancestor_moves_mesh_light_and_camera() {
    let scene = load(&turning());
    assert_eq!(
        scene.static_mesh.triangles.len(),
        1,
        "the other triangle stands still"
    );
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(scene.objects[0].name, "spinner");
    assert_eq!(scene.animation.duration_s(), 2.0);
    let origin = scene.file_from_scene_m.as_vec3();
    for (time_s, angle) in [(0.0, 0.0), (1.0, FRAC_PI_4), (1.5, 0.75 * FRAC_PI_2)] {
        let pose = scene.pose_at(time_s);
        let expected = Vec3::new(2.0 * f32::cos(angle), 0.0, -2.0 * f32::sin(angle)) - origin;
        assert_near(
            pose.scene_from_object[0].transform_point3(Vec3::ZERO),
            expected,
        );
        assert_near(pose.lights[0].position, expected);
        assert_near(pose.cameras[0].pose.position_m, expected);
        let forward = Vec3::new(-f32::sin(angle), 0.0, -f32::cos(angle));
        assert_near(pose.cameras[0].pose.orientation * Vec3::NEG_Z, forward);
    }
}

#[test]
fn time_loops_and_any_time_is_allowed() {
    let scene = load(&turning());
    let at = |time_s| scene.pose_at(time_s).lights[0].position;
    assert_near(at(2.0 + 0.5), at(0.5));
    assert_near(at(-0.5), at(1.5));
    assert_near(at(2e9 + 0.5), at(0.5));
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_near(at(odd), at(0.0));
    }
    assert!(
        (at(0.5) - at(1.5)).length() > 0.1,
        "the comparison can fail"
    );
    let still = load(&triangle_on(json!({"mesh": 0})));
    assert!(still.pose_at(f64::NAN).scene_from_object.is_empty());
}

#[test]
fn bounds_cover_the_start_and_bounds_over_time_the_whole_motion() {
    let scene = load(&turning());
    let origin = scene.file_from_scene_m.as_vec3();
    assert_near(scene.bounds.max + origin, Vec3::new(3.0, 1.0, 0.0));
    let whole = scene.bounds_over_time();
    // The far corner (3, 0, 0) turns to (0, 0, -3).
    assert!(whole.min.z + origin.z < -2.99 && whole.min.z + origin.z > -3.3);
    assert_eq!(whole.max, scene.bounds.max);
    assert_eq!(
        load(&triangle_on(json!({"mesh": 0})))
            .bounds_over_time()
            .diagonal_m(),
        2.0_f32.sqrt()
    );
}

#[test]
fn translation_and_scale_follow_their_interpolation() {
    let animated = |interpolation: &str, values: &[[f32; 3]], path: &str| {
        let mut glb = triangle_on(json!({"mesh": 0}));
        glb.animate(0, path, interpolation, &[0.0, 1.0, 2.0], values);
        let scene = load(&glb);
        let origin = scene.file_from_scene_m.as_vec3();
        let pose = scene.pose_at(0.25);
        pose.scene_from_object[0].transform_point3(Vec3::X) + origin
    };
    let values = [[0.0; 3], [4.0, 0.0, 0.0], [0.0; 3]];
    assert_near(animated("LINEAR", &values, "translation"), Vec3::X * 2.0);
    assert_near(animated("STEP", &values, "translation"), Vec3::X);
    // Zero tangents: the smoothstep 3t² - 2t³ of the way.
    let splines: Vec<_> = values
        .iter()
        .flat_map(|v| [[0.0; 3], *v, [0.0; 3]])
        .collect();
    let smooth = 4.0 * (3.0 * 0.0625 - 2.0 * 0.015625);
    assert_near(
        animated("CUBICSPLINE", &splines, "translation"),
        Vec3::X * (1.0 + smooth),
    );
    let scales = [[1.0; 3], [5.0; 3], [1.0; 3]];
    assert_near(animated("LINEAR", &scales, "scale"), Vec3::X * 2.0);
}

#[test]
fn of_two_animations_of_one_property_the_later_wins_with_a_warning() {
    let mut glb = triangle_on(json!({"mesh": 0}));
    glb.animate(
        0,
        "translation",
        "LINEAR",
        &[0.0, 8.0],
        &[[0.0; 3], [8.0, 0.0, 0.0]],
    );
    glb.animate(
        0,
        "translation",
        "LINEAR",
        &[0.0, 2.0],
        &[[0.0; 3], [0.0, 2.0, 0.0]],
    );
    let scene = load(&glb);
    let origin = scene.file_from_scene_m.as_vec3();
    let corner = scene.pose_at(1.0).scene_from_object[0].transform_point3(Vec3::ZERO);
    assert_near(corner + origin, Vec3::Y);
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].contains("later one"),
        "{:?}",
        scene.warnings
    );
}
