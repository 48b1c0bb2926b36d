//! Material that lies beside the checkout and is not part of it: tests that need it skip loudly where it is absent.

use std::path::PathBuf;

/// The path `relative` in the folder `shared` beside the checkout, or `None`, said on stderr, where it is absent.
pub fn shared(relative: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../shared")
        .join(relative);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}
