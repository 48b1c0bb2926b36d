//! The layers of a frame, verified and brought to LOCAL space.

use openxr_sys as sys;
use openxr_sys::CompositionLayerFlags;

use super::pointer::{AnyLayer, array, chained, layers};
use super::views::MAX_LAYERS;
use crate::XrResult;
use crate::extension::Extension;
use crate::pose::Pose;
use crate::runtime::Runtime;
use crate::sink::{Blend, Camera, Layer, ProjectionView, Quad, Shape, SubImage};
use crate::space::{self, Resolved};

const LOCAL: Resolved = Resolved::of(sys::ReferenceSpaceType::LOCAL);
const VIEW: Resolved = Resolved::of(sys::ReferenceSpaceType::VIEW);

/// The frame's layers, lowest first; those whose space is lost are left out.
pub(super) fn verified(
    runtime: &Runtime,
    session: sys::Session,
    info: &sys::FrameEndInfo,
) -> XrResult<Vec<Layer>> {
    if info.layer_count > MAX_LAYERS {
        return Err(sys::Result::ERROR_LAYER_LIMIT_EXCEEDED);
    }
    let frame = Frame {
        runtime,
        session,
        display_time: info.display_time,
    };
    let mut verified = Vec::new();
    for layer in layers(info)? {
        verified.extend(match layer {
            AnyLayer::Projection(layer) => frame.projection(layer)?,
            AnyLayer::Quad(layer) => frame.quad(layer)?,
            AnyLayer::Other => return Err(sys::Result::ERROR_LAYER_INVALID),
        });
    }
    Ok(verified)
}

/// The eyes as the script has them.
pub(super) fn cameras(
    runtime: &Runtime,
    session: sys::Session,
    display_time: sys::Time,
) -> XrResult<[Camera; 2]> {
    let (of_session, instance) = runtime.peek(session)?;
    let time_ns = of_session.pacing.script_time_ns(display_time);
    let script = &instance.setup.script;
    let head = space::locate(script, VIEW, LOCAL, time_ns, false);
    Ok(script.eyes(time_ns).map(|eye| Camera {
        local_from_eye: head.base_from_space.then(eye.head_from_eye),
        fov: eye.fov,
    }))
}

struct Frame<'a> {
    runtime: &'a Runtime,
    session: sys::Session,
    display_time: sys::Time,
}

impl Frame<'_> {
    fn projection(&self, layer: &sys::CompositionLayerProjection) -> XrResult<Option<Layer>> {
        let local_from_space = self.local_from(layer.space)?;
        let views = array(layer, layer.views, layer.view_count)?;
        let [left, right] = views else {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        };
        let view = |view: &sys::CompositionLayerProjectionView| {
            if view.ty != sys::CompositionLayerProjectionView::TYPE {
                return Err(sys::Result::ERROR_VALIDATION_FAILURE);
            }
            let pose = Pose::verified(&view.pose)?;
            let image = self.sub_image(&view.sub_image)?;
            self.depth(view)?;
            let sys::Fovf {
                angle_left,
                angle_right,
                angle_up,
                angle_down,
            } = view.fov;
            let local_from_eye = local_from_space.unwrap_or(Pose::IDENTITY).then(pose);
            let fov = [angle_left, angle_right, angle_up, angle_down];
            Ok(ProjectionView {
                camera: Camera {
                    local_from_eye,
                    fov,
                },
                image,
            })
        };
        let shape = Shape::Projection([view(left)?, view(right)?]);
        Ok(local_from_space.map(|_| Layer {
            shape,
            blend: blend(layer.layer_flags),
        }))
    }

    fn quad(&self, layer: &sys::CompositionLayerQuad) -> XrResult<Option<Layer>> {
        let local_from_space = self.local_from(layer.space)?;
        let pose = Pose::verified(&layer.pose)?;
        let image = self.sub_image(&layer.sub_image)?;
        let seen_by = match layer.eye_visibility {
            sys::EyeVisibility::BOTH => [true, true],
            sys::EyeVisibility::LEFT => [true, false],
            sys::EyeVisibility::RIGHT => [false, true],
            _ => return Err(sys::Result::ERROR_VALIDATION_FAILURE),
        };
        let size = [layer.size.width, layer.size.height];
        Ok(local_from_space.map(|local_from_space| {
            let local_from_quad = local_from_space.then(pose);
            let shape = Shape::Quad(Quad {
                seen_by,
                local_from_quad,
                size,
                image,
            });
            Layer {
                shape,
                blend: blend(layer.layer_flags),
            }
        }))
    }

    /// Depth is verified as any image; the compositor has no use for it.
    fn depth(&self, view: &sys::CompositionLayerProjectionView) -> XrResult<()> {
        let (_, instance) = self.runtime.peek(self.session)?;
        if !instance
            .extensions
            .contains(Extension::CompositionLayerDepth)
        {
            return Ok(());
        }
        let Some(depth) = chained::<sys::CompositionLayerDepthInfoKHR>(view, view.next)? else {
            return Ok(());
        };
        self.sub_image(&depth.sub_image)?;
        let range = 0.0..=1.0;
        let is_sound = range.contains(&depth.min_depth)
            && range.contains(&depth.max_depth)
            && depth.min_depth <= depth.max_depth
            && depth.near_z != depth.far_z;
        if is_sound {
            Ok(())
        } else {
            Err(sys::Result::ERROR_VALIDATION_FAILURE)
        }
    }

    fn sub_image(&self, image: &sys::SwapchainSubImage) -> XrResult<SubImage> {
        let swapchain = self.runtime.swapchains.get(image.swapchain)?;
        if swapchain.session != self.session || image.image_array_index >= swapchain.array_size {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        if swapchain.queue.last_released().is_none() {
            return Err(sys::Result::ERROR_LAYER_INVALID);
        }
        let sys::Rect2Di { offset, extent } = image.image_rect;
        let fits = |offset: i32, extent: i32, size: u32| {
            offset >= 0 && extent > 0 && i64::from(offset) + i64::from(extent) <= i64::from(size)
        };
        if !fits(offset.x, extent.width, swapchain.size[0])
            || !fits(offset.y, extent.height, swapchain.size[1])
        {
            return Err(sys::Result::ERROR_SWAPCHAIN_RECT_INVALID);
        }
        Ok(SubImage {
            swapchain: image.swapchain,
            rect: image.image_rect,
            array_layer: image.image_array_index,
        })
    }

    /// None while the space is lost.
    fn local_from(&self, space: sys::Space) -> XrResult<Option<Pose>> {
        let resolved = self.runtime.resolve(space, self.session)?;
        let (of_session, instance) = self.runtime.peek(self.session)?;
        let time_ns = of_session.pacing.script_time_ns(self.display_time);
        let located = space::locate(&instance.setup.script, resolved, LOCAL, time_ns, false);
        Ok((located.flags != 0).then_some(located.base_from_space))
    }
}

fn blend(flags: CompositionLayerFlags) -> Blend {
    if !flags.contains(CompositionLayerFlags::BLEND_TEXTURE_SOURCE_ALPHA) {
        Blend::Opaque
    } else if flags.contains(CompositionLayerFlags::UNPREMULTIPLIED_ALPHA) {
        Blend::Unpremultiplied
    } else {
        Blend::Premultiplied
    }
}
