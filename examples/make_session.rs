//! Makes the bundled session folder anew: `cargo run --example make_session [FOLDER]`.

use std::error::Error;
use std::path::{Path, PathBuf};

use macula::gaze::synthetic::natural_look;
use macula::gaze::trace::files;

fn main() -> Result<(), Box<dyn Error>> {
    let bundled = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/sessions/natural-look");
    let folder = std::env::args_os().nth(1).map_or(bundled, PathBuf::from);
    for file in [files::METADATA, files::GAZE, files::FRAMES, files::EVENTS] {
        let old = folder.join(file);
        if old.exists() {
            std::fs::remove_file(old)?;
        }
    }
    natural_look().save(&folder)?;
    println!("{}", folder.display());
    Ok(())
}
