//! Lets the binary tell which commit it was built from, and whether anything stood beside it.

use std::process::Command;

fn main() {
    // Outside a repository there is nothing to tell.
    if git(&["rev-parse", "--git-dir"]).is_none() {
        println!("cargo:rerun-if-changed=build.rs");
        return;
    }
    for watched in [
        ".git/HEAD",
        ".git/index",
        ".git/refs/heads",
        "src",
        "shaders",
        "xr-sim/src",
        "Cargo.toml",
    ] {
        println!("cargo:rerun-if-changed={watched}");
    }
    if let Some(commit) = git(&["rev-parse", "HEAD"]) {
        let is_dirty = git(&[
            "--no-optional-locks",
            "status",
            "--porcelain",
            "--untracked-files=no",
        ])
        .is_some_and(|changes| !changes.is_empty());
        let suffix = if is_dirty { "-dirty" } else { "" };
        println!("cargo:rustc-env=MACULA_GIT_COMMIT={commit}{suffix}");
    }
}

/// What a git command prints; nothing outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    output.status.success().then_some(text)
}
