//! What people and programs read: stdout and stderr. The `println!` of `cli` and its kin lead here.
//!
//! A reader that goes away early (`macula inspect SCENE | head`) is no fault: the rest is not printed, work that is begun is done, and
//! the exit code tells how that went.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write as _};
use std::sync::OnceLock;

/// What stdout refused first; after it nothing more is printed there.
static REFUSAL: OnceLock<io::Error> = OnceLock::new();

/// Prints to stdout.
pub fn print(text: Arguments) {
    let _ = try_to(|| io::stdout().write_fmt(text));
}

/// Prints to stderr. If it refuses, there is nobody left to tell.
pub fn print_error(text: Arguments) {
    let _ = io::stderr().write_fmt(text);
}

/// Prints what stdout still holds back.
///
/// # Errors
/// What stdout refused first, a full disk for one, unless its reader went away.
pub fn finish() -> Result<(), &'static io::Error> {
    try_to(|| io::stdout().flush())
}

/// Does something with stdout, as long as it has refused nothing.
fn try_to(act: impl FnOnce() -> io::Result<()>) -> Result<(), &'static io::Error> {
    if REFUSAL.get().is_none()
        && let Err(error) = act()
    {
        // Another thread's refusal may have come first; one is enough.
        let _ = REFUSAL.set(error);
    }
    match REFUSAL.get() {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}
