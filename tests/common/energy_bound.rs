//! How bright a picture can be at most, from the lights and the surfaces alone.
//!
//! Radiance is taken over the square of the index of what it travels in, which no interface changes. A surface of albedo rho that emits L
//! keeps a level B where L + rho B <= B: if all that comes to it is B at most, so is all that leaves it. Light starts from nothing and takes
//! one bounce after the other, so the smallest level that all surfaces keep is never exceeded. What neither emits nor adds light, a mirror or
//! clear glass, keeps every level. Light straight from lamps without extent is counted as emission of what it falls on.
//!
//! No bound is known, and none is given, where
//! - lamps without extent meet mirrors, sharp lobes or anything that transmits: curved ones focus without limit, and light passes thin walls
//!   straight on;
//! - a base lies under a coat (or a rough interface) and both together may reflect more than they get, as glTF's do at grazing angles, or
//!   where a surface that emits may lose nothing;
//! - solids are not closed surfaces turned outward: on a round through an open one radiance may grow without end.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{Affine3A, DVec3, Vec3};
use macula::scene::{Material, PunctualKind, PunctualLight, SMOOTH_ALPHA, Scene};

/// A triangle, placed as it is at one time.
struct Facet<'a> {
    corners: [DVec3; 3],
    material: &'a Material,
}

/// No radiance that comes to `eye` (scene space, metres; `None`: wherever it is) exceeds this at the time `time_s`, W/(m² sr), any channel;
/// `None` where no such bound is known.
pub fn radiance_bound_w_m2_sr(scene: &Scene, time_s: f64, eye: Option<Vec3>) -> Option<f64> {
    let pose = scene.pose_at(time_s);
    let facets = facets(scene, &pose.scene_from_object);
    let mut level = 0.0f64;
    for facet in &facets {
        level = level.max(level_w_m2_sr(facet, &pose.lights)?);
    }
    let bound = level * squeeze_at(&facets, eye.map(|eye| eye.as_dvec3()))?;
    bound.is_finite().then_some(bound)
}

fn facets<'a>(scene: &'a Scene, scene_from_object: &[Affine3A]) -> Vec<Facet<'a>> {
    let objects = scene.objects.iter().map(|object| &object.mesh);
    let moving = objects.zip(scene_from_object.iter().copied());
    let meshes = std::iter::once((&scene.static_mesh, Affine3A::IDENTITY)).chain(moving);
    let of_mesh = |(mesh, place): (&'a macula::scene::Mesh, Affine3A)| {
        (0..mesh.triangles.len()).map(move |triangle| {
            let corner = |p: Vec3| place.transform_point3(p).as_dvec3();
            let mut corners = mesh.corners(triangle).map(corner);
            if place.matrix3.determinant() < 0.0 {
                corners.swap(1, 2);
            }
            Facet {
                corners,
                material: &scene.materials[mesh.material_of_triangle[triangle] as usize],
            }
        })
    };
    meshes.flat_map(of_mesh).collect()
}

/// The smallest level that a surface keeps.
fn level_w_m2_sr(facet: &Facet<'_>, lights: &[PunctualLight]) -> Option<f64> {
    let material = facet.material;
    let irradiance: f64 = lights.iter().map(|light| from(facet, light)).sum();
    let focus = if irradiance > 0.0 {
        value_bound(material)?
    } else {
        0.0
    };
    let emitted = f64::from(material.emission_w_per_m2_sr.max_element()) + focus * irradiance;
    let albedo = albedo_bound(material);
    if emitted == 0.0 {
        return (albedo <= 1.0).then_some(0.0);
    }
    (albedo < 1.0).then(|| emitted / (1.0 - albedo))
}

/// Whether light passes somewhere: a metal lets none through, and a texture may make less of a metal of it.
fn may_transmit(material: &Material) -> bool {
    let may_be_dielectric =
        material.metallic < 1.0 || material.metallic_roughness_texture.is_some();
    material.transmission > 0.0 && may_be_dielectric
}

/// The share of light in one direction that a surface makes of the same light from all directions, at most. Lobes of facets give no more than
/// their largest reflectance; a smooth interface parts light among reflection, tint and base.
fn albedo_bound(material: &Material) -> f64 {
    let base = f64::from(material.base_color.max_element());
    let [metallic, transmission, strength] = [
        material.metallic,
        material.transmission,
        material.specular_factor,
    ]
    .map(f64::from);
    if may_transmit(material) {
        let under = base * (1.0 - transmission);
        let is_smooth = !material.may_be_rough();
        return if is_smooth { 1.0 } else { 1.0 + under };
    }
    let metals = match material.metallic_roughness_texture {
        Some(_) => [0.0, metallic],
        None => [metallic; 2],
    };
    let of = |metallic: f64| {
        // The largest reflectance is that at grazing angles, or a metal's own.
        let coat = strength * (1.0 - metallic);
        base * (1.0 - metallic)
            + if metallic > 0.0 {
                coat + metallic
            } else {
                coat
            }
    };
    metals.map(of).into_iter().fold(0.0, f64::max)
}

