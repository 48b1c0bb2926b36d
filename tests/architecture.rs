//! Who may know whom in `src/`, and what only some places may do. The tables here are the statement; the code is held to them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Each room of `src/` (a folder or a file) and the rooms that it may use. Knowledge runs downwards only: a room uses none that
/// stands above it here. `cli`, first, may use all.
const MAY_USE: &[(&str, &[&str])] = &[
    // A session and a picture: what runs the frames.
    ("session", &["frame", "gaze", "gpu", "view", "xr"]),
    (
        "frame",
        &[
            "fovea",
            "gather",
            "gaze",
            "gpu",
            "image",
            "params",
            "scene",
            "technique",
            "view",
        ],
    ),
    (
        "cost",
        &[
            "gpu",
            "image",
            "metrics",
            "oracle",
            "params",
            "scene",
            "still",
            "technique",
            "view",
        ],
    ),
    (
        "effect_cost",
        &["gather", "gpu", "params", "scene", "still", "technique"],
    ),
    (
        "still",
        &[
            "gather",
            "gpu",
            "image",
            "params",
            "scene",
            "technique",
            "view",
        ],
    ),
    ("report", &["image", "metrics"]),
    // Light transport: techniques compose what stands under them.
    (
        "technique",
        &[
            "fovea", "gather", "gpu", "image", "oracle", "params", "photon", "scene",
        ],
    ),
    ("oracle", &["scene", "view"]),
    (
        "gather",
        &["gpu", "image", "params", "photon", "scene", "view"],
    ),
    ("photon", &["gpu", "params", "scene", "view"]),
    // Showing and judging pictures.
    ("metrics", &["image", "view"]),
    ("image", &["file_kind", "gpu"]),
    // What comes in: the scene, the head and the eyes.
    ("scene", &["file_kind", "gpu", "view"]),
    ("gaze", &["fovea", "view"]),
    ("fovea", &["view"]),
    ("xr", &["gpu", "view"]),
    // The ground.
    ("file_kind", &[]),
    ("gpu", &[]),
    ("params", &[]),
    ("view", &[]),
];

/// Single modules that may use what their room may not.
const EXCEPTIONS: &[(&str, &str)] = &[
    // The presenter draws an eye's picture: it names the buffer that the gather fills, and nothing else of that room.
    ("image/present.rs", "gather"),
];

/// Where `unsafe` may stand: at the boundaries to Vulkan and OpenXR.
const UNSAFE_PLACES: &[&str] = &["gpu/", "xr/interop.rs"];

/// What only the command line does: print, read the environment, end the process.
const ONLY_CLI: &[&str] = &[
    "println!",
    "print!",
    "eprintln!",
    "eprint!",
    "dbg!",
    "env::args",
    "env::current_exe",
    "env::temp_dir",
    "env::var",
    "process::exit",
    "process::abort",
];

/// A source file: its path under `src/` with `/`, and its text.
struct File {
    path: String,
    text: String,
}

impl File {
    fn new(path: &str, text: &str) -> Self {
        let (path, text) = (path.to_owned(), text.to_owned());
        Self { path, text }
    }

    /// The folder under `src/`, or the file's stem.
    fn room(&self) -> &str {
        let first = self.path.split('/').next().unwrap();
        first.strip_suffix(".rs").unwrap_or(first)
    }

    /// The lines before the file's own tests, without comments.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        let lines = self.text.lines().enumerate();
        lines
            .take_while(|(_, line)| !line.starts_with("#[cfg(test)]"))
            .map(|(number, line)| (number + 1, line.split("//").next().unwrap()))
    }

    /// The rooms that the code names through `crate::`.
    fn used_rooms(&self) -> BTreeSet<String> {
        let code: String = self.code().map(|(_, line)| line).collect();
        let after = code.split("crate::").skip(1);
        after.flat_map(first_names).collect()
    }

    fn lines_with(&self, needles: &[&str]) -> Vec<String> {
        let has_word = |line: &str, needle: &str| {
            line.match_indices(needle).any(|(at, _)| {
                let before = line[..at].chars().next_back();
                before.is_none_or(|c| !c.is_alphanumeric() && c != '_')
            })
        };
        self.code()
            .filter(|(_, line)| needles.iter().any(|needle| has_word(line, needle)))
            .map(|(number, line)| format!("{}:{number}: {}", self.path, line.trim()))
            .collect()
    }
}

