//! The application's session against the simulated runtime: what the script says arrives, what is drawn is shown, and it ends in order.

mod loader;
mod script;

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{Quat, Vec3};
use macula::view::Pose;
use macula::xr::{
    EndReason, EyeView, Frame, GazeReading, Hand, Runtime, Step, TrackedPose, XrApp, XrError,
    XrOptions,
};

use script::{
    EYE_SIZE, EYES_SHUT, FOV_RAD, FRAME_COUNT, GAZE_PERIOD_NS, HEAD_LOST, IPD_M, PERIOD_NS,
    PRESSED, START_NS, display_time_ns, gaze_dir_in_view, gaze_sample_at, head, write_session,
};

/// The simulated runtime has one configuration a process: one run at a time.
fn alone() -> MutexGuard<'static, ()> {
    static RUN: Mutex<()> = Mutex::new(());
    RUN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn config(session: &Path) -> xr_sim::Config {
    xr_sim::Config {
        session: Some(session.into()),
        eye_width: EYE_SIZE[0],
        eye_height: EYE_SIZE[1],
        clock: xr_sim::ClockKind::Virtual,
        ..Default::default()
    }
}

fn connect(config: xr_sim::Config) -> XrApp {
    xr_sim::configure(config).expect("the session folder is right");
    let entry = Runtime::InProcess(xr_sim::get_instance_proc_addr)
        .entry()
        .expect("an entry");
    XrApp::connect(entry, &XrOptions::default()).expect("a session")
}

/// sRGB bytes that tell eye and frame apart.
fn color(frame: usize, eye: usize) -> [u8; 3] {
    let ramp = 5 * frame as u8;
    [[ramp, 40, 200], [255 - ramp, 90, 10]][eye]
}

/// IEC 61966-2-1.
fn linear(srgb: u8) -> f64 {
    let s = f64::from(srgb) / 255.0;
    if s <= 0.04045 {
        s / 12.92
    } else {
        ((s + 0.055) / 1.055).powf(2.4)
    }
}

fn clear_both_eyes(app: &XrApp, frame: &Frame) {
    let gpu = app.gpu();
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    for (eye, view) in frame.targets().into_iter().flatten().enumerate() {
        let [r, g, b] = color(frame.index as usize, eye).map(linear);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
    }
    gpu.queue.submit([encoder.finish()]);
}

/// A frame as it arrived.
struct Seen {
    display_time_ns: i64,
    period_ns: i64,
    rendered: bool,
    head: TrackedPose,
    views: [EyeView; 2],
    gaze: GazeReading,
    buttons: Vec<(String, Hand)>,
}

impl From<&Frame> for Seen {
    fn from(frame: &Frame) -> Self {
        Self {
            display_time_ns: frame.predicted_display_time_ns,
            period_ns: frame.predicted_period_ns,
            rendered: frame.targets().is_some(),
            head: frame.head,
            views: frame.views,
            gaze: frame.gaze,
            buttons: frame
                .buttons
                .iter()
                .map(|b| (b.to_string(), b.hand))
                .collect(),
        }
    }
}

/// Draws every frame until the session ends. `skip` says which frames are dropped instead of submitted.
fn play(app: &mut XrApp, skip: impl Fn(usize) -> bool) -> (Vec<Seen>, EndReason) {
    let mut seen = Vec::new();
    // A session that never ends must not hang the test.
    for _ in 0..100 * FRAME_COUNT {
        match app.next_frame().expect("the session goes on") {
            Step::Frame(frame) => {
                seen.push(Seen::from(&*frame));
                clear_both_eyes(app, &frame);
                if !skip(frame.index as usize) {
                    app.submit(*frame).expect("the frame is taken");
                }
            }
            Step::Idle => {}
            Step::Ended(reason) => return (seen, reason),
        }
    }
    panic!("the session did not end with its script");
}

fn session_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_session(folder.path());
    folder
}

