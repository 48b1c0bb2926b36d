//! Linear pictures as OpenEXR files: 32-bit float R, G and B, scan lines compressed without loss in blocks of 16 (ZIP), which every
//! EXR reader knows. The `image` crate writes tiles with RLE only, so this talks to the `exr` crate under it.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use ::exr::prelude::*;

use super::LinearImage;
use crate::file_kind::kind_of;

/// The first bytes of every EXR file (OpenEXR File Layout, "Magic Number").
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// A file may ask for no more pixels than this on a side, and no more than [`MAX_PIXELS`] in all, before memory is given to it.
pub const MAX_SIDE: usize = 16_384;
/// 64 Mi pixels, 768 MiB as 32-bit RGB: twice a pair of 4096x4096 eye images.
pub const MAX_PIXELS: usize = 1 << 26;

/// Why a picture could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// The file could not be opened, or is a folder.
    #[error("cannot open {}: check that it exists and may be read; it must be an OpenEXR picture, such as `macula render SCENE --out NAME.exr` writes", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is something else.
    #[error(
        "{} is {found}, not an OpenEXR picture of radiance; `macula render SCENE --out NAME.exr` writes one",
        path.display()
    )]
    NotExr {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// The file is an EXR, but cut short, or holds something that this reader does not know.
    #[error(
        "cannot read {} as an OpenEXR picture with channels R, G and B: it may be cut short; write or copy it again",
        path.display()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        source: ::exr::error::Error,
    },
    /// The file says that it is larger than [`MAX_SIDE`] or [`MAX_PIXELS`].
    #[error(
        "{} says it holds {width}x{height} pixels; at most {MAX_SIDE} a side and {MAX_PIXELS} in all are read",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Pixels across, as the file says.
        width: usize,
        /// Pixels down, as the file says.
        height: usize,
    },
    /// The picture to write has no pixels, or not as many as its size says.
    #[error(
        "cannot write {}: {pixels} pixels do not make a picture of {width}x{height}",
        path.display()
    )]
    WrongPixelCount {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
    /// The file could not be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        source: ::exr::error::Error,
    },
}

/// Reads the first flat RGB layer of an EXR file (half, float or integer samples; alpha and other channels are ignored; the
/// data window is the picture). NaN and infinite samples are kept as they are.
///
/// # Errors
/// A file that is missing, cut short, no EXR, without R, G and B, or larger than the limits.
pub fn read(path: &Path) -> std::result::Result<LinearImage, ExrError> {
    let unopened = |source| ExrError::Open {
        path: path.into(),
        source,
    };
    let mut file = BufReader::new(File::open(path).map_err(unopened)?);
    let first_bytes = file.fill_buf().map_err(unopened)?;
    if !first_bytes.starts_with(&MAGIC) {
        return Err(ExrError::NotExr {
            path: path.into(),
            found: kind_of(first_bytes).unwrap_or("something else"),
        });
    }
    let unreadable = |source| ExrError::Read {
        path: path.into(),
        source,
    };
    let chunks = ::exr::block::read(file, false).map_err(unreadable)?;
    for header in chunks.headers() {
        let Vec2(width, height) = header.layer_size;
        if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
            return Err(ExrError::TooLarge {
                path: path.into(),
                width,
                height,
            });
        }
    }
    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size, vec![[0.0_f32; 3]; size.area()]),
            |(size, rgb): &mut (Vec2<usize>, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                rgb[at.flat_index_for_size(*size)] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(chunks)
        .map_err(unreadable)?;
    let (size, rgb) = image.layer_data.channel_data.pixels;
    Ok(LinearImage {
        width: size.width() as u32,
        height: size.height() as u32,
        rgb,
    })
}

/// Writes a picture as 32-bit float RGB. What it replaces, if anything, is the caller's business.
///
/// # Errors
/// A picture whose pixels do not fit its size, or a file that cannot be written.
pub fn write(path: &Path, image: &LinearImage) -> std::result::Result<(), ExrError> {
    if !image.is_whole() {
        return Err(ExrError::WrongPixelCount {
            path: path.into(),
            width: image.width,
            height: image.height,
            pixels: image.rgb.len(),
        });
    }
    let size = Vec2(image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = image.rgb[at.flat_index_for_size(size)];
        (r, g, b)
    });
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    Image::from_layer(layer)
        .write()
        .to_file(path)
        .map_err(|source| ExrError::Write {
            path: path.into(),
            source,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(width: u32, height: u32) -> LinearImage {
        let rgb = (0..width * height)
            .map(|i| [i as f32 * 0.37, 1e-6 * i as f32, 1e6 / (1.0 + i as f32)])
            .collect();
        LinearImage { width, height, rgb }
    }

    #[test]
    fn a_picture_comes_back_bit_for_bit_at_odd_sizes_too() {
        let folder = tempfile::tempdir().unwrap();
        for (width, height) in [(1, 1), (7, 33), (64, 5)] {
            let mut image = gradient(width, height);
            image.rgb[0] = [f32::INFINITY, -0.0, -3.5];
            let path = folder.path().join("picture.exr");
            write(&path, &image).unwrap();
            assert_eq!(read(&path).unwrap(), image);
        }
    }

    #[test]
    fn nan_samples_survive_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nan.exr");
        let mut image = gradient(3, 3);
        image.rgb[4][1] = f32::NAN;
        write(&path, &image).unwrap();
        assert!(read(&path).unwrap().rgb[4][1].is_nan());
    }

    #[test]
    fn every_truncation_is_refused_with_the_name_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let whole = folder.path().join("whole.exr");
        write(&whole, &gradient(9, 40)).unwrap();
        let bytes = std::fs::read(&whole).unwrap();
        let cut = folder.path().join("cut.exr");
        for length in (0..bytes.len()).step_by(13) {
            std::fs::write(&cut, &bytes[..length]).unwrap();
            let error = read(&cut).unwrap_err().to_string();
            assert!(error.contains("cut.exr"), "{length}: {error}");
        }
        std::fs::write(&cut, &bytes).unwrap();
        read(&cut).expect("the whole file is readable, so the cuts are what was refused");
    }

    #[test]
    fn a_size_beyond_the_limits_is_refused_before_memory_is_given_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huge.exr");
        write(&path, &gradient(2, 2)).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let mut set = |attribute: &[u8], offset: usize, value: i32| {
            let found = bytes.windows(attribute.len()).position(|w| w == attribute);
            let length_field = 4;
            let at = found.unwrap() + attribute.len() + length_field + offset;
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        };
        // xmin, ymin, xmax, ymax; 16 lines a chunk.
        set(b"dataWindow\0box2i\0", 8, 65_535);
        set(b"dataWindow\0box2i\0", 12, 65_535);
        set(b"chunkCount\0int\0", 0, 4096);
        std::fs::write(&path, bytes).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, ExrError::TooLarge { .. }), "{error:?}");
        assert!(error.to_string().contains("65536x65536"), "{error}");
    }

    #[test]
    fn a_picture_that_lacks_pixels_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("short.exr");
        let mut image = gradient(4, 4);
        image.rgb.pop();
        assert!(matches!(
            write(&path, &image),
            Err(ExrError::WrongPixelCount { pixels: 15, .. })
        ));
        assert!(!path.exists());
    }
}
