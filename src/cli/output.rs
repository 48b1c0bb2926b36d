//! Where results go. An output grows under `NAME.partial` beside its place and is renamed when it is complete, so that what stands under
//! its own name is whole. Nothing that exists is replaced without `--force`, and never a folder that macula did not write.
//! A run that stops early (Ctrl-C, an error, a crash) leaves `NAME.partial` with what was complete.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use super::run_record::{self, RUN_FILE, RunRecord};
use super::{CliError, CliResult};

/// Why an output cannot be made or completed.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The path has no last name (`/`, `..`).
    #[error("{} does not name an output; give a path that ends in a name", .0.display())]
    NoName(PathBuf),
    /// Something is there and `--force` was not given.
    #[error("{} exists; pass --force to replace it or choose another name", .0.display())]
    Exists(PathBuf),
    /// An earlier run left its partial result there and `--force` was not given.
    #[error("{} was left by a run that did not finish; move it away or pass --force to replace it", .0.display())]
    PartialExists(PathBuf),
    /// Something is there that macula did not write; `--force` does not touch it.
    #[error("{} is not an output of macula ({why}), so it is not replaced, even with --force; choose another name", path.display())]
    NotOurs {
        /// What is there.
        path: PathBuf,
        /// How it is known not to be ours.
        why: &'static str,
    },
    /// The file system refused.
    #[error("cannot {action} {}; check that the place can be written and has room", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

pub(super) fn failed<'a>(
    action: &'static str,
    path: &'a Path,
) -> impl FnOnce(io::Error) -> OutputError + 'a {
    move |source| OutputError::Io {
        action,
        path: path.into(),
        source,
    }
}

/// A folder that is being filled.
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    partial: PathBuf,
}

impl OutputDir {
    /// Makes `NAME.partial` (and the folders above it) with a first `run.json` in it. Call it before any long work: here it shows
    /// whether the place can be written.
    ///
    /// # Errors
    /// Something exists that may not be replaced, or the place cannot be written.
    pub fn create(target: &Path, force: bool, record: &RunRecord) -> Result<Self, OutputError> {
        let partial = with_suffix(target, ".partial")?;
        check_free(target, &partial, force, check_folder_is_ours)?;
        if exists(&partial)? {
            fs::remove_dir_all(&partial).map_err(failed("remove", &partial))?;
        }
        create_parents(target)?;
        fs::create_dir(&partial).map_err(failed("create the folder", &partial))?;
        let output = Self {
            target: target.into(),
            partial,
        };
        record.write(&output.partial, false)?;
        Ok(output)
    }

    /// Goes on with what an earlier run left: with its partial folder, or with a copy of the `carried` entries of the finished one,
    /// which stays until this one is finished. `check` refuses a folder that holds something else. With `force`, or where nothing is
    /// there, as [`OutputDir::create`].
    ///
    /// # Errors
    /// As for [`OutputDir::create`], or what `check` found.
    pub fn resume(
        target: &Path,
        force: bool,
        record: &RunRecord,
        carried: &[&str],
        check: impl Fn(&Path) -> CliResult,
    ) -> Result<Self, CliError> {
        let partial = with_suffix(target, ".partial")?;
        if force {
            return Ok(Self::create(target, force, record)?);
        }
        for folder in [partial.as_path(), target] {
            if exists(folder)? {
                check_folder_is_ours(folder)?;
                check(folder)?;
            }
        }
        if !exists(&partial)? {
            create_parents(target)?;
            // Under a name of its own until all is there, so that a copy that was cut short is not taken for the whole.
            let copying = with_suffix(target, ".copying")?;
            if exists(&copying)? {
                check_folder_is_ours(&copying)?;
                fs::remove_dir_all(&copying).map_err(failed("remove", &copying))?;
            }
            fs::create_dir(&copying).map_err(failed("create the folder", &copying))?;
            record.write(&copying, false)?;
            if exists(target)? {
                for name in carried {
                    copy(&target.join(name), &copying.join(name))?;
                }
            }
            fs::rename(&copying, &partial).map_err(failed("rename to", &partial))?;
        }
        record.write(&partial, false)?;
        // Not before: what was refused is not ours to clear away.
        Ok(Self {
            target: target.into(),
            partial,
        })
    }

