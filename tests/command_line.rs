//! The program as a user meets it: help, exit codes, and one clear line with the mend where something is wrong.

#[path = "common/program.rs"]
mod program;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use program::{Run, asset, command, macula, run};
use tempfile::TempDir;

const COMMANDS: [&str; 9] = [
    "demo", "replay", "render", "compare", "cost", "inspect", "session", "doctor", "help",
];

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// `render` of the bundled cornell box, as quick as it gets, into `out`.
fn render(out: &Path, more: &[&str]) -> Run {
    let mut command = command(["render"]);
    command.arg(asset("scenes/cornell.glb"));
    command.args(["--passes", "1", "--set", "photon.count=100"]);
    if !more.contains(&"--size") {
        command.args(["--size", "8x8"]);
    }
    run(command.args(more).arg("--out").arg(out))
}

/// It failed with exit code `code` in one line that holds all of `words`, and nothing was written.
fn assert_refused(refused: &Run, code: i32, words: &[&str]) {
    assert_eq!(refused.code, Some(code), "{}", refused.complaint);
    let errors = refused.errors();
    assert_eq!(errors.len(), 1, "{}", refused.complaint);
    for word in words {
        assert!(errors[0].contains(word), "no `{word}` in: {}", errors[0]);
    }
    assert_eq!(refused.out, "");
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn help_of_every_command_says_what_it_is_for_and_explains_each_option() {
    let overview = macula("--help");
    assert_eq!(overview.code, Some(0));
    for name in COMMANDS {
        assert!(overview.out.contains(&format!("  {name} ")), "{name}");
        let help = macula(&format!("{name} --help"));
        assert_eq!((help.code, help.complaint.as_str()), (Some(0), ""));
        let purpose = help.out.lines().next().unwrap();
        assert!(purpose.len() > 15, "{name}: {purpose}");
        assert!(help.out.contains(&format!("Usage: macula {name}")));
        assert_eq!(macula(&format!("help {name}")).code, Some(0));
    }
    let replay = macula("replay --help").out;
    for option in [
        "--session",
        "--technique",
        "--size",
        "--frames",
        "--runtime",
        "--capture",
        "--report",
        "--out",
        "--set",
        "--params",
        "--device",
        "--log",
        "--json",
        "--force",
    ] {
        let mut from_option = replay
            .lines()
            .skip_while(|line| !line.trim().starts_with(option));
        let explanation = from_option.nth(1);
        let words = explanation.unwrap_or_default().split_whitespace().count();
        assert!(words > 1, "{option}: {explanation:?}");
    }
}

#[test]
fn more_photons_than_any_device_binds_are_refused_with_what_to_lower() {
    let scene = asset("scenes/furnace.glb");
    let folder = tempfile::tempdir().unwrap();
    let refused = macula(&format!(
        "render {} --size 8x8 --photons 64000000 --out {}",
        scene.display(),
        folder.path().join("a.exr").display()
    ));
    assert_refused(&refused, 1, &["photon_position", "fewer photons"]);
}

#[test]
fn wrong_arguments_end_with_2_and_a_hint() {
    for (line, hint) in [
        ("", "Usage"),
        ("rendr", "render"),
        ("render --bogus", "--help"),
        ("render a.glb", "--out"),
        ("render a.glb --out a.png --size 0x0", "640x480"),
        ("render a.glb --out a.png --size 64", "640x480"),
        ("render a.glb --out a.png --size 99999x1", "16384"),
        ("render a.glb --out a.png --passes 0", "1.."),
        ("render a.glb --out a.png --seconds 1e20", "0.5"),
        ("render a.glb --out a.png --seconds 0", "0.5"),
        ("render a.glb --out a.png --gaze 10", "--help"),
        ("replay a.glb --session s --out o --size 5000x10", "4096"),
        ("replay a.glb --session s --out o --frames 9..3", "0..89"),
        ("replay a.glb --session s --out o --every 0", "1.."),
        ("replay a.glb --session s --out o --runtime other", "system"),
        ("doctor --log loud", "debug"),
        ("render a.glb --out a.png --seconds -1", "0.5"),
        ("render a.glb --out a.png --passes -1", "1.."),
        ("replay a.glb --session s --out o --every -2", "1.."),
        ("cost a.glb --out c --budget-ms -5", "above 0"),
        ("cost a.glb --out c --equal-error -0.1", "above 0"),
        ("cost a.glb --out c --equal-time -5", "above 0"),
        ("cost a.glb --check-budget -5", "above 0"),
        ("cost a.glb --out c --point-seconds -1", "above 0"),
        ("help params phooton", "`photon`"),
        ("help params count_photons", "gather"),
        ("help params photon twice", "no help"),
    ] {
        let refused = macula(line);
        assert_eq!(refused.code, Some(2), "{line}: {}", refused.complaint);
        assert!(
            refused.complaint.contains(hint),
            "{line}: {}",
            refused.complaint
        );
        assert_eq!(refused.out, "", "{line}");
    }
}

#[test]
fn an_unknown_technique_parameter_camera_or_format_is_named_with_what_there_is() {
    let home = folder();
    let out = home.path().join("picture.png");
    for (args, words) in [
        (["--technique", "pmm"], ["pmm", "pm-direct"]),
        (
            ["--set", "gather.radius=1"],
            ["gather.radius", "gather.radius_m"],
        ),
        (["--set", "photon.count"], ["photon.count", "="]),
        (["--set", "photon.count=-3"], ["photon.count", "-3"]),
        (["--set", "direct.shadow_rays=1000"], ["shadow_rays", "256"]),
        (
            ["--params", "absent.toml"],
            ["absent.toml", "parameter file"],
        ),
        (["--camera", "kitchen"], ["kitchen", "viewer"]),
        (["--device", "no such card"], ["no such card", "0: "]),
    ] {
        let is_in_the_arguments = matches!(args[0], "--technique" | "--set");
        let code = if is_in_the_arguments { 2 } else { 1 };
        assert_refused(&render(&out, &args), code, &words);
    }
    let refused = render(&home.path().join("picture.gif"), &[]);
    assert_refused(&refused, 2, &["picture.gif", ".exr", ".png"]);
    assert_eq!(names(home.path()), [""; 0], "nothing is left behind");
    assert_eq!(render(&out, &[]).code, Some(0), "all else was right");
    assert_eq!(names(home.path()), ["picture.png"]);
}

#[test]
fn a_missing_or_broken_scene_is_named() {
    let home = folder();
    let broken = home.path().join("broken.glb");
    fs::write(&broken, b"glTF\x02\0\0\0\xff\0\0\0half a").unwrap();
    for scene in [home.path().join("absent.glb"), broken] {
        let name = scene.file_name().unwrap().to_str().unwrap();
        for name_of_command in ["render", "inspect"] {
            let mut command = command([name_of_command]);
            command.arg(&scene);
            if name_of_command == "render" {
                command.arg("--out").arg(home.path().join("picture.png"));
            }
            assert_refused(&run(&mut command), 1, &[name]);
        }
    }
    assert_eq!(names(home.path()), ["broken.glb"]);
}

#[test]
fn help_on_a_room_or_a_parameter_shows_its_parameters_and_no_others() {
    let room = macula("help params photon");
    assert_eq!(room.code, Some(0), "{}", room.complaint);
    assert!(room.out.contains("photon.count") && room.out.contains("photon.depth_max"));
    assert!(!room.out.contains("gather.radius_m"));
    assert!(macula("help params").out.contains("gather.radius_m"));
    let one = macula("help params photon.count --json").json();
    assert_eq!(one["params"].as_array().unwrap().len(), 1);
    assert_eq!(one["params"][0]["key"], "photon.count");
}

/// Files and a folder that are not what the program is given them for, with what an error must call them.
fn strange_files(home: &Path) -> Vec<(PathBuf, &'static str)> {
    let strange: [(&str, &[u8], &str); 4] = [
        (
            "picture.png",
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
            "a PNG picture",
        ),
        ("archive.zip", b"PK\x03\x04\x14\0", "a ZIP archive"),
        ("empty", b"", "an empty file"),
        ("words.txt", b"dear reader", "words.txt"),
    ];
    let mut files = Vec::new();
    for (name, bytes, kind) in strange {
        fs::write(home.join(name), bytes).unwrap();
        files.push((home.join(name), kind));
    }
    fs::create_dir(home.join("folder")).unwrap();
    files.push((home.join("folder"), "folder"));
    files.push((home.join("absent"), "absent"));
    files
}

#[test]
fn a_file_of_another_kind_is_named_with_what_it_is_and_what_is_wanted() {
    let home = folder();
    let strange = strange_files(home.path());
    let before = names(home.path());
    let (out, cornell) = (home.path().join("out"), asset("scenes/cornell.glb"));
    let picture = home.path().join("never-read.exr");
    for (file, kind) in &strange {
        let name = file.file_name().unwrap().to_str().unwrap();
        let refuse = |words: &[&OsStr], told: [&str; 2]| {
            assert_refused(&run(&mut command(words)), 1, &[name, told[0], told[1]]);
        };
        let [file, out, cornell] = [file, &out, &cornell].map(|path| path.as_os_str());
        let [inspect, cost, replay, compare] =
            ["inspect", "cost", "replay", "compare"].map(OsStr::new);
        let [to, session] = ["--out", "--session"].map(OsStr::new);
        let scene = "assets/scenes/cornell.glb";
        refuse(&[inspect, file], [kind, scene]);
        refuse(&[cost, file, to, out], [kind, scene]);
        let recording = ["is no session folder", "assets/sessions/natural-look"];
        refuse(&[replay, cornell, session, file, to, out], recording);
        if *kind != "folder" {
            refuse(&[compare, file, picture.as_os_str()], [kind, "OpenEXR"]);
        }
    }
    assert_eq!(names(home.path()), before, "nothing is left behind");
}

#[test]
fn a_picture_that_is_cut_short_is_told_from_one_of_another_kind() {
    let home = folder();
    let (whole, torn) = (home.path().join("whole.exr"), home.path().join("torn.exr"));
    assert_eq!(render(&whole, &[]).code, Some(0));
    let bytes = fs::read(&whole).unwrap();
    fs::write(&torn, &bytes[..bytes.len() / 2]).unwrap();
    let compared = |other: &Path| run(command(["compare"]).arg(&whole).arg(other));
    assert_refused(&compared(&torn), 1, &["torn.exr", "cut short"]);
    let refused = compared(&asset("scenes/cornell.glb"));
    assert_refused(&refused, 1, &["cornell.glb", "a glTF scene", "OpenEXR"]);
    assert_eq!(compared(&whole).code, Some(0));
}

#[test]
fn a_recording_or_a_parameter_file_of_another_kind_is_named_with_what_is_wanted() {
    let home = folder();
    for (file, kind) in strange_files(home.path()) {
        let mut command = command(["session", "import"]);
        command.arg(&file).arg("--out").arg(home.path().join("s"));
        let name = file.file_name().unwrap().to_str().unwrap();
        let what = if kind == "folder" {
            "it is a folder"
        } else {
            name
        };
        assert_refused(&run(&mut command), 1, &[name, what]);
    }
    let params = home.path().join("folder");
    let refused = render(
        &home.path().join("a.png"),
        &["--params", params.to_str().unwrap()],
    );
    assert_refused(&refused, 1, &["folder", "TOML"]);
}

#[test]
fn an_output_that_exists_is_kept_unless_forced() {
    let home = folder();
    let out = home.path().join("picture.png");
    fs::write(&out, "dear").unwrap();
    assert_refused(&render(&out, &[]), 1, &["picture.png", "--force"]);
    assert_eq!(fs::read(&out).unwrap(), b"dear");
    assert_eq!(render(&out, &["--force"]).code, Some(0));
    assert!(fs::read(&out).unwrap().starts_with(b"\x89PNG"));

    let folder = home.path().join("holiday");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("photo.jpg"), "dear").unwrap();
    let refused = replay_into(&folder, &natural_look(), &["--force"]);
    assert_refused(&refused, 1, &["holiday", "another name"]);
    assert_eq!(names(&folder), ["photo.jpg"]);
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let home = folder();
    let file = home.path().join("file");
    fs::write(&file, "").unwrap();
    // Below a file there is no folder: true for every user, root included.
    assert_refused(&render(&file.join("picture.png"), &[]), 1, &["file"]);
    let refused = replay_into(&file.join("out"), &natural_look(), &[]);
    assert_refused(&refused, 1, &["file"]);
}

