//! What the simulated headset is and plays: set in-process, or read from the file that `XR_SIM_CONFIG` names.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::script::{Script, ScriptError};

/// The environment variable that names the configuration file where the process set none.
const CONFIG_VARIABLE: &str = "XR_SIM_CONFIG";

/// The largest side of an eye's image, in pixels.
pub const MAX_IMAGE_SIZE: u32 = 4096;

/// The largest side of a swapchain's image, in pixels: both eyes side by side.
pub(crate) const MAX_SWAPCHAIN_SIZE: u32 = 2 * MAX_IMAGE_SIZE;

/// The simulated headset: what it plays, its displays, its clock and where its pictures go.
///
/// The same fields, as JSON, make the file that `XR_SIM_CONFIG` names; a field left out has its default,
/// an unknown one is an error, and a relative path there is relative to the file's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The session folder to replay. None: a still head, the gaze ahead, without end.
    pub session: Option<PathBuf>,
    /// The first frame shown: a row of `frames.csv`, counted from 0.
    pub first_frame: usize,
    /// The last row shown at most. None: the last of the recording.
    pub last_frame: Option<usize>,
    /// Every how many-th row is shown: 9 makes 10 Hz of a 90 Hz recording, at the recorded times.
    pub frame_step: usize,
    /// Recommended width of an eye's image, in pixels.
    pub eye_width: u32,
    /// Recommended height of an eye's image, in pixels.
    pub eye_height: u32,
    /// How time passes.
    pub clock: ClockKind,
    /// Where the pictures of the submitted layers go. None: nowhere.
    pub capture: Option<Capture>,
    /// Whether the headset has an eye tracker at all.
    pub eye_gaze: bool,
    /// The Vulkan device to offer. None: the best, discrete before integrated before virtual before CPU.
    pub device: Option<DeviceChoice>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            session: None,
            first_frame: 0,
            last_frame: None,
            frame_step: 1,
            eye_width: 1024,
            eye_height: 1024,
            clock: ClockKind::RealTime,
            capture: None,
            eye_gaze: true,
            device: None,
        }
    }
}

/// How the headset's time passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockKind {
    /// Frame by frame at the script's times, never sleeping: the same run gives the same results.
    Virtual,
    /// With the clock on the wall; a frame that comes too late is skipped as a headset would.
    RealTime,
}

/// Pictures of what each eye was shown, one file per eye and frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capture {
    /// Made where missing; receives `left_00000.png`, `right_00000.png` and so on.
    pub folder: PathBuf,
    /// Their format.
    #[serde(default)]
    pub format: PictureFormat,
}

/// The format of captured pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureFormat {
    /// 8 bits a channel, sRGB.
    #[default]
    Png,
    /// 32-bit floats, linear.
    Exr,
}

/// Which Vulkan device the headset hangs on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum DeviceChoice {
    /// Its place in the driver's list, counted from 0.
    Index(usize),
    /// A part of its name, in any case.
    Name(String),
}

/// Why a configuration was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The configuration file can't be read.
    #[error("cannot read the configuration {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The configuration file isn't one.
    #[error("{} is no configuration: {source}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// The folder for captured pictures can't be made.
    #[error("cannot make the capture folder {}: {source}", path.display())]
    CaptureFolder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A field is out of its range.
    #[error("{field} is {value}; give {allowed}")]
    Range {
        /// The field of [`Config`].
        field: &'static str,
        /// What was given.
        value: String,
        /// What would be right.
        allowed: String,
    },
    /// The session folder can't be replayed.
    #[error(transparent)]
    Script(#[from] ScriptError),
}

/// A configuration with its script loaded: all that an instance needs to know.
#[derive(Debug)]
pub(crate) struct Setup {
    pub config: Config,
    pub script: Script,
}

static CONFIGURED: Mutex<Option<Arc<Setup>>> = Mutex::new(None);

/// Sets what the instances made in this process from now on simulate, in place of `XR_SIM_CONFIG`.
///
/// The session folder is read here, so that what is wrong with it is told here.
///
/// # Errors
/// A field out of range, or a session folder that can't be replayed; the former configuration stays.
pub fn configure(config: Config) -> Result<(), ConfigError> {
    let setup = Setup::new(config)?;
    *CONFIGURED.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(setup));
    Ok(())
}

impl Setup {
    fn new(config: Config) -> Result<Self, ConfigError> {
        for (field, value) in [
            ("eye_width", config.eye_width),
            ("eye_height", config.eye_height),
        ] {
            if !(1..=MAX_IMAGE_SIZE).contains(&value) {
                return Err(range(field, value, format!("1 to {MAX_IMAGE_SIZE} pixels")));
            }
        }
        if config.frame_step == 0 {
            return Err(range("frame_step", 0, "1 or more".into()));
        }
        if let Some(last) = config.last_frame.filter(|last| *last < config.first_frame) {
            let allowed = format!("first_frame ({}) or more", config.first_frame);
            return Err(range("last_frame", last, allowed));
        }
        if let Some(Capture { folder: path, .. }) = &config.capture {
            fs::create_dir_all(path).map_err(|source| ConfigError::CaptureFolder {
                path: path.into(),
                source,
            })?;
        }
        let script = match &config.session {
            Some(folder) => {
                let script = Script::load(folder)?;
                let count = script.frames().len();
                if config.first_frame >= count {
                    let allowed = format!("less than {count}, the frames of {}", folder.display());
                    return Err(range("first_frame", config.first_frame, allowed));
                }
                script
            }
            None => Script::still(),
        };
        Ok(Self { config, script })
    }

    /// What the process set, else the file that the environment names, else the default.
    pub fn current() -> Result<Arc<Self>, ConfigError> {
        if let Some(setup) = &*CONFIGURED.lock().unwrap_or_else(PoisonError::into_inner) {
            return Ok(setup.clone());
        }
        let config = match std::env::var_os(CONFIG_VARIABLE) {
            Some(path) => read(Path::new(&path))?,
            None => Config::default(),
        };
        Ok(Arc::new(Self::new(config)?))
    }
}

fn read(path: &Path) -> Result<Config, ConfigError> {
    let text = fs::read_to_string(path).map_err(|source| ConfigError::Read {
        path: path.into(),
        source,
    })?;
    let mut config: Config = serde_json::from_str(&text).map_err(|source| ConfigError::Parse {
        path: path.into(),
        source,
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    config.session = config.session.map(|session| folder.join(session));
    config.capture = config.capture.map(|capture| Capture {
        folder: folder.join(capture.folder),
        ..capture
    });
    Ok(config)
}

fn range(field: &'static str, value: impl ToString, allowed: String) -> ConfigError {
    ConfigError::Range {
        field,
        value: value.to_string(),
        allowed,
    }
}
