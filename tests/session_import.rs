//! Other programs' recordings become sessions, or are refused with the reason.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use macula::cli::{self, CliError, Globals};
use macula::gaze::import::{Format, Imported, import};
use macula::gaze::trace::{Session, TraceError};

/// A real recording, or `None` (said loudly) where they are not at hand.
fn real(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/traces/sranipal")
        .join(name);
    if path.is_file() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is not there", path.display());
    None
}

fn imported(path: &Path) -> Imported {
    import(path, None).unwrap()
}

#[derive(Parser)]
struct CommandLine {
    #[command(flatten)]
    session: cli::session::Args,
    #[command(flatten)]
    globals: Globals,
}

fn run(words: &[&str]) -> Result<(), CliError> {
    let words = ["session"].iter().chain(words);
    let line = CommandLine::try_parse_from(words).unwrap();
    cli::session::run(line.session, &line.globals)
}

/// A made-up recording in the format: the head turns about Unity's Y, the eyes against it.
struct Recording {
    lines: usize,
    head_deg_per_s: f64,
    eye_gain: f64,
}

impl Default for Recording {
    fn default() -> Self {
        Self {
            lines: 600,
            head_deg_per_s: 20.0,
            eye_gain: 1.0,
        }
    }
}

const HEADER: &str = "time(100ns);time_stamp(ms);eye_valid_L;eye_valid_R;openness_L;openness_R;pupil_diameter_L(mm);pupil_diameter_R(mm);gaze_origin_L.x(mm);gaze_origin_L.y(mm);gaze_origin_L.z(mm);gaze_origin_R.x(mm);gaze_origin_R.y(mm);gaze_origin_R.z(mm);gaze_direct_L.x;gaze_direct_L.y;gaze_direct_L.z;gaze_direct_R.x;gaze_direct_R.y;gaze_direct_R.z;helmet_pos_x;helmet_pos_y;helmet_pos_z;helmet_rot_x;helmet_rot_y;helmet_rot_z";

impl Recording {
    fn text(&self) -> String {
        let mut text = format!("{HEADER}\r\n\r\n");
        for line in 0..self.lines {
            let time_s = line as f64 / 120.0;
            let frame_s = (time_s * 90.0).floor() / 90.0;
            // Back and forth, a second each way.
            let swing = |t: f64| 1.0 - (t.rem_euclid(2.0) - 1.0).abs();
            let right_deg = self.head_deg_per_s * swing(time_s);
            let head_deg = 100.0 + self.head_deg_per_s * swing(frame_s);
            // SRanipal's +x is left: an eye that turns left, against the head, has a growing x.
            let (x, z) = (self.eye_gain * right_deg).to_radians().sin_cos();
            let ticks = 638_342_802_882_596_202_i64 + (time_s * 1e7) as i64;
            let device_ms = (i32::MAX - 2000).wrapping_add((time_s * 1e3) as i32);
            text += &format!(
                "{ticks};{device_ms};31;31;1;1;3.5;3.4;32;1;-38;-32;1;-38;{x};0;{z};{x};0;{z};1;1.2;0.5;5;{head_deg};0\r\n"
            );
        }
        text
    }

    fn save(&self, folder: &Path) -> PathBuf {
        save(folder, &self.text())
    }
}

