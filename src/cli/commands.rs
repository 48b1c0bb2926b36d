//! The subcommands, and how the process ends: 0 done, 1 failed, 2 wrong arguments.

use std::error::Error;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use super::{
    CliError, CliResult, Globals, compare, console, cost, demo, doctor, help, inspect, render,
    replay, session,
};

/// Real-time global illumination that follows the eye: replay recorded head and gaze sessions through OpenXR, lit by photon mapping.
#[derive(Debug, Parser)]
#[command(
    name = "macula",
    version,
    propagate_version = true,
    disable_help_subcommand = true
)]
struct Cli {
    #[command(flatten)]
    globals: Globals,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Replay(replay::Args),
    Render(render::Args),
    Compare(compare::Args),
    Cost(cost::Args),
    Inspect(inspect::Args),
    Session(session::Args),
    Doctor(doctor::Args),
    Help(help::Args),
}

impl Command {
    fn run(self, globals: &Globals) -> CliResult {
        match self {
            Self::Demo(args) => demo::run(args, globals),
            Self::Replay(args) => replay::run(args, globals),
            Self::Render(args) => render::run(args, globals),
            Self::Compare(args) => compare::run(args, globals),
            Self::Cost(args) => cost::run(args, globals),
            Self::Inspect(args) => inspect::run(args, globals),
            Self::Session(args) => session::run(args, globals),
            Self::Doctor(args) => doctor::run(args, globals),
            Self::Help(args) => help::run(args, globals),
        }
    }
}

/// Parses the command line, runs it, and says what failed.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let Ok(level) = cli.globals.log.parse::<tracing::Level>() else {
        eprintln!(
            "error: --log takes error, warn, info, debug or trace, not `{}`",
            cli.globals.log
        );
        return ExitCode::from(2);
    };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .without_time()
        .init();
    let outcome = cli.command.run(&cli.globals).and_then(|()| {
        console::finish().map_err(|error| CliError::because("stdout could not be written", error))
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", error.message);
            let mut cause: Option<&dyn Error> =
                error.cause.as_deref().map(|cause| cause as &dyn Error);
            while let Some(link) = cause {
                eprintln!("  caused by: {link}");
                cause = link.source();
            }
            ExitCode::from(error.exit_code)
        }
    }
}

/// The clap command, for help and tests.
pub(super) fn command() -> clap::Command {
    use clap::CommandFactory as _;
    Cli::command()
}
