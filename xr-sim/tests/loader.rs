//! Through the standard loader: a manifest, a configuration file, the loader's own validation layer.

mod common;

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::codes::*;
use common::{FIRST_NS, PERIOD_NS, recording};
use openxr as xr;
use xr_sim::{Capture, ClockKind, Config, PictureFormat, write_manifest};

const VALIDATION: &str = "XR_APILAYER_LUNARG_core_validation";
/// What the layer writes before each complaint's rule.
const COMPLAINT: &str = "VUID-";
/// Set for the process that a test starts anew to have its own environment.
const INNER: &str = "XR_SIM_TEST_INNER";

/// This build's shared library; cargo puts it beside the tests.
fn library() -> PathBuf {
    let name = format!(
        "{}xr_sim{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    std::env::current_exe().unwrap().with_file_name(name)
}

/// A folder with a recording, a configuration and a manifest, and the environment that points at them.
struct Setting(tempfile::TempDir);

impl Setting {
    fn new(frame_count: i64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("session")).unwrap();
        recording(&folder.path().join("session"), frame_count);
        let config = Config {
            session: Some("session".into()),
            capture: Some(Capture {
                folder: "pictures".into(),
                format: PictureFormat::Png,
            }),
            clock: ClockKind::Virtual,
            eye_width: 320,
            eye_height: 320,
            ..Config::default()
        };
        let text = serde_json::to_string(&config).unwrap();
        fs::write(folder.path().join("config.json"), text).unwrap();
        write_manifest(&folder.path().join("manifest.json"), &library()).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn environment(&self, command: &mut Command) {
        command
            .env("XR_RUNTIME_JSON", self.path("manifest.json"))
            .env("XR_SIM_CONFIG", self.path("config.json"))
            .env("XR_CORE_VALIDATION_EXPORT_TYPE", "text")
            .env("XR_CORE_VALIDATION_FILE_NAME", self.path("validation.txt"));
    }

    fn complaints(&self) -> usize {
        let text = fs::read_to_string(self.path("validation.txt")).unwrap_or_default();
        text.matches(COMPLAINT).count()
    }
}

/// Runs a test of this file once more in a process with that environment; its standard error.
fn run_inner(test: &str, environment: impl FnOnce(&mut Command)) -> String {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", test, "--nocapture"])
        .env(INNER, "1");
    environment(&mut command);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success(),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stdout)
    );
    said
}

/// The standard loader, or none, loudly.
fn loader() -> Option<xr::Entry> {
    // SAFETY: the system's loader is what its name says
    let loader = unsafe { xr::Entry::load(&()) }.ok();
    if loader.is_none() {
        eprintln!("SKIPPED: no OpenXR loader here (Debian: libopenxr-loader1)");
    }
    loader
}

/// Makes an instance through the loader with the validation layer, where there is one.
fn validated_instance(entry: &xr::Entry) -> Option<xr::Instance> {
    let layers = entry.enumerate_layers().unwrap();
    if layers.iter().all(|layer| layer.layer_name != VALIDATION) {
        eprintln!("SKIPPED: no core validation layer here (Debian: openxr-layer-corevalidation)");
        return None;
    }
    let mut extensions = xr::ExtensionSet::default();
    extensions.mnd_headless = true;
    let application = xr::ApplicationInfo {
        application_name: "loaded",
        ..Default::default()
    };
    Some(
        entry
            .create_instance(&application, &extensions, &[VALIDATION], &())
            .unwrap(),
    )
}

#[test]
fn the_loader_finds_the_runtime_its_recording_and_nothing_to_complain_of() {
    if std::env::var_os(INNER).is_none() {
        let setting = Setting::new(4);
        run_inner(
            "the_loader_finds_the_runtime_its_recording_and_nothing_to_complain_of",
            |command| setting.environment(command),
        );
        assert_eq!(setting.complaints(), 0);
        return;
    }
    let Some(instance) = loader().as_ref().and_then(validated_instance) else {
        return;
    };
    assert_eq!(instance.properties().unwrap().runtime_name, "xr-sim");
    let system = instance
        .system(xr::FormFactor::HEAD_MOUNTED_DISPLAY)
        .unwrap();
    // SAFETY: a session without graphics needs no handles
    let (session, mut waiter, mut stream) = unsafe {
        instance.create_session::<xr::Headless>(system, &xr::headless::SessionCreateInfo {})
    }
    .unwrap();
    let states = common::poll_states(&instance);
    assert_eq!(states, [xr::SessionState::IDLE, xr::SessionState::READY]);
    session
        .begin(xr::ViewConfigurationType::PRIMARY_STEREO)
        .unwrap();
    for frame in 0..4 {
        let time = waiter.wait().unwrap().predicted_display_time;
        assert_eq!(time.as_nanos(), FIRST_NS + frame * PERIOD_NS);
        stream.begin().unwrap();
        stream
            .end(time, xr::EnvironmentBlendMode::OPAQUE, &[])
            .unwrap();
    }
    assert_eq!(
        common::poll_states(&instance).last(),
        Some(&xr::SessionState::STOPPING)
    );
    session.end().unwrap();
}