    /// The folder to write into. It moves when the output is finished, so keep no path of it.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Writes the final `run.json` and gives the folder its name, replacing what [`OutputDir::create`] was allowed to replace.
    ///
    /// # Errors
    /// The place changed meanwhile, or the file system refuses; what was written stays under the partial name.
    pub fn finish(self, record: &RunRecord) -> Result<PathBuf, OutputError> {
        record.write(&self.partial, true)?;
        if !exists(&self.target)? {
            fs::rename(&self.partial, &self.target).map_err(failed("rename to", &self.target))?;
            return Ok(self.target.clone());
        }
        // The old folder steps aside first, so that a complete one stands at every moment but between two renames.
        check_folder_is_ours(&self.target)?;
        let aside = with_suffix(&self.target, &format!(".replaced-{}", std::process::id()))?;
        fs::rename(&self.target, &aside).map_err(failed("move aside", &self.target))?;
        if let Err(source) = fs::rename(&self.partial, &self.target) {
            let back = fs::rename(&aside, &self.target);
            return Err(failed("rename to", &self.target)(
                back.err().unwrap_or(source),
            ));
        }
        fs::remove_dir_all(&aside).map_err(failed("remove", &aside))?;
        Ok(self.target.clone())
    }

    /// Ends early: `NAME.partial` stays, and its `run.json` says that it is not complete. Its path, or `None` if nothing but the
    /// record was in it: then it goes away.
    ///
    /// # Errors
    /// The record cannot be written.
    pub fn keep_partial(self, record: &RunRecord) -> Result<Option<PathBuf>, OutputError> {
        record.write(&self.partial, false)?;
        Ok((!self.holds_only_the_record()).then(|| self.partial.clone()))
    }

    fn holds_only_the_record(&self) -> bool {
        fs::read_dir(&self.partial).is_ok_and(|entries| {
            let mut entries = entries.flatten();
            entries.all(|entry| entry.file_name() == RUN_FILE)
        })
    }
}

