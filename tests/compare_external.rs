//! `macula compare --flip` and `--fovvideovdp`: calls of other programs, played here by scripts.

#[cfg(not(unix))]
#[test]
fn external_metrics_are_called_and_understood() {
    eprintln!("SKIPPED: the programs are played by shell scripts, which this system does not run");
}

#[cfg(unix)]
mod scripts {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;
    use std::path::Path;
    use std::process::{Command, Output};

    use macula::image::{LinearImage, exr};

    /// A script of that name that sees both pictures, keeps its arguments and the name of its folder, and says `words`.
    fn install(folder: &Path, name: &str, words: &str) {
        let script = format!(
            "#!/bin/sh\n\
         echo \"$@\" > '{folder}/arguments'\n\
         pwd > '{folder}/place'\n\
         [ -s test.* ] && [ -s reference.* ] || exit 9\n\
         {words}\n",
            folder = folder.display()
        );
        let path = folder.join(name);
        fs::write(&path, script).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn flat(value: f32) -> LinearImage {
        LinearImage {
            width: 16,
            height: 16,
            rgb: vec![[value; 3]; 256],
        }
    }

    /// Runs `macula compare` where only the scripts of `folder` are on the search path.
    fn compare(folder: &Path, options: &[&str]) -> Output {
        for (name, value) in [("a.exr", 1.0), ("b.exr", 1.25), ("nan.exr", f32::NAN)] {
            let mut picture = flat(1.0);
            picture.rgb[0] = [value; 3];
            exr::write(&folder.join(name), &picture).unwrap();
        }
        Command::new(env!("CARGO_BIN_EXE_macula"))
            .current_dir(folder)
            .env("PATH", folder)
            .arg("compare")
            .args(options)
            .output()
            .unwrap()
    }

    fn complaint(output: Output) -> String {
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    }

    fn read(folder: &Path, name: &str) -> String {
        fs::read_to_string(folder.join(name))
            .unwrap()
            .trim()
            .to_owned()
    }

    const FLIP_WORDS: &str = "cat <<'END'
Invoking HDR-FLIP
     Pixels per degree: 24
     Start exposure: -2.8500
     Stop exposure: 4.7978
FLIP between reference image <reference.exr> and test image <test.exr>
     Mean: 0.735657
     Weighted median: 0.825466
     Max: 0.992674
END";

    /// `cat` is not on the bare search path.
    fn say(words: &str) -> String {
        words.replacen("cat", "/bin/cat", 1)
    }

    #[test]
    fn flip_is_called_on_the_linear_pictures_and_understood() {
        let home = tempfile::tempdir().unwrap();
        install(home.path(), "flip", &say(FLIP_WORDS));
        let output = compare(home.path(), &["b.exr", "a.exr", "--flip", "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["flip"]["mean"], 0.735657);
        assert_eq!(json["flip"]["weighted_median"], 0.825466);
        assert_eq!(json["flip"]["pixels_per_degree"], 24.0);
        assert!(!read(home.path(), "arguments").contains("--pixels-per-degree"));
        let place = read(home.path(), "place");
        assert!(!Path::new(&place).exists(), "{place} was cleaned up");
        assert_ne!(Path::new(&place), home.path());

        // 16 pixels over a slope of 2, on the axis.
        let gaze = ["--gaze", "0,0", "--vfov", "90"];
        let output = compare(
            home.path(),
            &[&["b.exr", "a.exr", "--flip"], &gaze[..]].concat(),
        );
        let table = String::from_utf8(output.stdout).unwrap();
        assert!(table.contains("FLIP mean 0.7357"), "{table}");
        let arguments = read(home.path(), "arguments");
        assert!(
            arguments.contains("--pixels-per-degree 0.1396"),
            "{arguments}"
        );
    }

    #[test]
    fn fovvideovdp_is_called_on_the_shown_pictures_and_quoted() {
        let home = tempfile::tempdir().unwrap();
        let words = "echo 'FovVideoVDP=8.1250 [JOD]'; echo '[INFO] \"FovVideoVDP v1.2.2, 13.15 [pix/deg]\"' >&2";
        install(home.path(), "fvvdp", words);
        let verdict = |options: &[&str]| -> serde_json::Value {
            let fixed = ["b.exr", "a.exr", "--fovvideovdp", "--json"];
            let output = compare(home.path(), &[&fixed[..], options].concat());
            let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            json["fovvideovdp"].clone()
        };
        let plain = verdict(&[]);
        assert_eq!(
            (&plain["jod"], &plain["foveated"]),
            (&8.125.into(), &false.into())
        );
        assert_eq!(plain["quote"], "FovVideoVDP v1.2.2, 13.15 [pix/deg]");
        let arguments = read(home.path(), "arguments");
        assert!(arguments.contains("--display standard_hmd"), "{arguments}");
        assert!(!arguments.contains("--foveated"), "{arguments}");
        // Its command line knows one gaze only, the picture's middle.
        assert_eq!(
            verdict(&["--gaze", "0,0", "--vfov", "60"])["foveated"],
            true
        );
        assert!(read(home.path(), "arguments").contains("--foveated"));
        assert_eq!(
            verdict(&["--gaze", "9,0", "--vfov", "60"])["foveated"],
            false
        );
        assert!(!read(home.path(), "arguments").contains("--foveated"));
    }

    #[test]
    fn a_metric_that_is_missing_fails_or_says_something_else_is_named_with_the_mend() {
        let home = tempfile::tempdir().unwrap();
        let judge =
            |options: &[&str]| compare(home.path(), &[&["b.exr", "a.exr"], options].concat());
        let missing = complaint(judge(&["--flip"]));
        assert!(missing.contains("pip install flip-evaluator"), "{missing}");
        let missing = complaint(judge(&["--fovvideovdp"]));
        assert!(missing.contains("pip install pyfvvdp"), "{missing}");

        install(home.path(), "flip", "echo 'upside down'");
        let foreign = complaint(judge(&["--flip"]));
        assert!(foreign.contains("says no `Mean`"), "{foreign}");
        install(
            home.path(),
            "fvvdp",
            "echo 'Unknown display model' >&2; exit 3",
        );
        let failed = complaint(judge(&["--fovvideovdp=telescope"]));
        assert!(
            failed.contains("failed") && failed.contains("Unknown display model"),
            "{failed}"
        );

        install(home.path(), "flip", &say(FLIP_WORDS));
        assert_eq!(judge(&["--flip"]).status.code(), Some(0));
        let nan = complaint(compare(home.path(), &["nan.exr", "a.exr", "--flip"]));
        assert!(
            nan.contains("nan.exr") && nan.contains("3 of its values"),
            "{nan}"
        );
    }
}