#[test]
fn times_poses_gaze_and_buttons_arrive_as_the_script_says() {
    let _alone = alone();
    let folder = session_folder();
    let mut app = connect(config(folder.path()));
    assert!(app.headset().supports_eye_gaze);
    assert_eq!(app.image_size(), EYE_SIZE);
    let (seen, reason) = play(&mut app, |_| false);
    assert_eq!(reason, EndReason::Exit);
    assert_eq!(seen.len(), FRAME_COUNT);

    for (i, frame) in seen.iter().enumerate() {
        assert_eq!(frame.display_time_ns, display_time_ns(i), "frame {i}");
        assert_eq!(frame.period_ns, PERIOD_NS, "frame {i}");
        assert!(frame.rendered, "frame {i}");
        check_head_and_eyes(i, frame);
        check_gaze(i, frame);
    }
    let pressed: Vec<_> = seen
        .iter()
        .enumerate()
        .flat_map(|(i, f)| f.buttons.iter().map(move |b| (i, b.0.as_str(), b.1)))
        .collect();
    assert_eq!(
        pressed,
        [
            (PRESSED.start, "select_right down", Hand::Right),
            (PRESSED.end, "select_right up", Hand::Right)
        ]
    );
}

fn assert_close(got: Pose, want: Pose, what: &str, frame: usize) {
    let angle = got.orientation.angle_between(want.orientation);
    let distance = got.position_m.distance(want.position_m);
    assert!(
        angle < 1e-3 && distance < 1e-5,
        "{what} of frame {frame}: {got:?}, not {want:?}"
    );
}

fn check_head_and_eyes(i: usize, frame: &Seen) {
    let lost = HEAD_LOST.contains(&i);
    assert_eq!(frame.head.flags.is_valid(), !lost, "frame {i}");
    assert_eq!(frame.head.flags.is_tracked(), !lost, "frame {i}");
    // A lost head stays where it was last seen.
    let held = if lost { HEAD_LOST.start - 1 } else { i };
    assert_close(frame.head.pose, head(held), "head", i);
    for (eye, side) in [-1.0, 1.0].into_iter().enumerate() {
        let head_from_eye = Pose {
            orientation: Quat::IDENTITY,
            position_m: Vec3::X * side * IPD_M / 2.0,
        };
        let EyeView { view, flags } = frame.views[eye];
        assert_close(view.pose, head(held).compose(head_from_eye), "eye", i);
        assert_eq!(flags.is_valid(), !lost, "frame {i}");
        let fov = [
            view.fov.left_rad,
            view.fov.right_rad,
            view.fov.up_rad,
            view.fov.down_rad,
        ];
        assert_eq!(fov, FOV_RAD[eye], "frame {i}");
    }
}

fn check_gaze(i: usize, frame: &Seen) {
    let sample = gaze_sample_at(display_time_ns(i));
    let open = !EYES_SHUT.contains(&sample);
    assert!(frame.gaze.active, "frame {i}");
    assert_eq!(frame.gaze.is_tracked(), open, "frame {i}");
    assert_eq!(frame.gaze.ray_in_view().is_some(), open, "frame {i}");
    assert_eq!(
        frame.gaze.ray_in_local().is_some(),
        open && !HEAD_LOST.contains(&i),
        "frame {i}"
    );
    if let Some(ray) = frame.gaze.ray_in_view() {
        assert!(
            ray.dir.abs_diff_eq(gaze_dir_in_view(sample), 1e-5),
            "frame {i}"
        );
        let sampled_ns = START_NS + sample as i64 * GAZE_PERIOD_NS;
        assert_eq!(frame.gaze.sample_time_ns, Some(sampled_ns), "frame {i}");
    }
    if let Some(ray) = frame.gaze.ray_in_local() {
        let dir_in_local = head(i).orientation * gaze_dir_in_view(sample);
        assert!(ray.dir.abs_diff_eq(dir_in_local, 1e-5), "frame {i}");
        assert!(
            ray.origin_m.abs_diff_eq(head(i).position_m, 1e-5),
            "frame {i}"
        );
    }
}

#[test]
fn each_eye_is_shown_what_was_drawn_for_it() {
    let _alone = alone();
    let folder = session_folder();
    let pictures = folder.path().join("pictures");
    let capture = xr_sim::Capture {
        folder: pictures.clone(),
        format: xr_sim::PictureFormat::Png,
    };
    let mut app = connect(xr_sim::Config {
        capture: Some(capture),
        ..config(folder.path())
    });
    play(&mut app, |_| false);
    drop(app);
    for frame in 0..FRAME_COUNT {
        for eye in 0..2 {
            let picture = picture(&pictures, frame, eye);
            assert!(
                worst_difference(&picture, color(frame, eye)) <= 1,
                "frame {frame}, eye {eye}"
            );
            // Were eyes or frames swapped, this would be seen.
            assert!(
                worst_difference(&picture, color(frame, 1 - eye)) > 10,
                "frame {frame}"
            );
            assert!(
                worst_difference(&picture, color(frame + 1, eye)) > 3,
                "frame {frame}"
            );
        }
    }
}

