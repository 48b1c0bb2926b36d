//! Where submitted frames go: nowhere, or composed into a picture for each eye.

mod compose;
mod texel;

use std::path::{Path, PathBuf};

use openxr_sys as sys;

use crate::XrResult;
use crate::config::{Capture, Config, PictureFormat};
use crate::handle::Slab;
use crate::pose::Pose;
use crate::swapchain::Swapchain;
use compose::Canvas;

/// A verified layer, its poses brought to LOCAL space.
#[derive(Debug)]
pub(crate) struct Layer {
    pub shape: Shape,
    pub blend: Blend,
}

#[derive(Debug)]
pub(crate) enum Shape {
    /// What fills each eye's view.
    Projection([ProjectionView; 2]),
    /// A rectangle in the world, in the eyes that see it.
    Quad(Quad),
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct ProjectionView {
    pub camera: Camera,
    pub image: SubImage,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Quad {
    pub seen_by: [bool; 2],
    /// Its middle; +X to its right, +Y up.
    pub local_from_quad: Pose,
    /// In metres.
    pub size: [f32; 2],
    pub image: SubImage,
}

/// An eye as a pinhole: angles of the left, right, upper and lower edge in radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Camera {
    pub local_from_eye: Pose,
    pub fov: [f32; 4],
}

/// A part of a swapchain's image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubImage {
    pub swapchain: sys::Swapchain,
    pub rect: sys::Rect2Di,
    pub array_layer: u32,
}

/// How a layer covers those below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Blend {
    Opaque,
    /// The colour has been multiplied with alpha already.
    Premultiplied,
    Unpremultiplied,
}

/// Receives what the eyes are shown.
pub(crate) struct Sink {
    capture: Option<Capture>,
    default_size: [u32; 2],
}

impl Sink {
    pub fn new(config: &Config) -> Self {
        Self {
            capture: config.capture.clone(),
            default_size: [config.eye_width, config.eye_height],
        }
    }

    /// Takes a frame; `cameras` are the eyes for layers that bring none of their own.
    pub fn show(
        &self,
        frame_index: u64,
        layers: &[Layer],
        cameras: [Camera; 2],
        swapchains: &Slab<Swapchain>,
    ) -> XrResult<()> {
        let Some(capture) = self.capture.as_ref().filter(|_| !layers.is_empty()) else {
            return Ok(());
        };
        for (eye, name) in ["left", "right"].into_iter().enumerate() {
            let canvas = self.compose(eye, layers, cameras[eye], swapchains)?;
            let (extension, picture) = match capture.format {
                PictureFormat::Png => ("png", canvas.to_srgb()),
                PictureFormat::Exr => ("exr", canvas.to_linear()),
            };
            let path = capture
                .folder
                .join(format!("{name}_{frame_index:05}.{extension}"));
            write(&path, &picture)?;
        }
        Ok(())
    }

    fn compose(
        &self,
        eye: usize,
        layers: &[Layer],
        camera: Camera,
        swapchains: &Slab<Swapchain>,
    ) -> XrResult<Canvas> {
        let first_view = layers.iter().find_map(|layer| match &layer.shape {
            Shape::Projection(views) => Some(views[eye]),
            Shape::Quad(_) => None,
        });
        let (camera, size) = match first_view {
            Some(view) => (view.camera, view.image.size()),
            None => (camera, self.default_size),
        };
        let mut canvas = Canvas::new(size);
        for layer in layers {
            match &layer.shape {
                Shape::Projection(views) => {
                    canvas.fill(&views[eye].image.read(swapchains)?, layer.blend);
                }
                Shape::Quad(quad) if quad.seen_by[eye] => {
                    canvas.draw(&quad.image.read(swapchains)?, layer.blend, quad, camera);
                }
                Shape::Quad(_) => {}
            }
        }
        Ok(canvas)
    }
}

impl SubImage {
    fn size(&self) -> [u32; 2] {
        [
            self.rect.extent.width as u32,
            self.rect.extent.height as u32,
        ]
    }

    fn read(&self, swapchains: &Slab<Swapchain>) -> XrResult<texel::Picture> {
        let swapchain = swapchains.get(self.swapchain)?;
        let index = swapchain
            .queue
            .last_released()
            .ok_or(sys::Result::ERROR_LAYER_INVALID)?;
        texel::Picture::decode(&swapchain.images.read(index, self.rect, self.array_layer)?)
    }
}

fn write(path: &Path, picture: &image::DynamicImage) -> XrResult<()> {
    picture.save(path).map_err(|error| {
        let path: PathBuf = path.into();
        tracing::error!("cannot write {}: {error}", path.display());
        sys::Result::ERROR_RUNTIME_FAILURE
    })
}
