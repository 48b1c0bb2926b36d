//! Reading session folders, whole and damaged.

use std::fs;
use std::path::Path;

use glam::Vec3;

use super::*;

const FRAMES: &str =
    "head_px,predicted_display_ns,head_py,head_pz\n0,1000,0,0\n1,2000,0,0\n3,3000,0,0\n";

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

fn load(files: &[(&str, &str)]) -> Result<Script, ScriptError> {
    Script::load(folder(files).path())
}

/// What is said of a damaged folder.
fn refusal(files: &[(&str, &str)]) -> String {
    load(files).expect_err("damaged").to_string()
}

/// What is said of damage in one more line of the frames, or in another file beside them.
fn frames(line: &str) -> String {
    refusal(&[("frames.csv", &format!("{FRAMES}{line}\n"))])
}
fn beside(name: &str, text: &str) -> String {
    refusal(&[("frames.csv", FRAMES), (name, text)])
}

#[test]
fn the_head_is_interpolated_between_frames_and_held_beyond_them() {
    let script = load(&[("frames.csv", FRAMES)]).expect("sound");
    for (time_ns, x) in [
        (0, 0.0),
        (1000, 0.0),
        (1500, 0.5),
        (2000, 1.0),
        (2500, 2.0),
        (3000, 3.0),
        (9000, 3.0),
    ] {
        let HeadPose {
            local_from_head,
            flags,
        } = script.head(time_ns);
        assert_eq!(
            (local_from_head.position, flags),
            (Vec3::new(x, 0.0, 0.0), TRACKED)
        );
    }
}

#[test]
fn missing_columns_have_their_defaults() {
    let script = load(&[("frames.csv", FRAMES)]).expect("sound");
    let [left, right] = script.eyes(2000);
    let ipd = right.head_from_eye.position.x - left.head_from_eye.position.x;
    assert!((ipd - 0.063).abs() < 1e-6);
    let angle = std::f32::consts::FRAC_PI_4;
    assert_eq!(left.fov, [-angle, angle, angle, -angle]);
    assert_eq!(script.frames()[0].period_ns, DEFAULT_PERIOD_NS);
    assert!(!script.has_gaze());
    assert_eq!(script.pressed(Hand::Left, "trigger", 2000), 0.0);
}

#[test]
fn a_frame_without_a_head_has_it_where_it_was_and_untracked() {
    let frames = "predicted_display_ns,head_px,head_py,head_pz\n1,5,0,0\n2,,,\n";
    let script = load(&[("frames.csv", frames)]).expect("sound");
    let head = script.head(2);
    assert_eq!((head.local_from_head.position.x, head.flags), (5.0, 0));
}

#[test]
fn a_last_line_that_is_cut_is_left_out() {
    for cut in ["4,40", "4,4000,0,0", "4", "4,4000,0,\u{0}"] {
        let script = load(&[("frames.csv", &format!("{FRAMES}{cut}"))]).expect("sound but for it");
        assert_eq!(script.frames().len(), 3, "{cut:?}");
    }
    let whole = load(&[("frames.csv", &format!("{FRAMES}4,4000,0,0\n"))]).expect("sound");
    assert_eq!(whole.frames().len(), 4);
}

#[test]
fn damage_is_told_by_file_line_and_column() {
    let no_column = |text| refusal(&[("frames.csv", text)]);
    let gaze = |line| beside("gaze.csv", &format!("time_ns,valid,dx,dy,dz\n{line}\n"));
    let events = |line| beside("events.csv", &format!("time_ns,event,value\n{line}\n"));
    for (said, parts) in [
        (
            frames("x,4000,0,0"),
            [
                "frames.csv, line 5, column head_px",
                "\"x\" is no finite number",
            ],
        ),
        (
            frames("inf,4000,0,0"),
            ["frames.csv, line 5, column head_px", "is no finite number"],
        ),
        (
            frames("0,4e3,0,0"),
            ["column predicted_display_ns", "is no whole number"],
        ),
        (
            frames("0,3000,0,0"),
            ["column predicted_display_ns", "after the line before"],
        ),
        (
            frames("0,,0,0"),
            ["column predicted_display_ns", "must be given"],
        ),
        (
            frames("0,4000,0"),
            ["frames.csv, line 5", "3 fields where the header has 4"],
        ),
        (
            no_column("a,b\n1,2\n"),
            ["frames.csv", "no column predicted_display_ns"],
        ),
        (
            no_column(""),
            ["frames.csv", "no column predicted_display_ns"],
        ),
        (
            no_column("predicted_display_ns\n"),
            ["frames.csv", "nothing to replay"],
        ),
        (refusal(&[]), ["cannot read", "frames.csv"]),
        (
            gaze("1,2,0,0,-1"),
            ["gaze.csv, line 2, column valid", "neither 0 nor 1"],
        ),
        (
            gaze("1,1,0,0,0"),
            ["gaze.csv, line 2, column dx", "length 0"],
        ),
        (
            beside("gaze.csv", "time_ns,valid\n1,1\n"),
            ["gaze.csv", "no column dx"],
        ),
        (
            events("1,button,press"),
            ["events.csv, line 2, column value", "select_right down"],
        ),
    ] {
        for part in parts {
            assert!(said.contains(part), "{said:?} lacks {part:?}");
        }
    }
    let pose = ["px", "py", "pz", "qx", "qy", "qz", "qw"].map(|name| format!("head_{name}"));
    let no_rotation = format!("predicted_display_ns,{}\n1,0,0,0,0,0,0,0\n", pose.join(","));
    assert!(no_column(&no_rotation).contains("column head_qx"));
    let turned = "predicted_display_ns,l_fov_l,l_fov_r,l_fov_u,l_fov_d\n1,0.5,-0.5,0.5,-0.5\n";
    assert!(no_column(turned).contains("column l_fov_l"));
}

#[test]
fn text_that_is_none_is_refused() {
    let folder = folder(&[]);
    let mut bytes = FRAMES.as_bytes().to_vec();
    bytes.extend(b"\xff\xfe,1,2,3\n");
    fs::write(folder.path().join("frames.csv"), bytes).expect("a file");
    let said = Script::load(folder.path())
        .expect_err("damaged")
        .to_string();
    assert!(said.contains("line 5") && said.contains("UTF-8"), "{said}");
    assert!(Script::load(Path::new("no/such/folder")).is_err());
}

#[test]
fn gaze_out_of_order_is_sorted_and_held() {
    let gaze = "time_ns,valid,dx,dy,dz\n30,1,0,0,-1\n10,1,1,0,0\n20,0,0,0,-1\n";
    let script = load(&[("frames.csv", FRAMES), ("gaze.csv", gaze)]).expect("sound");
    let seen = [9, 10, 25, 30, 50_000_030, 50_000_031].map(|time_ns| {
        script
            .gaze(time_ns)
            .map(|sample| (sample.time_ns, sample.view_from_gaze.is_some()))
    });
    let held = Some((30, true));
    assert_eq!(
        seen,
        [None, Some((10, true)), Some((20, false)), held, held, None]
    );
}
