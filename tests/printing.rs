//! What the program prints: help on every topic, and what becomes of words that nobody reads.

#[path = "common/program.rs"]
mod program;

use std::io;
use std::process::Stdio;

use program::{asset, command, macula, run};

/// Every command, with those under it.
const COMMANDS: [&str; 11] = [
    "demo",
    "replay",
    "render",
    "compare",
    "cost",
    "inspect",
    "session",
    "session import",
    "session info",
    "doctor",
    "help",
];

#[test]
fn help_on_a_command_is_what_the_command_prints_with_help() {
    for name in COMMANDS {
        let [asked, own] = [format!("help {name}"), format!("{name} --help")].map(|l| macula(&l));
        assert_eq!((asked.code, asked.complaint.as_str()), (Some(0), ""));
        assert_eq!(asked.out, own.out, "{name}");
        assert!(asked.out.contains(&format!("Usage: macula {name}")));
        assert!(asked.out.contains("--json"), "{name}: no global options");
    }
    assert_eq!(macula("help").out, macula("--help").out);
    assert!(macula("help params --json").json()["params"].is_array());
    assert_ne!(macula("help").out, macula("help render").out);
}

#[test]
fn help_on_an_unknown_topic_names_the_nearest() {
    for (topic, words) in [
        ("rendr", ["`rendr`", "`render`"]),
        ("parms", ["`parms`", "`params`"]),
        ("session imprt", ["`session imprt`", "`import`"]),
        (
            "session kitchen",
            ["`session kitchen`", "`macula session --help`"],
        ),
        (
            "render kitchen",
            ["`render kitchen`", "`macula render --help`"],
        ),
    ] {
        let refused = macula(&format!("help {topic}"));
        assert_eq!((refused.code, refused.out.as_str()), (Some(2), ""));
        for word in words {
            assert!(refused.errors()[0].contains(word), "{}", refused.complaint);
        }
    }
}

#[test]
fn a_reader_that_goes_away_ends_the_printing_quietly() {
    let (scene, session) = (asset("scenes/cornell.glb"), asset("sessions/natural-look"));
    let (scene, session) = (scene.to_str().unwrap(), session.to_str().unwrap());
    for line in [
        vec!["inspect", scene],
        vec!["inspect", scene, "--json"],
        vec!["session", "info", session],
        vec!["help", "params"],
        vec!["help", "render"],
        vec!["--help"],
    ] {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let ended = run(command(&line).stdout(writer));
        assert_eq!(ended.code, Some(0), "{line:?}: {}", ended.complaint);
        assert_eq!(ended.complaint, "", "{line:?}");
    }
}

#[test]
fn errors_that_nobody_reads_keep_their_exit_code() {
    let (reader, writer) = io::pipe().unwrap();
    drop(reader);
    let status = command(["inspect", "absent.glb"]).stderr(writer).status();
    assert_eq!(status.unwrap().code(), Some(1));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
    for line in ["help params", "help params --json"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        let refused = run(command(line.split(' ')).stdout(Stdio::from(full.unwrap())));
        assert_eq!(refused.code, Some(1), "{line}");
        assert!(
            refused.errors()[0].contains("stdout"),
            "{}",
            refused.complaint
        );
    }
}
