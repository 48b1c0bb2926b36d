//! A recorded session in, lit pictures out: the program on the bundled recording, and the frames of one session from within.

#[path = "common/chromium.rs"]
#[allow(dead_code, reason = "other tests use the rest of it")]
mod chromium;
#[path = "common/program.rs"]
#[allow(dead_code, reason = "other tests use the rest of it")]
mod program;

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use macula::frame::FrameRenderer;
use macula::gaze::Session;
use macula::image::png;
use macula::params::Params;
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::technique;
use macula::xr::{Runtime, XrApp, XrOptions};
use program::{Run, asset, command, run};

/// Replays parts of the bundled recording at 64x64 with few photons.
fn replay(out: &Path, more: &[&str]) -> Run {
    let mut command = command(["replay"]);
    command.arg(asset("scenes/cornell.glb"));
    command.arg("--session").arg(asset("sessions/natural-look"));
    command.arg("--out").arg(out);
    if !more.contains(&"--size") {
        command.args(["--size", "64x64"]);
    }
    command.args(["--set", "photon.count=3000"]).args(more);
    let run = run(&mut command);
    assert_eq!(run.code, Some(0), "{}", run.complaint);
    run
}

/// Rows of a `frames.csv`, by column.
fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("frames.csv")).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    let text = &row[column];
    text.parse()
        .unwrap_or_else(|_| panic!("{column} is `{text}`"))
}

/// Names and bytes of all pictures.
fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder.join("frames")).unwrap();
    entries
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

#[test]
fn a_replay_leaves_pictures_a_table_a_report_and_what_made_them() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let told = replay(
        &out,
        &["--frames", "0..30", "--every", "10", "--report", "--json"],
    );
    let told = told.json();
    assert_eq!(told["frames"], 4);
    assert!(told["report"].as_str().unwrap().ends_with("report.html"));

    let names: Vec<String> = pictures(&out).into_keys().collect();
    let expected = ["left", "right"]
        .iter()
        .flat_map(|eye| (0..4).map(move |frame| format!("{eye}_{frame:05}.png")));
    assert_eq!(names, expected.collect::<Vec<_>>());
    for name in names {
        let picture = image::open(out.join("frames").join(&name)).unwrap();
        let picture = picture.to_rgb8();
        assert_eq!((picture.width(), picture.height()), (64, 64));
        let lit = picture.pixels().filter(|p| p.0.iter().any(|c| *c > 20));
        assert!(lit.count() > 1000, "{name} is lit");
    }

    let rows = rows(&out);
    assert_eq!(rows.len(), 4);
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(number(row, "frame"), index as f64);
        assert_eq!(number(row, "photons_emitted"), 3000.0);
        assert_eq!(number(row, "photons_dropped"), 0.0);
        assert!(number(row, "photons_stored") > 0.0);
        assert!(number(row, "wall_ms") > 0.0);
        let [left, right] = ["left", "right"].map(|eye| {
            let [left_deg, right_deg] =
                ["left", "right"].map(|side| number(row, &format!("{eye}_fov_{side}_deg")));
            assert!(left_deg < 0.0 && right_deg > 0.0);
            number(row, &format!("{eye}_gaze_azimuth_deg"))
        });
        assert!(left > right, "the eyes converge: {left} and {right}");
        for column in ["photon_tracing_ms", "visible_points_ms", "resolve_ms"] {
            assert!(number(row, column) >= 0.0, "{column}");
        }
    }
    let run: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!(run["program"], "macula");
    assert_eq!(run["complete"], true);
    assert_eq!(run["parameters"]["photon.count"], "3000");
    assert_eq!(run["seed"], 1);
    for key in ["version", "device", "driver", "runtime"] {
        assert!(
            run[key].as_str().is_some_and(|text| !text.is_empty()),
            "{key}"
        );
    }
    for key in ["parameters_sha256", "scene_sha256"] {
        assert_eq!(run[key].as_str().unwrap().len(), 64, "{key}");
    }
    assert!(run["timings_s"]["rendering"].as_f64().unwrap() > 0.0);
    assert!(run["warnings"].is_array());
}

#[test]
fn two_replays_give_the_same_bytes_and_another_seed_gives_others() {
    let home = tempfile::tempdir().unwrap();
    let replayed = |name: &str, more: &[&str]| {
        let out = home.path().join(name);
        let frames = ["--frames", "100..190", "--every", "30"];
        replay(&out, &[&frames, more].concat());
        pictures(&out)
    };
    for technique in ["pm-direct", "pm", "fpm"] {
        let technique = ["--technique", technique];
        let first = replayed("first", &[&technique[..], &["--force"]].concat());
        assert_eq!(first.len(), 8);
        assert!(first == replayed("second", &[&technique[..], &["--force"]].concat()));
        let other = [&technique[..], &["--force", "--set", "random.seed=2"]].concat();
        let other = replayed("other", &other);
        assert!(first.iter().all(|(name, bytes)| other[name] != *bytes));
    }
}

