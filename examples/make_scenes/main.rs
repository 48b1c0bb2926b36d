//! Writes the bundled scenes: `cargo run --example make_scenes [FOLDER]`, by default into `assets/scenes`.

use std::io;
use std::path::PathBuf;
use std::{env, fs};

mod bundle;

fn main() -> io::Result<()> {
    let default_folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes");
    let folder = PathBuf::from(env::args_os().nth(1).unwrap_or(default_folder.into()));
    fs::create_dir_all(&folder)?;
    for (file_name, make) in bundle::SCENES {
        let path = folder.join(file_name);
        let glb = make();
        fs::write(&path, &glb)?;
        println!("{} ({} bytes)", path.display(), glb.len());
    }
    Ok(())
}