fn picture(folder: &Path, frame: usize, eye: usize) -> image::RgbImage {
    let path = folder.join(format!("{}_{frame:05}.png", ["left", "right"][eye]));
    let picture = image::open(&path)
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
        .to_rgb8();
    assert_eq!(picture.dimensions(), (EYE_SIZE[0], EYE_SIZE[1]));
    picture
}

fn worst_difference(picture: &image::RgbImage, color: [u8; 3]) -> u8 {
    let differences = picture
        .pixels()
        .flat_map(|pixel| (0..3).map(|c| pixel[c].abs_diff(color[c])));
    differences.max().unwrap_or(u8::MAX)
}

#[test]
fn a_dropped_frame_does_not_hold_up_the_session() {
    let _alone = alone();
    let folder = session_folder();
    let pictures = folder.path().join("pictures");
    let capture = xr_sim::Capture {
        folder: pictures.clone(),
        format: xr_sim::PictureFormat::Png,
    };
    let mut app = connect(xr_sim::Config {
        capture: Some(capture),
        ..config(folder.path())
    });
    let (seen, reason) = play(&mut app, |frame| frame % 3 == 1);
    drop(app);
    assert_eq!(reason, EndReason::Exit);
    assert_eq!(seen.len(), FRAME_COUNT);
    assert!(worst_difference(&picture(&pictures, 3, 0), color(3, 0)) <= 1);
}

#[test]
fn a_frame_is_submitted_once_and_before_the_next() {
    let _alone = alone();
    let folder = session_folder();
    let mut app = connect(config(folder.path()));
    let mut next = || loop {
        match app.next_frame().expect("the session goes on") {
            Step::Frame(frame) => return frame,
            Step::Idle => {}
            Step::Ended(reason) => panic!("ended: {reason:?}"),
        }
    };
    let (late, current) = (next(), next());
    let error = app.submit(*late).expect_err("the frame is over");
    assert!(
        matches!(error, XrError::StaleFrame { submitted: 0 }),
        "{error}"
    );
    app.submit(*current).expect("the frame in work is taken");
}

#[test]
fn asking_to_exit_ends_the_session_and_another_can_follow() {
    let _alone = alone();
    let folder = session_folder();
    for _ in 0..2 {
        let mut app = connect(config(folder.path()));
        let mut frames = 0;
        let reason = loop {
            match app.next_frame().expect("the session goes on") {
                Step::Frame(frame) => {
                    frames += 1;
                    app.submit(*frame).expect("the frame is taken");
                    if frames == 5 {
                        app.request_exit().expect("the wish is heard");
                    }
                }
                Step::Idle => {}
                Step::Ended(reason) => break reason,
            }
        };
        assert_eq!(reason, EndReason::Exit);
        assert!(frames < FRAME_COUNT / 2, "it went on for {frames} frames");
        let again = app.next_frame().expect("an ended session stays ended");
        assert!(matches!(again, Step::Ended(EndReason::Exit)));
    }
}

#[test]
fn without_an_eye_tracker_the_session_runs_and_gaze_is_inactive() {
    let _alone = alone();
    let folder = session_folder();
    let mut app = connect(xr_sim::Config {
        eye_gaze: false,
        ..config(folder.path())
    });
    assert!(!app.headset().supports_eye_gaze);
    let (seen, _) = play(&mut app, |_| false);
    assert_eq!(seen.len(), FRAME_COUNT);
    assert!(seen.iter().all(|frame| frame.gaze == GazeReading::INACTIVE));
}

#[test]
fn an_image_larger_than_the_headset_takes_is_refused() {
    let _alone = alone();
    let folder = session_folder();
    xr_sim::configure(config(folder.path())).expect("the session folder is right");
    let entry = Runtime::InProcess(xr_sim::get_instance_proc_addr)
        .entry()
        .expect("an entry");
    let options = XrOptions {
        image_size: Some([1 << 20, 64]),
    };
    let error = XrApp::connect(entry, &options)
        .err()
        .expect("must be refused");
    assert!(
        matches!(
            error,
            XrError::ImageSize {
                width: 0x10_0000,
                ..
            }
        ),
        "{error}"
    );
}
