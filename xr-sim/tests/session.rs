//! The life of sessions, spaces and input, without a display.

mod common;

use std::time::{Duration, Instant};

use common::headless::Headless;
use common::*;
use openxr as xr;
use xr_sim::{ClockKind, Config, configure};

#[test]
fn a_headless_session_is_focused_once_begun_and_ends_with_its_script() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 3);
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_1);
    assert_eq!(
        app.events(),
        ["IDLE", "READY", "SYNCHRONIZED", "VISIBLE", "FOCUSED"]
    );
    app.frame();
    assert_eq!(
        app.events(),
        ["profile"],
        "profiles are told when actions are synchronised"
    );
    app.frame();
    assert_eq!(app.events(), [""; 0]);
    app.frame();
    assert_eq!(app.events(), ["VISIBLE", "SYNCHRONIZED", "STOPPING"]);
    app.session.end().unwrap();
    assert_eq!(app.events(), ["IDLE", "EXITING"]);
}

#[test]
fn an_application_may_ask_to_leave() {
    let _turn = turn();
    configure(config()).unwrap();
    let mut app = Headless::new(V1_0);
    app.frame();
    app.events();
    app.session.request_exit().unwrap();
    assert_eq!(app.events(), ["VISIBLE", "SYNCHRONIZED", "STOPPING"]);
    app.session.end().unwrap();
    assert_eq!(app.events(), ["IDLE", "EXITING"]);
}

#[test]
fn buttons_are_pressed_and_released_as_recorded() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 6);
    let events = format!(
        "time_ns,event,trial,value\n{},button,,select_right down\n{},note,,anything\n{},button,,select_right up\n\
         {},button,,trigger_left 0.25\n",
        frame_ns(1) - 1,
        frame_ns(2),
        frame_ns(3),
        frame_ns(4),
    );
    std::fs::write(folder.path().join("events.csv"), events).unwrap();
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    let [left, right] = ["/user/hand/left", "/user/hand/right"]
        .map(|hand| app.instance.string_to_path(hand).unwrap());
    let mut seen = Vec::new();
    for _ in 0..6 {
        app.frame();
        let both = app.select.state(&app.session, xr::Path::NULL).unwrap();
        let on_right = app.select.state(&app.session, right).unwrap();
        let on_left = app.select.state(&app.session, left).unwrap();
        assert!(both.is_active && on_right.is_active && on_left.is_active);
        assert!(!on_left.current_state);
        assert_eq!(both.current_state, on_right.current_state);
        let trigger = app.trigger.state(&app.session, left).unwrap().current_state;
        seen.push((both.current_state, both.changed_since_last_sync, trigger));
        if both.changed_since_last_sync {
            assert!(both.last_change_time.as_nanos() > 0);
        }
    }
    let expected = [
        (false, false, 0.0),
        (true, true, 0.0),
        (true, false, 0.0),
        (false, true, 0.0),
        (false, false, 0.25),
        (false, false, 0.25),
    ];
    assert_eq!(seen, expected);
    assert_eq!(
        app.profile("/user/hand/left").as_deref(),
        Some("/interaction_profiles/oculus/touch_controller")
    );
    assert_eq!(app.profile("/user/head"), None);
    let sources = app.trigger.bound_sources(&app.session).unwrap();
    assert_eq!(sources.len(), 2);
    let all = xr::InputSourceLocalizedNameFlags::USER_PATH
        | xr::InputSourceLocalizedNameFlags::INTERACTION_PROFILE
        | xr::InputSourceLocalizedNameFlags::COMPONENT;
    let name = app
        .session
        .input_source_localized_name(sources[0], all)
        .unwrap();
    assert_eq!(name, "Left Hand Oculus Touch Controller Trigger");
}