fn natural_look() -> std::path::PathBuf {
    asset("sessions/natural-look")
}

/// Replays two frames, as quick as it gets.
fn replay_into(out: &Path, session: &Path, more: &[&str]) -> Run {
    run(&mut replay(out, session, more))
}

fn replay(out: &Path, session: &Path, more: &[&str]) -> std::process::Command {
    let mut command = command(["replay"]);
    command.arg(asset("scenes/cornell.glb"));
    command.arg("--session").arg(session).arg("--out").arg(out);
    command.args(["--size", "8x8", "--set", "photon.count=100"]);
    if !more.contains(&"--frames") {
        command.args(["--frames", "0..1"]);
    }
    command.args(more);
    command
}

#[test]
fn a_missing_session_or_a_frame_beyond_its_end_is_named() {
    let home = folder();
    let out = home.path().join("out");
    let refused = replay_into(&out, &home.path().join("absent"), &[]);
    assert_refused(&refused, 1, &["absent", "session folder"]);
    let refused = replay_into(&out, &natural_look(), &["--frames", "900..950"]);
    assert_refused(&refused, 1, &["natural-look", "900 frames"]);
    let refused = run(command(["session", "info"]).arg(home.path().join("absent")));
    assert_refused(&refused, 1, &["absent", "session folder"]);
    assert_eq!(names(home.path()), [""; 0], "nothing is left behind");
}

