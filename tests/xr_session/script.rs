//! The recorded session that the simulated runtime plays: every value is a formula, so that each frame can be checked.

use std::fs;
use std::path::Path;

use glam::{Quat, Vec3};
use macula::view::Pose;

pub const FRAME_COUNT: usize = 48;
pub const PERIOD_NS: i64 = 11_111_111;
pub const START_NS: i64 = 5_000_000_000;
/// Gaze samples come slower than frames here, so that a sample's own time differs from the display time.
pub const GAZE_PERIOD_NS: i64 = 20_000_000;
pub const IPD_M: f32 = 0.0625;
pub const FOV_RAD: [[f32; 4]; 2] = [[-0.9, 0.7, 0.75, -0.85], [-0.7, 0.9, 0.75, -0.85]];
pub const EYE_SIZE: [u32; 2] = [64, 48];
/// Frames whose head is lost, and samples in which the eyes are shut.
pub const HEAD_LOST: std::ops::Range<usize> = 20..24;
pub const EYES_SHUT: std::ops::Range<usize> = 8..11;
/// Frames at which the trigger goes down and up.
pub const PRESSED: std::ops::Range<usize> = 30..35;

pub fn display_time_ns(frame: usize) -> i64 {
    START_NS + frame as i64 * PERIOD_NS
}

pub fn head(frame: usize) -> Pose {
    let t = frame as f32;
    Pose {
        orientation: Quat::from_rotation_y(0.01 * t) * Quat::from_rotation_x(-0.004 * t),
        position_m: Vec3::new(0.002 * t, 0.1, -0.001 * t),
    }
}

pub fn gaze_sample_at(time_ns: i64) -> usize {
    ((time_ns - START_NS) / GAZE_PERIOD_NS) as usize
}

pub fn gaze_dir_in_view(sample: usize) -> Vec3 {
    let t = sample as f32;
    Vec3::new(0.02 * t - 0.2, 0.1 - 0.01 * t, -1.0).normalize()
}

pub fn write_session(folder: &Path) {
    let session = r#"{"format":"macula-session","version":1,"name":"test"}"#;
    fs::write(folder.join("session.json"), session).expect("session.json");

    let mut frames = String::from(
        "frame,predicted_display_ns,period_ns,head_px,head_py,head_pz,head_qx,head_qy,head_qz,head_qw,head_flags",
    );
    for eye in ["l", "r"] {
        for column in [
            "px", "py", "pz", "qx", "qy", "qz", "qw", "fov_l", "fov_r", "fov_u", "fov_d",
        ] {
            frames += &format!(",{eye}_{column}");
        }
    }
    for frame in 0..FRAME_COUNT {
        let Pose {
            orientation: q,
            position_m: p,
        } = head(frame);
        let flags = if HEAD_LOST.contains(&frame) { 0 } else { 15 };
        frames += &format!(
            "\n{frame},{},{PERIOD_NS},{},{},{}",
            display_time_ns(frame),
            p.x,
            p.y,
            p.z
        );
        frames += &format!(",{},{},{},{},{flags}", q.x, q.y, q.z, q.w);
        for (eye, side) in [-1.0, 1.0].into_iter().enumerate() {
            let [left, right, up, down] = FOV_RAD[eye];
            frames += &format!(
                ",{},0,0,0,0,0,1,{left},{right},{up},{down}",
                side * IPD_M / 2.0
            );
        }
    }
    fs::write(folder.join("frames.csv"), frames + "\n").expect("frames.csv");

    let mut gaze = String::from("time_ns,recv_ns,valid,ox,oy,oz,dx,dy,dz,confidence\n");
    for sample in 0..=gaze_sample_at(display_time_ns(FRAME_COUNT)) {
        let time_ns = START_NS + sample as i64 * GAZE_PERIOD_NS;
        let valid = u8::from(!EYES_SHUT.contains(&sample));
        let d = gaze_dir_in_view(sample);
        gaze += &format!(
            "{time_ns},{time_ns},{valid},0,0,0,{},{},{},1\n",
            d.x, d.y, d.z
        );
    }
    fs::write(folder.join("gaze.csv"), gaze).expect("gaze.csv");

    let mut events = String::from("time_ns,event,trial,value\n");
    for (frame, state) in [(PRESSED.start, "down"), (PRESSED.end, "up")] {
        events += &format!("{},button,,select_right {state}\n", display_time_ns(frame));
    }
    fs::write(folder.join("events.csv"), events).expect("events.csv");
}
