//! Swapchains of all kinds, and the layers that show them.

use std::path::Path;

use ash::vk;
use openxr as xr;
use openxr::sys::{self, Result as Code};
use xr_sim::{Capture, Config, PictureFormat, configure};

use crate::common::codes::*;
use crate::common::*;

/// A session on a Vulkan device in its first frame, which is begun.
struct Drawing {
    local: xr::Space,
    stream: xr::FrameStream<xr::Vulkan>,
    time: xr::Time,
    session: xr::Session<xr::Vulkan>,
    instance: xr::Instance,
    vulkan: Vulkan,
}

impl Drawing {
    fn new(captured: Option<&Path>) -> Option<Self> {
        let format = PictureFormat::Png;
        let capture = captured.map(|folder| Capture {
            folder: folder.into(),
            format,
        });
        configure(Config {
            capture,
            ..config()
        })
        .unwrap();
        let (instance, system) = instance(&entry(), V1_0);
        let vulkan = Vulkan::new(&instance, system)?;
        let info = vulkan.session_info();
        // SAFETY: the handles are living ones of this application
        let (session, mut waiter, mut stream) =
            unsafe { instance.create_session::<xr::Vulkan>(system, &info) }.unwrap();
        session
            .begin(xr::ViewConfigurationType::PRIMARY_STEREO)
            .unwrap();
        let time = waiter.wait().unwrap().predicted_display_time;
        stream.begin().unwrap();
        let local = session
            .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
            .unwrap();
        Some(Self {
            local,
            stream,
            time,
            session,
            instance,
            vulkan,
        })
    }

    /// A swapchain whose one released image is cleared to the colour, in all layers.
    fn cleared(&self, info: &SwapchainInfo, color: [f32; 4]) -> xr::Swapchain<xr::Vulkan> {
        let mut swapchain = self.session.create_swapchain(info).unwrap();
        let images = swapchain.enumerate_images().unwrap();
        let index = swapchain.acquire_image().unwrap() as usize;
        swapchain.wait_image(xr::Duration::INFINITE).unwrap();
        for layer in 0..info.array_size {
            self.vulkan.clear(images[index], layer, color);
        }
        swapchain.release_image().unwrap();
        swapchain
    }

    fn end(&mut self, layers: &[&xr::CompositionLayerBase<'_, xr::Vulkan>]) -> xr::Result<()> {
        self.stream
            .end(self.time, xr::EnvironmentBlendMode::OPAQUE, layers)
    }
}

type SwapchainInfo = xr::SwapchainCreateInfo<xr::Vulkan>;

fn swapchain_info(format: vk::Format, size: u32) -> SwapchainInfo {
    xr::SwapchainCreateInfo {
        create_flags: xr::SwapchainCreateFlags::EMPTY,
        usage_flags: drawn_into(),
        format: format.as_raw() as u32,
        sample_count: 1,
        width: size,
        height: size,
        face_count: 1,
        array_size: 1,
        mip_count: 1,
    }
}

const SRGB: vk::Format = vk::Format::R8G8B8A8_SRGB;

fn rect(x: i32, y: i32, width: i32, height: i32) -> xr::Rect2Di {
    xr::Rect2Di {
        offset: xr::Offset2Di { x, y },
        extent: xr::Extent2Di { width, height },
    }
}

fn part(
    swapchain: &xr::Swapchain<xr::Vulkan>,
    part: xr::Rect2Di,
) -> xr::SwapchainSubImage<'_, xr::Vulkan> {
    xr::SwapchainSubImage::new()
        .swapchain(swapchain)
        .image_rect(part)
}

fn fov() -> xr::Fovf {
    let angle = 0.5f32.atan();
    xr::Fovf {
        angle_left: -angle,
        angle_right: angle,
        angle_up: angle,
        angle_down: -angle,
    }
}

fn view(
    image: xr::SwapchainSubImage<'_, xr::Vulkan>,
) -> xr::CompositionLayerProjectionView<'_, xr::Vulkan> {
    let pose = xr::Posef::IDENTITY;
    xr::CompositionLayerProjectionView::new()
        .pose(pose)
        .fov(fov())
        .sub_image(image)
}

fn picture(folder: &Path, eye: &str) -> image::RgbImage {
    image::open(folder.join(format!("{eye}_00000.png")))
        .unwrap()
        .to_rgb8()
}

#[test]
fn every_format_offered_makes_a_swapchain() {
    let _turn = turn();
    let Some(app) = Drawing::new(None) else {
        return;
    };
    let formats = app.session.enumerate_swapchain_formats().unwrap();
    assert!(formats.len() >= 6, "{formats:?}");
    for format in formats {
        let format = vk::Format::from_raw(format as i32);
        let mut info = swapchain_info(format, 32);
        let is_depth = format!("{format:?}").starts_with('D');
        if is_depth {
            info.usage_flags = xr::SwapchainUsageFlags::DEPTH_STENCIL_ATTACHMENT;
        }
        (info.array_size, info.mip_count) = (2, 3);
        let mut swapchain = app.session.create_swapchain(&info).unwrap();
        for turn in 0..4 {
            assert_eq!(swapchain.acquire_image().unwrap(), turn % 3, "{format:?}");
            swapchain.wait_image(xr::Duration::NONE).unwrap();
            swapchain.release_image().unwrap();
        }
    }
}