#[test]
fn a_session_cut_in_the_middle_of_a_line_is_replayed_and_the_cut_is_told() {
    let home = folder();
    let cut = home.path().join("cut");
    fs::create_dir(&cut).unwrap();
    for name in names(&natural_look()) {
        let text = fs::read(natural_look().join(&name)).unwrap();
        // Some 40 rows and a half of each table.
        let keep = if name.ends_with("gaze.csv") || name.ends_with("frames.csv") {
            let lines = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
            lines.map(|(at, _)| at).nth(40).unwrap() + 20
        } else {
            text.len()
        };
        fs::write(cut.join(name), &text[..keep]).unwrap();
    }
    let out = home.path().join("out");
    let told = replay_into(&out, &cut, &["--frames", "0..500", "--every", "20"]);
    assert_eq!(told.code, Some(0), "{}", told.complaint);
    for table in ["gaze.csv", "frames.csv"] {
        let is_told = |line: &&str| line.starts_with("warning: ") && line.contains(table);
        assert!(
            told.complaint.lines().any(|line| is_told(&line)),
            "{}",
            told.complaint
        );
    }
    assert_eq!(
        names(&out.join("frames")).len(),
        4,
        "two frames of two eyes"
    );
    let whole = replay_into(&home.path().join("whole"), &natural_look(), &[]);
    assert!(!whole.complaint.contains("gaze.csv"), "{}", whole.complaint);
}

