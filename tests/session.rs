//! The native session folder: what is written reads back, a crash costs at most the last line, and damage is named.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use macula::fovea::eccentricity_rad;
use macula::gaze::events::{EventKind, EventParams, GazeEvent, detect_events};
use macula::gaze::source::GazeParams;
use macula::gaze::summary::Summary;
use macula::gaze::synthetic::natural_look;
use macula::gaze::trace::{
    ClockPair, EventRecord, FrameGaze, FrameRecord, Metadata, SessionWriter, files, head_flags,
};
use macula::gaze::{EyeSample, GazeRay, GazeSample, GazeSource, GazeState, Session};
use macula::view::{Fov, Pose, View};
use proptest::prelude::*;

fn bundled() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/sessions/natural-look")
}

/// A session with every cell filled once and empty once.
fn small() -> Session {
    let fov = Fov {
        left_rad: -0.87,
        right_rad: 0.75,
        up_rad: 0.8,
        down_rad: -0.85,
    };
    let eye = |x: f32| View {
        pose: Pose {
            position_m: Vec3::new(x, 0.001, -0.002),
            orientation: Quat::from_rotation_y(0.1 * x),
        },
        fov,
    };
    let frame = |frame: u64, full: bool| FrameRecord {
        frame,
        trial: full.then_some(3),
        predicted_display_ns: 2_000_000_000 + frame as i64 * 11_111_111,
        period_ns: full.then_some(11_111_111),
        local_from_head: full.then_some(Pose {
            position_m: Vec3::new(0.1, 1.0 / 3.0, -1e-7),
            orientation: Quat::from_xyzw(0.1, -0.2, 0.3, 0.9).normalize(),
        }),
        head_flags: if full { head_flags::TRACKED } else { 0 },
        head_from_eyes: [eye(-0.0315), eye(0.0315)],
        gaze: full.then_some(FrameGaze {
            sample_time_ns: Some(1_990_000_000),
            dir_in_view: Vec3::new(0.2, -0.1, -1.0).normalize(),
            state: GazeState::Held,
        }),
        cpu_ms: full.then_some(1.25),
        gpu_ms: full.then_some(7.5),
        missed: full.then_some(1),
    };
    let sample = |index: i64, full: bool| {
        let ray =
            GazeRay::new(Vec3::new(0.001, 0.0, 0.02), Vec3::new(0.3, 0.1, -0.8)).filter(|_| full);
        let eye = EyeSample {
            ray,
            openness: full.then_some(0.75),
            pupil_mm: full.then_some(3.3),
        };
        GazeSample {
            time_ns: 2_000_000_000 + 5_000_000 * index,
            recv_ns: full.then_some(2_008_000_000 + 5_000_000 * index),
            combined: ray,
            confidence: full.then_some(0.5),
            eyes: [eye, EyeSample::default()],
        }
    };
    let event = |time_ns: i64, value: &str| EventRecord {
        time_ns,
        event: "button".to_owned(),
        trial: None,
        value: value.to_owned(),
    };
    Session {
        metadata: Metadata {
            name: Some("small".to_owned()),
            clock: vec![ClockPair {
                time_ns: 2_000_000_000,
                utc: "2024-05-01T12:00:00Z".to_owned(),
            }],
            seed: Some(u64::MAX),
            consent: Some(true),
            notes: vec!["a note".to_owned()],
            ..Metadata::default()
        },
        gaze: vec![
            sample(0, true),
            sample(1, false),
            sample(2, true),
            sample(3, true),
        ],
        frames: vec![frame(0, true), frame(1, false), frame(2, true)],
        events: vec![
            event(2_000_000_000, "select_right down"),
            event(2_000_000_000, "a, \"b\""),
            event(2_100_000_000, ""),
        ],
        warnings: Vec::new(),
    }
}

fn saved(session: &Session) -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    session.save(&home.path().join("session")).unwrap();
    home
}

fn message(folder: &Path) -> String {
    Session::open(folder).unwrap_err().to_string()
}

/// A saved session with one piece of text in one of its files replaced.
fn edited(file: &str, edit: impl FnOnce(String) -> String) -> (tempfile::TempDir, PathBuf) {
    let home = saved(&small());
    let folder = home.path().join("session");
    let path = folder.join(file);
    let before = fs::read_to_string(&path).unwrap();
    let after = edit(before.clone());
    assert_ne!(before, after, "the edit must change {file}");
    fs::write(&path, after).unwrap();
    (home, folder)
}

