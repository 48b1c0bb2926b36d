//! `macula compare` on folders of frames: mean errors, flicker, what the two eyes are shown differently, and bad input.

use std::fs;
use std::path::{Path, PathBuf};

use macula::cli::CliError;
use macula::cli::compare::{Args, GazeAngles, ReferenceSe, SequenceJudgement};
use macula::image::{LinearImage, exr};
use macula::metrics::region::EccentricityLimits;

const SIDE: u32 = 32;
const LIMITS: EccentricityLimits = EccentricityLimits {
    fovea_rad: 0.17,
    transition_rad: 0.26,
};

/// A folder with frames of these names, each of one value but where `spot` (column, row, value) says otherwise.
fn sequence(
    home: &Path,
    name: &str,
    frames: &[(&str, f32)],
    spot: Option<(u32, u32, f32)>,
) -> PathBuf {
    let folder = home.join(name);
    fs::create_dir_all(&folder).unwrap();
    for (frame, value) in frames {
        let mut picture = flat(*value);
        if let Some((column, row, value)) = spot {
            picture.rgb[(row * SIDE + column) as usize] = [value; 3];
        }
        exr::write(&folder.join(frame), &picture).unwrap();
    }
    folder
}

fn flat(value: f32) -> LinearImage {
    LinearImage {
        width: SIDE,
        height: SIDE,
        rgb: vec![[value; 3]; (SIDE * SIDE) as usize],
    }
}

fn args(image: &Path, reference: &Path) -> Args {
    Args {
        image: image.into(),
        reference: reference.into(),
        gaze: None,
        vfov: None,
        reference_se: ReferenceSe::Beside,
        flip: false,
        fovvideovdp: None,
    }
}

