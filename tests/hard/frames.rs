//! Frames of a session with odd inputs: a case is a stream of inputs to the frame renderer, and how the gaze of each must come about.
//!
//! Every picture is finite and not negative, as bright as the same eyes' picture of a calm frame (where the case says that they see the
//! same), and every gaze direction is a unit vector ahead of the eye.

use glam::Vec3;
use macula::frame::{FrameInput, FrameOutcome, FrameRenderer};
use macula::gaze::{GazeRay, GazeSample, GazeState};
use macula::image::LinearImage;
use macula::params::Params;
use macula::scene::Scene;
use macula::scene::bvh::SceneCaster;
use macula::technique::TechniqueEntry;
use macula::view::{Fov, Pose, View};

use crate::maker::{EYE_FORMAT, eye_target, gpu, mean};
use crate::runner::techniques;
use crate::stages::furnace;

/// Pixels of an eye's picture across and down.
const SIDE: u32 = 12;
/// The walls' radiance of the furnace that all frames look at.
const RADIANCE: f64 = 2.0;
/// How far a frame's mean may be from it: photons of one small map, at 12x12 pixels.
const TOLERANCE: f64 = 0.25;
const FRAME_NS: i64 = 11_111_111;
const START_NS: i64 = 1_000_000_000;

/// What an eye's picture must be.
#[derive(Clone, Copy, PartialEq)]
pub enum Seen {
    /// The walls, as bright as they are.
    Walls,
    /// Nothing: there is no view to draw.
    Black,
}

/// A stream of frames.
pub struct FrameCase {
    pub name: &'static str,
    pub inputs: Vec<FrameInput>,
    /// How the gaze of each frame comes about.
    pub states: Vec<GazeState>,
    /// What both eyes see in each frame.
    pub seen: Seen,
}

/// A head that stands still and eyes that look straight ahead.
pub fn calm(index: u32) -> FrameInput {
    let display_time_ns = START_NS + i64::from(index) * FRAME_NS;
    let eye = |x: f32| View {
        pose: Pose {
            position_m: x * Vec3::X,
            ..Pose::IDENTITY
        },
        fov: Fov::symmetric(1.2, 1.0),
    };
    FrameInput {
        index,
        display_time_ns,
        scene_time_s: f64::from(index) * 0.011,
        local_from_head: Pose::IDENTITY,
        local_from_eye: [eye(-0.03), eye(0.03)],
        gaze: Some(looking(display_time_ns, Vec3::NEG_Z)),
    }
}

/// A sample that the tracker took just before `display_time_ns`; none of a direction that is no direction.
pub fn looking(display_time_ns: i64, dir: Vec3) -> GazeSample {
    GazeSample::combined(display_time_ns - 8_000_000, GazeRay::new(Vec3::ZERO, dir))
}

impl FrameCase {
    /// Calm frames, each changed by `change`; all are tracked.
    pub fn new(name: &'static str, frames: u32, change: impl Fn(&mut FrameInput)) -> Self {
        let changed = |index| {
            let mut input = calm(index);
            change(&mut input);
            input
        };
        Self {
            name,
            inputs: (0..frames).map(changed).collect(),
            states: vec![GazeState::Tracked; frames as usize],
            seen: Seen::Walls,
        }
    }

    pub fn states(self, states: Vec<GazeState>) -> Self {
        Self { states, ..self }
    }

    pub fn seen(self, seen: Seen) -> Self {
        Self { seen, ..self }
    }

    fn judge(&self, scene: &Scene, entry: &TechniqueEntry) -> Result<(), String> {
        let caster = SceneCaster::new(scene);
        let mut renderer = renderer(scene, &caster, entry);
        let targets = [(); 2].map(|()| eye_target([SIDE; 2]));
        for (input, state) in self.inputs.iter().zip(&self.states) {
            let outcome = renderer.render(input, &targets).unwrap();
            let pictures = renderer
                .images()
                .each_ref()
                .map(|image| image.read(gpu()).unwrap());
            verdict(&outcome, &pictures, *state, self.seen)
                .map_err(|problem| format!("frame {}: {problem}", input.index))?;
        }
        Ok(())
    }
}

fn verdict(
    outcome: &FrameOutcome,
    pictures: &[LinearImage; 2],
    state: GazeState,
    seen: Seen,
) -> Result<(), String> {
    if outcome.gaze.state != state {
        return Err(format!(
            "the gaze is {:?}, not {state:?}",
            outcome.gaze.state
        ));
    }
    if !outcome.gaze.ray.is_ahead() || !outcome.regions.transition_radius_rad.is_finite() {
        return Err("the gaze leads nowhere".into());
    }
    for (dir, picture) in outcome.gaze_dir_in_eye.iter().zip(pictures) {
        if !dir.is_normalized() {
            return Err(format!("an eye looks along {dir}"));
        }
        let values = picture.rgb.as_flattened();
        if !values.iter().all(|x| x.is_finite() && *x >= 0.0) {
            return Err("there are values that no radiance has".into());
        }
        let expected = if seen == Seen::Walls { RADIANCE } else { 0.0 };
        let mean = mean(picture)[1];
        if (mean - expected).abs() > TOLERANCE * expected {
            return Err(format!("the mean is {mean}, not {expected}"));
        }
    }
    Ok(())
}

fn renderer<'a>(
    scene: &'a Scene,
    caster: &'a SceneCaster,
    entry: &TechniqueEntry,
) -> FrameRenderer<'a> {
    let mut params = Params::default();
    for (key, value) in [("photon.count", "4000"), ("path.samples", "4")] {
        params.set(key, value).unwrap();
    }
    FrameRenderer::new(gpu(), scene, caster, &params, entry, [SIDE; 2], EYE_FORMAT).unwrap()
}

/// Judges every technique by every case, and one of each case's frames by wrong expectations; says how many there were.
pub fn hold(family: &str, cases: Vec<FrameCase>) {
    let scene = furnace().load();
    let mut failures = Vec::new();
    let mut frames = 0;
    for case in &cases {
        for entry in techniques() {
            frames += case.inputs.len();
            if let Err(failure) = case.judge(&scene, entry) {
                failures.push(format!("{}, {}: {failure}", case.name, entry.name));
            }
        }
        failures.extend(controls_that_pass(case, &scene));
    }
    println!("{family}: {} cases, {frames} frames judged", cases.len());
    assert!(failures.is_empty(), "{family}:\n{}", failures.join("\n"));
}

/// Wrong expectations of a case that its frames meet all the same: there should be none.
fn controls_that_pass(case: &FrameCase, scene: &Scene) -> Vec<String> {
    let with = |states, seen| FrameCase {
        name: case.name,
        inputs: case.inputs.clone(),
        states,
        seen,
    };
    let other_seen = match case.seen {
        Seen::Walls => Seen::Black,
        Seen::Black => Seen::Walls,
    };
    let wrongs = [
        with(vec![GazeState::Predicted; case.states.len()], case.seen),
        with(case.states.clone(), other_seen),
    ];
    let entry = techniques()[0];
    let passing = wrongs
        .iter()
        .filter(|wrong| wrong.judge(scene, entry).is_ok());
    passing
        .map(|_| format!("{}: a wrong expectation passes", case.name))
        .collect()
}