fn save(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("recording.csv");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_persons_recording_keeps_its_gaze_and_head() {
    for (name, samples, valid, ipd_mm, yaw_deg) in [
        ("TESTNA01_360VR_Fist3.csv", 1665, 0.98, 70.0, 51.8),
        ("TESTNA05_360VR_Spread7.csv", 1336, 0.955, 66.8, 72.2),
    ] {
        let Some(path) = real(name) else { return };
        let Imported { session, report } = imported(&path);
        let summary = &report.summary;
        println!("{name}: {report:#?}");
        assert_eq!((report.format, report.damaged_lines), (Format::Sranipal, 0));
        assert_eq!(session.gaze.len(), samples);
        assert!((summary.gaze_rate_hz - 120.0).abs() < 1.0);
        assert!((summary.frame_rate_hz - 90.0).abs() < 0.01);
        assert!(summary.gaze_valid_share > valid && summary.gaze_valid_share < 1.0);
        assert!((summary.ipd_m.unwrap() * 1e3 - ipd_mm).abs() < 0.5);
        assert!(summary.head_tracked_share > 0.99);
        // The file's own yaw, without the jump from 180 to -180 degrees.
        let [right, left] = summary.head_yaw_rad.map(f64::to_degrees);
        println!("yaw {right} {left}");
        assert!(((left - right) - yaw_deg).abs() < 1.0, "{}", left - right);
        assert!(summary.head_peak_speed_rad_s.to_degrees() < 300.0);
        assert!(summary.saccades > 10 && summary.blinks >= 1);
        assert!(
            session
                .gaze
                .iter()
                .all(|sample| sample.recv_ns >= Some(sample.time_ns))
        );
        let reflex = summary.reflex.unwrap();
        assert!(
            reflex.correlation > 0.5 && !reflex.contradicts(),
            "{reflex:?}"
        );
    }
}

#[test]
fn the_left_eye_is_on_the_left_and_gaze_points_ahead() {
    let home = tempfile::tempdir().unwrap();
    let Imported { session, .. } = imported(&Recording::default().save(home.path()));
    let [left, right] = session.frames[0].head_from_eyes;
    assert!(
        (left.pose.position_m.x + 0.032).abs() < 1e-6
            && (right.pose.position_m.x - 0.032).abs() < 1e-6
    );
    assert!(
        left.fov.left_rad.abs() > left.fov.right_rad,
        "an eye sees farther outwards than across the nose"
    );
    let sample = session.gaze_at(1_500_000_000).unwrap();
    assert!(sample.eyes[0].ray.unwrap().origin_m().x < 0.0);
    // The head turns right in the first second, so LOCAL yaw falls, and the eyes turn left.
    let head = session.local_from_head_at(1_500_000_000).unwrap();
    assert!((head.orientation * glam::Vec3::NEG_Z).x > 0.1);
    let dir = sample.combined.unwrap().dir();
    assert!(dir.x < -0.1 && dir.z < -0.9, "{dir}");
}

#[test]
fn the_counters_wrap_and_the_repeated_poses_are_not_seen_in_the_session() {
    let home = tempfile::tempdir().unwrap();
    let Imported { session, report } = imported(&Recording::default().save(home.path()));
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    assert_eq!(session.gaze.len(), 600);
    let steps = session
        .gaze
        .windows(2)
        .map(|pair| pair[1].time_ns - pair[0].time_ns);
    assert!(
        steps
            .into_iter()
            .all(|step| (7_900_000..9_100_000).contains(&step))
    );
    // An even turn stays even: every frame turns by the same angle.
    let turns: Vec<f32> = session.frames[10..80]
        .windows(2)
        .map(|pair| {
            let [from, to] =
                [&pair[0], &pair[1]].map(|frame| frame.local_from_head.unwrap().orientation);
            from.angle_between(to).to_degrees() * 90.0
        })
        .collect();
    assert!(
        turns.iter().all(|turn| (turn - 20.0).abs() < 2.0),
        "{turns:?}"
    );
}

#[test]
fn eyes_that_turn_with_the_head_are_warned_of() {
    let home = tempfile::tempdir().unwrap();
    let swapped = Recording {
        eye_gain: -1.0,
        ..Recording::default()
    };
    let report = imported(&swapped.save(home.path())).report;
    assert!(report.summary.reflex.unwrap().correlation < -0.9);
    assert!(
        report
            .warnings
            .iter()
            .any(|warning| warning.contains("swapped")),
        "{:?}",
        report.warnings
    );
    let right = imported(&Recording::default().save(home.path())).report;
    assert!(right.summary.reflex.unwrap().correlation > 0.9);
    let still = Recording {
        head_deg_per_s: 0.0,
        ..Recording::default()
    };
    let report = imported(&still.save(home.path())).report;
    assert_eq!(report.summary.reflex, None);
    assert!(
        report
            .warnings
            .iter()
            .any(|warning| warning.contains("head pose never changes"))
    );
}

#[test]
fn a_damaged_line_is_counted_and_named_and_the_rest_is_kept() {
    let home = tempfile::tempdir().unwrap();
    let mut lines: Vec<String> = Recording::default()
        .text()
        .lines()
        .map(str::to_owned)
        .collect();
    lines[50] = lines[50].replacen(";31;", ";x;", 1);
    lines[60] = "638;5".to_owned();
    lines[70] = lines[69].clone();
    lines[80] = lines[80].replace(";1.2;", ";NaN;");
    let Imported { session, report } = imported(&save(home.path(), &lines.join("\n")));
    // The file's last line has no line break.
    assert_eq!((report.lines, report.damaged_lines), (600, 5));
    assert_eq!(session.gaze.len(), 595);
    let damage = report.damage.join("\n");
    for clue in [
        "line 51, column eye_valid_L: `x`",
        "line 61",
        "line 71, column time(100ns)",
        "line 81, column helmet_pos_y: `NaN`",
        "line 602: cut off",
    ] {
        assert!(damage.contains(clue), "{clue} in {damage}");
    }
    assert!(
        report
            .warnings
            .iter()
            .any(|warning| warning.contains("5 damaged lines"))
    );
}

fn refusal(path: &Path) -> String {
    match import(path, None) {
        Err(error @ TraceError::Unusable { .. }) => error.to_string(),
        other => panic!("{} should be unusable: {other:?}", path.display()),
    }
}

#[test]
fn recordings_that_hold_nothing_are_refused_with_the_reason() {
    if let Some(path) = real("TESTNA10_360VR_Fist3.csv") {
        let reason = refusal(&path);
        assert!(
            reason.contains("0.7%") && reason.contains("head pose never changes"),
            "{reason}"
        );
    }
    if let Some(path) = real("TESTVA03_2D_Spread9.csv") {
        assert!(refusal(&path).contains("no rows"), "{}", refusal(&path));
    }
    let home = tempfile::tempdir().unwrap();
    assert!(refusal(&save(home.path(), "")).contains("no known format"));
    assert!(refusal(&save(home.path(), "a,b\n1,2\n")).contains("sranipal"));
    assert!(refusal(&save(home.path(), &format!("{HEADER}\n"))).contains("no rows"));
    assert!(refusal(&save(home.path(), &format!("{HEADER}\nx\ny\n"))).contains("damaged"));
    let missing = home.path().join("missing.csv");
    assert!(
        import(&missing, None)
            .unwrap_err()
            .to_string()
            .contains("missing.csv")
    );
    let other_columns = save(home.path(), "a;b\n1;2\n");
    let error = import(&other_columns, Some(Format::Sranipal))
        .unwrap_err()
        .to_string();
    assert!(error.contains("no column `time(100ns)`"), "{error}");
}

#[test]
fn the_command_writes_a_session_that_reads_back_and_replaces_one_only_by_force() {
    let home = tempfile::tempdir().unwrap();
    let path = Recording::default().save(home.path());
    let out = home.path().join("out");
    let words = [
        "import",
        path.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    run(&words).unwrap();
    let session = Session::open(&out).unwrap();
    let direct = imported(&path).session;
    assert_eq!(
        (&session.gaze, &session.frames),
        (&direct.gaze, &direct.frames)
    );
    assert_eq!(session.metadata.name.as_deref(), Some("recording"));
    xr_sim::configure(xr_sim::Config {
        session: Some(out.clone()),
        ..xr_sim::Config::default()
    })
    .unwrap();
    assert!(
        session
            .metadata
            .notes
            .iter()
            .any(|note| note.contains("90 Hz"))
    );
    assert!(
        fs::read_to_string(out.join("import.json"))
            .unwrap()
            .contains("file_sha256")
    );
    run(&["info", out.to_str().unwrap()]).unwrap();
    run(&["info", out.to_str().unwrap(), "--json"]).unwrap();

    let refusal = run(&words).unwrap_err();
    assert!(refusal.message.contains("--force"), "{}", refusal.message);
    run(&[&words[..], &["--force"]].concat()).unwrap();
    assert!(Session::open(&out).is_ok());
}

#[test]
fn a_refused_recording_leaves_no_folder_behind() {
    let home = tempfile::tempdir().unwrap();
    let path = save(home.path(), &format!("{HEADER}\n"));
    let out = home.path().join("out");
    run(&[
        "import",
        path.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ])
    .unwrap_err();
    let left: Vec<_> = fs::read_dir(home.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left, ["recording.csv"]);
    let missing = run(&["info", out.to_str().unwrap()]).unwrap_err();
    assert!(
        missing.message.contains("no such folder"),
        "{}",
        missing.message
    );
}
