//! The device's building blocks: arrays cut into chunks, prefix sums, the sort, and the regions of the eye.

use glam::Vec3;
use macula::fovea::region::{Region, eccentricity_rad};
use macula::frame::regions;
use macula::gather::{EyeImage, EyeSettings};
use macula::gpu::layout::PhotonCounters;
use macula::gpu::pass::{Kernel, Recorder, Resources};
use macula::gpu::resources::{self, SplitArray, TexelArray};
use macula::gpu::shader::{Stage, TEXEL_SHIFT, chunk_shift, compose_text};
use macula::gpu::timing::PassTimer;
use macula::params::Params;
use macula::photon::sort::{PrefixSum, RadixSort};
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::scene::gpu_scene::GpuScene;
use macula::technique::{self, FrameSettings, Start};
use wgpu::Buffer;

use crate::maker::{bundled, gpu};

/// Runs one dispatch of `threads`.
fn dispatch(name: &'static str, source: String, bound: &Resources<'_>, threads: u32) {
    let kernel = Kernel::from_source(gpu(), Stage { name }, source, &[]).unwrap();
    let kernel = kernel.bind(gpu(), bound).unwrap();
    run(|recorder| recorder.pass(name, &[(&kernel, threads)]));
}

fn run(record: impl FnOnce(&mut Recorder<'_>)) {
    let mut timer = PassTimer::new(gpu());
    let mut recorder = Recorder::new(gpu(), &mut timer);
    record(&mut recorder);
    recorder.finish().unwrap();
}

/// Writes and reads around the borders of the chunks: element `i` of `places` becomes 3 · place + 1, and is read back.
const AROUND_BORDERS: &str = "
@group(0) @binding(0) var<storage, read> places: array<u32>;
@group(0) @binding(1) var<storage, read_write> seen: array<u32>;
//! split numbers: u32, read_write, 0, 2

@compute @workgroup_size(64)
fn around_borders(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= arrayLength(&places)) { return; }
  let place = places[id.x];
  store_numbers(place, 3u * place + 1u);
  seen[id.x] = load_numbers(place);
}
";

#[test]
fn an_array_in_three_chunks_is_one_array() {
    let chunk = 1u32 << chunk_shift(4);
    let places: Vec<u32> = [0, chunk, 2 * chunk]
        .into_iter()
        .flat_map(|border| (0..64u32).map(move |i| (border + i).saturating_sub(32)))
        .chain([3 * chunk - 1])
        .collect();
    let chunks: Vec<Buffer> = (0..3)
        .map(|_| resources::storage::<u32>(gpu(), "chunk", u64::from(chunk)).unwrap())
        .collect();
    let listed = resources::storage_with(gpu(), "places", &places).unwrap();
    let seen = resources::storage::<u32>(gpu(), "seen", places.len() as u64).unwrap();
    let bound = Resources::default()
        .with("places", &listed)
        .with("seen", &seen)
        .with("numbers_0", &chunks[0])
        .with("numbers_1", &chunks[1])
        .with("numbers_2", &chunks[2]);
    let source = compose_text("around_borders", AROUND_BORDERS, &|_| 3).unwrap();
    dispatch("around_borders", source, &bound, places.len() as u32);

    let seen: Vec<u32> = resources::read_back(gpu(), &seen, places.len() as u64).unwrap();
    let expected: Vec<u32> = places.iter().map(|place| 3 * place + 1).collect();
    assert_eq!(seen, expected);
    let chunks: Vec<Vec<u32>> = chunks
        .iter()
        .map(|buffer| resources::read_back(gpu(), buffer, u64::from(chunk)).unwrap())
        .collect();
    let held = |place: u32| chunks[(place / chunk) as usize][(place % chunk) as usize];
    assert!(places.iter().all(|place| held(*place) == 3 * place + 1));
    // What nobody wrote is still zero: no store went astray.
    let written: std::collections::BTreeSet<u32> = places.into_iter().collect();
    let nonzero = chunks.iter().flatten().filter(|value| **value != 0).count();
    assert_eq!(nonzero, written.len());
}

/// Reads vectors at `places` of an array in a texture.
const FROM_A_TEXTURE: &str = "
@group(0) @binding(0) var<storage, read> places: array<u32>;
@group(0) @binding(1) var<storage, read_write> seen: array<vec4u>;
//! texel_array vectors: u32, 0, 2

@compute @workgroup_size(64)
fn from_a_texture(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= arrayLength(&places)) { return; }
  seen[id.x] = load_vectors(places[id.x]);
}
";