fn degrees_apart(azimuth_deg: f64, elevation_deg: f64, dir: Vec3) -> f64 {
    let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
    let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
    let shown = glam::DVec3::new(cos_e * sin_a, sin_e, -cos_e * cos_a);
    shown.angle_between(dir.as_dvec3()).to_degrees()
}

/// How far the steadied gaze may lag behind the tracker's sample: a sixth of the fovea.
const STEADIED_DEG: f64 = 1.5;

#[test]
fn the_gaze_of_every_frame_is_the_recording_s_and_blinks_and_losses_are_told() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let more = [
        "--frames",
        "0..899",
        "--every",
        "6",
        "--size",
        "8x8",
        "--capture",
        "none",
    ];
    replay(&out, &more);
    let recording = Session::open(&asset("sessions/natural-look")).unwrap();
    let rows = rows(&out);
    assert_eq!(rows.len(), 150);
    let error_deg = |row: &BTreeMap<String, String>, late_ns: i64| {
        let age_ns = (number(row, "gaze_age_ms") * 1e6) as i64;
        let sample_time_ns = number(row, "display_time_ns") as i64 - age_ns;
        // Ages are written to the microsecond.
        let sample = recording.gaze_at(sample_time_ns + 1_000 - late_ns)?;
        sample.combined.map(|ray| {
            let [azimuth, elevation] =
                ["gaze_azimuth_deg", "gaze_elevation_deg"].map(|column| number(row, column));
            degrees_apart(azimuth, elevation, ray.dir())
        })
    };
    let states = |state: &str| rows.iter().filter(|row| row["gaze_state"] == state).count();
    let tracked = rows.iter().filter(|row| row["gaze_state"] == "tracked");
    for row in tracked.clone() {
        let error = error_deg(row, 0).expect("a tracked gaze was recorded");
        assert!(
            error < STEADIED_DEG,
            "frame {}: {error} degrees",
            row["frame"]
        );
        assert!(number(row, "gaze_age_ms") < 11.2);
    }
    let is_off = |error: Option<f64>| error.is_none_or(|deg| deg > STEADIED_DEG);
    let late = tracked.filter(|row| is_off(error_deg(row, 300_000_000)));
    assert!(
        late.count() > 50,
        "a gaze that is a fixation late is noticed"
    );
    // 4.35 to 4.75 s, and blinks at 2.6 and 8.6 s: 6.6% of the samples.
    assert!(
        (120..148).contains(&states("tracked")),
        "{}",
        states("tracked")
    );
    assert_eq!(states("tracked") + states("held"), 150);
    let held: Vec<f64> = rows
        .iter()
        .filter(|row| row["gaze_state"] == "held")
        .map(|row| number(row, "display_time_ns") * 1e-9 - 1.0)
        .collect();
    for (from_s, to_s) in [(2.6, 2.9), (4.35, 4.75), (8.6, 8.9)] {
        let is_within = |time: &f64| (from_s - 0.05..to_s + 0.1).contains(time);
        assert!(held.iter().any(is_within), "held at {from_s} s: {held:?}");
    }
}

#[test]
fn a_range_beyond_the_recording_ends_with_it() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let more = [
        "--frames",
        "895..2000",
        "--every",
        "2",
        "--size",
        "8x8",
        "--capture",
        "exr",
    ];
    replay(&out, &more);
    let times: Vec<f64> = rows(&out)
        .iter()
        .map(|row| number(row, "display_time_ns"))
        .collect();
    let recording = Session::open(&asset("sessions/natural-look")).unwrap();
    let expected = [895, 897, 899].map(|i: usize| recording.frames[i].predicted_display_ns as f64);
    assert_eq!(times, expected);
    let names: Vec<String> = pictures(&out).into_keys().collect();
    assert_eq!(names.len(), 6);
    assert!(names.iter().all(|name| name.ends_with(".exr")));
}

#[test]
fn the_report_of_a_real_replay_opens_in_a_browser_without_a_complaint() {
    let Some(browser) = chromium::browser() else {
        return;
    };
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    replay(&out, &["--frames", "0..60", "--every", "20", "--report"]);
    let page = out.join("report.html");
    let picture_at = |frame: u32| {
        let seen = chromium::visit(browser, &page, &format!("#frame={frame}"), 3000);
        assert_eq!(seen.console, [""; 0]);
        assert!(seen.document.contains("natural-look in cornell"));
        assert!(seen.document.contains("pm-direct"));
        let image = seen.document.split("<img ").nth(1).unwrap();
        let image = image.split('>').next().unwrap().to_owned();
        assert!(image.contains("data:image/jpeg;base64,"), "frame {frame}");
        image
    };
    let [first, last] = [0, 3].map(picture_at);
    assert!(first != last, "each frame has a picture of its own");
    assert!(first == picture_at(0));
}

