//! Lets the binary tell which commit it was built from.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=.git/HEAD");
    println!("cargo:rerun-if-changed=.git/refs/heads");
    let output = Command::new("git").args(["rev-parse", "HEAD"]).output();
    if let Some(commit) = output.ok().filter(|output| output.status.success()) {
        println!(
            "cargo:rustc-env=MACULA_GIT_COMMIT={}",
            String::from_utf8_lossy(&commit.stdout).trim()
        );
    }
}
