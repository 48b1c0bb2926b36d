//! What the shaders compute of scattering and sampling, on the device, against the oracle and against closed forms.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::LazyLock;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use macula::gpu::pass::{Kernel, Recorder};
use macula::gpu::shader::{Stage, compose_text};
use macula::gpu::timing::PassTimer;
use macula::gpu::{GpuDevice, Headless, resources};
use macula::oracle::bsdf::{Bsdf, fresnel};
use macula::oracle::random::Random;
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;

use crate::chi_squared::{SIGMAS, sigmas};
use crate::kinds::{NO_COAT, coated, eyes, glass, lambert, metal, milk_glass, part_metal};
use crate::sphere::{BINS, bin_integrals, bin_of};

/// What one thread is asked.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Question {
    wo: [f32; 3],
    alpha: f32,
    f0: [f32; 3],
    f90: f32,
    coat_f0: [f32; 3],
    coat_f90: f32,
    diffuse: [f32; 3],
    ior: f32,
    wi: [f32; 3],
    is_front: u32,
    u: [f32; 4],
}

/// What it answers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Answer {
    direction: [f32; 3],
    weight: f32,
    value: [f32; 3],
    scalar: f32,
}

const COMMON: &str = "//! use bsdf, lights

struct Question {
  wo: vec3f, alpha: f32,
  f0: vec3f, f90: f32,
  coat_f0: vec3f, coat_f90: f32,
  diffuse: vec3f, ior: f32,
  wi: vec3f, is_front: u32,
  u: vec4f,
}
struct Answer { direction: vec3f, weight: f32, value: vec3f, scalar: f32 }

@group(1) @binding(0) var<storage, read> questions: array<Question>;
@group(1) @binding(1) var<storage, read_write> answers: array<Answer>;

const N: vec3f = vec3f(0.0, 0.0, 1.0);

fn bsdf_of(q: Question) -> Bsdf {
  var bsdf: Bsdf;
  bsdf.diffuse = q.diffuse;
  bsdf.alpha = q.alpha;
  bsdf.f0 = q.f0;
  bsdf.f90 = q.f90;
  bsdf.coat_f0 = q.coat_f0;
  bsdf.coat_f90 = q.coat_f90;
  bsdf.ior = q.ior;
  bsdf.is_solid = true;
  return bsdf;
}

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= arrayLength(&questions)) { return; }
  let q = questions[id.x];
  let front = q.is_front != 0u;
  var answer: Answer;
";

/// Asks the device: `body` sets `answer` from the question `q`.
fn ask(body: &str, questions: &[Question]) -> Vec<Answer> {
    static GPU: LazyLock<GpuDevice> =
        LazyLock::new(|| GpuDevice::create(&Headless::default()).unwrap());
    let gpu = &*GPU;
    let furnace = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/furnace.glb");
    let scene = LoadedScene::new(gpu, Scene::load(&furnace).unwrap()).unwrap();
    let asked = resources::storage_with(gpu, "questions", questions).unwrap();
    let count = questions.len() as u64;
    let answered = resources::storage::<Answer>(gpu, "answers", count).unwrap();
    let bound = scene.on_gpu.resources();
    let bound = bound.with("questions", &asked).with("answers", &answered);
    let source = format!("{COMMON}{body}\n  answers[id.x] = answer;\n}}\n");
    let size = |name: &str| scene.on_gpu.shader_size(name).unwrap_or(1);
    let source = compose_text("probe", &source, &size).unwrap();
    // Every lobe is gathered, and every lobe is there.
    let constants = [("GATHERED_ALPHA_MIN", 0.001)];
    let kernel = Kernel::from_source(gpu, Stage { name: "probe" }, source, &constants).unwrap();
    let kernel = kernel.bind(gpu, &bound).unwrap();
    let mut timer = PassTimer::new(gpu);
    let mut recorder = Recorder::new(gpu, &mut timer);
    recorder.pass("probe", &[(&kernel, questions.len() as u32)]);
    recorder.finish().unwrap();
    resources::read_back(gpu, &answered, count).unwrap()
}

fn question(bsdf: &Bsdf, wo: DVec3, random: &mut Random) -> Question {
    // The shaders keep an interface in the coat's place; its reflection is traced, not gathered.
    let interface_f90 = bsdf.interface.map(|interface| -interface.ior as f32);
    let reflection = match bsdf.interface {
        None => bsdf.reflection,
        Some(_) => NO_COAT,
    };
    Question {
        wo: wo.as_vec3().to_array(),
        alpha: bsdf.alpha as f32,
        f0: reflection.f0.as_vec3().to_array(),
        f90: reflection.f90 as f32,
        coat_f0: bsdf.coat.f0.as_vec3().to_array(),
        coat_f90: interface_f90.unwrap_or(bsdf.coat.f90 as f32),
        diffuse: bsdf.albedo.as_vec3().to_array(),
        ior: 1.5,
        wi: direction(random).as_vec3().to_array(),
        is_front: 1,
        u: [(); 4].map(|()| random.uniform() as f32),
    }
}

