//! A whole application: from the instance to the last recorded frame, drawing on a Vulkan device.

mod common;

use common::*;
use openxr as xr;
use xr_sim::{Capture, Config, PictureFormat, configure};

/// What a run of the application saw.
#[derive(PartialEq)]
struct Run {
    states: Vec<xr::SessionState>,
    display_times: Vec<i64>,
    views: Vec<Vec<xr::View>>,
}

/// Replays as configured: clears each eye's layer to a colour of the frame, to the end of the recording.
fn run(colors: impl Fn(usize, u32) -> [f32; 4]) -> Option<Run> {
    let entry = entry();
    let (instance, system) = instance(&entry, V1_0);
    let vulkan = Vulkan::new(&instance, system)?;
    // SAFETY: the handles are living ones of this application
    let (session, mut waiter, mut stream) =
        unsafe { instance.create_session::<xr::Vulkan>(system, &vulkan.session_info()) }.unwrap();
    let local = session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
        .unwrap();
    let configuration = xr::ViewConfigurationType::PRIMARY_STEREO;
    let size = instance
        .enumerate_view_configuration_views(system, configuration)
        .unwrap()[0];
    let (width, height) = (
        size.recommended_image_rect_width,
        size.recommended_image_rect_height,
    );
    let format = ash::vk::Format::R8G8B8A8_SRGB.as_raw() as u32;
    assert!(
        session
            .enumerate_swapchain_formats()
            .unwrap()
            .contains(&format)
    );
    let mut swapchain = session
        .create_swapchain(&xr::SwapchainCreateInfo {
            create_flags: xr::SwapchainCreateFlags::EMPTY,
            usage_flags: xr::SwapchainUsageFlags::COLOR_ATTACHMENT,
            format,
            sample_count: 1,
            width,
            height,
            face_count: 1,
            array_size: 2,
            mip_count: 1,
        })
        .unwrap();
    let images = swapchain.enumerate_images().unwrap();
    let mut run = Run {
        states: Vec::new(),
        display_times: Vec::new(),
        views: Vec::new(),
    };
    let mut is_running = false;
    loop {
        for state in poll_states(&instance) {
            run.states.push(state);
            match state {
                xr::SessionState::READY => {
                    session.begin(configuration).unwrap();
                    is_running = true;
                }
                xr::SessionState::STOPPING => {
                    session.end().unwrap();
                    is_running = false;
                }
                xr::SessionState::EXITING => return Some(run),
                _ => {}
            }
        }
        if !is_running {
            continue;
        }
        let state = waiter.wait().unwrap();
        stream.begin().unwrap();
        assert!(state.should_render);
        let index = swapchain.acquire_image().unwrap();
        swapchain.wait_image(xr::Duration::INFINITE).unwrap();
        for eye in 0..2 {
            vulkan.clear(
                images[index as usize],
                eye,
                colors(run.display_times.len(), eye),
            );
        }
        swapchain.release_image().unwrap();
        let time = state.predicted_display_time;
        let (flags, views) = session.locate_views(configuration, time, &local).unwrap();
        assert!(
            flags.contains(
                xr::ViewStateFlags::ORIENTATION_VALID | xr::ViewStateFlags::POSITION_VALID
            )
        );
        let rect = xr::Rect2Di {
            offset: xr::Offset2Di { x: 0, y: 0 },
            extent: xr::Extent2Di {
                width: width as i32,
                height: height as i32,
            },
        };
        let projection = [0, 1].map(|eye| {
            xr::CompositionLayerProjectionView::new()
                .pose(views[eye].pose)
                .fov(views[eye].fov)
                .sub_image(
                    xr::SwapchainSubImage::new()
                        .swapchain(&swapchain)
                        .image_array_index(eye as u32)
                        .image_rect(rect),
                )
        });
        let layer = xr::CompositionLayerProjection::new()
            .space(&local)
            .views(&projection);
        stream
            .end(time, xr::EnvironmentBlendMode::OPAQUE, &[&layer])
            .unwrap();
        run.display_times.push(time.as_nanos());
        run.views.push(views);
    }
}

fn color(frame: usize, eye: u32) -> [f32; 4] {
    [frame as f32 / 16.0, eye as f32, 0.25, 1.0]
}

/// 8 bits on the sRGB curve, as the device encodes a clear colour.
fn srgb(linear: f32) -> u8 {
    let encoded = if linear <= 0.0031308 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}