#[test]
fn swapchains_that_cannot_be_get_their_codes() {
    let _turn = turn();
    let Some(app) = Drawing::new(None) else {
        return;
    };
    let create = |change: &dyn Fn(&mut SwapchainInfo)| {
        let mut info = swapchain_info(SRGB, 32);
        change(&mut info);
        app.session.create_swapchain(&info).err().unwrap_or(SUCCESS)
    };
    let unknown = vk::Format::R4G4_UNORM_PACK8.as_raw() as u32;
    let all_bits = xr::SwapchainUsageFlags::from_raw(u64::MAX);
    let protected = xr::SwapchainCreateFlags::PROTECTED_CONTENT;
    let unsupported = Code::ERROR_FEATURE_UNSUPPORTED;
    codes! {
        "sound": create(&|_| {}) => SUCCESS;
        "format": create(&|info| info.format = unknown) => Code::ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED;
        "width": create(&|info| info.width = 0) => INVALID;
        "height": create(&|info| info.height = 100_000) => INVALID;
        "mips": create(&|info| info.mip_count = 7) => INVALID;
        "layers": create(&|info| info.array_size = 0) => INVALID;
        "faces": create(&|info| info.face_count = 5) => INVALID;
        "samples": create(&|info| info.sample_count = 3) => INVALID;
        "very many samples": create(&|info| info.sample_count = 64) => unsupported;
        "usage": create(&|info| info.usage_flags = all_bits) => INVALID;
        "protected": create(&|info| info.create_flags = protected) => unsupported;
    }
}

#[test]
fn layers_that_cannot_be_get_their_codes() {
    let _turn = turn();
    let Some(mut app) = Drawing::new(None) else {
        return;
    };
    let drawn = app.cleared(&swapchain_info(SRGB, 32), [1.0; 4]);
    let fresh = app
        .session
        .create_swapchain(&swapchain_info(SRGB, 32))
        .unwrap();
    let local = app
        .session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
        .unwrap();
    let whole = rect(0, 0, 32, 32);
    let mut end = |swapchain, rect, layer, pose| {
        let image = || part(swapchain, rect).image_array_index(layer);
        let views = [(); 2].map(|()| view(image()).pose(pose));
        let layer = xr::CompositionLayerProjection::new()
            .space(&local)
            .views(&views);
        app.end(&[&layer]).err().unwrap_or(SUCCESS)
    };
    let sound = xr::Posef::IDENTITY;
    let mut skewed = sound;
    skewed.orientation.w = 2.0;
    let rect_invalid = Code::ERROR_SWAPCHAIN_RECT_INVALID;
    codes! {
        "nothing drawn": end(&fresh, whole, 0, sound) => Code::ERROR_LAYER_INVALID;
        "too wide": end(&drawn, rect(1, 0, 32, 32), 0, sound) => rect_invalid;
        "negative": end(&drawn, rect(-1, 0, 8, 8), 0, sound) => rect_invalid;
        "empty": end(&drawn, rect(0, 0, 0, 8), 0, sound) => rect_invalid;
        "overflowing": end(&drawn, rect(i32::MAX, 0, i32::MAX, 8), 0, sound) => rect_invalid;
        "no such layer": end(&drawn, whole, 1, sound) => INVALID;
        "skewed": end(&drawn, whole, 0, skewed) => Code::ERROR_POSE_INVALID;
        "sound": end(&drawn, whole, 0, sound) => SUCCESS;
    }
}

#[test]
fn layers_that_are_none_get_their_codes() {
    let _turn = turn();
    let Some(app) = Drawing::new(None) else {
        return;
    };
    let one_view = sys::CompositionLayerProjection {
        space: app.local.as_raw(),
        view_count: 1,
        ..zeroed!(CompositionLayerProjection)
    };
    let end = |layer: *const sys::CompositionLayerBaseHeader| {
        let layers = [layer];
        let mut info = zeroed!(FrameEndInfo);
        info.display_time = app.time;
        info.environment_blend_mode = xr::EnvironmentBlendMode::OPAQUE;
        (info.layer_count, info.layers) = (1, layers.as_ptr());
        // SAFETY: structures of their types, or null as the case has it
        unsafe { (app.instance.fp().end_frame)(app.session.as_raw(), &info) }
    };
    let header = |layer: &sys::CompositionLayerProjection| std::ptr::from_ref(layer).cast();
    let mistyped = mistyped!(CompositionLayerProjection);
    codes! {
        "null": end(std::ptr::null()) => Code::ERROR_LAYER_INVALID;
        "of no type": end(header(&mistyped)) => Code::ERROR_LAYER_INVALID;
        "without a second view": end(header(&one_view)) => INVALID;
    }
}

