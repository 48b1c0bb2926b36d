//! Pictures inside the page: encoded once, written as base64 into blocks that the browser does not decode until a frame is shown.

use std::io::{self, Write};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::{Frame, ReportError};

/// Noise in the periphery makes pictures large; at this quality no blocks show and 100 frames for two eyes at 320x320 stay under 15 MB.
const JPEG_QUALITY: u8 = 90;
/// More pictured frames than this make a page that browsers open slowly.
const MAX_PICTURED_FRAMES: usize = 240;

/// An encoded picture.
#[derive(Clone, Debug)]
pub struct Picture {
    media_type: &'static str,
    bytes: Vec<u8>,
}

impl Picture {
    /// A picture that is a PNG file already.
    pub fn png(bytes: Vec<u8>) -> Self {
        Self {
            media_type: "image/png",
            bytes,
        }
    }

    /// Encodes 8-bit sRGB samples (R G B A, row by row; alpha is ignored) as JPEG.
    ///
    /// # Errors
    /// [`ReportError::Encode`]: samples that do not fit the size, or a size that JPEG cannot hold.
    pub fn jpeg(width: u32, height: u32, rgba: &[u8]) -> Result<Self, ReportError> {
        let failed = |source| ReportError::Encode {
            width,
            height,
            samples: rgba.len(),
            source,
        };
        if rgba.is_empty() || rgba.len() != 4 * width as usize * height as usize {
            return Err(failed(None));
        }
        let rgb: Vec<u8> = rgba
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)
            .encode(&rgb, width, height, ExtendedColorType::Rgb8)
            .map_err(|source| failed(Some(source)))?;
        Ok(Self {
            media_type: "image/jpeg",
            bytes,
        })
    }

    /// Encodes 8-bit sRGB samples (R G B, row by row) as PNG, without loss.
    ///
    /// # Errors
    /// [`ReportError::Encode`]: samples that do not fit the size.
    pub fn png_of(width: u32, height: u32, rgb: &[u8]) -> Result<Self, ReportError> {
        let failed = |source| ReportError::Encode {
            width,
            height,
            samples: rgb.len(),
            source,
        };
        if rgb.is_empty() || rgb.len() != 3 * width as usize * height as usize {
            return Err(failed(None));
        }
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes)
            .write_image(rgb, width, height, ExtendedColorType::Rgb8)
            .map_err(|source| failed(Some(source)))?;
        Ok(Self::png(bytes))
    }

    /// The picture as an address that holds all of it.
    pub(super) fn data_uri(&self) -> String {
        let text = STANDARD.encode(&self.bytes);
        format!("data:{};base64,{text}", self.media_type)
    }

    /// How large it is, encoded.
    pub fn byte_count(&self) -> usize {
        self.bytes.len()
    }
}

/// Every how many frames a frame should carry pictures, so that a report of `frame_count` frames stays one that browsers open at ease: 1
/// for up to 240 frames.
pub fn picture_stride(frame_count: usize) -> usize {
    frame_count.div_ceil(MAX_PICTURED_FRAMES).max(1)
}

/// Writes every picture as a data block named after its frame's place in the report and its eye.
pub(super) fn write_all(frames: &[Frame], out: &mut impl Write) -> io::Result<()> {
    for (frame, eye, picture) in frames.iter().enumerate().flat_map(|(i, frame)| {
        let eyes = frame.eyes.iter().enumerate();
        eyes.filter_map(move |(e, eye)| Some((i, e, eye.picture.as_ref()?)))
    }) {
        let media_type = picture.media_type;
        write!(
            out,
            "<script type=\"{media_type}\" id=\"picture-{frame}-{eye}\">"
        )?;
        {
            let mut encoder = EncoderWriter::new(&mut *out, &STANDARD);
            encoder.write_all(&picture.bytes)?;
            encoder.finish()?;
        }
        writeln!(out, "</script>")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jpeg_looks_like_its_source() {
        let rgba: Vec<u8> = (0..64 * 64)
            .flat_map(|i| [(i % 64 * 4) as u8, 128, 30, 255])
            .collect();
        let picture = Picture::jpeg(64, 64, &rgba).unwrap();
        let decoded = image::load_from_memory(&picture.bytes).unwrap().to_rgb8();
        for (shown, source) in decoded.pixels().zip(rgba.chunks_exact(4)) {
            for channel in 0..3 {
                assert!(shown[channel].abs_diff(source[channel]) < 12);
            }
        }
        assert!(Picture::jpeg(64, 64, &rgba[4..]).is_err());
        assert!(Picture::jpeg(0, 0, &[]).is_err());
    }

    #[test]
    fn long_recordings_show_every_nth_frame() {
        assert_eq!([0, 1, 240, 241, 900].map(picture_stride), [1, 1, 1, 2, 4]);
    }
}