/// Replaces a cell, by line (from 1) and column name.
fn with_cell(table: &str, line: usize, column: &str, value: &str) -> String {
    let mut rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    let index = rows[0].iter().position(|name| *name == column).unwrap();
    rows[line - 1][index] = value;
    rows.iter().map(|row| row.join(",") + "\n").collect()
}

#[test]
fn what_is_written_reads_back_bit_for_bit() {
    let session = small();
    let home = saved(&session);
    assert_eq!(
        Session::open(&home.path().join("session")).unwrap(),
        session
    );
}

#[test]
fn columns_are_found_by_name_and_unknown_ones_are_passed_over() {
    let (_home, folder) = edited(files::GAZE, |table| {
        table
            .lines()
            .map(|line| {
                let mut cells: Vec<&str> = line.split(',').collect();
                cells.reverse();
                format!("extra,{}\r\n", cells.join(","))
            })
            .collect()
    });
    assert_eq!(Session::open(&folder).unwrap().gaze, small().gaze);
}

#[test]
fn cutting_the_samples_anywhere_loses_at_most_the_last_line() {
    let session = small();
    let home = saved(&session);
    let folder = home.path().join("session");
    let whole = fs::read(folder.join(files::GAZE)).unwrap();
    for length in 0..whole.len() {
        fs::write(folder.join(files::GAZE), &whole[..length]).unwrap();
        let cut = Session::open(&folder).unwrap_or_else(|error| panic!("cut at {length}: {error}"));
        let whole_lines = whole[..length]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        assert_eq!(
            cut.gaze,
            session.gaze[..whole_lines.saturating_sub(1)],
            "cut at {length}"
        );
        let mid_line = length > 0 && whole[length - 1] != b'\n';
        let is_told = cut.warnings.iter().any(|warning| {
            warning.contains("cut off") || warning.contains("before its first line")
        });
        assert_eq!(
            is_told,
            mid_line || length == 0,
            "cut at {length}: {:?}",
            cut.warnings
        );
    }
}

#[test]
fn a_bad_cell_is_named_by_file_line_and_column() {
    let samples = [
        (3, "time_ns", "2000000000", "is not later than 2000000000"),
        (3, "time_ns", "-5", "positive"),
        (3, "time_ns", "", "is empty"),
        (3, "valid", "2", "neither 0 nor 1"),
        (2, "dx", "NaN", "not finite"),
        (2, "oz", "inf", "not finite"),
        (2, "dx", "0,3", "cells where"),
        (2, "dx", "abc", "not a number"),
        (2, "dx", "5", "of length 5"),
        (2, "dx", "", "is empty"),
        (4, "l_openness", "1.5", "outside 0 to 1"),
    ];
    let frames = [
        (3, "predicted_display_ns", "1", "is not later than"),
        (2, "head_qw", "3", "a quaternion of length"),
        (2, "head_px", "", "is empty"),
        (3, "head_flags", "15", "calls a head pose valid"),
        (2, "l_fov_r", "-2", "field of view"),
        (2, "r_qx", "", "is empty"),
        (2, "gaze_state", "guessed", "none of tracked"),
        (2, "missed", "-1", "not a whole number"),
    ];
    let cases = samples
        .map(|case| (files::GAZE, case))
        .into_iter()
        .chain(frames.map(|case| (files::FRAMES, case)));
    for (file, (line, column, value, problem)) in cases {
        let (_home, folder) = edited(file, |table| with_cell(&table, line, column, value));
        let message = message(&folder);
        for clue in [file, &format!("line {line}"), problem] {
            assert!(
                message.contains(clue),
                "{column} = {value}: {clue} in `{message}`"
            );
        }
        let names_column = message.contains(column)
            || problem.contains("cells")
            || problem.contains("length")
            || problem.contains("field");
        assert!(names_column, "{column} in `{message}`");
    }
}

