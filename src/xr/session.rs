//! The session: connect, follow the states, run the frame loop, end in order.

use std::sync::Arc;
use std::time::Duration;

use openxr::{SessionState, sys};

use super::headset::{Headset, HeadsetInfo, STEREO};
use super::input::{ButtonChange, Input};
use super::interop::{self, RuntimeVulkan};
use super::swapchain::EyeSwapchain;
use super::views::{EyeView, TrackedPose, Viewer, fov_to_xr, pose_to_xr};
use super::{GazeReading, XrError, failed};
use crate::gpu::GpuDevice;

/// How long [`XrApp::next_frame`] rests while the runtime lets nothing run.
const IDLE_REST: Duration = Duration::from_millis(5);

/// What the application asks of the session.
#[derive(Clone, Debug, Default)]
pub struct XrOptions {
    /// Width and height of each eye's image, pixels; `None` takes what the runtime recommends.
    pub image_size: Option<[u32; 2]>,
}

/// Why a session is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// It was asked to end: by [`XrApp::request_exit`], by the person or by the runtime.
    Exit,
    /// The session was lost, e.g. the headset was unplugged; a new one can be made now.
    SessionLost,
    /// The whole runtime is going away; `until_ns` (display clock, nanoseconds) says when connecting makes sense again, if known.
    InstanceLost {
        /// The runtime's loss time.
        until_ns: Option<i64>,
    },
}

impl std::fmt::Display for EndReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Exit => "asked to end",
            Self::SessionLost => "the session was lost: check the headset and start again",
            Self::InstanceLost { .. } => "the runtime went away: start it and try again",
        })
    }
}

/// What [`XrApp::next_frame`] came back with.
#[derive(Debug)]
pub enum Step {
    /// A frame to render (see [`Frame::targets`]) and to hand to [`XrApp::submit`].
    Frame(Box<Frame>),
    /// The session is not running now; call again.
    Idle,
    /// The session is over; every further call says so again.
    Ended(EndReason),
}

/// One frame: when it will be seen, from where, and what the person looks at. Everything is located at the one display time.
#[derive(Debug)]
pub struct Frame {
    /// Counts from 0 over the session's begun frames.
    pub index: u64,
    /// When the frame will be seen, nanoseconds on the runtime's clock.
    pub predicted_display_time_ns: i64,
    /// Time to the next frame, nanoseconds.
    pub predicted_period_ns: i64,
    /// Whether the picture will be seen. If not, [`Frame::targets`] has none and the frame is submitted empty.
    pub should_render: bool,
    /// `local_from_head`.
    pub head: TrackedPose,
    /// Left and right eye, `local_from_eye`. [`XrApp::submit`] tells the compositor that these were rendered.
    pub views: [EyeView; 2],
    /// Where the person looks.
    pub gaze: GazeReading,
    /// Buttons pressed and released since the last frame.
    pub buttons: Vec<ButtonChange>,
    targets: Option<[wgpu::TextureView; 2]>,
}

impl Frame {
    /// The left and right eye's image to draw into, each [`XrApp::image_size`] large and of [`XrApp::format`] (linear in, sRGB stored);
    /// `None` if there is nothing to render. They are colour targets only, and what they hold at first is undefined.
    pub fn targets(&self) -> Option<&[wgpu::TextureView; 2]> {
        self.targets.as_ref()
    }
}

/// A connected application: instance, system, device and session.
///
/// The device's queue belongs to the runtime during [`XrApp::next_frame`] and [`XrApp::submit`]: no other thread may submit to it then
/// (`XR_KHR_vulkan_enable2`, concurrency).
pub struct XrApp {
    // Dropped in this order: children before parents, the session before the device, the device before the instance.
    swapchain: EyeSwapchain,
    input: Input,
    viewer: Viewer,
    stream: openxr::FrameStream<openxr::Vulkan>,
    waiter: openxr::FrameWaiter,
    session: openxr::Session<openxr::Vulkan>,
    gpu: Arc<GpuDevice>,
    headset: Headset,

    blend_mode: openxr::EnvironmentBlendMode,
    state: SessionState,
    running: bool,
    ended: Option<EndReason>,
    /// Begun and not ended: its index and display time.
    begun: Option<(u64, openxr::Time)>,
    next_index: u64,
}

