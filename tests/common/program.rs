//! Runs the built program as a user would.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// What came of a run.
pub struct Run {
    pub code: Option<i32>,
    pub out: String,
    pub complaint: String,
}

impl Run {
    /// The lines of the standard error that say what failed. Drivers and loaders write there too, but nothing that looks like ours.
    pub fn errors(&self) -> Vec<&str> {
        let is_error = |line: &&str| line.starts_with("error: ");
        self.complaint.lines().filter(is_error).collect()
    }

    /// What `--json` printed.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {}", self.out))
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let [out, complaint] = [output.stdout, output.stderr]
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let code = output.status.code();
        Self {
            code,
            out,
            complaint,
        }
    }
}

/// The program with arguments, to be given an environment and run.
pub fn command<A: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_macula"));
    command.args(args);
    command
}

/// Runs the program and looks at what it said: whatever goes wrong, it does not panic.
pub fn run(command: &mut Command) -> Run {
    let run = Run::from(command.output().unwrap());
    assert!(!run.complaint.contains("panicked"), "{}", run.complaint);
    run
}

/// Runs the program with words that hold no spaces.
pub fn macula(line: &str) -> Run {
    run(&mut command(line.split_whitespace()))
}

/// A bundled file or folder.
pub fn asset(name: &str) -> PathBuf {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    assets.join(name)
}
