//! Every knob of macula, once: key, unit, range, default, source.
//!
//! A parameter file (TOML) and `--set key=value` name the same keys; a key that nobody reads is an error. The hash of all values goes
//! into every output, so that a picture can be traced to what made it.

use std::fmt;

use serde::Serialize;
use sha2::{Digest, Sha256};

/// What is wrong with a parameter that a person gave.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No knob has this key.
    #[error("there is no parameter `{key}`{}; `macula help params` lists them", hint(.nearest))]
    UnknownKey {
        /// The key given.
        key: String,
        /// The most similar key, if one is similar.
        nearest: Option<&'static str>,
    },
    /// The value is no number of the right kind.
    #[error("parameter `{key}` takes {expected} in {range}, not `{value}`")]
    NotReadable {
        /// The key.
        key: &'static str,
        /// The value given.
        value: String,
        /// What it takes.
        expected: &'static str,
        /// The range.
        range: String,
    },
    /// The value is outside its range.
    #[error("parameter `{key}` is {value}, but must lie in {range}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// The value given.
        value: String,
        /// The range.
        range: String,
    },
    /// `--set` was given something else than key=value.
    #[error("`{0}` is not of the form key=value")]
    NotAnAssignment(String),
    /// The parameter file is not TOML.
    #[error("the parameter file is not valid TOML: {0}")]
    NotToml(String),
    /// Two parameters contradict each other.
    #[error("parameter `{key}` is {value}: {rule}")]
    Contradiction {
        /// The key.
        key: &'static str,
        /// Its value.
        value: String,
        /// The rule that it breaks.
        rule: &'static str,
    },
}

fn hint(nearest: &Option<&'static str>) -> String {
    nearest
        .map(|key| format!(" (did you mean `{key}`?)"))
        .unwrap_or_default()
}

/// What a person reads about one knob.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    /// `room.name`.
    pub key: &'static str,
    /// Unit, or what is counted.
    pub unit: &'static str,
    /// Smallest and largest value.
    pub range: String,
    /// Value when nobody sets it.
    pub default: String,
    /// What it does.
    pub doc: &'static str,
    /// Where its default comes from.
    pub source: &'static str,
}

/// A type that a knob can have.
trait Value: Copy + PartialOrd + fmt::Display + std::str::FromStr {
    const EXPECTED: &'static str;
    fn is_usable(self) -> bool {
        true
    }
}
impl Value for u32 {
    const EXPECTED: &'static str = "a whole number";
}
impl Value for f32 {
    const EXPECTED: &'static str = "a number";
    fn is_usable(self) -> bool {
        self.is_finite()
    }
}

fn parse<T: Value>(key: &'static str, text: &str, min: T, max: T) -> Result<T, ParamError> {
    let range = || format!("{min}..{max}");
    let value: T = text
        .trim()
        .replace('_', "")
        .parse()
        .map_err(|_| ParamError::NotReadable {
            key,
            value: text.into(),
            expected: T::EXPECTED,
            range: range(),
        })?;
    if !value.is_usable() || value < min || value > max {
        return Err(ParamError::OutOfRange {
            key,
            value: text.into(),
            range: range(),
        });
    }
    Ok(value)
}

