//! The page of `macula cost`: what accuracy costs in time, to be understood without help. Plain data in, a file out, as for a session's
//! report, with which it shares colours and tables.

mod sections;

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::{Fact, Picture, ReportError, STYLE, data, fill, tables, write_file};

/// Everything that the page shows.
#[derive(Clone, Debug, Default)]
pub struct CostPage {
    /// The answer in one sentence.
    pub title: String,
    /// What was measured, a few words each.
    pub subtitle: Vec<String>,
    /// What follows: headings, and plain sentences under each.
    pub sentences: Vec<(String, Vec<String>)>,
    /// What to do next: a few words, and the command that does it.
    pub next: Vec<(String, String)>,
    /// Every warning that was given.
    pub warnings: Vec<String>,
    /// Names of all techniques that there are, shown or not: a technique's colour and shape are those of its place here, on every page.
    pub techniques: Vec<String>,
    /// The points, by rising time.
    pub points: Vec<PlotPoint>,
    /// Parameters that differ from their defaults and are the same at all points that read them.
    pub shared: String,
    /// The budget, milliseconds, where one was asked for.
    pub budget_ms: Option<f64>,
    /// Pictures of chosen points, the reference first.
    pub crops: Vec<Crop>,
    /// Techniques at one error or one time.
    pub comparisons: Vec<Comparison>,
    /// Where and by what it was measured.
    pub facts: Vec<Fact>,
}

/// One measured setting.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PlotPoint {
    /// Name of the technique.
    pub technique: String,
    /// The setting in a few words.
    pub label: String,
    /// Pixels of the picture, as `WxH`.
    pub size: String,
    /// Paths of a pass, with what is counted: `4000 photons`.
    pub paths: String,
    /// Number of paths, for sorting.
    pub effort: u32,
    /// Passes of a frame.
    pub passes: u32,
    /// What else differs from the defaults, and is not the same at all points.
    pub others: String,
    /// Median time of a frame, milliseconds.
    pub ms: f64,
    /// 25th and 75th percentile, milliseconds.
    pub quartiles_ms: [f64; 2],
    /// Relative mean squared error in the fovea.
    pub relmse_fovea: Option<f64>,
    /// Its standard error over frames.
    pub relmse_fovea_se: f64,
    /// The share of it that is bias, 0 to 1.
    pub bias_share: f64,
    /// Mean squared error in the fovea, (W/(m² sr))².
    pub mse_fovea: Option<f64>,
    /// In the transition.
    pub mse_transition: Option<f64>,
    /// In the periphery.
    pub mse_periphery: Option<f64>,
    /// Time of each stage, milliseconds.
    pub pass_ms: Vec<(String, f64)>,
    /// Whether no other point beats it.
    pub on_front: bool,
    /// Whether it is the one chosen for the budget.
    pub is_chosen: bool,
}

/// What a point looks like.
#[derive(Clone, Debug)]
pub struct Crop {
    /// What it is of, such as `chosen for 50 ms`.
    pub name: String,
    /// Its figures.
    pub caption: String,
    /// The picture.
    pub picture: Picture,
    /// Where it is wrong; the reference has none.
    pub error: Option<Picture>,
}

/// Techniques at one error or one time.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// The level, such as `Foveal error 0.02`.
    pub name: String,
    /// What the last column tells, such as `times the fastest`.
    pub ratio_name: String,
    /// Technique, time, error, ratio and setting, as text.
    pub rows: Vec<[String; 5]>,
}

/// The page with a slot `{{name}}` for each part that differs.
const PAGE: &str = include_str!("page.html");

impl CostPage {
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
            "subtitle" => sections::subtitle(&self.subtitle, out),
            "sentences" => sections::sentences(&self.sentences, out),
            "next" => sections::next(&self.next, out),
            "warnings" => tables::warnings(&self.warnings, out),
            "crops" => sections::crops(&self.crops, out),
            "comparisons" => sections::comparisons(&self.comparisons, out),
            "shared" => sections::shared(&self.shared, out),
            "points" => sections::points(&self.points, out),
            "provenance" => tables::provenance(&self.facts, out),
            "style" => {
                out.write_all(STYLE.as_bytes())?;
                out.write_all(include_str!("page.css").as_bytes())
            }
            "script" => out.write_all(include_str!("page.js").as_bytes()),
            "data" => {
                let data = serde_json::json!({
                    "techniques": self.techniques,
                    "points": self.points,
                    "budget_ms": self.budget_ms,
                });
                out.write_all(data::escaped(&data).as_bytes())
            }
            // The text before the first slot.
            _ => Ok(()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(page: &CostPage) -> String {
        let mut text = Vec::new();
        page.write_to(&mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn every_slot_of_the_page_is_filled_and_it_asks_for_nothing_outside_itself() {
        let page = written(&CostPage::default());
        assert!(!page.contains("{{") && page.contains("default-src 'none'"));
        // Names of XML vocabularies are no requests.
        let page = page.replace("http://www.w3.org/2000/svg", "");
        for address in ["http:", "https:", "//cdn", "@import", "url("] {
            assert!(!page.contains(address), "{address}");
        }
    }

    #[test]
    fn names_cannot_end_a_script_or_become_markup() {
        let hostile = "</script><script>alert(1)</script><!--{{data}}";
        let page = CostPage {
            title: hostile.into(),
            subtitle: vec![hostile.into()],
            sentences: vec![(hostile.into(), vec![hostile.into()])],
            next: vec![(hostile.into(), hostile.into())],
            warnings: vec![hostile.into()],
            techniques: vec![hostile.into()],
            shared: hostile.into(),
            points: vec![PlotPoint {
                technique: hostile.into(),
                label: hostile.into(),
                others: hostile.into(),
                pass_ms: vec![(hostile.into(), 1.0)],
                ..PlotPoint::default()
            }],
            crops: vec![Crop {
                name: hostile.into(),
                caption: hostile.into(),
                picture: Picture::png(vec![1]),
                error: None,
            }],
            comparisons: vec![Comparison {
                name: hostile.into(),
                ratio_name: hostile.into(),
                rows: vec![[hostile; 5].map(str::to_owned)],
            }],
            facts: vec![Fact {
                name: hostile.into(),
                value: hostile.into(),
            }],
            ..CostPage::default()
        };
        let (harmless, page) = (written(&CostPage::default()), written(&page));
        for token in ["<script", "</script", "<!--"] {
            let count = |page: &str| page.matches(token).count();
            assert_eq!(count(&page), count(&harmless), "{token}");
        }
        assert!(page.contains("&lt;/script&gt;"), "the name is still shown");
    }
}