/// Uniform over the upper hemisphere, not quite to the horizon.
fn direction(random: &mut Random) -> DVec3 {
    let z = 0.02 + 0.98 * random.uniform();
    let phi = 2.0 * PI * random.uniform();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

#[test]
fn the_shaders_bsdf_is_the_oracles_for_every_pair_of_directions() {
    let kinds = [
        lambert(0.7),
        coated(0.2),
        coated(0.6),
        metal(0.5),
        metal(0.15),
        metal(1.0),
        part_metal(0.3),
        milk_glass(0.0),
        Bsdf {
            albedo: DVec3::splat(0.5),
            ..glass(1.0 / 1.5, 0.0)
        },
    ];
    let mut random = Random::of([1, 0, 0, 0]);
    let mut questions = Vec::new();
    let mut expected = Vec::new();
    for bsdf in &kinds {
        for _ in 0..3000 {
            let wo = direction(&mut random);
            let asked = question(bsdf, wo, &mut random);
            expected.push(bsdf.evaluate(DVec3::Z, vector(asked.wo), vector(asked.wi)));
            questions.push(asked);
        }
    }
    let answers = ask(
        "  answer.value = gathered_bsdf(bsdf_of(q), N, q.wo, q.wi);",
        &questions,
    );
    let is_close = |answer: &Answer, exact: &DVec3, factor: f64| {
        let difference = (vector(answer.value) * factor - *exact).abs();
        difference.cmple(exact.abs() * 1e-3 + 1e-5).all()
    };
    for (index, (answer, exact)) in answers.iter().zip(&expected).enumerate() {
        assert!(
            is_close(answer, exact, 1.0),
            "{:?}: {answer:?}, not {exact}",
            questions[index]
        );
    }
    let wrong = answers.iter().zip(&expected);
    let noticed = wrong
        .filter(|(answer, exact)| !is_close(answer, exact, 1.01))
        .count();
    assert!(noticed * 2 > answers.len(), "1 % is noticed: {noticed}");
}

#[test]
fn the_shaders_fresnel_reflectance_is_the_exact_one_up_to_total_reflection() {
    let mut random = Random::of([2, 0, 0, 0]);
    let questions: Vec<Question> = (0..4000)
        .map(|i| Question {
            ior: [1.5, 1.0 / 1.5, 1.0, 2.4][i % 4],
            u: [random.uniform() as f32, 0.0, 0.0, 0.0],
            ..Default::default()
        })
        .collect();
    let answers = ask(
        "  answer.scalar = fresnel_dielectric(q.u.x, q.ior);",
        &questions,
    );
    let mut total = 0;
    for (asked, answer) in questions.iter().zip(&answers) {
        let exact = fresnel(f64::from(asked.u[0]), f64::from(asked.ior));
        let difference = (f64::from(answer.scalar) - exact).abs();
        // Near the critical angle the reflectance rises without bound in slope.
        assert!(
            difference < 2e-3,
            "{asked:?}: {} for {exact}",
            answer.scalar
        );
        total += u32::from(exact == 1.0);
    }
    assert!(total > 100, "{total} rays are reflected totally");
    let index_one = questions.iter().zip(&answers).filter(|(q, _)| q.ior == 1.0);
    assert!(index_one.clone().count() > 0 && index_one.clone().all(|(_, a)| a.scalar < 1e-6));
}

const SAMPLES: usize = 100_000;

/// Fails unless the device's directions follow the oracle's density; zero directions are those that were absorbed.
fn follow(answers: &[Answer], density: impl Fn(DVec3) -> f64) -> f64 {
    let mut observed = vec![0.0; BINS + 1];
    for answer in answers {
        let wi = vector(answer.direction);
        let bin = if wi == DVec3::ZERO { BINS } else { bin_of(wi) };
        observed[bin] += 1.0;
    }
    let mut expected = bin_integrals(density);
    expected.push((1.0 - expected.iter().sum::<f64>()).max(0.0));
    let total = answers.len() as f64;
    expected.iter_mut().for_each(|share| *share *= total);
    sigmas(&observed, &expected)
}

#[test]
fn the_shaders_reflections_follow_the_oracles_density_with_its_weights() {
    for bsdf in [metal(0.5), metal(0.15), metal(0.9)] {
        for wo in eyes() {
            let mut random = Random::of([3, 0, 0, 0]);
            let questions: Vec<Question> = (0..SAMPLES)
                .map(|_| question(&bsdf, wo, &mut random))
                .collect();
            let answers = ask(
                "  let scatter = sample_reflection(bsdf_of(q), N, q.wo, q.u.xy);
  answer.direction = scatter.direction;
  answer.weight = scatter.weight.x;",
                &questions,
            );
            let above = follow(&answers, |wi| bsdf.density(DVec3::Z, wo, wi));
            assert!(
                above < SIGMAS,
                "alpha {} at {wo}: {above} sigmas",
                bsdf.alpha
            );
            let sharper = Bsdf {
                alpha: 0.9 * bsdf.alpha,
                ..bsdf
            };
            let control = follow(&answers, |wi| sharper.density(DVec3::Z, wo, wi));
            assert!(
                control > SIGMAS,
                "alpha {} at {wo}: the control passes",
                bsdf.alpha
            );
            for answer in answers.iter().filter(|a| a.direction[2] > 0.01) {
                let wi = vector(answer.direction);
                let exact =
                    bsdf.evaluate(DVec3::Z, wo, wi).x * wi.z / bsdf.density(DVec3::Z, wo, wi);
                let difference = (f64::from(answer.weight) - exact).abs();
                assert!(
                    difference < 2e-3 * exact,
                    "{wi}: {} for {exact}",
                    answer.weight
                );
            }
        }
    }
}

#[test]
fn light_through_the_shaders_frosted_glass_follows_the_oracles_density_with_its_weights() {
    for (is_front, ior) in [(1, 1.5), (0, 1.0 / 1.5)] {
        let bsdf = glass(ior, 0.3);
        for wo in eyes() {
            let mut random = Random::of([4, 0, 0, 0]);
            let questions: Vec<Question> = (0..SAMPLES)
                .map(|_| Question {
                    is_front,
                    ..question(&bsdf, wo, &mut random)
                })
                .collect();
            let answers = ask(
                "  var bsdf = bsdf_of(q);
  bsdf.transmission = vec3f(1.0);
  let h = half_vector_sample(N, q.wo, bsdf.alpha, q.u.xy);
  let reflectance = interface_reflectance(bsdf, front, dot(q.wo, h));
  var scatter = refract_through(bsdf, N, h, q.wo, front);
  scatter.weight *= radiance_scale(bsdf, front);
  if (q.u.z < reflectance) {
    scatter = ABSORBED;
    let wi = reflect(-q.wo, h);
    if (wi.z > 0.0) { scatter = Scatter(wi, vec3f(masking(N, wi, bsdf.alpha)), false); }
  }
  answer.direction = scatter.direction;
  answer.weight = scatter.weight.x;",
                &questions,
            );
            let above = follow(&answers, |wi| bsdf.density(DVec3::Z, wo, wi));
            assert!(above < SIGMAS, "index {ior} at {wo}: {above} sigmas");
            let other = glass(1.1 * ior, 0.3);
            let control = follow(&answers, |wi| other.density(DVec3::Z, wo, wi));
            assert!(control > SIGMAS, "index {ior} at {wo}: the control passes");
            for answer in answers.iter().filter(|a| a.direction[2].abs() > 0.01) {
                let wi = vector(answer.direction);
                let density = bsdf.density(DVec3::Z, wo, wi);
                let exact = bsdf.evaluate(DVec3::Z, wo, wi).x * wi.z.abs() / density;
                let difference = (f64::from(answer.weight) - exact).abs();
                // In single precision the half vector of what is refracted is known to a few digits only.
                let is_close = difference < 2e-2 * exact.max(0.05);
                assert!(is_close, "index {ior}, {wi}: {} for {exact}", answer.weight);
            }
        }
    }
}

#[test]
fn the_shaders_hemispheres_caps_and_triangles_are_filled_as_they_say() {
    let mut random = Random::of([5, 0, 0, 0]);
    let questions: Vec<Question> = (0..SAMPLES)
        .map(|_| question(&lambert(0.5), DVec3::Z, &mut random))
        .collect();
    let cosine = |wi: DVec3| wi.z.max(0.0) / PI;
    let hemisphere = ask(
        "  answer.direction = cosine_hemisphere_sample(q.u.xy);",
        &questions,
    );
    assert!(follow(&hemisphere, cosine) < SIGMAS);
    // The edge of the cap is that of bins: 24 rings over heights from -1 to 1.
    let cap = |wi: DVec3| if wi.z > 0.5 { 1.0 / PI } else { 0.0 };
    let capped = ask("  answer.direction = cap_sample(q.u.xy, 0.5);", &questions);
    assert!(follow(&capped, cap) < SIGMAS);
    assert!(follow(&capped, cosine) > SIGMAS && follow(&hemisphere, cap) > SIGMAS);

    // Small triangles of equal area: along each barycentric coordinate, eight strips.
    let triangle = ask(
        "  answer.direction = vec3f(triangle_sample(q.u.xy), 0.0);",
        &questions,
    );
    let mut counts = std::collections::BTreeMap::new();
    for answer in &triangle {
        let [b, c, _] = answer.direction;
        let strips = [1.0 - b - c, b, c].map(|x| ((8.0 * x) as u32).min(7));
        *counts.entry(strips).or_insert(0.0) += 1.0;
    }
    let observed: Vec<f64> = counts.values().copied().collect();
    let even = vec![SAMPLES as f64 / 64.0; 64];
    // Rounding puts a point on a line between triangles now and then.
    let whole: Vec<f64> = observed.into_iter().filter(|count| *count > 10.0).collect();
    assert_eq!(whole.len(), 64);
    assert!(sigmas(&whole, &even) < SIGMAS);
}

#[test]
fn the_shaders_light_samples_bring_what_the_lights_shine() {
    // A triangle seen from below, at a slant, and a spot: means over samples against sums over fine parts, and against the definition.
    let corners = [
        DVec3::new(-0.3, -0.2, 1.0),
        DVec3::new(0.1, 0.6, 1.3),
        DVec3::new(0.7, -0.1, 0.9),
    ];
    let (edge1, edge2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let mut random = Random::of([6, 0, 0, 0]);
    let questions: Vec<Question> = (0..SAMPLES)
        .map(|_| question(&lambert(0.5), DVec3::Z, &mut random))
        .collect();
    let light = |kind: &str| {
        let v = |v: DVec3| format!("vec3f({}, {}, {})", v.x, v.y, v.z);
        format!(
            "  var light: Light;
  light.kind = {kind};
  light.position = {};
  light.edge1 = {};
  light.edge2 = {};
  light.area_m2 = 0.5 * length(cross(light.edge1, light.edge2));
  light.emission = vec3f(2.0);
  light.emission_texture = -1;
  light.spot_scale = 2.5;
  light.spot_offset = -1.25;
  light.sides = BOTH_SIDES;
  let light_sample = sample_light(light, vec3f(0.0), q.u.xy);
  answer.direction = light_sample.direction;
  answer.weight = light_sample.irradiance.x;
  answer.scalar = light_sample.distance_m;",
            v(corners[0]),
            v(edge1),
            v(edge2)
        )
    };
    let irradiance = |answers: &[Answer]| {
        let on_floor = |a: &Answer| f64::from(a.weight) * f64::from(a.direction[2]).max(0.0);
        answers.iter().map(on_floor).sum::<f64>() / answers.len() as f64
    };
    let parts = 400;
    let area_m2 = 0.5 * edge1.cross(edge2).length();
    let normal = edge1.cross(edge2).normalize();
    let mut exact = 0.0;
    for i in 0..parts * parts {
        let (u, v) = ((i % parts) as f64 + 0.5, (i / parts) as f64 + 0.5);
        let (u, v) = (u / parts as f64, v / parts as f64);
        // Half of the parallelogram.
        if u + v < 1.0 {
            let to = corners[0] + edge1 * u + edge2 * v;
            let cosines = to.normalize().dot(normal).abs() * to.normalize().z;
            exact += 2.0 * cosines / to.length_squared() * 2.0 * area_m2 / f64::from(parts * parts);
        }
    }
    let of_triangle = irradiance(&ask(&light("LIGHT_TRIANGLE"), &questions));
    assert!(
        (of_triangle / exact - 1.0).abs() < 0.005,
        "{of_triangle} for {exact}"
    );

    // A spot: its axis is the unit first edge, its falloff clamp(2.5 cos - 1.25)².
    let axis = edge1.normalize();
    let to_light = -axis - 0.8 * axis.any_orthonormal_vector();
    let place = format!("vec3f({}, {}, {})", to_light.x, to_light.y, to_light.z);
    let spot = light("LIGHT_SPOT").replace(
        "let light_sample",
        &format!(
            "light.edge1 = normalize(light.edge1);\n  light.position = {place};\n  let light_sample"
        ),
    );
    let answers = ask(&spot, &questions[..64]);
    let cosine = -to_light.normalize().dot(axis);
    let share = (2.5 * cosine - 1.25).clamp(0.0, 1.0).powi(2);
    let exact = 2.0 * share / to_light.length_squared();
    assert!(
        share > 0.1 && share < 0.9,
        "{share} is on the cone's border"
    );
    for answer in &answers {
        assert!((f64::from(answer.weight) / exact - 1.0).abs() < 1e-4);
        assert!((vector(answer.direction) - to_light.normalize()).length() < 1e-5);
    }
}