/// Samples of each pixel, and where in the picture the eye looks.
struct Sampled {
    counts: Vec<u32>,
    gaze_uv: Vec2,
}

impl Sampled {
    /// The middle of the pixels with the most samples.
    fn finest_uv(&self, side: u32) -> Vec2 {
        let most = self.counts.iter().max().unwrap();
        let finest = (0..side * side).filter(|i| self.counts[*i as usize] == *most);
        let places: Vec<Vec2> = finest
            .map(|i| Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32)
            .collect();
        places.iter().sum::<Vec2>() / places.len() as f32
    }
}

#[test]
fn the_headset_shows_what_was_rendered_and_the_fovea_is_where_the_eye_looks() {
    const SIDE: u32 = 64;
    let home = tempfile::tempdir().unwrap();
    let captured = home.path().join("captured");
    xr_sim::configure(xr_sim::Config {
        session: Some(asset("sessions/natural-look")),
        last_frame: Some(899),
        frame_step: 100,
        eye_width: SIDE,
        eye_height: SIDE,
        clock: xr_sim::ClockKind::Virtual,
        capture: Some(xr_sim::Capture {
            folder: captured.clone(),
            format: xr_sim::PictureFormat::Png,
        }),
        ..Default::default()
    })
    .unwrap();
    let entry = Runtime::InProcess(xr_sim::get_instance_proc_addr)
        .entry()
        .unwrap();
    let mut app = XrApp::connect(entry, &XrOptions::default()).unwrap();
    let gpu = Arc::clone(app.gpu());
    let scene = Scene::load(&asset("scenes/cornell.glb")).unwrap();
    let caster = SceneCaster::new(&scene);
    let mut params = Params::default();
    params.photon.count = 2000;
    let technique = technique::find("pm-direct").unwrap();
    let (size, format) = (app.image_size(), app.format());
    assert_eq!(size, [SIDE; 2]);
    let mut renderer =
        FrameRenderer::new(&gpu, &scene, &caster, &params, technique, size, format).unwrap();

    let mut rendered: Vec<[Vec<u8>; 2]> = Vec::new();
    let mut sampled: Vec<Sampled> = Vec::new();
    let stop = std::sync::atomic::AtomicBool::new(false);
    macula::session::run(
        &mut app,
        &mut renderer,
        &stop,
        |input, outcome, renderer| {
            let images = renderer.images().each_ref();
            rendered.push(images.map(|image| png::to_rgb8(&image.read(&gpu).unwrap(), 0.0)));
            for (eye, image) in images.into_iter().enumerate() {
                let sums: Vec<[f32; 4]> = image.sums().read(&gpu, u64::from(SIDE * SIDE)).unwrap();
                let fov = input.local_from_eye[eye].fov;
                sampled.push(Sampled {
                    counts: sums.iter().map(|sum| sum[3] as u32).collect(),
                    gaze_uv: fov.project(outcome.gaze_dir_in_eye[eye]).unwrap(),
                });
            }
            Ok::<_, Infallible>(())
        },
    )
    .unwrap();
    assert_eq!(rendered.len(), 9);

    let shown = |eye: &str, frame: usize| {
        let path = captured.join(format!("{eye}_{frame:05}.png"));
        image::open(path).unwrap().to_rgb8().into_raw()
    };
    let largest_difference = |a: &[u8], b: &[u8]| {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
    };
    for (frame, [left, right]) in rendered.iter().enumerate() {
        let (left_shown, right_shown) = (shown("left", frame), shown("right", frame));
        assert!(largest_difference(left, &left_shown) <= 1, "left {frame}");
        assert!(
            largest_difference(right, &right_shown) <= 1,
            "right {frame}"
        );
        assert!(
            largest_difference(left, &right_shown) > 10,
            "the eyes differ"
        );
    }

    let apart = |sampled: &Sampled, gaze_uv: Vec2| sampled.finest_uv(SIDE).distance(gaze_uv);
    for one in &sampled {
        assert!(
            apart(one, one.gaze_uv) < 0.03,
            "{}",
            apart(one, one.gaze_uv)
        );
        let least = one.counts.iter().min().unwrap();
        assert!(one.counts.iter().max().unwrap() > least);
    }
    let moved = sampled
        .iter()
        .filter(|one| apart(one, Vec2::splat(0.5)) > 0.05);
    assert!(moved.count() > 4, "the fovea does not stay in the middle");
}
