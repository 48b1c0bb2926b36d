//! `macula compare` on files: agreement with an independent program, regions, and bad input.

#[path = "common/shared.rs"]
mod shared;

use std::path::{Path, PathBuf};
use std::process::Command;

use macula::cli::CliError;
use macula::cli::compare::{Args, GazeAngles, Judgement, ReferenceSe};
use macula::image::{LinearImage, exr};
use macula::metrics::region::EccentricityLimits;
use shared::shared;

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

fn judge(args: &Args) -> Result<Judgement, CliError> {
    let limits = EccentricityLimits {
        fovea_rad: 9.78_f64.to_radians(),
        transition_rad: 14.78_f64.to_radians(),
    };
    macula::cli::compare::judge(args, limits)
}

fn write(folder: &Path, name: &str, image: &LinearImage) -> PathBuf {
    let path = folder.join(name);
    exr::write(&path, image).unwrap();
    path
}

fn flat(width: u32, height: u32, value: f32) -> LinearImage {
    LinearImage {
        width,
        height,
        rgb: vec![[value; 3]; (width * height) as usize],
    }
}

/// A picture near `reference` that errs by a share of it, unevenly, a little too bright, with a few fireflies and a NaN.
fn perturbed(reference: &LinearImage, brightness: f32) -> LinearImage {
    let mut image = reference.clone();
    for (i, rgb) in image.rgb.iter_mut().enumerate() {
        let wobble = 0.2 * (i as f32 * 12.9898).sin();
        *rgb = rgb.map(|x| x * (brightness + wobble) + 1e-4);
    }
    image.rgb[1000] = [300.0; 3];
    image.rgb[2000][1] = f32::NAN;
    image
}

