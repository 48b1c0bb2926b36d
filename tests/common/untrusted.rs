//! Whatever the bytes of a file are, reading it ends in something that can be used, or in an error that names the file: what the fuzz
//! targets (`fuzz/`) and the property tests both run. Each function says whether the bytes were accepted.

use std::fs;
use std::path::Path;

use macula::gaze::Session;
use macula::gaze::events::{EventParams, detect_events};
use macula::gaze::summary::Summary;
use macula::gaze::trace::files;
use macula::params::Params;
use macula::scene::bvh::SceneCaster;
use macula::scene::effects::Effects;
use macula::scene::{LoadLimits, Scene, SceneProblem};

/// Small enough that no input takes long.
const LIMITS: LoadLimits = LoadLimits {
    file_bytes: 1 << 24,
    json_items: 100_000,
    nodes: 10_000,
    vertices: 200_000,
    triangles: 200_000,
    texture_pixels: 1 << 20,
    animation_keys: 100_000,
};

/// The bytes as a scene file called `name`: loaded, and used whole if it loads.
pub fn gltf_scene(bytes: &[u8], name: &str) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let loaded = Scene::load_with(&path, &LIMITS);
    let is_accepted = loaded.is_ok();
    match loaded {
        Ok(scene) => {
            let caster = SceneCaster::new(&scene);
            let pose = scene.pose_at(0.7);
            let (origin, dir) = (scene.bounds.center(), glam::Vec3::new(0.3, -0.8, 0.1));
            caster.first_hit(origin, dir, f32::INFINITY, &pose);
            assert!(scene.static_mesh.positions.iter().all(|p| p.is_finite()));
            assert!(scene.static_mesh.normals.iter().all(|n| n.is_finite()));
            assert!(scene.bounds_over_time().diagonal_m().is_finite());
            Effects::report(&scene, 0.2);
        }
        Err(error) => {
            assert!(error.to_string().contains(name));
            let is_limit = matches!(error.problem, SceneProblem::TooLarge { .. });
            assert!(!is_limit || error.problem.to_string().contains("LoadLimits::"));
        }
    }
    is_accepted
}

/// The bytes as a session folder, its files one after the other under their names as `head` prints them (`==> gaze.csv <==`): opened,
/// and used whole if it opens.
pub fn session_reader(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    for file in [files::METADATA, files::GAZE, files::FRAMES, files::EVENTS] {
        let title = format!("==> {file} <==\n");
        if let Some(start) = place_of(title.as_bytes(), bytes) {
            let rest = &bytes[start + title.len()..];
            let end = place_of(b"==> ", rest).unwrap_or(rest.len());
            fs::write(folder.path().join(file), &rest[..end]).unwrap();
        }
    }
    use_session(folder.path())
}

fn place_of(part: &[u8], whole: &[u8]) -> Option<usize> {
    whole.windows(part.len()).position(|window| window == part)
}

fn use_session(folder: &Path) -> bool {
    let opened = Session::open(folder);
    let is_accepted = opened.is_ok();
    match opened {
        Ok(session) => {
            assert!(session.duration_ns() >= 0);
            let _ = Summary::of(&session);
            detect_events(&session, EventParams::default());
            let mut pairs = session.gaze.windows(2);
            assert!(pairs.all(|pair| pair[0].time_ns < pair[1].time_ns));
            let times = session
                .frames
                .iter()
                .map(|frame| frame.predicted_display_ns);
            for time_ns in times.chain([i64::MIN, 0, i64::MAX]) {
                session.local_from_head_at(time_ns);
                session.gaze_at(time_ns);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    is_accepted
}

/// The bytes as a parameter file: what it sets reads back as itself, and no error is without words.
pub fn parameter_file(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let mut params = Params::default();
    let result = params.set_toml(&text);
    let is_accepted = result.is_ok();
    match result {
        Ok(()) => {
            let mut again = Params::default();
            for (key, value) in params.values() {
                again.set(key, &value).unwrap();
            }
            assert_eq!(params, again);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    is_accepted
}