#[test]
fn spaces_stand_where_the_script_has_them() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 5);
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let app = Headless::new(V1_1);
    let reference = |ty| {
        app.session
            .create_reference_space(ty, xr::Posef::IDENTITY)
            .unwrap()
    };
    let types = app.session.enumerate_reference_spaces().unwrap();
    assert_eq!(types.len(), 4);
    let time = xr::Time::from_nanos(frame_ns(2));
    let stage = reference(xr::ReferenceSpaceType::STAGE);
    let floor = reference(xr::ReferenceSpaceType::LOCAL_FLOOR);
    let (view_in_local, velocity) = app.view.relate(&app.local, time).unwrap();
    assert!((view_in_local.pose.position.x - 0.02).abs() < 1e-6);
    // 1 cm and 1 degree a frame, 90 frames a second
    assert!(
        (velocity.linear_velocity.x - 0.9).abs() < 1e-2,
        "{:?}",
        velocity.linear_velocity
    );
    assert!((velocity.angular_velocity.y - 90f32.to_radians()).abs() < 1e-2);
    for standing in [&stage, &floor] {
        let local = app.local.locate(standing, time).unwrap();
        assert!(
            local
                .location_flags
                .contains(xr::SpaceLocationFlags::POSITION_TRACKED)
        );
        assert_eq!(local.pose.position.y, 1.6, "the eyes' height");
        let head = app.view.locate(standing, time).unwrap();
        assert!(
            (head.pose.position.x - 0.02).abs() < 1e-6 && (head.pose.position.y - 1.6).abs() < 1e-6
        );
    }
    // between frames the head moves on evenly
    let between = xr::Time::from_nanos(frame_ns(2) + PERIOD_NS / 2);
    let halfway = app.view.locate(&app.local, between).unwrap();
    assert!((halfway.pose.position.x - 0.025).abs() < 1e-6);
    // there and back again
    let there = app.view.locate(&stage, time).unwrap().pose;
    let back = stage.locate(&app.view, time).unwrap().pose;
    assert!((there.orientation.y + back.orientation.y).abs() < 1e-6);
}

#[test]
fn a_space_has_its_own_pose_in_its_origin() {
    let _turn = turn();
    configure(config()).unwrap();
    let app = Headless::new(V1_0);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // turned left by a quarter, 1 m ahead
    let pose = xr::Posef {
        orientation: xr::Quaternionf {
            x: 0.0,
            y: half,
            z: 0.0,
            w: half,
        },
        position: xr::Vector3f {
            x: 0.0,
            y: 0.0,
            z: -1.0,
        },
    };
    let turned = app
        .session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, pose)
        .unwrap();
    let time = xr::Time::from_nanos(1);
    let local_in_turned = app.local.locate(&turned, time).unwrap().pose;
    let xr::Vector3f { x, y, z } = local_in_turned.position;
    assert!(
        (x + 1.0).abs() < 1e-6 && y.abs() < 1e-6 && z.abs() < 1e-6,
        "{x} {y} {z}"
    );
}

#[test]
fn real_time_is_paced_by_the_period() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 40);
    configure(Config {
        session: Some(folder.path().into()),
        clock: ClockKind::RealTime,
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    app.frame();
    let start = Instant::now();
    let times: Vec<_> = (0..20).map(|_| app.frame().as_nanos()).collect();
    let elapsed = start.elapsed();
    // from one frame's start to that of the twentieth after it: at least 19 periods and a bit of the first
    assert!(
        elapsed >= Duration::from_nanos(19 * PERIOD_NS as u64),
        "{elapsed:?}"
    );
    assert!(
        times
            .windows(2)
            .all(|pair| pair[1] > pair[0] && (pair[1] - pair[0]) % PERIOD_NS == 0)
    );
}

#[test]
fn frames_that_come_too_late_are_skipped_in_real_time() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 1000);
    configure(Config {
        session: Some(folder.path().into()),
        clock: ClockKind::RealTime,
        ..config()
    })
    .unwrap();
    let mut app = Headless::new(V1_0);
    let before = app.frame().as_nanos();
    std::thread::sleep(Duration::from_millis(200));
    let after = app.frame().as_nanos();
    assert!(
        after - before > 17 * PERIOD_NS,
        "{}",
        (after - before) / PERIOD_NS
    );
}

#[test]
fn a_frame_may_be_waited_for_while_another_is_drawn_but_only_once_that_has_begun() {
    let _turn = turn();
    configure(config()).unwrap();
    let mut app = Headless::new(V1_0);
    app.waiter.wait().unwrap();
    let mut waiter = app.waiter;
    let waiting = std::thread::spawn(move || {
        let state = waiter.wait().unwrap();
        (Instant::now(), state.predicted_display_time)
    });
    std::thread::sleep(Duration::from_millis(50));
    assert!(!waiting.is_finished(), "the frame before hasn't begun");
    let begun = Instant::now();
    app.stream.begin().unwrap();
    let (woken, _) = waiting.join().unwrap();
    assert!(woken >= begun);
    let time = xr::Time::from_nanos(FIRST_NS);
    app.stream
        .end(time, xr::EnvironmentBlendMode::OPAQUE, &[])
        .unwrap();
}