/// What the kit's own numpy program says about the picture, or `None`, said on stderr, where it cannot run.
fn numpy_verdict(image: &Path, scene: &str) -> Option<serde_json::Value> {
    let program = shared("scenes/compare.py")?;
    let python = ["python3", "python"].into_iter().find(|python| {
        let numpy = Command::new(python).args(["-c", "import numpy"]).output();
        numpy.is_ok_and(|output| output.status.success())
    });
    let Some(python) = python else {
        eprintln!("SKIPPED: no Python with numpy to run {}", program.display());
        return None;
    };
    let report = image.with_extension("json");
    let output = Command::new(python)
        .arg(program)
        .args([
            image.as_os_str(),
            scene.as_ref(),
            "--allow-nonfinite".as_ref(),
        ])
        .args(["--json".as_ref(), report.as_os_str()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    Some(serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap())
}

#[test]
fn the_numbers_agree_with_an_independent_program() {
    let folder = tempfile::tempdir().unwrap();
    for scene in ["a-cornell-diffuse", "f-glossy", "j-spot"] {
        let Some(reference) = shared(&format!("scenes/refs/{scene}.exr")) else {
            return;
        };
        let candidate = perturbed(&exr::read(&reference).unwrap(), 1.02);
        let image = write(folder.path(), "candidate.exr", &candidate);
        let Some(theirs) = numpy_verdict(&image, scene) else {
            return;
        };
        let ours = judge(&Args {
            reference_se: ReferenceSe::File(reference.with_extension("se.exr")),
            ..args(&image, &reference)
        });
        let ours = ours.unwrap().comparison;
        let agree = |name: &str, ours: f64, theirs: &serde_json::Value| {
            let theirs = theirs.as_f64().unwrap();
            // Block means are 32-bit floats here; everything else agrees to more digits.
            let close = (ours - theirs).abs() <= 1e-5 * theirs.abs();
            assert!(close, "{scene} {name}: {ours} here, {theirs} there");
        };
        let whole = ours.whole.unwrap().error;
        let blocks = ours.block8.unwrap();
        for (ours, theirs) in [(&whole, &theirs["all"]), (&blocks, &theirs["block8"])] {
            assert_eq!(ours.pixels, theirs["n"]);
            agree("relMSE", ours.relmse, &theirs["relmse"]);
            agree("trimmed", ours.relmse_trimmed, &theirs["relmse_trim"]);
            agree("RMSE", ours.mse.sqrt(), &theirs["rmse"]);
            agree("p50", ours.relative_error_p50, &theirs["p50"]);
            agree("p95", ours.relative_error_p95, &theirs["p95"]);
            for channel in 0..3 {
                let ratio = ours.mean_ratio[channel].unwrap();
                agree("mean ratio", ratio, &theirs["bias"][channel]);
            }
        }
        let corrected = whole.relmse_corrected.unwrap();
        agree("corrected", corrected, &theirs["all"]["relmse_corrected"]);
        assert_eq!(ours.faults.nan, theirs["nan"]);

        // The same check sees a picture that is 1% brighter than the one that was judged there.
        let brighter = perturbed(&exr::read(&reference).unwrap(), 1.03);
        let brighter = write(folder.path(), "brighter.exr", &brighter);
        let brighter = judge(&args(&brighter, &reference)).unwrap().comparison;
        let ratio = brighter.whole.unwrap().error.mean_ratio[0].unwrap();
        let theirs = theirs["all"]["bias"][0].as_f64().unwrap();
        assert!((ratio - theirs).abs() > 1e-3);
    }
}

#[test]
fn an_error_in_the_fovea_is_found_there_and_only_there() {
    let folder = tempfile::tempdir().unwrap();
    let reference = flat(64, 64, 1.0);
    let mut candidate = reference.clone();
    // Gaze 20 degrees right and 10 up in a 90 degree view: tan 20° = 0.364, tan 10° / cos 20° = 0.188, so about pixel (43, 25).
    candidate.rgb[25 * 64 + 43] = [2.0; 3];
    let reference = write(folder.path(), "reference.exr", &reference);
    let candidate = write(folder.path(), "candidate.exr", &candidate);
    let looking_at = |azimuth_deg| {
        let result = judge(&Args {
            gaze: Some(GazeAngles {
                azimuth_deg,
                elevation_deg: 10.0,
            }),
            vfov: Some(90.0),
            ..args(&candidate, &reference)
        });
        let comparison = result.unwrap().comparison;
        let mse = |area: &Option<macula::metrics::Area>| area.as_ref().unwrap().error.mse;
        (mse(&comparison.fovea), mse(&comparison.periphery))
    };
    let (fovea, periphery) = looking_at(20.0);
    assert!(fovea > 0.0 && periphery == 0.0);
    let (fovea, periphery) = looking_at(-20.0);
    assert!(fovea == 0.0 && periphery > 0.0);
}

#[test]
fn the_table_and_the_json_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let reference = write(folder.path(), "reference.exr", &flat(16, 16, 1.0));
    let candidate = write(folder.path(), "candidate.exr", &flat(16, 16, 1.25));
    let judgement = judge(&args(&candidate, &reference)).unwrap();
    let json = serde_json::to_value(&judgement).unwrap();
    assert_eq!(json["whole"]["mean_ratio"][1], 1.25);
    assert_eq!(json["whole"]["bias"][0], 0.25);
    assert_eq!(json["whole"]["mse"], 0.0625);
    for known_by_scripts in [
        "pixels",
        "mse_corrected",
        "relmse",
        "relmse_corrected",
        "relmse_trimmed",
        "relative_error_p50",
        "relative_error_p95",
        "psnr_db",
        "ssim",
    ] {
        assert!(
            json["whole"].get(known_by_scripts).is_some(),
            "{known_by_scripts}"
        );
    }
    assert_eq!(
        (&json["width"], &json["faults"]["nan"]),
        (&16.into(), &0.into())
    );
    assert!(json.get("fovea").is_none() && json.get("fovea_limit_rad").is_none());
    let table = judgement.to_string();
    assert!(
        table.contains("1.2500") && table.contains("+2.500e-1") && table.contains("6.250e-2"),
        "{table}"
    );
    assert!(table.contains("not known"), "{table}");
    assert!(
        table.contains("8x8 blocks") && !table.contains("periphery "),
        "{table}"
    );
}

#[test]
fn the_noise_of_a_reference_is_found_beside_it_taken_off_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let truth = flat(32, 32, 1.0);
    // A reference that errs by its standard error, up and down in turn.
    let mut reference = truth.clone();
    for (i, rgb) in reference.rgb.iter_mut().enumerate() {
        *rgb = [if i.is_multiple_of(2) { 1.25 } else { 0.75 }; 3];
    }
    let candidate = write(folder.path(), "candidate.exr", &truth);
    let wrong = write(folder.path(), "wrong.exr", &flat(32, 32, 2.0));
    let reference = write(folder.path(), "reference.exr", &reference);
    let without = judge(&args(&candidate, &reference)).unwrap();
    assert_eq!(without.reference_se, None);
    let beside = write(folder.path(), "reference.se.exr", &flat(32, 32, 0.25));

    let found = judge(&args(&candidate, &reference)).unwrap();
    assert_eq!(found.reference_se.as_deref(), Some(beside.as_path()));
    let error = found.comparison.whole.as_ref().unwrap().error.clone();
    assert!(error.mse == 0.0625 && error.mse_corrected.unwrap().abs() < 1e-12);
    assert!(error.is_below_reference_noise());
    let table = found.to_string();
    assert!(
        table.contains("reference.se.exr") && table.contains("  <"),
        "{table}"
    );

    let seen = judge(&args(&wrong, &reference)).unwrap();
    let error = seen.comparison.whole.as_ref().unwrap().error.clone();
    assert!(!error.is_below_reference_noise() && error.mse_corrected.unwrap() > 0.9);
    assert!(!seen.to_string().contains("  <"), "{seen}");

    let refused = Args {
        reference_se: ReferenceSe::None,
        ..args(&candidate, &reference)
    };
    let refused = judge(&refused).unwrap();
    assert_eq!(refused.reference_se, None);
    assert_eq!(refused.comparison.whole.unwrap().error.mse_corrected, None);
}