#[test]
fn without_a_vulkan_device_one_line_says_how_to_get_one() {
    let home = folder();
    let blind = |command: &mut std::process::Command| {
        let nowhere = home.path().join("no-such-driver.json");
        command
            .env("VK_DRIVER_FILES", &nowhere)
            .env("VK_ICD_FILENAMES", &nowhere);
        run(command)
    };
    let mut picture = command(["render", "--out"]);
    picture.arg(home.path().join("picture.png"));
    picture.arg(asset("scenes/cornell.glb"));
    let mut session = replay(&home.path().join("out"), &natural_look(), &[]);
    for command in [&mut picture, &mut session] {
        let words = ["no Vulkan device", "mesa-vulkan-drivers"];
        assert_refused(&blind(command), 1, &words);
    }
    assert_eq!(names(home.path()), [""; 0], "nothing is left behind");
    let doctor = blind(&mut command(["doctor"]));
    assert_eq!(doctor.code, Some(1));
    assert!(doctor.out.contains("mesa-vulkan-drivers"), "{}", doctor.out);
    assert_eq!(
        macula("doctor").code,
        Some(0),
        "with a driver it is content"
    );
}

#[test]
fn without_an_openxr_runtime_one_line_says_what_to_do() {
    let doctor = macula("doctor --json").json();
    if doctor["openxr"]["loader"] != true {
        eprintln!("SKIPPED: no OpenXR loader on this machine");
        return;
    }
    let home = folder();
    let mut command = replay(
        &home.path().join("out"),
        &natural_look(),
        &["--runtime", "system"],
    );
    command.env("XR_RUNTIME_JSON", home.path().join("no-such-runtime.json"));
    let words = ["no OpenXR runtime", "--runtime sim"];
    assert_refused(&run(&mut command), 1, &words);
    assert_eq!(names(home.path()), [""; 0], "nothing is left behind");
}

