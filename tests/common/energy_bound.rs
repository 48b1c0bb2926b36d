//! How bright a picture can be at most, from the lights and the surfaces alone.

use std::f64::consts::PI;

use glam::Vec3;
use macula::scene::{Material, PunctualKind, Scene};

/// No radiance in the scene exceeds this, W/(m² sr), any channel; `None` where no such bound is known.
///
/// A scene of Lambertian surfaces of albedo rho or less that emit at most L and receive at most E straight from punctual lights has
/// radiance (L + rho E / pi) / (1 - rho) at most: one bounce multiplies the largest radiance by rho at most.
pub fn radiance_bound_w_m2_sr(scene: &Scene) -> Option<f64> {
    let is_lambert =
        |m: &&Material| m.metallic == 0.0 && m.transmission == 0.0 && m.specular_factor == 0.0;
    // The last material is glTF's default, which only triangles without one have.
    let used = || {
        let mesh = &scene.static_mesh;
        let materials = mesh.material_of_triangle.iter();
        materials.map(|material| &scene.materials[*material as usize])
    };
    if !scene.objects.is_empty() || !used().all(|m| is_lambert(&m)) {
        return None;
    }
    let largest = |of: &dyn Fn(&Material) -> Vec3| {
        used()
            .map(|m| f64::from(of(m).max_element()))
            .fold(0.0, f64::max)
    };
    let albedo = largest(&|m| m.base_color);
    let emission = largest(&|m| m.emission_w_per_m2_sr);
    let lights = scene.lights.iter();
    let irradiance: f64 = lights
        .map(|light| {
            let intensity = f64::from(light.intensity.max_element());
            match light.kind {
                PunctualKind::Directional => intensity,
                _ => intensity / f64::from(nearest_surface_m(scene, light.position)).powi(2),
            }
        })
        .sum();
    let bound = (emission + albedo * irradiance / PI) / (1.0 - albedo);
    (albedo < 1.0 && bound.is_finite()).then_some(bound)
}

/// A distance, metres, that no triangle is nearer than: to its plane or to its bounding box.
fn nearest_surface_m(scene: &Scene, point: Vec3) -> f32 {
    let mesh = &scene.static_mesh;
    let distance_m = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let to_plane_m = normal.dot(point - a).abs();
        let in_box = point.clamp(a.min(b).min(c), a.max(b).max(c));
        to_plane_m.max(point.distance(in_box))
    };
    (0..mesh.triangles.len())
        .map(distance_m)
        .fold(f32::INFINITY, f32::min)
}
