//! The command line: the only place that prints, reads the environment or ends the process. One file a subcommand.

/// The standard library's, but for a reader that goes away: there that one panics, [`console`] stops.
macro_rules! print {
    ($($text:tt)*) => { $crate::cli::console::print(format_args!($($text)*)) };
}
/// As `print!`, with the end of the line.
macro_rules! println {
    ($($text:tt)*) => { print!("{}\n", format_args!($($text)*)) };
}
/// As `println!`, to stderr.
macro_rules! eprintln {
    ($($text:tt)*) => { $crate::cli::console::print_error(format_args!("{}\n", format_args!($($text)*))) };
}

pub mod collect;
pub mod commands;
pub mod common;
pub mod compare;
pub mod console;
pub mod cost;
pub mod demo;
pub mod doctor;
pub mod eye_columns;
pub mod help;
pub mod inspect;
pub mod output;
pub mod progress;
pub mod render;
pub mod replay;
pub mod run_defaults;
pub mod run_record;
pub mod session;

pub use commands::main;

use std::error::Error;
use std::fmt;
use std::path::PathBuf;

/// What a subcommand failed with: one line that names what failed, on which file or device, and the mend; causes follow under it.
#[derive(Debug)]
pub struct CliError {
    /// The one line.
    pub message: String,
    /// What caused it, printed under the line, link by link.
    pub cause: Option<Box<dyn Error + Send + Sync>>,
    /// The exit code: 1 where the work failed, 2 where the arguments were wrong, 3 where a check could not tell.
    pub exit_code: u8,
}

impl CliError {
    /// An error without a deeper cause.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            cause: None,
            exit_code: 1,
        }
    }

    /// An error with what caused it.
    pub fn because(
        message: impl Into<String>,
        cause: impl Into<Box<dyn Error + Send + Sync>>,
    ) -> Self {
        Self {
            message: message.into(),
            cause: Some(cause.into()),
            exit_code: 1,
        }
    }

    /// The same error, because the arguments were wrong.
    pub fn in_arguments(self) -> Self {
        Self {
            exit_code: 2,
            ..self
        }
    }

    /// The same error, because what was measured proves neither.
    pub fn undecided(self) -> Self {
        Self {
            exit_code: 3,
            ..self
        }
    }
}

/// Any typed error of the library is one: its own text is the line, its sources are the causes.
impl<E: Error + Send + Sync + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        let message = error.to_string();
        match error.source() {
            Some(_) => Self::because(message, SourceOf(error)),
            None => Self::new(message),
        }
    }
}

/// What is under an error, owned together with it.
#[derive(Debug)]
struct SourceOf<E>(E);

impl<E: Error> fmt::Display for SourceOf<E> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0
            .source()
            .map_or(Ok(()), |source| fmt::Display::fmt(source, f))
    }
}

impl<E: Error> Error for SourceOf<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source().and_then(Error::source)
    }
}

/// What a subcommand returns: nothing, or the error that makes another exit code than 0.
pub type CliResult = Result<(), CliError>;

/// Options that every subcommand shares.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Globals {
    /// Print one JSON object for machines on stdout (SI units in the key names).
    #[arg(long, global = true)]
    pub json: bool,
    /// Replace an existing output.
    #[arg(long, global = true)]
    pub force: bool,
    /// Set one parameter, e.g. `--set gather.radius_m=0.02`; may be repeated. `macula help params` lists them.
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    pub set: Vec<String>,
    /// Read parameters from a TOML file.
    #[arg(long, value_name = "FILE.toml", global = true)]
    pub params: Option<PathBuf>,
    /// Use this Vulkan device, by name or index (`macula doctor` lists them).
    #[arg(long, value_name = "NAME|INDEX", global = true)]
    pub device: Option<String>,
    /// How much to log on stderr: error, warn, info, debug, trace.
    #[arg(long, value_name = "LEVEL", default_value = "warn", global = true)]
    pub log: String,
}