macro_rules! knobs {
    ($($(#[doc = $room_doc:literal])* $room:ident: $Room:ident {
        $($(#[doc = $doc:literal])+ $name:ident: $ty:ty = $default:expr, $min:expr, $max:expr, $unit:literal, $source:literal;)+
    })+) => {
        $(
            $(#[doc = $room_doc])*
            #[derive(Clone, Debug, PartialEq)]
            pub struct $Room {
                $($(#[doc = $doc])+ #[doc = concat!("\n\nUnit: ", $unit, ".")] pub $name: $ty,)+
            }
            impl Default for $Room {
                fn default() -> Self {
                    Self { $($name: $default,)+ }
                }
            }
        )+

        /// All parameters, by room.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Params {
            $($(#[doc = $room_doc])* pub $room: $Room,)+
        }

        impl Params {
            /// Every knob, in the order of the rooms.
            pub fn knobs() -> Vec<Knob> {
                let defaults = Self::default();
                vec![$($(Knob {
                    key: concat!(stringify!($room), ".", stringify!($name)),
                    unit: $unit,
                    range: format!("{}..{}", $min as $ty, $max as $ty),
                    default: defaults.$room.$name.to_string(),
                    doc: concat!($($doc,)+).trim(),
                    source: $source,
                },)+)+]
            }

            /// Sets one parameter from text.
            ///
            /// # Errors
            /// [`ParamError`] for an unknown key, an unreadable value or one out of range.
            pub fn set(&mut self, key: &str, value: &str) -> Result<(), ParamError> {
                match key {
                    $($(concat!(stringify!($room), ".", stringify!($name)) => {
                        let key = concat!(stringify!($room), ".", stringify!($name));
                        self.$room.$name = parse::<$ty>(key, value, $min, $max)?;
                    })+)+
                    _ => return Err(ParamError::UnknownKey { key: key.into(), nearest: nearest_key(key) }),
                }
                Ok(())
            }

            /// Every key with its value as text, in the order of [`Params::knobs`].
            pub fn values(&self) -> Vec<(&'static str, String)> {
                vec![$($((concat!(stringify!($room), ".", stringify!($name)), self.$room.$name.to_string()),)+)+]
            }
        }
    };
}

knobs! {
    /// Photons: how many start and how far they go.
    photon: Photon {
        /// Paths emitted a pass of `render`, or a frame of a session.
        count: u32 = 200_000, 0, 64_000_000, "paths", "what two CPU cores trace in about half a second; FPM's tables use 2 to 4 million on a GPU";
        /// Most surfaces that a path meets, the first included.
        depth_max: u32 = 32, 1, 128, "surfaces", "at an albedo of 0.8 all but 0.1 % of the light; FPM section 4.1 stops at 8";
        /// Paths traced at once; a map that fills up drops whole batches, so a smaller batch drops less.
        batch: u32 = 65_536, 64, 1_048_576, "paths", "large enough to fill a GPU, small beside a map";
        /// Room in the map, in photons for each emitted path. A full map stops the emission; the rest is counted as dropped.
        stored_per_path: f32 = 4.0, 0.01, 128.0, "photons/path", "twice what closed rooms of albedo 0.7 store";
    }
    /// Gathering photons at visible points.
    gather: Gather {
        /// Radius of the global map, half the scene's diagonal at most; 0: from the scene's area and the photon count, so that
        /// `photons_per_estimate` fall into it, a twentieth of the diagonal at most.
        radius_m: f32 = 0.0, 0.0, 1e6, "m", "see photons_per_estimate";
        /// Photons that an estimate from the global map holds on average, if spread evenly over the scene's surfaces.
        photons_per_estimate: f32 = 40.0, 1.0, 100_000.0, "photons", "50 to 100 in Jensen 1996; fewer blur less and take less time, and passes average the noise";
        /// Radius of the caustic map, as a share of the global one.
        caustic_radius_scale: f32 = 0.4, 0.01, 1.0, "1", "caustics are sharper; Jensen 1996 section 2";
        /// Smallest cosine between a photon's surface and the gathering one.
        normal_cos_min: f32 = 0.9, -1.0, 1.0, "cosine", "keeps corners apart, lets curved surfaces through";
        /// Farthest that a photon may lie from the tangent plane, in radii.
        flatness: f32 = 0.3, 0.01, 1.0, "radii", "keeps steps and thin sheets apart";
        /// GGX alpha (roughness²) from which a reflection is gathered from photons; below, rays follow it.
        glossy_alpha_min: f32 = 0.2, 0.001, 2.0, "1", "a lobe much narrower than the hemisphere meets too few photons";
        /// Rays in the tangent plane that find where walls and edges cut the gather's disc; 0 takes every disc for whole.
        coverage_rays: u32 = 8, 0, 32, "rays", "12 to 16 in the prototype; with 8 the tests of thin walls, corners and edges hold";
        /// How fast the radius shrinks over the passes of `render`: r²(i+1) = r²(i) (i + alpha)/(i + 1).
        radius_alpha: f32 = 0.6666667, 0.01, 1.0, "1", "Knaus and Zwicker 2011, equation 15";
    }
    /// Light straight from the lights.
    direct: Direct {
        /// Shadow rays a visible point.
        shadow_rays: u32 = 2, 1, 256, "rays", "with 4 samples a pixel in the fovea: 8 rays a pixel";
        /// Candidates of which each shadow ray keeps one.
        candidates: u32 = 4, 1, 64, "candidates", "Talbot et al. 2005";
        /// Share of the picks, of photons and candidates, that go to lights by what they bring to where the eye looks; the others go by
        /// power, so that no light is forgotten. 0: all go by power.
        importance_share: f32 = 0.75, 0.0, 0.95, "1", "no light is picked less than a quarter as often as by power alone";
    }
    /// Indirect light by paths from where the eye looks.
    indirect: Indirect {
        /// Paths for each sample of the fovea.
        paths: u32 = 1, 0, 1024, "paths", "with 4 samples a pixel: 4, enough by the prototype";
        /// Paths for each sample of the transition.
        transition_paths: u32 = 1, 0, 1024, "paths", "as in the fovea";
        /// Paths for each sample of the periphery.
        periphery_paths: u32 = 1, 0, 1024, "paths", "as in the fovea";
        /// Most surfaces that such a path meets.
        depth_max: u32 = 32, 1, 128, "surfaces", "as photon.depth_max";
    }
    /// Irradiance records, in which paths of `fpm` end.
    record: Record {
        /// Records a frame.
        count: u32 = 4096, 1, 1_048_576, "records", "3 to 10 % of the stored photons in the prototype";
        /// Records of a grid cell that a path looks at, of those that lie in it.
        per_cell: u32 = 4, 1, 64, "records", "chosen, not measured";
        /// How far a path looks for a record, in gather radii.
        radius_scale: f32 = 1.0, 0.1, 8.0, "radii", "a record is blurred over one radius already";
    }
    /// Photons that are aimed at what makes caustics, beside the others.
    aimed: Aimed {
        /// Paths emitted a pass of `render`, or a frame of a session.
        count: u32 = 30_000, 0, 64_000_000, "paths", "the prototype; as good as 280 thousand that are not aimed in the Cornell box, 100 thousand in the gallery";
    }
    /// Light that pixels keep from frame to frame, in sessions, where nothing in the scene moves.
    temporal: Temporal {
        /// Samples that a pixel keeps of the light of diffuse surfaces; 0: every frame is lit from scratch.
        kept_samples: u32 = 64, 0, 65_536, "samples", "16 frames' worth at 4 samples a pixel";
        /// Frames from one lit sample of a pixel outside the fovea to the next, where its light is kept.
        refresh_frames: u32 = 4, 1, 64, "frames", "chosen, not measured: at 90 frames/s light is 44 ms old at most";
    }
    /// The edge-avoiding filter over indirect light.
    filter: Filter {
        /// Levels over light that paths bring, each reaching twice as far as the one before; 0: none.
        path_levels: u32 = 3, 0, 7, "levels", "15x15 pixels: in the Cornell box 4 blur more than they smooth, 2 leave more noise";
        /// Levels over light from photon density; 0: none.
        photon_levels: u32 = 0, 0, 7, "levels", "photon density is smooth already; the papers filter it all the same";
        /// Smallest cosine between the normals of two points across which light is filtered.
        normal_cos_min: f32 = 0.9, -1.0, 1.0, "cosine", "as gather.normal_cos_min";
        /// Steepest line between two points, against the tangent plane, along which light is filtered.
        slope_max: f32 = 0.2, 0.001, 1.0, "1", "steps stop it, gentle curves don't";
    }
    /// The eye's paths.
    eye: Eye {
        /// Most mirrors and glass faces that an eye path passes.
        chain_max: u32 = 16, 1, 64, "surfaces", "two glass objects in a row and a mirror";
    }
    /// The oracle.
    path: Path {
        /// Paths a pixel in a pass of `render`, or in a frame of a session; the regions of the eye are all alike to it.
        samples: u32 = 16, 1, 65_536, "paths", "a few seconds a pass at 256x256 on two cores";
        /// Most surfaces that scatter light on its way from lamp to eye; 0: as many as chance allows.
        depth_max: u32 = 0, 0, 1_000_000, "surfaces", "unbiased; references of others stop at 64 or so";
        /// Photons a pass for what paths never meet, or seldom: light from point, spot and directional lights by way of mirrors, glass and
        /// sharp lobes. 0: paths alone.
        caustic_photons: u32 = 1_000_000, 0, 100_000_000, "photons", "chosen, not measured; none are traced where nothing is specular or sharp";
        /// Radius over which these photons are counted; 0: a thousandth of the scene's diagonal.
        caustic_radius_m: f32 = 0.0, 0.0, 1e6, "m", "about a pixel of a picture 500 pixels wide";
    }
    /// The regions around the gaze, and what each gets.
    fovea: Fovea {
        /// Half-angle of the fovea.
        radius_deg: f32 = 9.78, 0.0, 180.0, "degrees", "FPM section 4.1";
        /// Half-angle at which the transition ends and the periphery begins.
        transition_deg: f32 = 14.78, 0.0, 180.0, "degrees", "the fovea's radius and 5 degrees; FPM leaves it open";
        /// Samples a pixel in the fovea.
        samples: u32 = 4, 1, 64, "samples", "smooth edges where the eye can see them";
        /// Samples a pixel in the transition.
        transition_samples: u32 = 2, 1, 64, "samples", "between the two";
        /// Samples a pixel in the periphery.
        periphery_samples: u32 = 1, 1, 64, "samples", "the eye resolves a tenth of the fovea's detail there";
        /// Gather radius in the middle of the transition, in foveal radii.
        transition_radius_scale: f32 = 1.0, 1.0, 8.0, "1", "plain photon mapping gathers alike everywhere; more costs time, as cells grow with it";
        /// Gather radius in the periphery, in foveal radii.
        periphery_radius_scale: f32 = 1.0, 1.0, 8.0, "1", "as in the transition";
    }
    /// Where the session's play space lies in the scene, seen from the file's first camera (upright, turned as it is).
    viewer: Viewer {
        /// To the right of the camera.
        right_m: f32 = 0.0, -1e6, 1e6, "m", "at the camera";
        /// Above the camera.
        up_m: f32 = 0.0, -1e6, 1e6, "m", "at the camera";
        /// Ahead of the camera.
        forward_m: f32 = 0.0, -1e6, 1e6, "m", "at the camera";
        /// Turned to the left of the camera's direction, so that a recording that looks aside still looks at the scene.
        yaw_deg: f32 = 0.0, -180.0, 180.0, "degrees", "as the camera looks";
    }
    /// What stands in for a gaze that is lost or meets nothing.
    gaze: Gaze {
        /// How long the last fixation is held once the eyes are lost.
        hold_s: f32 = 0.5, 0.0, 60.0, "s", "longer than any blink";
        /// How fast the regions widen after that.
        widening_deg_s: f32 = 10.0, 0.0, 180.0, "degrees/s", "unsure, not gone";
        /// How far they widen at most.
        widening_max_deg: f32 = 20.0, 0.0, 60.0, "degrees", "covers most of what a head looks at";
        /// Where the eyes aim when the gaze meets nothing.
        default_distance_m: f32 = 2.0, 0.1, 1000.0, "m", "beyond it the eyes differ by less than 1.8 degrees";
    }
    /// What is simulated: by itself, what the scene calls for.
    effects: EffectChoice {
        /// 1: run every effect, called for or not, to see what leaving out saves; the picture stays the same.
        all: u32 = 0, 0, 1, "0 or 1", "leaving out what a scene does not call for costs nothing";
    }
    /// Showing pictures.
    display: Display {
        /// Exposure of shown pictures; files of radiance are not touched.
        exposure_ev: f32 = 0.0, -32.0, 32.0, "EV", "radiance 1 W/(m2 sr) is display white";
    }
    /// The sequence of random numbers.
    random: RandomNumbers {
        /// Another seed gives another, equally good picture.
        seed: u32 = 1, 0, 4_294_967_295, "1", "any";
    }
}

/// What a name without its room most likely means: flags of the command line whose key does not end in their name, and names that
/// several rooms have.
const MEANT: &[(&str, &str)] = &[("photons", "photon.count"), ("count", "photon.count")];

fn nearest_key(key: &str) -> Option<&'static str> {
    let name = key.rsplit('.').next().unwrap_or(key);
    if let Some((_, key)) = MEANT.iter().find(|(known, _)| *known == name) {
        return Some(key);
    }
    let known = Params::default().values();
    nearest(key, known.into_iter().map(|(candidate, _)| candidate))
}

/// The candidate that a mistyped key most likely means, if one is similar.
pub fn nearest<'a>(key: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| {
            let name = candidate.rsplit('.').next().unwrap_or(candidate);
            let distance = edit_distance(key, candidate).min(edit_distance(key, name));
            (distance, candidate)
        })
        .min()
        // In a short word three other letters make any other word.
        .filter(|(distance, _)| *distance <= 3.min(key.chars().count() / 2))
        .map(|(_, candidate)| candidate)
}

/// Levenshtein's distance; keys are short.
fn edit_distance(a: &str, b: &str) -> usize {
    // A key that a person typed may be a whole file pasted by mistake.
    let a: Vec<char> = a.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.chars().enumerate() {
            let substituted = diagonal + usize::from(*from != to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[row.len() - 1]
}

impl Params {
    /// Reads `key=value`, as given to `--set`.
    ///
    /// # Errors
    /// [`ParamError`] as for [`Params::set`], or where there is no `=`.
    pub fn set_assignment(&mut self, assignment: &str) -> Result<(), ParamError> {
        let (key, value) = assignment
            .split_once('=')
            .ok_or_else(|| ParamError::NotAnAssignment(assignment.into()))?;
        self.set(key.trim(), value)
    }

    /// Reads a parameter file: TOML with one table a room.
    ///
    /// # Errors
    /// [`ParamError`] as for [`Params::set`], or where the text is not TOML.
    pub fn set_toml(&mut self, text: &str) -> Result<(), ParamError> {
        let table: toml::Table = text
            .parse()
            .map_err(|error: toml::de::Error| ParamError::NotToml(error.to_string()))?;
        self.set_table(table)
    }

    /// Reads the tables of a parameter file, one a room.
    ///
    /// # Errors
    /// [`ParamError`] as for [`Params::set`].
    pub fn set_table(&mut self, table: toml::Table) -> Result<(), ParamError> {
        for (room, entries) in table {
            let toml::Value::Table(entries) = entries else {
                return Err(ParamError::UnknownKey {
                    nearest: nearest_key(&room),
                    key: room,
                });
            };
            for (name, value) in entries {
                let text = match value {
                    toml::Value::String(text) => text,
                    other => other.to_string(),
                };
                self.set(&format!("{room}.{name}"), &text)?;
            }
        }
        Ok(())
    }

    /// Checks what one knob alone can't tell.
    ///
    /// # Errors
    /// [`ParamError::Contradiction`].
    pub fn checked(self) -> Result<Self, ParamError> {
        if self.fovea.transition_deg < self.fovea.radius_deg {
            return Err(ParamError::Contradiction {
                key: "fovea.transition_deg",
                value: self.fovea.transition_deg.to_string(),
                rule: "it can't be smaller than fovea.radius_deg",
            });
        }
        if matches!(self.gather.coverage_rays, 1 | 2) {
            return Err(ParamError::Contradiction {
                key: "gather.coverage_rays",
                value: self.gather.coverage_rays.to_string(),
                rule: "a polygon has 3 corners at least; 0 takes every disc for whole",
            });
        }
        Ok(self)
    }

    /// SHA-256 over all keys and values, as lower-case hex.
    pub fn sha256(&self) -> String {
        let mut hasher = Sha256::new();
        for (key, value) in self.values() {
            hasher.update(format!("{key}={value}\n"));
        }
        hasher
            .finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_knob_accepts_its_own_default_and_says_where_it_comes_from() {
        let mut params = Params::default();
        for knob in Params::knobs() {
            assert_eq!(params.set(knob.key, &knob.default), Ok(()), "{}", knob.key);
            assert!(
                !knob.doc.is_empty() && !knob.unit.is_empty() && !knob.source.is_empty(),
                "{}",
                knob.key
            );
        }
        assert_eq!(params, Params::default());
    }

    #[test]
    fn an_unknown_key_is_refused_and_the_nearest_one_named() {
        let error = Params::default().set("gather.radius", "1").unwrap_err();
        assert!(error.to_string().contains("gather.radius_m"), "{error}");
        let error = Params::default().set("shadow_rays", "1").unwrap_err();
        assert!(error.to_string().contains("direct.shadow_rays"), "{error}");
    }

    #[test]
    fn a_key_without_its_room_or_named_as_a_flag_is_told_in_full() {
        for (toml, meant) in [
            ("photons = 5", "`photon.count`"),
            ("[photon]\nphotons = 5", "`photon.count`"),
            ("count = 5", "`photon.count`"),
            ("seed = 5", "`random.seed`"),
            ("radius = 5", "`gather.radius_m`"),
        ] {
            let error = Params::default().set_toml(toml).unwrap_err().to_string();
            assert!(error.contains(meant), "{toml}: {error}");
        }
        let error = Params::default().set_toml("foo = 5").unwrap_err();
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }

    #[test]
    fn values_out_of_range_or_not_numbers_are_refused() {
        let mut params = Params::default();
        for (key, value) in [
            ("gather.radius_m", "NaN"),
            ("gather.radius_m", "inf"),
            ("gather.radius_m", "-1"),
            ("photon.count", "1.5"),
            ("photon.count", "-3"),
            ("photon.count", "64000001"),
            ("photon.count", "5000000000"),
        ] {
            let error = params.set(key, value).unwrap_err().to_string();
            let knobs = Params::knobs();
            let knob = knobs.iter().find(|knob| knob.key == key).unwrap();
            assert!(error.contains(&knob.range), "{error}");
        }
        assert_eq!(params, Params::default());
    }

    #[test]
    fn a_file_and_an_assignment_set_the_same_knob_and_change_the_hash() {
        let (mut from_file, mut from_flag) = (Params::default(), Params::default());
        from_file
            .set_toml("[photon]\ncount = 1_000\n[gather]\nradius_m = 0.5\n")
            .unwrap();
        from_flag.set_assignment("photon.count=1000").unwrap();
        assert_ne!(from_file.sha256(), from_flag.sha256());
        from_flag.set_assignment("gather.radius_m = 0.5").unwrap();
        assert_eq!(from_file.sha256(), from_flag.sha256());
    }

    #[test]
    fn a_transition_inside_the_fovea_is_refused() {
        let mut params = Params::default();
        params.set("fovea.transition_deg", "5").unwrap();
        assert!(params.checked().is_err());
    }

    #[test]
    fn a_polygon_of_one_or_two_rays_is_refused() {
        for (rays, is_sound) in [("0", true), ("1", false), ("2", false), ("3", true)] {
            let mut params = Params::default();
            params.set("gather.coverage_rays", rays).unwrap();
            assert_eq!(params.checked().is_ok(), is_sound, "{rays} rays");
        }
    }
}
