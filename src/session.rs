//! A session from its first frame to its last: poses and gaze from OpenXR into frames, pictures back. The runtime may be any.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::frame::{FrameInput, FrameOutcome, FrameRenderer};
use crate::gaze::{GazeRay, GazeSample};
use crate::gpu::GpuError;
use crate::view::Pose;
use crate::xr::{self, EndReason, XrApp, XrError};

/// Why a session stopped before its end.
#[derive(Debug, thiserror::Error)]
pub enum SessionError<E: std::error::Error + 'static> {
    /// OpenXR failed.
    #[error(transparent)]
    Xr(#[from] XrError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Whoever watched the frames could not go on.
    #[error(transparent)]
    Watcher(E),
}

/// How a session came to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionEnd {
    /// Frames that were rendered and shown.
    pub frames: u32,
    /// Why it ended.
    pub reason: EndReason,
}

/// Runs the session until the runtime ends it or `stop` is raised; `watch` sees each frame after it was shown.
///
/// # Errors
/// [`SessionError`]; the session is left in order all the same.
pub fn run<E: std::error::Error + 'static>(
    app: &mut XrApp,
    renderer: &mut FrameRenderer<'_>,
    stop: &AtomicBool,
    mut watch: impl FnMut(&FrameInput, &FrameOutcome, &FrameRenderer<'_>) -> Result<(), E>,
) -> Result<SessionEnd, SessionError<E>> {
    let mut rendered = 0;
    let mut first_display_time_ns = None;
    let mut last_head = Pose::IDENTITY;
    let mut is_leaving = false;
    loop {
        // Also while nothing is shown, or a headset that is off could not be left.
        if stop.load(Ordering::SeqCst) && !is_leaving {
            is_leaving = true;
            app.request_exit()?;
        }
        let frame = match app.next_frame()? {
            xr::Step::Frame(frame) => frame,
            xr::Step::Idle => continue,
            xr::Step::Ended(reason) => {
                return Ok(SessionEnd {
                    frames: rendered,
                    reason,
                });
            }
        };
        let Some(targets) = frame.targets() else {
            app.submit(*frame)?;
            continue;
        };
        // Where the head is lost, the picture stays where it was: nothing is worse than a jump to the origin.
        if frame.head.flags.is_valid() {
            last_head = frame.head.pose;
        }
        let display_time_ns = frame.predicted_display_time_ns;
        let start_ns = *first_display_time_ns.get_or_insert(display_time_ns);
        let input = FrameInput {
            index: rendered,
            display_time_ns,
            scene_time_s: display_time_ns.saturating_sub(start_ns) as f64 * 1e-9,
            local_from_head: last_head,
            local_from_eye: frame.views.map(|eye| eye.view),
            gaze: gaze_sample(&frame.gaze, display_time_ns),
        };
        let outcome = renderer.render(&input, targets)?;
        app.submit(*frame)?;
        rendered += 1;
        watch(&input, &outcome, renderer).map_err(SessionError::Watcher)?;
    }
}

/// The runtime's gaze as the gaze room knows it; `None` where it has none at all.
fn gaze_sample(reading: &xr::GazeReading, display_time_ns: i64) -> Option<GazeSample> {
    if !reading.active {
        return None;
    }
    let ray = reading
        .is_tracked()
        .then(|| reading.ray_in_view())
        .flatten();
    let ray = ray.and_then(|ray| GazeRay::new(ray.origin_m, ray.dir));
    // A runtime that does not tell the sample's time predicts it for the display time.
    Some(GazeSample::combined(
        reading.sample_time_ns.unwrap_or(display_time_ns),
        ray,
    ))
}
