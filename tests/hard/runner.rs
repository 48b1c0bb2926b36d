//! A hard case, and how every technique's picture of it is judged.
//!
//! A picture is taken in passes with random numbers of their own, so their spread tells the noise of its mean: a tolerance is five
//! standard errors, and 2 % for the bias of methods that blur. Every picture is finite and not negative, no
//! brighter than its lights allow, and comes without warnings that the case does not expect.

use macula::image::LinearImage;
use macula::scene::Scene;
use macula::scene::loaded::LoadedScene;
use macula::technique::{self, REGISTRY, Statistics, TechniqueEntry};

use crate::energy_bound::radiance_bound_w_m2_sr;
use crate::maker::{Recipe, gpu, mean};

/// The technique that others are judged by.
const ORACLE: &str = "path";
/// Standard errors that a mean may be off.
const STANDARD_ERRORS: f64 = 5.0;
/// The share of a mean that the bias of methods that blur may take.
const BIAS: f64 = 0.02;

/// The techniques, the oracle first.
pub fn techniques() -> Vec<&'static TechniqueEntry> {
    let mut entries: Vec<_> = REGISTRY.iter().collect();
    entries.sort_by_key(|entry| entry.name != ORACLE);
    entries
}

/// What a picture must be.
pub enum Expected {
    /// This mean, each channel, W/(m² sr).
    Mean([f64; 3]),
    /// Not a photon arrives: every pixel is exactly 0.
    Black,
    /// This mean where direct light comes by shadow rays or paths, and black where it comes from photons, of which there are none.
    WithoutPhotons([f64; 3]),
    /// Some light, however much.
    Lit,
    /// The mean that the oracle finds.
    Oracle,
    /// The mean of the same technique's picture of another scene.
    Like(Box<Scene>),
}

/// What shows that the judgement can fail.
pub enum Control {
    /// The picture itself, brighter by this factor.
    Brighter(f64),
    /// The picture itself with this radiance on top, W/(m² sr).
    Added(f64),
    /// Another scene's picture.
    Scene(Box<Scene>),
}

/// A scene and settings that are hard on numbers.
pub struct Case {
    name: &'static str,
    scene: Scene,
    settings: Vec<(&'static str, &'static str)>,
    size: (u32, u32),
    passes: u32,
    expected: Expected,
    warning: Option<&'static str>,
    photons_only: Option<&'static str>,
    has_delta_caustic: bool,
    known_shortfall: f64,
    control: Control,
}

impl Case {
    /// 16x16 pixels in 8 passes of 4000 photon paths, or of 4 paths a pixel or sample; a mean within 2 % and noise, where 15 % more is noticed.
    pub fn new(name: &'static str, scene: Scene, expected: Expected) -> Self {
        Self {
            name,
            scene,
            settings: vec![
                ("photon.count", "4000"),
                ("path.samples", "4"),
                ("indirect.paths", "4"),
            ],
            size: (16, 16),
            passes: 8,
            expected,
            warning: None,
            photons_only: None,
            has_delta_caustic: false,
            known_shortfall: 0.0,
            control: Control::Brighter(1.15),
        }
    }

    /// Nothing but black is right, and `lit` shows that there could be light.
    pub fn black(name: &'static str, scene: Scene, lit: Scene) -> Self {
        let control = Control::Scene(Box::new(lit));
        let case = Self::new(name, scene, Expected::Black).passes(4);
        Self { control, ..case }
    }

    pub fn set(mut self, key: &'static str, value: &'static str) -> Self {
        self.settings.push((key, value));
        self
    }

    pub fn size(self, width: u32, height: u32) -> Self {
        let size = (width, height);
        Self { size, ..self }
    }

    pub fn passes(self, passes: u32) -> Self {
        Self { passes, ..self }
    }

    pub fn control(self, control: Control) -> Self {
        Self { control, ..self }
    }

    /// The technique must warn, with this in its words.
    pub fn warned(self, words: &'static str) -> Self {
        let warning = Some(words);
        Self { warning, ..self }
    }

    /// The case is about photon maps, for the given reason: it says nothing of a technique that has none.
    pub fn photons_only(self, reason: &'static str) -> Self {
        let photons_only = Some(reason);
        Self {
            photons_only,
            ..self
        }
    }