impl XrApp {
    /// Connects to the runtime behind `entry`: instance, headset, Vulkan device, session, actions, images.
    ///
    /// # Errors
    /// [`XrError`], each with its mend.
    pub fn connect(entry: openxr::Entry, options: &XrOptions) -> Result<Self, XrError> {
        let headset = Headset::open(&entry)?;
        if !headset.info.supports_eye_gaze {
            tracing::warn!(
                "{} on {} does not track eyes; going on without gaze",
                headset.info.system_name,
                headset.info.runtime_name
            );
        }
        let maker = RuntimeVulkan::new(&headset.instance, headset.system)?;
        let gpu = Arc::new(GpuDevice::create(&maker)?);
        let (session, waiter, stream) =
            interop::create_session(&headset.instance, headset.system, &gpu)?;
        let input = Input::attach(&headset.instance, &session, headset.eye_gaze_enabled)?;
        let viewer = Viewer::new(&session)?;
        let swapchain = EyeSwapchain::new(&session, &gpu, &headset.info, options.image_size)?;
        Ok(Self {
            blend_mode: headset.blend_mode()?,
            swapchain,
            input,
            viewer,
            stream,
            waiter,
            session,
            gpu,
            headset,
            state: SessionState::IDLE,
            running: false,
            ended: None,
            begun: None,
            next_index: 0,
        })
    }

    /// The device that the runtime made, on which everything is rendered.
    pub fn gpu(&self) -> &Arc<GpuDevice> {
        &self.gpu
    }

    /// What runtime and headset say of themselves.
    pub fn headset(&self) -> &HeadsetInfo {
        &self.headset.info
    }

    /// Width and height of each eye's image, pixels.
    pub fn image_size(&self) -> [u32; 2] {
        self.swapchain.size
    }