#[test]
fn the_validation_layer_does_complain_where_there_is_cause() {
    if std::env::var_os(INNER).is_none() {
        let setting = Setting::new(4);
        let said = run_inner(
            "the_validation_layer_does_complain_where_there_is_cause",
            |command| setting.environment(command),
        );
        assert!(said.contains("SKIPPED") || setting.complaints() > 0);
        return;
    }
    let Some(instance) = loader().as_ref().and_then(validated_instance) else {
        return;
    };
    let info = mistyped!(SystemGetInfo);
    let get_system = instance.fp().get_system;
    // SAFETY: a structure of the right size, of the wrong type on purpose
    let code = unsafe { get_system(instance.as_raw(), &info, &mut Default::default()) };
    assert_eq!(code, INVALID);
}

#[test]
fn what_is_wrong_with_the_configuration_is_told() {
    if std::env::var_os(INNER).is_none() {
        let setting = Setting::new(4);
        let frames = setting.path("session/frames.csv");
        let damaged = fs::read_to_string(&frames)
            .unwrap()
            .replacen(",15,", ",fifteen,", 1);
        fs::write(&frames, damaged).unwrap();
        let said = run_inner("what_is_wrong_with_the_configuration_is_told", |command| {
            setting.environment(command);
        });
        let expected = "frames.csv, line 2, column head_flags: \"fifteen\"";
        assert!(
            said.contains("SKIPPED") || said.contains(expected),
            "{said}"
        );
        return;
    }
    let Some(entry) = loader() else { return };
    let made = entry.create_instance(
        &xr::ApplicationInfo {
            application_name: "loaded",
            ..Default::default()
        },
        &xr::ExtensionSet::default(),
        &[],
        &(),
    );
    assert!(made.is_err());
}

/// Runs Debian's `hello_xr` until it ends by itself; what it said. None, loudly, where it can't run.
fn hello_xr(setting: &Setting) -> Option<String> {
    let log = setting.path("hello_xr.txt");
    let mut command = Command::new("hello_xr");
    command
        .args(["-g", "Vulkan2"])
        .env("XR_ENABLE_API_LAYERS", VALIDATION)
        .stdin(Stdio::piped())
        .stdout(fs::File::create(&log).unwrap())
        .stderr(fs::File::create(setting.path("errors.txt")).unwrap());
    setting.environment(&mut command);
    let Ok(mut child) = command.spawn() else {
        eprintln!("SKIPPED: no hello_xr here (Debian: libopenxr-utils)");
        return None;
    };
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break Some(status);
        }
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    let said = read(&log) + &read(&setting.path("errors.txt"));
    assert!(
        status.is_some_and(|status| status.success()),
        "{status:?}\n{said}"
    );
    Some(said)
}

fn read(path: &Path) -> String {
    let mut bytes = Vec::new();
    fs::File::open(path)
        .unwrap()
        .read_to_end(&mut bytes)
        .unwrap();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn a_standard_program_runs_to_focus_and_ends_with_the_recording() {
    let setting = Setting::new(6);
    let Some(said) = hello_xr(&setting) else {
        return;
    };
    if said.contains("VK_ERROR") || said.contains("no Vulkan device") {
        eprintln!("SKIPPED: no Vulkan device here");
        return;
    }
    for state in [
        "READY",
        "SYNCHRONIZED",
        "VISIBLE",
        "FOCUSED",
        "STOPPING",
        "IDLE",
        "EXITING",
    ] {
        assert!(
            said.contains(&format!("->XR_SESSION_STATE_{state}")),
            "{state} lacks in\n{said}"
        );
    }
    assert_eq!(setting.complaints(), 0);
    assert!(
        !said.contains(COMPLAINT) && !said.contains("][Error"),
        "{said}"
    );
    let pictures = fs::read_dir(setting.path("pictures")).unwrap().count();
    assert_eq!(pictures, 12, "two eyes of six frames");
    let picture = |name: &str| {
        image::open(setting.path("pictures").join(name))
            .unwrap()
            .to_rgb8()
    };
    let [left, right] = [picture("left_00005.png"), picture("right_00005.png")];
    assert_eq!(left.dimensions(), (320, 320));
    let has = |color: [u8; 3]| left.pixels().any(|pixel| pixel.0 == color);
    // the program's cubes have pure faces before a slate grey
    assert!(has([255, 0, 0]) && has([0, 255, 0]) && has([0, 0, 255]));
    assert!(left != right, "the eyes see from two places");
}