fn read_from_a_texture(count: u32, places: &[u32]) -> (u32, Vec<[u32; 4]>) {
    let vectors: Vec<[u32; 4]> = (0..count).map(|i| [i, !i, 3 * i, i << 9]).collect();
    let array = TexelArray::new(gpu(), "vectors", &vectors).unwrap();
    let listed = resources::storage_with(gpu(), "places", places).unwrap();
    let seen = resources::storage::<[u32; 4]>(gpu(), "seen", places.len() as u64).unwrap();
    let bound = Resources::default()
        .with("places", &listed)
        .with("seen", &seen)
        .with_texel_array(&array);
    let source = compose_text("from_a_texture", FROM_A_TEXTURE, &|_| array.layers()).unwrap();
    dispatch("from_a_texture", source, &bound, places.len() as u32);
    let seen = resources::read_back(gpu(), &seen, places.len() as u64).unwrap();
    (array.layers(), seen)
}

#[test]
fn an_array_in_a_texture_reads_as_it_was_written_over_the_ends_of_rows_and_layers() {
    let (row, layer) = (1u32 << TEXEL_SHIFT, 1u32 << (2 * TEXEL_SHIFT));
    for (count, layers) in [
        (1, 1),
        (row, 1),
        (3 * row + 5, 1),
        (layer, 1),
        (layer + row + 5, 2),
    ] {
        let places: Vec<u32> = [0, row, 2 * row, layer, layer + row, count]
            .into_iter()
            .flat_map(|border| (0..16u32).map(move |i| (border + i).saturating_sub(8)))
            .filter(|place| *place < count)
            .collect();
        let expected: Vec<[u32; 4]> = places.iter().map(|i| [*i, !i, 3 * i, i << 9]).collect();
        assert_eq!(read_from_a_texture(count, &places), (layers, expected));
    }
}

