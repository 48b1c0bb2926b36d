//! `macula render` and the standard error that it leaves beside a picture.

#[path = "common/program.rs"]
mod program;

use std::fs;
use std::path::Path;

use macula::image::{LinearImage, exr};
use program::{Run, asset, command, macula, run};

/// Renders the bundled cornell box, as quick as it gets.
fn render(out: &Path, more: &str) -> Run {
    let mut command = command(["render"]);
    command
        .arg(asset("scenes/cornell.glb"))
        .arg("--out")
        .arg(out);
    command.args(["--size", "8x8", "--set", "photon.count=100"]);
    command.args(["--set", "path.samples=1", "--json"]);
    run(command.args(more.split_whitespace()))
}

fn root_mean_square(rgb: impl Iterator<Item = [f32; 3]>) -> f64 {
    let squares = rgb.map(|rgb| rgb.map(|x| f64::from(x).powi(2)).iter().sum::<f64>());
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 3));
    (sum / f64::from(count)).sqrt()
}

#[test]
fn the_standard_error_of_a_path_traced_picture_is_how_far_two_of_them_differ() {
    let home = tempfile::tempdir().unwrap();
    let picture = |name: &str, seed: u32| -> [LinearImage; 2] {
        let out = home.path().join(name);
        let done = render(&out, &format!("--technique path --passes 64 --seed {seed}"));
        assert_eq!(done.code, Some(0), "{}", done.complaint);
        let beside = out.with_extension("se.exr");
        assert_eq!(done.json()["standard_error"], beside.to_str().unwrap());
        [out, beside].map(|path| exr::read(&path).unwrap())
    };
    let ([first, first_error], [second, second_error]) = (picture("a.exr", 1), picture("b.exr", 2));
    let both = first.rgb.iter().zip(&second.rgb);
    let apart = root_mean_square(both.map(|(a, b)| std::array::from_fn(|i| a[i] - b[i])));
    let told =
        root_mean_square(first_error.rgb.into_iter().chain(second_error.rgb)) * 2.0_f64.sqrt();
    // 192 values, whose squares scatter: the ratio is within a fifth of one in most draws.
    let ratio = apart / told;
    assert!((0.7..1.4).contains(&ratio), "{apart} against {told}");
    // A single estimate scatters eight times as far as the mean of 64.
    assert!(!(0.7..1.4).contains(&(ratio / 8.0)));

    let [a, b] = ["a.exr", "b.exr"].map(|name| home.path().join(name));
    let judged = macula(&format!("compare --json {} {}", a.display(), b.display()));
    assert!(judged.json()["whole"]["relmse_corrected"].is_number());
}

#[test]
fn no_standard_error_of_an_older_picture_stays() {
    let home = tempfile::tempdir().unwrap();
    let (out, beside) = (home.path().join("a.exr"), home.path().join("a.se.exr"));
    for newer in [
        "--technique path --passes 1",
        "--technique pm --passes 2",
        "--technique pm-direct --passes 2",
    ] {
        let older = render(&out, "--technique path --passes 2 --force");
        assert_eq!(older.code, Some(0), "{}", older.complaint);
        assert!(beside.is_file());
        let done = render(&out, &format!("{newer} --force"));
        assert_eq!(done.code, Some(0), "{}", done.complaint);
        assert!(!beside.exists(), "{newer}");
        assert!(done.json()["standard_error"].is_null());
    }
    let names = fs::read_dir(home.path()).unwrap().count();
    assert_eq!(names, 1, "nothing but the picture");
}

#[test]
fn a_standard_error_that_exists_is_kept_unless_forced() {
    let home = tempfile::tempdir().unwrap();
    let (out, beside) = (home.path().join("a.exr"), home.path().join("a.se.exr"));
    fs::write(&beside, "dear").unwrap();
    for technique in ["path", "pm-direct"] {
        let refused = render(&out, &format!("--technique {technique} --passes 2"));
        assert_eq!(refused.code, Some(1));
        assert!(
            refused.errors()[0].contains("a.se.exr"),
            "{}",
            refused.complaint
        );
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    }
    assert_eq!(
        render(&home.path().join("a.png"), "--passes 1").code,
        Some(0)
    );
    assert_eq!(fs::read(&beside).unwrap(), b"dear", "it belongs to no PNG");
    let forced = render(&out, "--technique path --passes 2 --force");
    assert_eq!(forced.code, Some(0), "{}", forced.complaint);
    assert!(exr::read(&beside).is_ok());
}
