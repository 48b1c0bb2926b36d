//! The page that people look at: what a run showed, where the eye looked, and what it cost. One self-contained HTML file: no network, no
//! fonts, no second file; it works from a disk, on paper, and (its tables) without scripts.
//!
//! Plain data in, a file out. Pictures come encoded and go straight into the file, so a report is as large in memory as its JPEGs.
//! The page itself is `page.html`, `page.css` and `page.js` in this folder.

pub mod cost;
mod data;
mod picture;
mod statistics;
mod tables;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

pub use picture::{Picture, picture_stride};

/// A report.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The heading, such as `Replay of natural-look in cornell`.
    pub title: String,
    /// What was shown and how, a few words each, under the heading: scene, session, technique.
    pub subtitle: Vec<String>,
    /// Size of one eye's picture in pixels: width, height.
    pub picture_size: [u32; 2],
    /// The frames, in order of display.
    pub frames: Vec<Frame>,
    /// What the scene called for.
    pub effects: Vec<Effect>,
    /// Every parameter of the run.
    pub parameters: Vec<Parameter>,
    /// Where and by what it was made: device, driver, runtime, version, seed, hashes.
    pub provenance: Vec<Fact>,
    /// Every warning that was given.
    pub warnings: Vec<String>,
}

/// One frame.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// The frame's number in this run, as in the names of captured pictures.
    pub index: u64,
    /// When it was displayed, XrTime in nanoseconds.
    pub display_time_ns: i64,
    /// Left eye, right eye.
    pub eyes: [Eye; 2],
    /// `tracked`, `held`, `predicted`, `fallback` or `replay`, as in `frames.csv`; others are shown as they are named.
    pub gaze_state: String,
    /// Age of the gaze sample at display time, milliseconds; `None` if there was none.
    pub gaze_age_ms: Option<f64>,
    /// Direction of gaze in the head: to the right, up, degrees.
    pub gaze_angles_deg: Option<[f64; 2]>,
    /// Time of each pass, milliseconds, in the order in which they ran. A pass may be missing where it did not run.
    pub pass_ms: Vec<(String, f64)>,
    /// Other numbers of the frame, such as photons stored.
    pub counts: Vec<(String, u64)>,
}

/// One eye in one frame. Image points are (u, v) with (0, 0) the top left corner and (1, 1) the bottom right.
#[derive(Clone, Debug, Default)]
pub struct Eye {
    /// What it saw. Without one the page shows the nearest earlier picture and says so.
    pub picture: Option<Picture>,
    /// Where it looked.
    pub gaze_uv: Option<[f32; 2]>,
    /// The regions' outlines.
    pub outlines: Vec<Outline>,
}

/// Part of a region's outline in the picture.
#[derive(Clone, Debug)]
pub struct Outline {
    /// Whose outline it is.
    pub region: OutlinedRegion,
    /// Image points joined by lines; the first is repeated at the end of a closed outline.
    pub points_uv: Vec<[f32; 2]>,
}

/// A region that has an outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutlinedRegion {
    /// The fovea ends here.
    Fovea,
    /// The transition ends here and the periphery begins.
    Transition,
}

/// Something that a scene may call for, and what was done about it.
#[derive(Clone, Debug)]
pub struct Effect {
    /// Its name, such as `caustics`.
    pub name: String,
    /// Whether passes ran for it.
    pub active: bool,
    /// Why, or why not.
    pub why: String,
}

/// A parameter of the run.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its key, as for `--set`.
    pub key: String,
    /// Its value.
    pub value: String,
    /// The value's unit, empty where it has none.
    pub unit: String,
}

/// A fact about the run.
#[derive(Clone, Debug)]
pub struct Fact {
    /// What it is about, such as `device`.
    pub name: String,
    /// What it says.
    pub value: String,
}

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file could not be written.
    #[error("cannot write the report {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A picture could not be encoded.
    #[error("cannot encode a picture of {width}x{height} from {samples} samples")]
    Encode {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Samples given.
        samples: usize,
        /// What the encoder said, if it was asked.
        source: Option<image::ImageError>,
    },
}