/// Numbers without a pattern, the same every time.
fn scrambled(count: u32) -> impl Iterator<Item = u32> {
    (0..count).map(|i| {
        let mixed = (i ^ 0x5bd1_e995).wrapping_mul(0x9e37_79b9);
        (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 3
    })
}

fn prefix_sum_on_device(values: &[u32]) -> Vec<u32> {
    let length = values.len() as u32;
    let buffer = resources::storage_with(gpu(), "values", values).unwrap();
    let sum = PrefixSum::new(gpu(), &buffer, length).unwrap();
    sum.set_length(gpu(), length);
    run(|recorder| sum.record(recorder, "sum", length));
    resources::read_back(gpu(), &buffer, u64::from(length)).unwrap()
}

fn prefix_sum(values: &[u32]) -> Vec<u32> {
    let sums = values.iter().scan(0u32, |sum, value| {
        let before = *sum;
        *sum = sum.wrapping_add(*value);
        Some(before)
    });
    sums.collect()
}

#[test]
fn the_prefix_sum_is_exclusive_at_every_length() {
    for length in [1, 2, 255, 2047, 2048, 2049, 100_003, 5_000_001] {
        let values: Vec<u32> = scrambled(length).map(|value| value % 1000).collect();
        let is_right = prefix_sum_on_device(&values) == prefix_sum(&values);
        assert!(is_right, "{length} values");
        let mut others = values.clone();
        others[0] += 1;
        let is_seen = prefix_sum_on_device(&others) != prefix_sum(&values);
        assert_eq!(is_seen, length > 1, "{length} values");
    }
}

const KEY_BITS: u32 = 22;

/// Sorts (key, its place before) on the device, in room for `capacity` pairs.
fn sort_on_device(keys: &[u32], capacity: u32) -> Vec<(u32, u32)> {
    let count = keys.len() as u64;
    let order: Vec<u32> = (0..keys.len() as u32).collect();
    let room = |name| SplitArray::new::<u32>(gpu(), name, u64::from(capacity)).unwrap();
    let (key_sides, order_sides) = ([room("keys"), room("keys")], [room("order"), room("order")]);
    key_sides[0].write(gpu(), keys);
    order_sides[0].write(gpu(), &order);
    let counters = PhotonCounters {
        stored: keys.len() as u32,
        ..Default::default()
    };
    let counters = resources::storage_with(gpu(), "counters", &[counters]).unwrap();
    let sort = RadixSort::new(
        gpu(),
        key_sides.each_ref(),
        order_sides.each_ref(),
        &Resources::default().with("counters", &counters),
        capacity,
        KEY_BITS,
    )
    .unwrap();
    run(|recorder| sort.record(recorder, "sort"));
    let side = sort.sorted_side();
    let keys: Vec<u32> = key_sides[side].read(gpu(), count).unwrap();
    let order: Vec<u32> = order_sides[side].read(gpu(), count).unwrap();
    keys.into_iter().zip(order).collect()
}

#[test]
fn the_sort_is_stable_for_keys_of_every_kind() {
    const COUNT: u32 = 30_001;
    let key_max = (1u32 << KEY_BITS) - 1;
    let cases: [(&str, Vec<u32>); 7] = [
        ("random", scrambled(COUNT).map(|k| k & key_max).collect()),
        ("few", scrambled(COUNT).map(|k| k % 5).collect()),
        ("equal", vec![key_max; COUNT as usize]),
        ("sorted", (0..COUNT).collect()),
        ("reversed", (0..COUNT).rev().collect()),
        ("one", vec![7]),
        ("none", vec![]),
    ];
    for (what, keys) in cases {
        let mut expected: Vec<(u32, u32)> = keys.iter().copied().zip(0..).collect();
        expected.sort_by_key(|(key, _)| *key);
        for capacity in [COUNT, 3 * COUNT] {
            let sorted = sort_on_device(&keys, capacity);
            assert!(sorted == expected, "{what} keys in room for {capacity}");
        }
    }
}

/// How many samples each pixel of the left half of a session's picture got when the eye looks at `gaze_dir`.
fn samples_by_pixel(params: &Params, gaze_dir: Vec3, side: u32) -> (Vec<u32>, EyeSettings) {
    let scene = Scene::load(&bundled("furnace.glb")).unwrap();
    let (caster, pose) = (SceneCaster::new(&scene), scene.pose_at(0.0));
    let on_gpu = GpuScene::new(gpu(), &scene, &caster, &pose).unwrap();
    let entry = technique::find("pm-direct").unwrap();
    let start = Start {
        gpu: gpu(),
        scene: &scene,
        caster: &caster,
        on_gpu: &on_gpu,
        effects: technique::effects(&scene, params),
        params,
        size: (side, side),
        is_session: false,
    };
    let mut technique = (entry.start)(&start).unwrap();
    let image = EyeImage::new(gpu(), side, side).unwrap();
    let view = scene.cameras[0].view(side, side);
    let settings = EyeSettings::new(params, view, Some(gaze_dir));
    let frame = FrameSettings {
        frame: 0,
        pass: 0,
        pose: &pose,
        eyes: &[settings],
    };
    run(|recorder| {
        technique.prepare(recorder, &frame).unwrap();
        image.clear(recorder.encoder());
        technique.shade(recorder, &settings, &image).unwrap();
    });
    let sums: Vec<[f32; 4]> = image.sums().read(gpu(), u64::from(side * side)).unwrap();
    let counts = sums.iter().map(|[.., count]| *count as u32);
    (counts.collect(), settings)
}

#[test]
fn the_device_gives_each_pixel_the_samples_of_its_region() {
    const SIDE: u32 = 48;
    let mut params = Params::default();
    params.photon.count = 100;
    let gaze_dir = Vec3::new(0.25, -0.15, -1.0).normalize();
    let (counts, settings) = samples_by_pixel(&params, gaze_dir, SIDE);
    let samples_for = |gaze_dir: Vec3, pixel: u32| {
        let centre = glam::Vec2::new((pixel % SIDE) as f32 + 0.5, (pixel / SIDE) as f32 + 0.5);
        let dir = settings.fov.dir_in_view(centre / SIDE as f32);
        let eccentricity_rad = eccentricity_rad(dir, gaze_dir);
        let is_on_border = [params.fovea.radius_deg, params.fovea.transition_deg]
            .iter()
            .any(|deg| (eccentricity_rad - deg.to_radians()).abs() < 1e-5);
        let samples = match regions(&params).region(eccentricity_rad) {
            Region::Fovea => params.fovea.samples,
            Region::Transition => params.fovea.transition_samples,
            Region::Periphery => params.fovea.periphery_samples,
        };
        (!is_on_border).then_some(samples)
    };
    let disagreements = |gaze_dir: Vec3| {
        (0..SIDE * SIDE)
            .filter(|pixel| {
                samples_for(gaze_dir, *pixel).is_some_and(|s| s != counts[*pixel as usize])
            })
            .count()
    };
    assert_eq!(disagreements(gaze_dir), 0);
    for samples in [4, 2, 1] {
        assert!(counts.contains(&samples), "all three regions are seen");
    }
    let turned = glam::Quat::from_rotation_y(0.05) * gaze_dir;
    assert!(disagreements(turned) > 0, "a gaze 3 degrees off is noticed");
}