fn judge(image: &Path, reference: &Path) -> Result<SequenceJudgement, CliError> {
    macula::cli::compare::judge_sequence(&args(image, reference), LIMITS)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

#[test]
fn flicker_is_told_from_true_change_and_from_steady_bias() {
    let home = tempfile::tempdir().unwrap();
    let names = ["left_00000.exr", "left_00001.exr", "left_00002.exr"];
    let make = |name: &str, values: [f32; 3]| {
        let frames: Vec<_> = names.into_iter().zip(values).collect();
        sequence(home.path(), name, &frames, None)
    };
    let reference = make("reference", [1.0, 2.0, 2.0]);
    let steady = judge(&make("steady", [1.5, 2.5, 2.5]), &reference).unwrap();
    assert_eq!(steady.frames, 3);
    let whole = steady.areas.whole.as_ref().unwrap();
    let change = whole.temporal.unwrap();
    assert!(close(change.temporal_mse, 0.5) && close(change.temporal_mse_reference, 0.5));
    assert_eq!(change.temporal_mse_error, 0.0);
    let error = &whole.area.as_ref().unwrap().error;
    assert!(close(error.mse, 0.25) && close(error.bias[1], 0.5));
    let ratio = (1.5 + 1.25 + 1.25) / 3.0;
    assert!(close(error.mean_ratio[0].unwrap(), ratio));

    let flickering = judge(&make("flickering", [1.5, 1.5, 2.5]), &reference).unwrap();
    let change = flickering.areas.whole.as_ref().unwrap().temporal.unwrap();
    // The errors are 0.5, -0.5, 0.5.
    assert!(close(change.temporal_mse_error, 1.0) && close(change.temporal_mse, 0.5));
    let table = flickering.to_string();
    assert!(
        table.contains("flicker") && table.contains("1.000e0"),
        "{table}"
    );
    assert!(
        !table.contains("left/right"),
        "one eye has no stereo: {table}"
    );
    let json = serde_json::to_value(&flickering).unwrap();
    assert_eq!(json["whole"]["temporal_mse_error"], 1.0);
    assert_eq!(json["whole"]["mse"], 0.25);
    assert_eq!(json["per_frame"][1]["frame"], "left_00001.exr");
    assert_eq!(json["per_frame"][1]["whole"]["bias"][0], -0.5);
    assert!(json.get("stereo").is_none() && json.get("fovea").is_none());
}

#[test]
fn frames_come_in_the_order_of_their_numbers() {
    let home = tempfile::tempdir().unwrap();
    let frames = [("f9.exr", 1.0), ("f10.exr", 1.0), ("f11.exr", 2.0)];
    let judged = sequence(home.path(), "judged", &frames, None);
    let result = judge(&judged, &judged).unwrap();
    let names: Vec<_> = result
        .per_frame
        .iter()
        .map(|frame| frame.frame.as_str())
        .collect();
    assert_eq!(names, ["f9.exr", "f10.exr", "f11.exr"]);
    // By bare name f9 would follow f11: two changes in place of one.
    let change = result.areas.whole.unwrap().temporal.unwrap();
    assert!(close(change.temporal_mse, 0.5));
}

#[test]
fn what_the_eyes_are_shown_differently_is_told_from_what_they_share() {
    let home = tempfile::tempdir().unwrap();
    let make = |name: &str, left: f32, right: f32| {
        let frames = [("left_00000.exr", left), ("right_00000.exr", right)];
        sequence(home.path(), name, &frames, None)
    };
    let reference = make("reference", 1.0, 2.0);
    let stereo = |name, left, right| {
        let judgement = judge(&make(name, left, right), &reference).unwrap();
        (judgement.stereo.clone().unwrap().whole.unwrap(), judgement)
    };
    let (shared, _) = stereo("shared", 1.5, 2.5);
    assert_eq!(
        (shared.disagreement_mse, shared.disagreement_share),
        (0.0, Some(0.0))
    );
    let (opposed, judgement) = stereo("opposed", 1.5, 1.5);
    assert_eq!(
        (opposed.disagreement_mse, opposed.disagreement_share),
        (1.0, Some(2.0))
    );
    assert_eq!(opposed.left_right_ratio[0], Some(2.0));
    assert_eq!(judgement.frames, 2);
    let table = judgement.to_string();
    assert!(
        table.contains("at the same place") && table.contains("2.0000"),
        "{table}"
    );
}

#[test]
fn the_gaze_of_a_replay_gives_each_frame_its_regions() {
    let home = tempfile::tempdir().unwrap();
    let frames = [
        ("left_00000.exr", 1.0),
        ("left_00001.exr", 1.0),
        ("right_00000.exr", 1.0),
        ("right_00001.exr", 1.0),
    ];
    let reference = sequence(home.path(), "reference", &frames, None);
    // A wrong pixel 20 degrees to the right in views of 90 degrees: (0.364 + 1) / 2 of the width.
    sequence(home.path(), "replay/frames", &frames, Some((21, 16, 9.0)));
    let replay = home.path().join("replay");
    let table = |azimuths: [f64; 2]| {
        let eye = |eye: &str| {
            [
                "gaze_azimuth_deg",
                "gaze_elevation_deg",
                "fov_left_deg",
                "fov_right_deg",
                "fov_up_deg",
                "fov_down_deg",
            ]
            .map(|figure| format!("{eye}_{figure}"))
            .join(",")
        };
        let mut text = format!("frame,wall_ms,{},{}\n", eye("left"), eye("right"));
        for (frame, azimuth) in azimuths.into_iter().enumerate() {
            let view = format!("{azimuth},0,-45,45,45,-45");
            text += &format!("{frame},1.0,{view},{view}\n");
        }
        fs::write(replay.join("frames.csv"), text).unwrap();
    };
    let mse = |azimuths: [f64; 2]| {
        table(azimuths);
        let judgement = judge(&replay, &reference).unwrap();
        assert!(judgement.limits.is_some());
        let of = |area: &Option<macula::cli::compare::SequenceArea>| {
            area.as_ref().unwrap().area.as_ref().unwrap().error.mse
        };
        (of(&judgement.areas.fovea), of(&judgement.areas.periphery))
    };
    let (fovea, periphery) = mse([20.0, 20.0]);
    assert!(fovea > 0.0 && periphery == 0.0);
    let (fovea, periphery) = mse([-20.0, -20.0]);
    assert!(fovea == 0.0 && periphery > 0.0);
    let (fovea, periphery) = mse([20.0, -20.0]);
    assert!(fovea > 0.0 && periphery > 0.0);

    // The folder of pictures finds the table above it, and a gaze on the command line goes before it.
    let pictures = replay.join("frames");
    let judgement = judge(&pictures, &reference).unwrap();
    assert!(judgement.to_string().contains("each eye's gaze"));
    let told = Args {
        gaze: Some(GazeAngles {
            azimuth_deg: 20.0,
            elevation_deg: 0.0,
        }),
        vfov: Some(90.0),
        ..args(&replay, &reference)
    };
    let told = macula::cli::compare::judge_sequence(&told, LIMITS).unwrap();
    assert_eq!(told.areas.periphery.unwrap().area.unwrap().error.mse, 0.0);

    fs::write(replay.join("frames.csv"), "frame,gaze_state\n0,tracked\n").unwrap();
    let older = judge(&replay, &reference).unwrap();
    assert!(older.limits.is_none() && older.areas.fovea.is_none());
    table([0.0, f64::NAN]);
    let damaged = judge(&replay, &reference).unwrap_err();
    assert!(damaged.message.contains("frames.csv: row 2"), "{damaged:?}");
}

#[test]
fn the_noise_of_references_is_found_beside_each_frame() {
    let home = tempfile::tempdir().unwrap();
    let names = [
        ("left_00000.exr", 1.0),
        ("right_00000.exr", 1.0),
        ("left_00001.exr", 1.0),
        ("right_00001.exr", 1.0),
    ];
    let judged = sequence(home.path(), "judged", &names, None);
    let reference = sequence(home.path(), "reference", &names, None);
    for (name, _) in names {
        let beside = reference.join(name).with_extension("se.exr");
        exr::write(&beside, &flat(0.8)).unwrap();
    }
    let known = judge(&judged, &reference).unwrap();
    assert_eq!((known.frames, known.frames_with_reference_se), (4, 4));
    let whole = known.areas.whole.as_ref().unwrap();
    let noise = whole.area.as_ref().unwrap().error.reference_noise.unwrap();
    assert!(close(noise.reference_mse, 0.64));
    assert!(close(
        whole
            .temporal
            .unwrap()
            .temporal_mse_reference_noise
            .unwrap(),
        1.28
    ));
    let eyes = known.stereo.as_ref().unwrap().whole.unwrap();
    assert!(close(eyes.reference_disagreement_mse.unwrap(), 1.28 / 64.0));
    let refused = Args {
        reference_se: ReferenceSe::None,
        ..args(&judged, &reference)
    };
    let refused = macula::cli::compare::judge_sequence(&refused, LIMITS).unwrap();
    assert_eq!(refused.frames_with_reference_se, 0);
    assert!(refused.to_string().contains("not known"));

    fs::remove_file(reference.join("left_00000.se.exr")).unwrap();
    let partly = judge(&judged, &reference).unwrap();
    assert_eq!(partly.frames_with_reference_se, 3);
    assert!(partly.to_string().contains("known of 3 of 4 frames"));
    let whole = partly.areas.whole.as_ref().unwrap();
    assert_eq!(whole.area.as_ref().unwrap().error.reference_noise, None);
    let change = whole.temporal.unwrap();
    assert_eq!(change.temporal_mse_reference_noise, None);
    let eyes = partly.stereo.as_ref().unwrap().whole.unwrap();
    assert_eq!(eyes.reference_disagreement_mse, None);
}

#[test]
fn a_black_reference_does_not_stop_a_sequence() {
    let home = tempfile::tempdir().unwrap();
    let black = [("f0.exr", 0.0), ("f1.exr", 1.0), ("f2.exr", 1.0)];
    let reference = sequence(home.path(), "reference", &black, None);
    let half = [("f0.exr", 0.5), ("f1.exr", 1.0), ("f2.exr", 1.0)];
    let judged = sequence(home.path(), "judged", &half, None);
    let judgement = judge(&judged, &reference).unwrap();
    assert_eq!((judgement.frames, judgement.frames_against_black), (3, 1));
    assert!(judgement.to_string().contains("1 references"));
    let whole = judgement.areas.whole.unwrap();
    assert_eq!(whole.area.unwrap().error.mse, 0.0);
    assert!(close(
        whole.temporal.unwrap().temporal_mse_error,
        0.25 / 2.0
    ));
}

#[test]
fn bad_sequences_are_named_with_their_mend() {
    let home = tempfile::tempdir().unwrap();
    let two = [("left_0.exr", 1.0), ("left_1.exr", 1.0)];
    let whole = sequence(home.path(), "whole", &two, None);
    let short = sequence(home.path(), "short", &two[..1], None);
    let empty = sequence(home.path(), "empty", &[], None);
    let refusal = |image: &Path, reference: &Path| judge(image, reference).unwrap_err().message;
    for (image, reference) in [(&whole, &short), (&short, &whole)] {
        let message = refusal(image, reference);
        assert!(
            message.contains("left_1.exr is in") && message.contains("short"),
            "{message}"
        );
    }
    assert!(refusal(&empty, &whole).contains("--capture exr"));

    let odd = sequence(home.path(), "odd", &two, None);
    let small = LinearImage {
        width: 8,
        height: 8,
        rgb: vec![[1.0; 3]; 64],
    };
    exr::write(&odd.join("left_1.exr"), &small).unwrap();
    assert!(refusal(&odd, &whole).contains("left_1.exr is 8x8"));
    let message = refusal(&odd, &odd);
    assert!(message.contains("frames of one size"), "{message}");
    exr::write(&odd.join("left_1.exr"), &flat(f32::NAN)).unwrap();
    assert!(refusal(&odd, &whole).contains("left_1.exr"));

    let file = Args {
        reference_se: ReferenceSe::File("se.exr".into()),
        ..args(&whole, &whole)
    };
    let flip = Args {
        flip: true,
        ..args(&whole, &whole)
    };
    for single in [file, flip] {
        let error = macula::cli::compare::judge_sequence(&single, LIMITS).unwrap_err();
        assert_eq!(error.exit_code, 2, "{error:?}");
    }
    judge(&whole, &whole).expect("a good pair is compared");
}