impl Drop for OutputDir {
    /// A run that ends before it wrote anything leaves nothing behind; anything else stays.
    fn drop(&mut self) {
        if self.holds_only_the_record() {
            // Nothing is lost if this fails, and there is nobody left to tell.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

/// A single file that is being written.
#[derive(Debug)]
pub struct OutputFile {
    target: PathBuf,
    partial: PathBuf,
}

impl OutputFile {
    /// Makes an empty `NAME.partial` (and the folders above it). Call it before any long work: here it shows whether the place can be
    /// written.
    ///
    /// # Errors
    /// Something exists that may not be replaced, or the place cannot be written.
    pub fn create(target: &Path, force: bool) -> Result<Self, OutputError> {
        let partial = with_suffix(target, ".partial")?;
        check_free(target, &partial, force, check_is_file)?;
        create_parents(target)?;
        File::create(&partial).map_err(failed("create", &partial))?;
        Ok(Self {
            target: target.into(),
            partial,
        })
    }

    /// The file to write. It moves when the output is finished.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Gives the file its name, replacing what [`OutputFile::create`] was allowed to replace.
    ///
    /// # Errors
    /// The file system refuses; what was written stays under the partial name.
    pub fn finish(self) -> Result<PathBuf, OutputError> {
        fs::rename(&self.partial, &self.target).map_err(failed("rename to", &self.target))?;
        Ok(self.target.clone())
    }

    /// Removes what [`OutputFile::finish`] would replace, because what it belongs to changes now.
    ///
    /// # Errors
    /// The file system refuses.
    pub fn remove_old(&self) -> Result<(), OutputError> {
        if exists(&self.target)? {
            fs::remove_file(&self.target).map_err(failed("remove", &self.target))?;
        }
        Ok(())
    }

    /// Ends early: the path of `NAME.partial`, or `None` if nothing was written: then it goes away.
    pub fn keep_partial(self) -> Option<PathBuf> {
        (!self.is_empty()).then(|| self.partial.clone())
    }

    fn is_empty(&self) -> bool {
        fs::metadata(&self.partial).is_ok_and(|metadata| metadata.len() == 0)
    }
}

impl Drop for OutputFile {
    /// A run that ends before it wrote anything leaves nothing behind; anything else stays.
    fn drop(&mut self) {
        if self.is_empty() {
            // Nothing is lost if this fails, and there is nobody left to tell.
            let _ = fs::remove_file(&self.partial);
        }
    }
}

/// Refuses what is there without `force`, and with it what `check_ours` refuses.
fn check_free(
    target: &Path,
    partial: &Path,
    force: bool,
    check_ours: fn(&Path) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let check = |path: &Path, refusal: fn(PathBuf) -> OutputError| {
        if !exists(path)? {
            Ok(())
        } else if force {
            check_ours(path)
        } else {
            Err(refusal(path.into()))
        }
    };
    check(target, OutputError::Exists)?;
    check(partial, OutputError::PartialExists)
}

/// Whether anything, a dangling link included, has this name.
fn exists(path: &Path) -> Result<bool, OutputError> {
    match fs::symlink_metadata(path) {
        Ok(_) => Ok(true),
        // Above a file there are no names: creating the folders reports that better.
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
            ) =>
        {
            Ok(false)
        }
        Err(error) => Err(failed("look at", path)(error)),
    }
}

fn check_folder_is_ours(path: &Path) -> Result<(), OutputError> {
    let not_ours = |why| OutputError::NotOurs {
        path: path.into(),
        why,
    };
    let metadata = fs::symlink_metadata(path).map_err(failed("look at", path))?;
    if !metadata.is_dir() {
        return Err(not_ours("it is not a folder"));
    }
    let mut entries = fs::read_dir(path).map_err(failed("look into", path))?;
    if entries.next().is_none() {
        return Ok(());
    }
    if run_record::is_ours(path) {
        return Ok(());
    }
    Err(not_ours("it holds no run.json of macula"))
}

fn check_is_file(path: &Path) -> Result<(), OutputError> {
    let metadata = fs::symlink_metadata(path).map_err(failed("look at", path))?;
    if metadata.is_file() {
        return Ok(());
    }
    Err(OutputError::NotOurs {
        path: path.into(),
        why: "it is not a plain file",
    })
}

/// Copies a file, or a folder of files; what is not there is not copied.
fn copy(from: &Path, to: &Path) -> Result<(), OutputError> {
    if from.is_dir() {
        fs::create_dir_all(to).map_err(failed("create the folder", to))?;
        for entry in fs::read_dir(from).map_err(failed("look into", from))? {
            let name = entry.map_err(failed("look into", from))?.file_name();
            copy(&from.join(&name), &to.join(&name))?;
        }
    } else if from.is_file() {
        fs::copy(from, to).map_err(failed("copy", from))?;
    }
    Ok(())
}

/// The name beside `target` that ends in `suffix`.
fn with_suffix(target: &Path, suffix: &str) -> Result<PathBuf, OutputError> {
    let name = target
        .file_name()
        .ok_or_else(|| OutputError::NoName(target.into()))?;
    let mut name = name.to_os_string();
    name.push(suffix);
    Ok(target.with_file_name(name))
}

fn create_parents(target: &Path) -> Result<(), OutputError> {
    match target.parent() {
        Some(parent) if parent != Path::new("") => {
            fs::create_dir_all(parent).map_err(failed("create the folder", parent))
        }
        _ => Ok(()),
    }
}

/// A flag that Ctrl-C raises; long loops look at it between two pieces of work, end cleanly, and keep what is complete. A second Ctrl-C
/// ends the process at once. May be called again: there is one flag.
///
/// # Errors
/// The system does not let the process listen.
pub fn interrupt_flag() -> Result<&'static AtomicBool, CliError> {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();
    /// What shells report for a process that Ctrl-C ended.
    const INTERRUPTED: i32 = 130;
    let listen = || {
        ctrlc::set_handler(|| {
            if FLAG.swap(true, Ordering::SeqCst) {
                std::process::exit(INTERRUPTED);
            }
            eprintln!("stopping cleanly; press Ctrl-C again to stop at once");
        })
        .map_err(|error| error.to_string())
    };
    match LISTENING.get_or_init(listen) {
        Ok(()) => Ok(&FLAG),
        Err(cause) => Err(CliError::because("cannot listen for Ctrl-C", cause.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> RunRecord {
        RunRecord {
            seed: Some(7),
            ..RunRecord::new(["macula".into(), "demo".into()])
        }
    }

    fn read_json(path: &Path) -> serde_json::Value {
        serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
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
    fn a_folder_gets_its_name_only_when_it_is_complete() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("deep/out");
        let output = OutputDir::create(&target, false, &record()).unwrap();
        fs::write(output.path().join("frames.csv"), "frame").unwrap();
        assert!(!target.exists());
        assert_eq!(read_json(&output.path().join(RUN_FILE))["complete"], false);
        assert_eq!(output.finish(&record()).unwrap(), target);
        assert_eq!(names(home.path().join("deep").as_path()), ["out"]);
        assert_eq!(names(&target), ["frames.csv", "run.json"]);
        let run = read_json(&target.join(RUN_FILE));
        assert_eq!((&run["complete"], &run["seed"]), (&true.into(), &7.into()));
        assert_eq!(run["command"][1], "demo");
    }

    #[test]
    fn an_existing_folder_is_replaced_only_by_force_and_only_if_macula_wrote_it() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("out");
        let write = |force, text: &str| {
            let output = OutputDir::create(&target, force, &record())?;
            fs::write(output.path().join("text"), text).unwrap();
            output.finish(&record())
        };
        write(false, "first").unwrap();
        let refusal = write(false, "second").unwrap_err().to_string();
        assert!(
            refusal.contains("--force") && refusal.contains("out"),
            "{refusal}"
        );
        assert_eq!(fs::read_to_string(target.join("text")).unwrap(), "first");
        write(true, "second").unwrap();
        assert_eq!(fs::read_to_string(target.join("text")).unwrap(), "second");
        assert_eq!(names(home.path()), ["out"]);

        for foreign in [
            None,
            Some("{}"),
            Some(r#"{"program":"other"}"#),
            Some("not json"),
        ] {
            let photos = home.path().join("photos");
            let _ = fs::remove_dir_all(&photos);
            fs::create_dir(&photos).unwrap();
            fs::write(photos.join("holiday.jpg"), "dear").unwrap();
            if let Some(run) = foreign {
                fs::write(photos.join(RUN_FILE), run).unwrap();
            }
            let refusal = OutputDir::create(&photos, true, &record()).unwrap_err();
            assert!(matches!(refusal, OutputError::NotOurs { .. }), "{refusal}");
            assert_eq!(
                fs::read_to_string(photos.join("holiday.jpg")).unwrap(),
                "dear"
            );
        }
        fs::create_dir(home.path().join("empty")).unwrap();
        OutputDir::create(&home.path().join("empty"), true, &record()).unwrap();
    }

    #[test]
    fn what_a_stopped_run_wrote_is_kept_and_not_overwritten_unasked() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("out");
        let output = OutputDir::create(&target, false, &record()).unwrap();
        fs::write(output.path().join("text"), "half").unwrap();
        let kept = output.keep_partial(&record()).unwrap().unwrap();
        assert_eq!(kept, home.path().join("out.partial"));
        assert_eq!(names(&kept), ["run.json", "text"]);
        let refusal = OutputDir::create(&target, false, &record()).unwrap_err();
        assert!(
            matches!(refusal, OutputError::PartialExists(_)),
            "{refusal}"
        );
        assert_eq!(fs::read_to_string(kept.join("text")).unwrap(), "half");
        drop(OutputDir::create(&target, true, &record()).unwrap());
        assert_eq!(
            names(home.path()),
            [""; 0],
            "a run that wrote nothing leaves nothing"
        );
    }

    #[test]
    fn a_file_appears_when_it_is_complete_and_an_existing_one_needs_force() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("picture.exr");
        let output = OutputFile::create(&target, false).unwrap();
        fs::write(output.path(), "pixels").unwrap();
        assert!(!target.exists());
        output.finish().unwrap();
        assert!(matches!(
            OutputFile::create(&target, false),
            Err(OutputError::Exists(_))
        ));
        let output = OutputFile::create(&target, true).unwrap();
        fs::write(output.path(), "half").unwrap();
        let kept = output.keep_partial().unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "pixels");
        assert_eq!(fs::read_to_string(&kept).unwrap(), "half");
        fs::remove_file(kept).unwrap();
        drop(OutputFile::create(&target, true).unwrap());
        assert_eq!(names(home.path()), ["picture.exr"]);
        assert!(matches!(
            OutputFile::create(home.path(), true),
            Err(OutputError::NotOurs { .. })
        ));
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named_before_any_work() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("file");
        fs::write(&file, "").unwrap();
        for error in [
            OutputDir::create(&file.join("out"), false, &record()).unwrap_err(),
            OutputFile::create(&file.join("out.exr"), false).unwrap_err(),
        ] {
            assert!(matches!(&error, OutputError::Io { .. }), "{error:?}");
            assert!(error.to_string().contains("file"), "{error}");
        }
        for nameless in ["/", "..", ""] {
            let error = OutputDir::create(Path::new(nameless), true, &record()).unwrap_err();
            assert!(matches!(error, OutputError::NoName(_)), "{error}");
        }
    }
}