#[test]
fn directions_and_quaternions_that_are_nearly_unit_are_normalised() {
    let (_home, folder) = edited(files::GAZE, |table| {
        let table = with_cell(&table, 2, "dx", "0.0");
        let table = with_cell(&table, 2, "dy", "0.005");
        with_cell(&table, 2, "dz", "-1.003")
    });
    let dir = Session::open(&folder).unwrap().gaze[0]
        .combined
        .unwrap()
        .dir();
    assert!((dir.length() - 1.0).abs() < 1e-6, "{dir}");
}

#[test]
fn a_folder_that_is_no_session_is_refused_with_the_reason() {
    let home = tempfile::tempdir().unwrap();
    assert!(message(&home.path().join("nowhere")).contains("no such folder"));
    assert!(message(home.path()).contains("session.json is missing"));
    for file in [files::GAZE, files::FRAMES] {
        let home = saved(&small());
        fs::remove_file(home.path().join("session").join(file)).unwrap();
        assert!(message(&home.path().join("session")).contains(&format!("{file} is missing")));
    }
    for (text, clue) in [
        ("", "EOF"),
        ("[]", "session.json"),
        (r#"{"format":"other","version":1}"#, "`other`"),
        (r#"{"format":"macula-session","version":2}"#, "version is 2"),
        (
            r#"{"format":"macula-session","version":1,"seed":-1}"#,
            "session.json",
        ),
    ] {
        let (_home, folder) = edited(files::METADATA, |_| text.to_owned());
        assert!(
            message(&folder).contains(clue),
            "{clue} in {}",
            message(&folder)
        );
    }
    let (_home, folder) = edited(files::GAZE, |table| table.replacen("valid", "void", 1));
    assert!(message(&folder).contains("no column `valid`"));
}

#[test]
fn events_may_be_missing_and_an_empty_session_says_so() {
    let home = saved(&Session::default());
    let folder = home.path().join("session");
    fs::remove_file(folder.join(files::EVENTS)).unwrap();
    let session = Session::open(&folder).unwrap();
    assert_eq!(
        (
            session.duration_ns(),
            session.gaze_at(5),
            session.local_from_head_at(5)
        ),
        (0, None, None)
    );
    assert_eq!(session.warnings.len(), 2, "{:?}", session.warnings);
    assert_eq!(Summary::of(&session).gaze_rate_hz, 0.0);
}

#[test]
fn a_recorder_keeps_its_folder_readable_whatever_it_is_given() {
    let home = tempfile::tempdir().unwrap();
    let session = small();
    let mut writer = SessionWriter::create(home.path(), &Metadata::default()).unwrap();
    assert!(writer.gaze(&session.gaze[1]).unwrap());
    assert!(
        !writer.gaze(&session.gaze[1]).unwrap(),
        "the same sample again"
    );
    assert!(!writer.gaze(&session.gaze[0]).unwrap(), "an older one");
    let mut frame = session.frames[0].clone();
    frame.local_from_head = Some(Pose {
        orientation: Quat::NAN,
        position_m: Vec3::ZERO,
    });
    frame.gaze = Some(FrameGaze {
        dir_in_view: Vec3::NAN,
        ..frame.gaze.unwrap()
    });
    frame.cpu_ms = Some(f32::INFINITY);
    assert!(writer.frame(&frame).unwrap());
    let mut blind = session.frames[1].clone();
    blind.head_from_eyes[0].fov.left_rad = f32::NAN;
    assert!(!writer.frame(&blind).unwrap());
    for (time_ns, value) in [(50, "two\nlines"), (-3, " kept, ")] {
        let event = EventRecord {
            time_ns,
            value: value.to_owned(),
            ..session.events[0].clone()
        };
        writer.event(&event).unwrap();
    }
    let ended = Metadata {
        name: Some("ended".to_owned()),
        ..Metadata::default()
    };
    writer.write_metadata(&ended).unwrap();
    let back = Session::open(home.path()).unwrap();
    assert_eq!(
        (back.gaze.len(), back.frames.len(), back.metadata),
        (1, 1, ended)
    );
    assert_eq!(
        (
            back.frames[0].local_from_head,
            back.frames[0].gaze,
            back.frames[0].cpu_ms
        ),
        (None, None, None)
    );
    let values: Vec<_> = back
        .events
        .iter()
        .map(|event| (event.time_ns, event.value.as_str()))
        .collect();
    assert_eq!(values, [(50, "two lines"), (50, " kept, ")]);
    assert!(
        SessionWriter::create(home.path(), &Metadata::default()).is_err(),
        "an old session is never written over"
    );
}

#[test]
fn the_head_is_interpolated_between_frames_and_held_beyond() {
    let mut session = small();
    let turned = |deg: f32| {
        Some(Pose {
            position_m: Vec3::new(deg, 0.0, 0.0),
            orientation: Quat::from_rotation_y(deg.to_radians()),
        })
    };
    session.frames[0].local_from_head = turned(0.0);
    session.frames[1].local_from_head = turned(10.0);
    session.frames[2].local_from_head = turned(20.0);
    let yaw_at = |time_ns: i64| {
        let forward = session.local_from_head_at(time_ns).unwrap().orientation * Vec3::NEG_Z;
        (-forward.x).atan2(-forward.z).to_degrees()
    };
    let start_ns = session.frames[0].predicted_display_ns;
    for (time_ns, yaw_deg) in [
        (0, 0.0),
        (start_ns, 0.0),
        (start_ns + 5_555_555, 5.0),
        (start_ns + 16_666_666, 15.0),
        (i64::MAX, 20.0),
    ] {
        assert!(
            (yaw_at(time_ns) - yaw_deg).abs() < 1e-3,
            "{} at {time_ns}",
            yaw_at(time_ns)
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_damage_makes_the_reader_panic(
        file in prop::sample::select(vec![files::METADATA, files::GAZE, files::FRAMES, files::EVENTS]),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        length in any::<prop::sample::Index>(),
    ) {
        let home = saved(&small());
        let folder = home.path().join("session");
        let mut bytes = fs::read(folder.join(file)).unwrap();
        for (at, byte) in edits {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        bytes.truncate(length.index(bytes.len()) + 1);
        fs::write(folder.join(file), bytes).unwrap();
        if let Ok(session) = Session::open(&folder) {
            let _ = Summary::of(&session);
        }
    }

    #[test]
    fn any_sample_reads_back_as_it_was_written(
        time_ns in 1_i64..i64::MAX, dir: [f32; 3], origin in prop::array::uniform3(-1e3_f32..1e3), openness in 0.0_f32..=1.0,
    ) {
        let home = tempfile::tempdir().unwrap();
        let sample = GazeSample {
            eyes: [EyeSample { openness: Some(openness), ..EyeSample::default() }; 2],
            ..GazeSample::combined(time_ns, GazeRay::new(Vec3::from_array(origin), Vec3::from_array(dir)))
        };
        SessionWriter::create(home.path(), &Metadata::default()).unwrap().gaze(&sample).unwrap();
        prop_assert_eq!(Session::open(home.path()).unwrap().gaze, vec![sample]);
    }
}

/// Whether two tables are equal but for the last digit of numbers, which another machine's sine may round differently.
fn same_table(one: &str, other: &str) -> bool {
    let last_digit = 2.1e-6;
    let same_cell = |(one, other): (&str, &str)| {
        one == other
            || matches!((one.parse::<f64>(), other.parse::<f64>()), (Ok(a), Ok(b)) if (a - b).abs() <= last_digit)
    };
    let cells = |text: &str| {
        text.lines()
            .map(|line| line.split(',').count())
            .collect::<Vec<_>>()
    };
    let all_cells = |text: &str| {
        text.lines()
            .flat_map(|line| line.split(','))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let (a, b) = (all_cells(one), all_cells(other));
    cells(one) == cells(other) && a.iter().zip(&b).all(|(a, b)| same_cell((a, b)))
}

#[test]
fn the_bundled_session_is_what_its_generator_makes() {
    let home = saved(&natural_look());
    for file in [files::METADATA, files::GAZE, files::FRAMES, files::EVENTS] {
        let [made, kept] = [home.path().join("session"), bundled()]
            .map(|folder| fs::read_to_string(folder.join(file)).unwrap());
        assert!(
            same_table(&made, &kept),
            "{file} differs; run `cargo run --example make_session`"
        );
    }
    let kept = fs::read_to_string(bundled().join(files::GAZE)).unwrap();
    assert!(
        !same_table(&kept, &with_cell(&kept, 500, "dx", "0.5")),
        "a changed cell must show"
    );
}

fn count(events: &[GazeEvent], kind: EventKind) -> usize {
    events.iter().filter(|event| event.kind == kind).count()
}

#[test]
fn the_bundled_session_holds_ten_seconds_of_natural_look() {
    let session = Session::open(&bundled()).unwrap();
    assert!(session.warnings.is_empty(), "{:?}", session.warnings);
    let summary = Summary::of(&session);
    println!("{summary:#?}");
    assert_eq!((summary.frames, summary.gaze_samples), (900, 2000));
    assert!((summary.duration_s - 10.0).abs() < 0.02);
    assert!(
        (summary.frame_rate_hz - 90.0).abs() < 0.01 && (summary.gaze_rate_hz - 200.0).abs() < 0.01
    );
    assert_eq!(
        (
            summary.saccades,
            summary.pursuits,
            summary.blinks,
            summary.losses
        ),
        (19, 1, 2, 1)
    );
    assert!(
        (15..=25).contains(&summary.fixations),
        "{}",
        summary.fixations
    );
    assert!((0.90..0.96).contains(&summary.gaze_valid_share));
    assert!((summary.ipd_m.unwrap() - 0.063).abs() < 1e-6);
    let [right_deg, left_deg] = summary.head_yaw_rad.map(f64::to_degrees);
    assert!(
        -25.0 < right_deg && right_deg < -10.0 && 10.0 < left_deg && left_deg < 25.0,
        "{right_deg} {left_deg}"
    );
    assert!(
        (0.01..0.06).contains(&summary.head_reach_m),
        "{}",
        summary.head_reach_m
    );
    // The eyes compensate exactly, but for the pursuit, in which they lead the head.
    let reflex = summary.reflex.unwrap();
    assert!(
        reflex.correlation > 0.8 && (0.8..1.2).contains(&reflex.gain),
        "{reflex:?}"
    );
}

#[test]
fn its_events_are_where_its_script_puts_them() {
    let session = Session::open(&bundled()).unwrap();
    let events = detect_events(&session, EventParams::default());
    let start_ns = session.frames[0].predicted_display_ns;
    let found = |kind: EventKind| -> Vec<(f64, f64)> {
        let seconds = |time_ns: i64| (time_ns - start_ns) as f64 * 1e-9;
        let events = events.iter().filter(|event| event.kind == kind);
        events
            .map(|event| (seconds(event.start_ns), seconds(event.end_ns)))
            .collect()
    };
    let near = |(start_s, end_s): (f64, f64), from_s: f64, to_s: f64| {
        (start_s - from_s).abs() < 0.08 && (end_s - to_s).abs() < 0.08
    };
    let blinks = found(EventKind::Blink);
    assert!(
        near(blinks[0], 2.59, 2.85) && near(blinks[1], 8.61, 8.87),
        "{blinks:?}"
    );
    assert!(
        near(found(EventKind::Loss)[0], 4.30, 4.80),
        "{:?}",
        found(EventKind::Loss)
    );
    assert!(
        near(found(EventKind::Pursuit)[0], 5.94, 7.75),
        "{:?}",
        found(EventKind::Pursuit)
    );
    // On the main sequence, larger saccades are faster (Bahill, Clark and Stark 1975: 10 degrees at 300 to 500 per second).
    let saccades: Vec<_> = events
        .iter()
        .filter(|event| event.kind == EventKind::Saccade)
        .collect();
    for saccade in &saccades {
        let (deg, deg_per_s) = (
            saccade.amplitude_rad.to_degrees(),
            saccade.peak_speed_rad_s.to_degrees(),
        );
        assert!(
            (15.0 * deg..70.0 * deg).contains(&deg_per_s) && deg_per_s < 700.0,
            "{deg} at {deg_per_s}"
        );
    }
    let fixations = events
        .iter()
        .filter(|event| event.kind == EventKind::Fixation);
    assert!(
        fixations
            .into_iter()
            .all(|event| event.peak_speed_rad_s.to_degrees() < 100.0)
    );
    // Without the loss there is none: the detector does not make it up.
    let mut unbroken = session.clone();
    for index in 1..unbroken.gaze.len() {
        if unbroken.gaze[index].combined.is_none() {
            unbroken.gaze[index].combined = unbroken.gaze[index - 1].combined;
            unbroken.gaze[index].eyes = unbroken.gaze[index - 1].eyes;
        }
    }
    let events = detect_events(&unbroken, EventParams::default());
    assert_eq!(count(&events, EventKind::Loss), 0);
}

#[test]
fn the_gaze_source_follows_it_and_holds_through_blinks_and_loss() {
    let session = natural_look();
    let mut source = GazeSource::replay(GazeParams::default());
    let start_ns = session.frames[0].predicted_display_ns;
    let mut held_s = Vec::new();
    for frame in &session.frames {
        let display_ns = frame.predicted_display_ns;
        let newest = session.gaze_at(display_ns - 20_000_000);
        let reading = source.update(display_ns, newest);
        assert_eq!(
            reading.widening_rad, 0.0,
            "nothing here lasts long enough to widen the fovea"
        );
        match reading.state {
            GazeState::Replay => {
                let raw = newest.unwrap().combined.unwrap();
                let moved_deg = eccentricity_rad(reading.ray.dir(), raw.dir()).to_degrees();
                assert!(
                    moved_deg < 1.2,
                    "the filter moved the gaze by {moved_deg} at {display_ns}"
                );
            }
            GazeState::Held => held_s.push((display_ns - start_ns) as f64 * 1e-9),
            state => assert_eq!((state, frame.frame), (GazeState::Fallback, 0)),
        }
    }
    let in_script = |time_s: &f64| {
        [2.6..3.0, 4.35..4.85, 8.62..9.0]
            .iter()
            .any(|gap| gap.contains(time_s))
    };
    assert!(held_s.iter().all(in_script), "{held_s:?}");
    assert!(held_s.len() > 60, "{} of about 80 frames", held_s.len());
}

#[test]
fn the_simulated_headset_replays_the_same_folders() {
    let configure = |folder: &Path| {
        xr_sim::configure(xr_sim::Config {
            session: Some(folder.to_owned()),
            ..xr_sim::Config::default()
        })
    };
    configure(&bundled()).unwrap();
    let home = saved(&natural_look());
    let folder = home.path().join("session");
    configure(&folder).unwrap();
    let table = fs::read_to_string(folder.join(files::FRAMES)).unwrap();
    fs::write(
        folder.join(files::FRAMES),
        with_cell(&table, 2, "head_px", "NaN"),
    )
    .unwrap();
    assert!(configure(&folder).is_err() && Session::open(&folder).is_err());
}

#[test]
fn its_pupils_eyes_and_view_are_those_of_a_person_in_a_headset() {
    let session = natural_look();
    for sample in &session.gaze {
        let [left, right] = sample.eyes;
        assert_eq!(
            sample.combined.is_some(),
            left.ray.is_some() && right.ray.is_some()
        );
        let (Some(left), Some(right)) = (left.ray, right.ray) else {
            continue;
        };
        let vergence_deg =
            (left.dir().x.atan2(-left.dir().z) - right.dir().x.atan2(-right.dir().z)).to_degrees();
        assert!((1.0..4.0).contains(&vergence_deg), "{vergence_deg}");
        assert!(sample.combined.unwrap().dir().z < -0.6, "within the view");
        assert!(
            sample
                .eyes
                .iter()
                .all(|eye| (2.0..6.0).contains(&eye.pupil_mm.unwrap()))
        );
    }
    let lids = session.gaze.iter().filter_map(GazeSample::min_openness);
    assert_eq!(lids.fold(1.0, f32::min), 0.0);
    for frame in &session.frames {
        assert_eq!(frame.head_flags, head_flags::TRACKED);
        let [left, right] = frame.head_from_eyes;
        assert_eq!(left.fov.left_rad, -right.fov.right_rad);
        assert!(left.fov.left_rad < -left.fov.right_rad);
        let gaze = frame.gaze.unwrap();
        assert!(matches!(gaze.state, GazeState::Tracked | GazeState::Held));
        let age_ms = (frame.predicted_display_ns - gaze.sample_time_ns.unwrap()) as f64 * 1e-6;
        assert!(
            age_ms
                < if gaze.state == GazeState::Tracked {
                    31.0
                } else {
                    450.0
                },
            "{age_ms}"
        );
    }
}