    /// Its light comes from a lamp without extent, by way of mirrors or glass: it says nothing of a technique that finds no such light.
    pub fn delta_caustic(self) -> Self {
        Self {
            has_delta_caustic: true,
            ..self
        }
    }

    /// A fault that is known and told in README: a mean may be off by this share more.
    pub fn known_shortfall(self, share: f64) -> Self {
        let known_shortfall = share;
        Self {
            known_shortfall,
            ..self
        }
    }

    /// Why the case says nothing of a technique.
    fn is_beyond(&self, entry: &TechniqueEntry) -> Option<&'static str> {
        let no_photons = self.photons_only.filter(|_| !entry.has_photons);
        let is_unseen = self.has_delta_caustic && !entry.has_delta_caustics;
        no_photons.or(is_unseen.then_some("its paths never meet a lamp without extent"))
    }

    fn recipe(&self, technique: &'static str) -> Recipe {
        let (width, height) = self.size;
        let recipe = Recipe::new(technique).size(width, height);
        let settings = self.settings.iter();
        settings.fold(recipe, |recipe, (key, value)| recipe.set(key, value))
    }

    fn take(&self, technique: &'static str, scene: &Scene) -> Series {
        Series::take(&self.recipe(technique), scene, self.passes)
    }

    /// The most radiance that lights and surfaces allow before the case's eye, if a bound is known, W/(m² sr).
    pub fn bound_w_m2_sr(&self) -> Option<f64> {
        let eye = self.scene.cameras[0].view(1, 1).pose.position_m;
        radiance_bound_w_m2_sr(&self.scene, 0.0, Some(eye))
    }

    /// Whether the case asks for no more than some light.
    pub fn is_vague(&self) -> bool {
        matches!(self.expected, Expected::Lit)
    }

    /// Judges one technique.
    fn judge(&self, technique: &'static str) -> Result<(), String> {
        let target = match &self.expected {
            Expected::Mean(mean) => Target::exactly(*mean),
            Expected::WithoutPhotons(mean) => {
                let entry = technique::find(technique).unwrap();
                Target::exactly(match entry.has_direct_light {
                    true => *mean,
                    false => [0.0; 3],
                })
            }
            Expected::Black | Expected::Lit => Target::exactly([0.0; 3]),
            Expected::Oracle => {
                let recipe = self.recipe(ORACLE).set("path.samples", "32");
                let recipe = recipe.set("random.seed", "7");
                Target::of(&Series::take(&recipe, &self.scene, self.passes))
            }
            Expected::Like(scene) => Target::of(&self.take(technique, scene)),
        };
        let target = Target {
            bound: self.bound_w_m2_sr(),
            ..target
        };
        let series = self.take(technique, &self.scene);
        self.verdict(&series, &target)?;

        let wrong = match &self.control {
            Control::Brighter(factor) => series.with_each(|x| factor * x),
            Control::Added(radiance) => series.with_each(|x| x + radiance),
            Control::Scene(scene) => self.take(technique, scene),
        };
        let wrongs = [
            (wrong, "the control"),
            (series.spoiled(f32::NAN), "a pixel that is no number"),
            (series.spoiled(f32::INFINITY), "an infinite pixel"),
            (series.spoiled(-1e-6), "a negative pixel"),
        ];
        for (wrong, what) in wrongs {
            if self.verdict(&wrong, &target).is_ok() {
                let mean = wrong.mean;
                return Err(format!("{what} passes, with the mean {mean:?}"));
            }
        }
        Ok(())
    }

    fn verdict(&self, series: &Series, target: &Target) -> Result<(), String> {
        let values = series.image.rgb.as_flattened();
        if !values.iter().all(|x| x.is_finite() && *x >= 0.0) {
            return Err("there are values that no radiance has".into());
        }
        let warnings = series.statistics.warnings.join("\n");
        let is_told = match self.warning {
            Some(words) => warnings.contains(words),
            None => warnings.is_empty(),
        };
        if !is_told {
            return Err(format!("the warnings are `{warnings}`"));
        }
        if let Some(bound) = target.bound {
            let margin = tolerance([bound; 3], series.standard_error);
            if (0..3).any(|c| series.mean[c] > bound + margin[c]) {
                let mean = series.mean;
                return Err(format!(
                    "the mean {mean:?} is above {bound}, the most that lights and surfaces allow"
                ));
            }
        }
        let is_black = values.iter().all(|x| *x == 0.0);
        match self.expected {
            Expected::Black => is_black
                .then_some(())
                .ok_or_else(|| format!("not black, but {:?} in the mean", series.mean)),
            Expected::Lit => (!is_black).then_some(()).ok_or("black".into()),
            _ => self.agrees(series, target),
        }
    }

    fn agrees(&self, series: &Series, target: &Target) -> Result<(), String> {
        let noise = [0, 1, 2].map(|c| series.standard_error[c].hypot(target.standard_error[c]));
        let margin = tolerance(target.mean, noise);
        let margin = [0, 1, 2].map(|c| margin[c] + self.known_shortfall * target.mean[c]);
        let is_near = |c: usize| (series.mean[c] - target.mean[c]).abs() <= margin[c];
        (0..3).all(is_near).then_some(()).ok_or_else(|| {
            format!(
                "the mean is {:?}, not {:?} +- {margin:?}",
                series.mean, target.mean
            )
        })
    }
}

