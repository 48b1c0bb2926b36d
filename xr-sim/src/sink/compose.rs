//! A small compositor: layers painted one over the other, in linear light.

use glam::{Vec3, Vec4};
use image::{DynamicImage, Rgb32FImage, RgbImage};

use super::texel::{Picture, to_srgb8};
use super::{Blend, Camera, Quad};

/// What one eye sees; black where no layer is.
pub(super) struct Canvas {
    size: [u32; 2],
    colors: Vec<Vec4>,
}

impl Canvas {
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            colors: vec![Vec4::ZERO; size[0] as usize * size[1] as usize],
        }
    }

    /// Paints a picture over all of the view, texel by texel where it has the view's size.
    pub fn fill(&mut self, picture: &Picture, blend: Blend) {
        let [width, height] = self.size;
        self.paint(blend, |x, y| {
            // the texel under the pixel's middle
            let at = |pixel: u32, texels: u32, pixels: u32| {
                ((2 * u64::from(pixel) + 1) * u64::from(texels) / (2 * u64::from(pixels))) as u32
            };
            Some(picture.at(
                at(x, picture.size[0], width),
                at(y, picture.size[1], height),
            ))
        });
    }

    /// Paints a quad as the camera sees it, from its front side alone.
    pub fn draw(&mut self, picture: &Picture, blend: Blend, quad: &Quad, camera: Camera) {
        let [width, height] = self.size;
        let [left, right, up, down] = camera.fov.map(f32::tan);
        let quad_from_eye = quad.local_from_quad.inverse().then(camera.local_from_eye);
        let origin = quad_from_eye.position;
        self.paint(blend, |x, y| {
            let across = (x as f32 + 0.5) / width as f32;
            let below = (y as f32 + 0.5) / height as f32;
            let dir_in_eye = Vec3::new(
                left + (right - left) * across,
                up + (down - up) * below,
                -1.0,
            );
            let dir = quad_from_eye.orientation * dir_in_eye;
            if origin.z <= 0.0 || dir.z >= 0.0 {
                return None;
            }
            let hit = origin - dir * (origin.z / dir.z);
            let [u, v] = [hit.x / quad.size[0] + 0.5, 0.5 - hit.y / quad.size[1]];
            let is_inside = (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v);
            let texel = |u: f32, size: u32| ((u * size as f32) as u32).min(size - 1);
            is_inside.then(|| picture.at(texel(u, picture.size[0]), texel(v, picture.size[1])))
        });
    }

    fn paint(&mut self, blend: Blend, color_at: impl Fn(u32, u32) -> Option<Vec4>) {
        let width = self.size[0];
        for (index, below) in self.colors.iter_mut().enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            let Some(color) = color_at(x, y) else {
                continue;
            };
            let alpha = color.w;
            *below = match blend {
                Blend::Opaque => color,
                Blend::Premultiplied => color + *below * (1.0 - alpha),
                Blend::Unpremultiplied => color * alpha + *below * (1.0 - alpha),
            };
        }
    }

    /// 8 bits a channel on the sRGB curve.
    pub fn to_srgb(&self) -> DynamicImage {
        let [width, height] = self.size;
        let picture = RgbImage::from_fn(width, height, |x, y| {
            image::Rgb(self.at(x, y).map(to_srgb8))
        });
        picture.into()
    }

    /// Linear floats.
    pub fn to_linear(&self) -> DynamicImage {
        let [width, height] = self.size;
        Rgb32FImage::from_fn(width, height, |x, y| image::Rgb(self.at(x, y))).into()
    }

    fn at(&self, x: u32, y: u32) -> [f32; 3] {
        self.colors[y as usize * self.size[0] as usize + x as usize]
            .truncate()
            .to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::sink::SubImage;

    const RED: Vec4 = Vec4::new(1.0, 0.0, 0.0, 1.0);
    const HALF_GREEN: Vec4 = Vec4::new(0.0, 0.5, 0.0, 0.5);

    fn flat(color: Vec4, size: [u32; 2]) -> Picture {
        Picture {
            size,
            colors: vec![color; (size[0] * size[1]) as usize],
        }
    }

    fn quad(position: Vec3) -> Quad {
        let image = SubImage {
            swapchain: Default::default(),
            rect: Default::default(),
            array_layer: 0,
        };
        let local_from_quad = Pose::from_position(position);
        Quad {
            seen_by: [true; 2],
            local_from_quad,
            size: [1.0, 1.0],
            image,
        }
    }

    #[test]
    fn layers_are_blended_as_they_ask() {
        for (blend, expected) in [
            (Blend::Opaque, [0.0, 0.5, 0.0]),
            (Blend::Premultiplied, [0.5, 0.5, 0.0]),
            (Blend::Unpremultiplied, [0.5, 0.25, 0.0]),
        ] {
            let mut canvas = Canvas::new([2, 2]);
            canvas.fill(&flat(RED, [2, 2]), Blend::Opaque);
            canvas.fill(&flat(HALF_GREEN, [4, 4]), blend);
            assert_eq!(canvas.at(1, 1), expected, "{blend:?}");
        }
    }

    #[test]
    fn a_quad_covers_what_it_subtends() {
        // 1 m wide at 1 m, in a view that is 2 m wide there: the middle half
        let fov = [-1.0, 1.0, 1.0, -1.0].map(f32::atan);
        let camera = Camera {
            local_from_eye: Pose::IDENTITY,
            fov,
        };
        let mut canvas = Canvas::new([8, 8]);
        canvas.draw(
            &flat(RED, [1, 1]),
            Blend::Opaque,
            &quad(Vec3::NEG_Z),
            camera,
        );
        for y in 0..8 {
            for x in 0..8 {
                let is_covered = (2..6).contains(&x) && (2..6).contains(&y);
                assert_eq!(
                    canvas.at(x, y)[0],
                    f32::from(u8::from(is_covered)),
                    "{x} {y}"
                );
            }
        }
    }

    #[test]
    fn a_quad_is_not_seen_from_behind() {
        let fov = [-1.0, 1.0, 1.0, -1.0].map(f32::atan);
        let mut canvas = Canvas::new([8, 8]);
        let camera = Camera {
            local_from_eye: Pose::IDENTITY,
            fov,
        };
        canvas.draw(&flat(RED, [1, 1]), Blend::Opaque, &quad(Vec3::Z), camera);
        assert!(canvas.colors.iter().all(|color| *color == Vec4::ZERO));
    }

    #[test]
    fn a_quad_keeps_its_picture_upright() {
        let fov = [-1.0, 1.0, 1.0, -1.0].map(|tangent: f32| (tangent / 2.0).atan());
        let camera = Camera {
            local_from_eye: Pose::IDENTITY,
            fov,
        };
        let mut picture = flat(Vec4::ZERO, [2, 2]);
        picture.colors[1] = RED; // the upper right
        let mut canvas = Canvas::new([4, 4]);
        canvas.draw(&picture, Blend::Opaque, &quad(Vec3::NEG_Z), camera);
        assert_eq!(canvas.at(3, 0), [1.0, 0.0, 0.0]);
        assert_eq!(
            [canvas.at(0, 0), canvas.at(0, 3), canvas.at(3, 3)],
            [[0.0; 3]; 3]
        );
    }
}