    /// Format of the eyes' images, an sRGB one.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.swapchain.format
    }

    /// The session's state as last heard; `FOCUSED` is when the person sees the picture and gaze and buttons arrive.
    pub fn state(&self) -> SessionState {
        self.state
    }

    /// Asks the session to end; go on calling [`XrApp::next_frame`] until it says [`Step::Ended`].
    ///
    /// # Errors
    /// [`XrError::Call`].
    pub fn request_exit(&mut self) -> Result<(), XrError> {
        match self.session.request_exit() {
            Ok(()) => Ok(()),
            // Not yet begun or already over: nothing to wait for.
            Err(sys::Result::ERROR_SESSION_NOT_RUNNING) => {
                self.ended.get_or_insert(EndReason::Exit);
                Ok(())
            }
            Err(result) => self.unless_lost(failed("xrRequestExitSession")(result)),
        }
    }

    /// Follows the states and, while the session runs, waits for the next frame and begins it. A frame that was not submitted is ended
    /// without a picture first.
    ///
    /// # Errors
    /// [`XrError`]; a lost session or instance is no error but [`Step::Ended`].
    pub fn next_frame(&mut self) -> Result<Step, XrError> {
        match self.try_next_frame() {
            Ok(step) => Ok(step),
            Err(error) => {
                self.unless_lost(error)?;
                Ok(self.ended.map_or(Step::Idle, Step::Ended))
            }
        }
    }

    /// Gives the frame to the compositor, with the poses and fields of view that it says were rendered. All drawing into its targets must
    /// have been submitted to the queue.
    ///
    /// # Errors
    /// [`XrError::StaleFrame`] for a frame that is not the one in work; [`XrError::Call`]. A session lost here shows in the next step.
    pub fn submit(&mut self, frame: Frame) -> Result<(), XrError> {
        if self.begun.is_none_or(|(index, _)| index != frame.index) {
            return Err(XrError::StaleFrame {
                submitted: frame.index,
            });
        }
        let rendered = frame.targets.is_some().then_some(&frame.views);
        self.end_frame(rendered)
            .or_else(|error| self.unless_lost(error))
    }

    fn try_next_frame(&mut self) -> Result<Step, XrError> {
        self.end_frame(None)?;
        let heard = self.follow_events()?;
        if let Some(reason) = self.ended {
            return Ok(Step::Ended(reason));
        }
        if !self.running {
            if !heard {
                std::thread::sleep(IDLE_REST);
            }
            return Ok(Step::Idle);
        }
        let timing = self.waiter.wait().map_err(failed("xrWaitFrame"))?;
        let time = timing.predicted_display_time;
        let input = self.input.read(&self.session, &self.viewer, time)?;
        let head = self.viewer.head(time)?;
        let views = self.viewer.eyes(&self.session, time)?;
        // Last, so that the runtime's pacing counts only what follows as graphics work.
        if interop::begin_frame(&self.session)? {
            tracing::warn!("the OpenXR runtime discarded a frame");
        }
        let index = self.next_index;
        self.next_index += 1;
        self.begun = Some((index, time));
        let visible = timing.should_render && views.iter().all(EyeView::is_renderable);
        let targets = if visible {
            self.swapchain.acquire()?
        } else {
            None
        };
        Ok(Step::Frame(Box::new(Frame {
            index,
            predicted_display_time_ns: time.as_nanos(),
            predicted_period_ns: timing.predicted_display_period.as_nanos(),
            should_render: targets.is_some(),
            head,
            views,
            gaze: input.gaze,
            buttons: input.buttons,
            targets,
        })))
    }

    /// Ends the begun frame, if any: with the views' images as its one layer, or empty.
    fn end_frame(&mut self, rendered: Option<&[EyeView; 2]>) -> Result<(), XrError> {
        let Some((_, time)) = self.begun.take() else {
            return Ok(());
        };
        self.swapchain.release()?;
        let [width, height] = self.swapchain.size;
        let rect = openxr::Rect2Di {
            offset: openxr::Offset2Di { x: 0, y: 0 },
            extent: openxr::Extent2Di {
                width: width as i32,
                height: height as i32,
            },
        };
        let Some(eyes) = rendered else {
            return self
                .stream
                .end(time, self.blend_mode, &[])
                .map_err(failed("xrEndFrame"));
        };
        let views = [0, 1].map(|eye: usize| {
            let image = openxr::SwapchainSubImage::new()
                .swapchain(&self.swapchain.handle)
                .image_array_index(eye as u32)
                .image_rect(rect);
            openxr::CompositionLayerProjectionView::new()
                .pose(pose_to_xr(eyes[eye].view.pose))
                .fov(fov_to_xr(eyes[eye].view.fov))
                .sub_image(image)
        });
        let layer = openxr::CompositionLayerProjection::new()
            .space(&self.viewer.local)
            .views(&views);
        self.stream
            .end(time, self.blend_mode, &[&layer])
            .map_err(failed("xrEndFrame"))
    }

    /// Takes in all waiting events; whether there were any.
    fn follow_events(&mut self) -> Result<bool, XrError> {
        let mut buffer = openxr::EventDataBuffer::new();
        let instance = self.headset.instance.clone();
        let mut heard = false;
        while let Some(event) = instance
            .poll_event(&mut buffer)
            .map_err(failed("xrPollEvent"))?
        {
            heard = true;
            match event {
                openxr::Event::SessionStateChanged(change)
                    if change.session() == self.session.as_raw() =>
                {
                    self.enter(change.state())?;
                }
                openxr::Event::InstanceLossPending(loss) => {
                    let until_ns = Some(loss.loss_time().as_nanos());
                    self.ended = Some(EndReason::InstanceLost { until_ns });
                }
                openxr::Event::EventsLost(lost) => {
                    tracing::warn!("{} OpenXR events were lost", lost.lost_event_count());
                }
                openxr::Event::ReferenceSpaceChangePending(_) => {
                    tracing::info!("the play space was re-centred");
                }
                _ => {}
            }
        }
        Ok(heard)
    }

    /// Does what the session's new state asks for.
    fn enter(&mut self, state: SessionState) -> Result<(), XrError> {
        tracing::debug!("the session is {state:?}");
        self.state = state;
        match state {
            SessionState::READY => {
                self.session
                    .begin(STEREO)
                    .map_err(failed("xrBeginSession"))?;
                self.running = true;
            }
            SessionState::STOPPING => {
                self.running = false;
                self.session.end().map_err(failed("xrEndSession"))?;
            }
            SessionState::EXITING => self.ended = Some(EndReason::Exit),
            SessionState::LOSS_PENDING => self.ended = Some(EndReason::SessionLost),
            _ => {}
        }
        Ok(())
    }

    /// Turns the error of a lost session or instance into the session's end; hands back any other.
    fn unless_lost(&mut self, error: XrError) -> Result<(), XrError> {
        let reason = match &error {
            XrError::Call {
                result: sys::Result::ERROR_SESSION_LOST,
                ..
            } => EndReason::SessionLost,
            XrError::Call {
                result: sys::Result::ERROR_INSTANCE_LOST,
                ..
            } => EndReason::InstanceLost { until_ns: None },
            _ => return Err(error),
        };
        tracing::warn!("{error}");
        self.ended.get_or_insert(reason);
        Ok(())
    }
}

impl Drop for XrApp {
    fn drop(&mut self) {
        // The runtime destroys its images with the swapchain: the device must be done with them.
        if let Err(error) = self.gpu.wait("ending the OpenXR session") {
            tracing::warn!("{error}");
        }
    }
}