/// The page with a slot `{{name}}` for each part that differs between reports.
const PAGE: &str = include_str!("page.html");
/// Colours and text of every page.
const STYLE: &str = include_str!("page.css");

impl Report {
    /// Writes the page to a file.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        write_file(path, |file| self.write_to(file))
    }

    /// Writes the page, piece by piece.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        fill(PAGE, out, |slot, out| match slot {
            "title" => out.write_all(tables::escape(&self.title).as_bytes()),
            "subtitle" => tables::subtitle(self, out),
            "warnings" => tables::warnings(&self.warnings, out),
            "times" => tables::times(&self.frames, out),
            "gaze" => tables::gaze(&self.frames, out),
            "effects" => tables::effects(&self.effects, out),
            "parameters" => tables::parameters(&self.parameters, out),
            "provenance" => tables::provenance(&self.provenance, out),
            "style" => out.write_all(STYLE.as_bytes()),
            "script" => out.write_all(include_str!("page.js").as_bytes()),
            "data" => data::write(self, out),
            "pictures" => picture::write_all(&self.frames, out),
            // The text before the first slot.
            _ => Ok(()),
        })
    }
}

/// Writes a file of pages.
fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), ReportError> {
    let write = || {
        let mut file = BufWriter::new(File::create(path)?);
        write(&mut file)?;
        file.flush()
    };
    write().map_err(|source| ReportError::Write {
        path: path.into(),
        source,
    })
}

/// Writes a page and fills its slots. They are found in the page alone, so nothing in the data can be mistaken for one.
fn fill<W: Write>(
    page: &str,
    out: &mut W,
    mut slot: impl FnMut(&str, &mut W) -> io::Result<()>,
) -> io::Result<()> {
    for piece in page.split("{{") {
        let (name, text) = piece.split_once("}}").unwrap_or(("", piece));
        slot(name, out)?;
        out.write_all(text.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(report: &Report) -> String {
        let mut page = Vec::new();
        report.write_to(&mut page).unwrap();
        String::from_utf8(page).unwrap()
    }

    #[test]
    fn every_slot_of_the_page_is_filled() {
        let slots = PAGE
            .split("{{")
            .skip(1)
            .filter_map(|piece| piece.split_once("}}"));
        let page = written(&Report::default());
        let mut count = 0;
        for (slot, _) in slots {
            assert!(!page.contains(&format!("{{{{{slot}}}}}")), "{slot}");
            count += 1;
        }
        assert_eq!(count, 13);
    }

    #[test]
    fn names_cannot_end_a_script_or_become_markup() {
        let hostile = "</script><script>alert(1)</script><!--{{data}}";
        let report = Report {
            title: hostile.into(),
            subtitle: vec![hostile.into()],
            warnings: vec![hostile.into()],
            frames: vec![Frame {
                gaze_state: hostile.into(),
                pass_ms: vec![(hostile.into(), 1.0)],
                counts: vec![(hostile.into(), 1)],
                ..Frame::default()
            }],
            effects: vec![Effect {
                name: hostile.into(),
                active: true,
                why: hostile.into(),
            }],
            parameters: vec![Parameter {
                key: hostile.into(),
                value: hostile.into(),
                unit: hostile.into(),
            }],
            provenance: vec![Fact {
                name: hostile.into(),
                value: hostile.into(),
            }],
            ..Report::default()
        };
        let (harmless, page) = (written(&Report::default()), written(&report));
        for token in ["<script", "</script", "<!--"] {
            let count = |page: &str| page.matches(token).count();
            assert_eq!(count(&page), count(&harmless), "{token}");
        }
        assert!(page.contains("&lt;/script&gt;"), "the name is still shown");
    }

    #[test]
    fn the_page_asks_for_nothing_outside_itself() {
        let page = written(&Report::default());
        assert!(page.contains("default-src 'none'"));
        // Names of XML vocabularies are no requests.
        let page = page.replace("http://www.w3.org/2000/svg", "");
        for address in ["http:", "https:", "//cdn", "@import", "url("] {
            assert!(!page.contains(address), "{address}");
        }
    }
}