/// How far from what is expected a mean with the given noise may be.
fn tolerance(expected: [f64; 3], standard_error: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| BIAS * expected[c] + STANDARD_ERRORS * standard_error[c])
}

/// A mean that is wanted, how surely it is known, and the most that is possible.
struct Target {
    mean: [f64; 3],
    standard_error: [f64; 3],
    bound: Option<f64>,
}

impl Target {
    fn exactly(mean: [f64; 3]) -> Self {
        let standard_error = [0.0; 3];
        Self {
            mean,
            standard_error,
            bound: None,
        }
    }

    fn of(series: &Series) -> Self {
        Self {
            mean: series.mean,
            standard_error: series.standard_error,
            bound: None,
        }
    }
}

/// A picture, its mean and the mean's noise.
#[derive(Clone)]
pub struct Series {
    pub image: LinearImage,
    pub mean: [f64; 3],
    pub standard_error: [f64; 3],
    pub statistics: Statistics,
}

impl Series {
    /// Takes the passes one by one.
    pub fn take(recipe: &Recipe, scene: &Scene, passes: u32) -> Self {
        let loaded = LoadedScene::new(gpu(), scene.clone()).unwrap();
        let mut still = recipe.still(&loaded);
        let mut sum_before = [0.0; 3];
        let means: Vec<[f64; 3]> = (1..=passes)
            .map(|pass| {
                still.add_pass().unwrap();
                let sum = mean(&still.read().unwrap()).map(|x| x * f64::from(pass));
                let of_pass = [0, 1, 2].map(|c| sum[c] - sum_before[c]);
                sum_before = sum;
                of_pass
            })
            .collect();
        let count = f64::from(passes);
        let mean = sum_before.map(|sum| sum / count);
        let standard_error = [0, 1, 2].map(|c| {
            let squares = means.iter().map(|of_pass| (of_pass[c] - mean[c]).powi(2));
            (squares.sum::<f64>() / (count * (count - 1.0))).sqrt()
        });
        Self {
            image: still.read().unwrap(),
            mean,
            standard_error,
            statistics: still.statistics().unwrap(),
        }
    }

    fn with_each(&self, change: impl Fn(f64) -> f64) -> Self {
        let mut changed = self.clone();
        changed.mean = self.mean.map(&change);
        let values = changed.image.rgb.as_flattened_mut();
        values
            .iter_mut()
            .for_each(|x| *x = change(f64::from(*x)) as f32);
        changed
    }

    fn spoiled(&self, value: f32) -> Self {
        let mut spoiled = self.clone();
        spoiled.image.rgb[0][1] = value;
        spoiled
    }
}

/// Judges every technique by every case; says how many there were, and all that failed.
pub fn hold(family: &str, cases: Vec<Case>) {
    let mut judged = 0;
    let mut failures = Vec::new();
    for case in &cases {
        for entry in techniques() {
            if let Some(reason) = case.is_beyond(entry) {
                println!(
                    "{family}: {} says nothing of {}: {reason}",
                    case.name, entry.name
                );
                continue;
            }
            judged += 1;
            if let Err(failure) = case.judge(entry.name) {
                failures.push(format!("{}, {}: {failure}", case.name, entry.name));
            }
        }
    }
    println!("{family}: {} cases, {judged} pictures judged", cases.len());
    assert!(failures.is_empty(), "{family}:\n{}", failures.join("\n"));
}