#[test]
fn a_recording_is_replayed_frame_by_frame_and_then_ends() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 10);
    configure(Config {
        session: Some(folder.path().into()),
        ..config()
    })
    .unwrap();
    let Some(run) = run(color) else { return };
    assert_eq!(run.display_times, (0..10).map(frame_ns).collect::<Vec<_>>());
    use xr::SessionState as State;
    assert_eq!(
        run.states,
        [
            State::IDLE,
            State::READY,
            State::SYNCHRONIZED,
            State::VISIBLE,
            State::FOCUSED,
            State::VISIBLE,
            State::SYNCHRONIZED,
            State::STOPPING,
            State::IDLE,
            State::EXITING,
        ]
    );
    // frame 9: the head is at 9 cm and has turned left by 9 degrees
    let [left, right] = &run.views[9][..] else {
        panic!("two views")
    };
    let angle = 9f32.to_radians();
    let apart = [
        right.pose.position.x - left.pose.position.x,
        right.pose.position.z - left.pose.position.z,
    ];
    assert!(
        (apart[0] - 0.064 * angle.cos()).abs() < 1e-5
            && (apart[1] + 0.064 * angle.sin()).abs() < 1e-5
    );
    assert!(((left.pose.position.x + right.pose.position.x) / 2.0 - 0.09).abs() < 1e-6);
    assert!((left.pose.orientation.y - (angle / 2.0).sin()).abs() < 1e-6);
    assert_eq!(left.fov.angle_left, -0.8);
    assert_eq!(right.fov.angle_right, 0.8);
}

#[test]
fn first_last_and_step_pick_the_frames() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 40);
    let session = Some(folder.path().into());
    configure(Config {
        session,
        first_frame: 3,
        last_frame: Some(25),
        frame_step: 9,
        ..config()
    })
    .unwrap();
    let Some(run) = run(color) else { return };
    assert_eq!(run.display_times, [3, 12, 21].map(frame_ns));
}

#[test]
fn captured_pictures_hold_what_was_drawn() {
    let _turn = turn();
    let (folder, captured) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    recording(folder.path(), 3);
    for format in [PictureFormat::Png, PictureFormat::Exr] {
        configure(Config {
            session: Some(folder.path().into()),
            capture: Some(Capture {
                folder: captured.path().join("pictures"),
                format,
            }),
            ..config()
        })
        .unwrap();
        if run(color).is_none() {
            return;
        }
        let extension = if format == PictureFormat::Png {
            "png"
        } else {
            "exr"
        };
        for frame in 0..3 {
            for (eye, name) in [(0, "left"), (1, "right")] {
                let path = captured
                    .path()
                    .join(format!("pictures/{name}_{frame:05}.{extension}"));
                let picture = image::open(&path).unwrap();
                assert_eq!((picture.width(), picture.height()), (64, 48));
                let [r, g, b, _] = color(frame, eye);
                if format == PictureFormat::Png {
                    let expected = [srgb(r), srgb(g), srgb(b)];
                    assert!(
                        picture.to_rgb8().pixels().all(|pixel| pixel.0 == expected),
                        "{path:?}"
                    );
                } else {
                    let close = |a: f32, b: f32| (a - b).abs() < 0.01;
                    let is_right =
                        |p: &image::Rgb<f32>| close(p[0], r) && close(p[1], g) && close(p[2], b);
                    assert!(picture.to_rgb32f().pixels().all(is_right), "{path:?}");
                }
            }
        }
    }
}

#[test]
fn two_runs_are_the_same_to_the_last_bit_and_another_is_not() {
    let _turn = turn();
    let (folder, captured) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    recording(folder.path(), 6);
    let once = |name: &str, colors: fn(usize, u32) -> [f32; 4]| {
        let pictures = captured.path().join(name);
        configure(Config {
            session: Some(folder.path().into()),
            capture: Some(Capture {
                folder: pictures.clone(),
                format: PictureFormat::Png,
            }),
            ..config()
        })
        .unwrap();
        let run = run(colors)?;
        let mut files: Vec<_> = std::fs::read_dir(&pictures)
            .unwrap()
            .map(|file| file.unwrap().path())
            .collect();
        files.sort();
        assert_eq!(files.len(), 12);
        let bytes: Vec<_> = files
            .iter()
            .map(|file| std::fs::read(file).unwrap())
            .collect();
        Some((run, bytes))
    };
    let Some(first) = once("first", color) else {
        return;
    };
    let second = once("second", color).unwrap();
    let other = once("other", |frame, eye| color(frame + 1, eye)).unwrap();
    assert!(first == second);
    assert!(first.0 == other.0 && first.1 != other.1);
}