/// The largest BSDF times cosine for light from one direction, 1/sr: albedo/pi of the base, and GGX's peak 1/(pi alpha²) over 4 times the
/// largest masking 2/alpha of the share that is seen at a grazing angle. `None` where it has no limit.
fn value_bound(material: &Material) -> Option<f64> {
    let base = f64::from(material.base_color.max_element()) / PI;
    if material.metallic == 0.0 && material.transmission == 0.0 && material.specular_factor == 0.0 {
        return Some(base);
    }
    let alpha = f64::from(material.roughness * material.roughness);
    let is_spread = alpha >= f64::from(SMOOTH_ALPHA)
        && !may_transmit(material)
        && material.metallic_roughness_texture.is_none();
    is_spread.then(|| base + 0.5 / (PI * alpha.powi(3)))
}

/// Irradiance, W/m², that a lamp brings to a surface at most.
fn from(facet: &Facet<'_>, light: &PunctualLight) -> f64 {
    let intensity = f64::from(light.intensity.max_element());
    match light.kind {
        PunctualKind::Directional => intensity,
        _ => intensity / distance_m(facet, light.position.as_dvec3()).powi(2),
    }
}

/// A distance, metres, that no point of the triangle is nearer than: to its plane or to its bounding box.
fn distance_m(facet: &Facet<'_>, point: DVec3) -> f64 {
    let [a, b, c] = facet.corners;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let to_plane_m = normal.dot(point - a).abs();
    let in_box = point.clamp(a.min(b).min(c), a.max(b).max(c));
    to_plane_m.max(point.distance(in_box))
}

/// The square of the index of what lies at a point: the product over the solids around it, or over all of them. `None` where a solid is not
/// closed, or is turned inside out.
fn squeeze_at(facets: &[Facet<'_>], point: Option<DVec3>) -> Option<f64> {
    let is_solid = |m: &Material| m.is_solid && may_transmit(m);
    let mut of_index: HashMap<u32, Vec<[DVec3; 3]>> = HashMap::new();
    for facet in facets.iter().filter(|facet| is_solid(facet.material)) {
        let same_index = of_index.entry(facet.material.ior.to_bits()).or_default();
        same_index.push(facet.corners);
    }
    let mut squeeze = 1.0;
    for (index, triangles) in of_index {
        let parts = closed_parts(&triangles)?;
        let around = |point| triangles.iter().map(|t| solid_angle(t, point)).sum::<f64>();
        let turns = |point| (around(point) / (4.0 * PI)).round().max(0.0);
        let solids = point.map_or(f64::from(parts), turns);
        squeeze *= f64::from(f32::from_bits(index)).powf(2.0 * solids);
    }
    Some(squeeze)
}

/// How many parts hang together by their corners, if every edge is passed as often one way as the other and each part holds a volume.
fn closed_parts(triangles: &[[DVec3; 3]]) -> Option<u32> {
    let key = |p: DVec3| p.to_array().map(f64::to_bits);
    let mut edges: HashMap<_, i32> = HashMap::new();
    let mut part_of: HashMap<[u64; 3], usize> = HashMap::new();
    for (index, [a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((key(*from), key(*to))).or_default() += 1;
            *edges.entry((key(*to), key(*from))).or_default() -= 1;
        }
        let joined = [a, b, c].map(|p| part_of.insert(key(*p), index));
        for part in part_of.values_mut() {
            if joined.contains(&Some(*part)) {
                *part = index;
            }
        }
    }
    let mut volumes: HashMap<usize, f64> = HashMap::new();
    for [a, b, c] in triangles {
        *volumes.entry(part_of[&key(*a)]).or_default() += a.cross(*b).dot(*c);
    }
    let is_closed = edges.values().all(|passes| *passes == 0);
    let is_outward = volumes.values().all(|volume| *volume > 0.0);
    (is_closed && is_outward).then_some(volumes.len() as u32)
}

/// The solid angle of a triangle's back from a point, negative for its front, sr (Van Oosterom and Strackee, 1983).
fn solid_angle(corners: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(below)
}