/// The name, or the names in braces, that a path goes on with.
fn first_names(path: &str) -> Vec<String> {
    let name = |text: &str| -> String {
        let text = text.trim_start();
        text.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    let Some(list) = path.strip_prefix('{') else {
        return vec![name(path)];
    };
    let mut depth = 0;
    let mut names = vec![name(list)];
    for (at, character) in list.char_indices() {
        match character {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(name(&list[at + 1..])),
            _ => {}
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

fn sources() -> Vec<File> {
    fn collect(folder: &Path, root: &Path, files: &mut Vec<File>) {
        let entries = fs::read_dir(folder).unwrap();
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        for path in paths {
            if path.is_dir() {
                collect(&path, root, files);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let below = path.strip_prefix(root).unwrap();
                let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
                files.push(File::new(
                    &parts.join("/"),
                    &fs::read_to_string(&path).unwrap(),
                ));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &root, &mut files);
    assert!(files.len() > 50, "the sources were found");
    files
}

fn is_top(room: &str) -> bool {
    ["cli", "main", "lib"].contains(&room)
}

/// Uses that the tables do not allow.
fn forbidden_uses(files: &[File]) -> Vec<String> {
    let may_use: BTreeMap<_, _> = MAY_USE.iter().copied().collect();
    let mut found = Vec::new();
    for file in files.iter().filter(|file| !is_top(file.room())) {
        let Some(allowed) = may_use.get(file.room()) else {
            found.push(format!("{} is in no room that the table knows", file.path));
            continue;
        };
        for used in file.used_rooms() {
            let is_exception = EXCEPTIONS.contains(&(file.path.as_str(), used.as_str()));
            if used != file.room() && !allowed.contains(&used.as_str()) && !is_exception {
                found.push(format!("{} uses {used}", file.path));
            }
        }
    }
    found
}

fn unsafe_elsewhere(files: &[File]) -> Vec<String> {
    let may = |file: &&File| {
        !UNSAFE_PLACES
            .iter()
            .any(|place| file.path.starts_with(place))
    };
    let files = files.iter().filter(may);
    files
        .flat_map(|file| file.lines_with(&["unsafe "]))
        .collect()
}

fn cli_work_elsewhere(files: &[File]) -> Vec<String> {
    let files = files.iter().filter(|file| file.room() != "cli");
    files.flat_map(|file| file.lines_with(ONLY_CLI)).collect()
}

const NOTHING: [String; 0] = [];

#[test]
fn rooms_use_only_what_the_table_allows() {
    assert_eq!(forbidden_uses(&sources()), NOTHING);
    for (path, text, complaint) in [
        (
            "photon/lamp.rs",
            "use crate::gaze::GazeSample;",
            "photon/lamp.rs uses gaze",
        ),
        (
            "gpu/extra.rs",
            "fn f() { crate::cli::main(); }",
            "gpu/extra.rs uses cli",
        ),
        (
            "xr/extra.rs",
            "use crate::{\n    gpu::{A, B},\n    scene::Scene,\n    view::View,\n};",
            "xr/extra.rs uses scene",
        ),
        (
            "lounge/mod.rs",
            "",
            "lounge/mod.rs is in no room that the table knows",
        ),
    ] {
        assert_eq!(forbidden_uses(&[File::new(path, text)]), [complaint]);
    }
    let innocent =
        "// use crate::cli::main;\nuse crate::view::View;\n#[cfg(test)]\nuse crate::cli;";
    assert_eq!(
        forbidden_uses(&[File::new("gaze/extra.rs", innocent)]),
        NOTHING
    );
}

#[test]
fn the_table_runs_downwards_and_names_rooms_that_exist() {
    for (place, (room, used)) in MAY_USE.iter().enumerate() {
        for lower in *used {
            let stands = MAY_USE.iter().position(|(name, _)| name == lower);
            assert!(stands > Some(place), "{room} may use {lower}");
        }
    }
    let files = sources();
    let rooms: BTreeSet<&str> = files.iter().map(File::room).collect();
    for (room, _) in MAY_USE {
        assert!(rooms.contains(room), "there is no room {room}");
    }
    for (path, used) in EXCEPTIONS {
        let file = files.iter().find(|file| file.path == *path).unwrap();
        assert!(file.used_rooms().contains(*used), "{path} uses no {used}");
    }
}

#[test]
fn unsafe_stands_only_at_the_boundaries() {
    assert_eq!(unsafe_elsewhere(&sources()), NOTHING);
    let spoiled = File::new("photon/fast.rs", "let x = unsafe { *pointer };");
    assert_eq!(unsafe_elsewhere(&[spoiled]).len(), 1);
}

#[test]
fn only_the_command_line_prints_reads_the_environment_or_ends_the_process() {
    assert_eq!(cli_work_elsewhere(&sources()), NOTHING);
    for line in [
        "println!(\"hello\");",
        "let home = std::env::var(\"HOME\");",
        "std::process::exit(1);",
    ] {
        let spoiled = File::new("scene/loud.rs", line);
        assert_eq!(cli_work_elsewhere(&[spoiled]).len(), 1, "{line}");
    }
    let innocent = File::new("scene/quiet.rs", "writeln!(text, \"a\")?; // println!");
    assert_eq!(cli_work_elsewhere(&[innocent]), NOTHING);
}

#[test]
fn the_simulated_runtime_knows_nothing_of_macula_and_only_the_command_line_configures_it() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("xr-sim/Cargo.toml");
    assert!(!fs::read_to_string(manifest).unwrap().contains("macula"));
    let names_it = |file: &File| !file.lines_with(&["xr_sim"]).is_empty();
    let files = sources();
    let users: Vec<&str> = files
        .iter()
        .filter(|file| names_it(file))
        .map(File::room)
        .collect();
    assert!(!users.is_empty() && users.iter().all(|room| *room == "cli"));
}