#[test]
fn an_eye_is_shown_its_part_of_a_shared_image() {
    let _turn = turn();
    let captured = tempfile::tempdir().unwrap();
    let Some(mut app) = Drawing::new(Some(captured.path())) else {
        return;
    };
    // one image, two layers of it, in a linear format whose texels become sRGB in the picture
    let info = SwapchainInfo {
        array_size: 2,
        ..swapchain_info(vk::Format::R8G8B8A8_UNORM, 32)
    };
    let mut swapchain = app.session.create_swapchain(&info).unwrap();
    let images = swapchain.enumerate_images().unwrap();
    let index = swapchain.acquire_image().unwrap() as usize;
    swapchain.wait_image(xr::Duration::INFINITE).unwrap();
    app.vulkan.clear(images[index], 0, [1.0, 0.0, 0.0, 1.0]);
    app.vulkan.clear(images[index], 1, [0.0, 0.0, 0.5, 1.0]);
    swapchain.release_image().unwrap();
    let local = app
        .session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
        .unwrap();
    let views = [0, 1].map(|eye| view(part(&swapchain, rect(4, 8, 16, 20)).image_array_index(eye)));
    app.end(&[&xr::CompositionLayerProjection::new()
        .space(&local)
        .views(&views)])
        .unwrap();
    for (eye, expected) in [("left", [255, 0, 0]), ("right", [0, 0, 188])] {
        let picture = picture(captured.path(), eye);
        assert_eq!(picture.dimensions(), (16, 20));
        assert!(
            picture.pixels().all(|pixel| pixel.0 == expected),
            "{eye}: {:?}",
            picture[(0, 0)]
        );
    }
}

#[test]
fn a_quad_hangs_before_the_projection_in_the_eye_that_sees_it() {
    let _turn = turn();
    let captured = tempfile::tempdir().unwrap();
    let Some(mut app) = Drawing::new(Some(captured.path())) else {
        return;
    };
    let green = app.cleared(&swapchain_info(SRGB, 32), [0.0, 1.0, 0.0, 1.0]);
    let floats = swapchain_info(vk::Format::R16G16B16A16_SFLOAT, 8);
    let half_red = app.cleared(&floats, [0.5, 0.0, 0.0, 0.5]);
    let local = app
        .session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
        .unwrap();
    let views = [(); 2].map(|()| view(part(&green, rect(0, 0, 32, 32))));
    let projection = xr::CompositionLayerProjection::new()
        .space(&local)
        .views(&views);
    // the view is 2 m wide at 2 m; the quad takes its middle half
    let position = xr::Vector3f {
        x: 0.0,
        y: 0.0,
        z: -2.0,
    };
    let quad = xr::CompositionLayerQuad::new()
        .layer_flags(xr::CompositionLayerFlags::BLEND_TEXTURE_SOURCE_ALPHA)
        .space(&local)
        .eye_visibility(xr::EyeVisibility::LEFT)
        .sub_image(part(&half_red, rect(0, 0, 8, 8)))
        .pose(xr::Posef {
            position,
            ..xr::Posef::IDENTITY
        })
        .size(xr::Extent2Df {
            width: 1.0,
            height: 1.0,
        });
    app.end(&[&projection, &quad]).unwrap();
    let [left, right] = ["left", "right"].map(|eye| picture(captured.path(), eye));
    assert!(right.pixels().all(|pixel| pixel.0 == [0, 255, 0]));
    for (x, y, pixel) in left.enumerate_pixels() {
        let is_covered = (8..24).contains(&x) && (8..24).contains(&y);
        assert_eq!(
            pixel.0,
            if is_covered {
                [188, 188, 0]
            } else {
                [0, 255, 0]
            },
            "{x} {y}"
        );
    }
}

#[test]
fn several_samples_are_resolved_for_the_picture() {
    let _turn = turn();
    let captured = tempfile::tempdir().unwrap();
    let Some(mut app) = Drawing::new(Some(captured.path())) else {
        return;
    };
    let info = SwapchainInfo {
        sample_count: 4,
        ..swapchain_info(SRGB, 32)
    };
    if app.session.create_swapchain(&info).is_err() {
        eprintln!("SKIPPED: no images with 4 samples here");
        return;
    }
    let swapchain = app.cleared(
        &SwapchainInfo {
            sample_count: 4,
            ..info
        },
        [0.0, 1.0, 1.0, 1.0],
    );
    let local = app
        .session
        .create_reference_space(xr::ReferenceSpaceType::LOCAL, xr::Posef::IDENTITY)
        .unwrap();
    let views = [(); 2].map(|()| view(part(&swapchain, rect(8, 8, 16, 16))));
    app.end(&[&xr::CompositionLayerProjection::new()
        .space(&local)
        .views(&views)])
        .unwrap();
    assert!(
        picture(captured.path(), "left")
            .pixels()
            .all(|pixel| pixel.0 == [0, 255, 255])
    );
}