#[test]
fn bad_input_is_named_with_its_mend() {
    let folder = tempfile::tempdir().unwrap();
    let small = write(folder.path(), "small.exr", &flat(8, 4, 1.0));
    let turned = write(folder.path(), "turned.exr", &flat(4, 8, 1.0));
    let nan = write(folder.path(), "nan.exr", &flat(8, 4, f32::NAN));
    let text = folder.path().join("text.exr");
    std::fs::write(&text, "not a picture").unwrap();
    let missing = folder.path().join("missing.exr");
    for (image, reference, says) in [
        (&missing, &small, "missing.exr"),
        (&small, &missing, "missing.exr"),
        (&text, &small, "text.exr"),
        (&small, &turned, "8x4"),
        (&small, &nan, "nan.exr"),
        (&nan, &small, "nan.exr"),
    ] {
        let error = judge(&args(image, reference)).unwrap_err();
        assert!(error.message.contains(says), "{error:?}");
    }
    let cause = judge(&args(&small, &nan)).unwrap_err().cause.unwrap();
    assert!(cause.to_string().contains("96 channel values"), "{cause}");
    judge(&args(&small, &small)).expect("a good pair is compared");
}

#[test]
fn a_gaze_is_two_angles_in_range() {
    let gaze: GazeAngles = "-5,2.5".parse().unwrap();
    assert_eq!((gaze.azimuth_deg, gaze.elevation_deg), (-5.0, 2.5));
    let dir = "90,0".parse::<GazeAngles>().unwrap().dir_in_view();
    assert!((dir.x - 1.0).abs() < 1e-12 && dir.z.abs() < 1e-12);
    for bad in [
        "", "5", "5;3", "5,3,1", "a,b", "nan,0", "inf,0", "0,91", "181,0",
    ] {
        assert!(bad.parse::<GazeAngles>().is_err(), "{bad}");
    }
}

#[test]
fn the_command_line_wants_gaze_and_field_of_view_together() {
    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }
    let parse = |options: &[&str]| {
        let words = ["compare", "image.exr", "reference.exr"]
            .iter()
            .chain(options);
        <Line as clap::Parser>::try_parse_from(words).map(|line| line.args)
    };
    let plain = parse(&[]).unwrap();
    assert_eq!(
        (plain.gaze, plain.reference_se),
        (None, ReferenceSe::Beside)
    );
    let noise = |choice| parse(&["--reference-se", choice]).unwrap().reference_se;
    assert_eq!(noise("none"), ReferenceSe::None);
    assert_eq!(noise("./none"), ReferenceSe::File("./none".into()));
    let display = |option: &[&str]| parse(option).unwrap().fovvideovdp;
    assert_eq!(display(&["--fovvideovdp"]).as_deref(), Some("standard_hmd"));
    assert_eq!(display(&["--fovvideovdp=ipad"]).as_deref(), Some("ipad"));
    let gaze = parse(&["--gaze", "-5,-2.5", "--vfov", "60"])
        .unwrap()
        .gaze
        .unwrap();
    assert_eq!((gaze.azimuth_deg, gaze.elevation_deg), (-5.0, -2.5));
    for wrong in [
        &["--gaze", "1,2"][..],
        &["--vfov", "60"],
        &["--gaze", "1", "--vfov", "60"],
        &["--gaze", "1,2", "--vfov", "180"],
        &["--gaze", "1,2", "--vfov", "nan"],
    ] {
        assert!(parse(wrong).is_err(), "{wrong:?}");
    }
}

#[test]
fn the_program_prints_one_object_and_ends_as_promised() {
    let folder = tempfile::tempdir().unwrap();
    let reference = write(folder.path(), "reference.exr", &flat(16, 16, 1.0));
    let candidate = write(folder.path(), "candidate.exr", &flat(16, 16, 1.25));
    let macula = |words: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_macula"))
            .current_dir(folder.path())
            .arg("compare")
            .args(words)
            .output()
            .unwrap()
    };
    let gaze = [
        "candidate.exr",
        "reference.exr",
        "--gaze",
        "0,0",
        "--vfov",
        "60",
    ];
    let output = macula(&[&gaze[..], &["--json", "--set", "fovea.radius_deg=5"]].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["whole"]["mean_ratio"][2], 1.25);
    let limit = json["fovea_limit_rad"].as_f64().unwrap();
    assert!((limit - 5_f64.to_radians()).abs() < 1e-6);
    let regions = ["fovea", "transition", "periphery"];
    let pixels = regions.map(|region| json[region]["pixels"].as_u64().unwrap());
    assert_eq!(pixels.iter().sum::<u64>(), 256);

    let output = macula(&["candidate.exr", "absent.exr"]);
    assert_eq!(output.status.code(), Some(1));
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(complaint.starts_with("error: ") && complaint.contains("absent.exr"));
    assert!(complaint.contains("caused by: "), "{complaint}");
    assert_eq!(macula(&gaze[..4]).status.code(), Some(2));
    let mixed = macula(&["candidate.exr", "."]);
    assert_eq!(mixed.status.code(), Some(2));
    let complaint = String::from_utf8(mixed.stderr).unwrap();
    assert!(complaint.contains("two folders"), "{complaint}");
    assert!(reference.exists() && candidate.exists());
}