#[test]
fn what_machines_read_is_one_json_object_and_nothing_else() {
    let home = folder();
    let picture = home.path().join("picture.exr");
    let rendered = render(&picture, &["--json"]).json();
    assert_eq!(rendered["technique"], "pm-direct");
    assert_eq!(rendered["passes"], 1);
    assert!(rendered["mean_w_per_m2_sr"][0].as_f64().unwrap() > 0.0);

    let doctor = macula("doctor --json").json();
    assert!(doctor["vulkan"]["devices"][0]["usable"].as_bool().unwrap());
    assert!(doctor["missing"].is_array());
    let inspected = run(command(["inspect", "--json"]).arg(asset("scenes/room.glb"))).json();
    assert_eq!(inspected["geometry"]["static_triangles"], 108_030);
    let info = run(command(["session", "info", "--json"]).arg(natural_look())).json();
    assert_eq!(info["summary"]["frames"], 900);
    let parameters = macula("help params --json").json();
    let parameters = parameters["params"].as_array().unwrap();
    let count = parameters.iter().find(|p| p["key"] == "photon.count");
    assert_eq!(count.unwrap()["default"], "200000");

    for line in ["doctor", "help params"] {
        let text = macula(line).out;
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_err());
        assert!(text.lines().count() > 10, "{line} is for people: {text}");
    }
}

#[test]
fn parameters_come_from_the_file_and_single_ones_override_it() {
    let home = folder();
    let file = home.path().join("fast.toml");
    fs::write(&file, "[photon]\ncount = 50\n[random]\nseed = 9\n").unwrap();
    let file = file.to_str().unwrap();
    let emitted = |name: &str, more: &[&str]| {
        let more = [more, &["--json"]].concat();
        let json = render(&home.path().join(name), &more).json();
        json["counts"][0][1].as_f64().unwrap()
    };
    // `render` here sets 100 photons itself.
    assert_eq!(emitted("a.exr", &[]), 100.0);
    assert_eq!(emitted("b.exr", &["--params", file]), 100.0);
    assert_eq!(emitted("c.exr", &["--photons", "70"]), 70.0);
    let pixels = |name: &str| fs::read(home.path().join(name)).unwrap();
    assert_ne!(
        pixels("a.exr"),
        pixels("b.exr"),
        "the seed came from the file"
    );
}
