//! Eye gaze: its flags, its sample times, and what becomes of it when the eyes are lost.

mod common;

use common::headless::{Gaze, Headless};
use common::*;
use openxr as xr;
use xr_sim::{Config, configure};

const TRACKED: u64 = 0b1111;

/// The latest sample not after a time.
fn sample_at(time_ns: i64) -> i64 {
    (time_ns - gaze_ns(0)) / 5_000_000
}

fn is_close(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

#[test]
fn each_frame_has_the_latest_sample_with_its_own_time() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 20);
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    assert!(app.supports_eye_gaze());
    let mut blinks = 0;
    for frame in 0..20 {
        let time = app.frame();
        assert_eq!(time.as_nanos(), frame_ns(frame));
        let sample = sample_at(time.as_nanos());
        let Gaze {
            flags,
            position,
            direction,
            sample_time_ns,
        } = app.locate_gaze(&app.view, time);
        assert_eq!(
            sample_time_ns,
            gaze_ns(sample),
            "the sample's true time, not the frame's"
        );
        assert!(
            app.is_gaze_active(),
            "shut eyes leave the tracker where it is"
        );
        if is_blink(sample) {
            blinks += 1;
            assert_eq!(flags, 0, "frame {frame}");
        } else {
            let (x, z) = gaze_direction(sample);
            assert_eq!(flags, TRACKED, "frame {frame}");
            assert!(
                is_close(direction, [x as f32, 0.0, z as f32]),
                "frame {frame}: {direction:?}"
            );
            assert!(is_close(position, [0.0, 0.01, 0.0]));
        }
    }
    assert!((3..8).contains(&blinks), "{blinks} frames of the blink");
}

#[test]
fn the_gaze_in_the_room_is_the_heads_pose_and_the_gaze_in_the_head() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 5);
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    let time = (0..4).map(|_| app.frame()).last().unwrap();
    let gaze = app.locate_gaze(&app.local, time);
    // the head has turned left by 3 degrees, the gaze in it right by a tenth of a degree a sample
    let angle = (3.0 - 0.1 * sample_at(time.as_nanos()) as f32).to_radians();
    assert!(
        is_close(gaze.direction, [-angle.sin(), 0.0, -angle.cos()]),
        "{gaze:?}"
    );
    assert!(is_close(gaze.position, [0.03, 0.01, 0.0]), "{gaze:?}");
}

#[test]
fn gaze_that_stays_away_is_lost_after_50_milliseconds() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 10);
    let last_ns = FIRST_NS + 10_000_000;
    std::fs::write(
        folder.path().join("gaze.csv"),
        format!("time_ns,valid,dx,dy,dz\n{last_ns},1,0,0,-1\n"),
    )
    .unwrap();
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    app.frame();
    let locate = |time_ns| app.locate_gaze(&app.view, xr::Time::from_nanos(time_ns));
    for (time_ns, flags, sample_time_ns) in [
        (last_ns - 1, 0, 0),
        (last_ns, TRACKED, last_ns),
        (last_ns + 50_000_000, TRACKED, last_ns),
        (last_ns + 50_000_001, 0, 0),
    ] {
        let gaze = locate(time_ns);
        assert_eq!(
            (gaze.flags, gaze.sample_time_ns),
            (flags, sample_time_ns),
            "{}",
            time_ns - last_ns
        );
    }
}

#[test]
fn without_an_eye_tracker_bindings_are_taken_and_never_active() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 3);
    let session = Some(folder.path().to_path_buf());
    let is_there = |config| {
        configure(config).unwrap();
        let mut app = Headless::new(V1_0);
        let time = app.frame();
        let is_located = app.locate_gaze(&app.view, time).flags != 0;
        let profile = app.profile("/user/eyes_ext");
        assert_eq!(app.supports_eye_gaze(), app.is_gaze_active());
        assert_eq!(app.supports_eye_gaze(), is_located);
        assert_eq!(app.supports_eye_gaze(), profile.is_some());
        app.supports_eye_gaze()
    };
    assert!(is_there(Config {
        session: session.clone(),
        ..config()
    }));
    assert!(!is_there(Config {
        session: session.clone(),
        eye_gaze: false,
        ..config()
    }));
    std::fs::remove_file(folder.path().join("gaze.csv")).unwrap();
    assert!(
        !is_there(Config {
            session,
            ..config()
        }),
        "nothing was recorded"
    );
    assert!(is_there(config()), "no recording at all: the gaze is ahead");
}
