//! `macula help`: the commands, one of them, or the parameters.

use std::iter;

use serde_json::json;

use super::{CliError, CliResult, Globals, commands};
use crate::params::{Params, nearest};

/// The topic that is no command.
const PARAMS: &str = "params";

/// Explain a command, or list every parameter with `help params`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// A command and those under it (`session import`), or `params`.
    #[arg(value_name = "TOPIC")]
    pub topic: Vec<String>,
}

/// Prints help; on a command, what its own `--help` prints.
///
/// # Errors
/// There is no such topic.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    match args.topic.as_slice() {
        [topic] if topic == PARAMS => print_params(globals),
        words => {
            check_command(words)?;
            let words = words.iter().map(String::as_str);
            let line = iter::once("macula").chain(words).chain(["--help"]);
            // Prints, and ends the process as `--help` does.
            commands::command().get_matches_from(line);
        }
    }
    Ok(())
}

/// Refuses words that lead to no command.
fn check_command(words: &[String]) -> CliResult {
    let root = commands::command();
    let mut command = &root;
    for (depth, word) in words.iter().enumerate() {
        let Some(found) = command.find_subcommand(word) else {
            let known: String = words[..depth]
                .iter()
                .map(|word| format!(" {word}"))
                .collect();
            let topics = command.get_subcommands().map(clap::Command::get_name);
            let topics = topics.chain((depth == 0).then_some(PARAMS));
            let meant = nearest(word, topics)
                .map(|topic| format!(" (did you mean `{topic}`?)"))
                .unwrap_or_default();
            return Err(CliError::new(format!(
                "there is no help on `{}`{meant}; `macula{known} --help` says what there is",
                words[..=depth].join(" ")
            ))
            .in_arguments());
        };
        command = found;
    }
    Ok(())
}

fn print_params(globals: &Globals) {
    if globals.json {
        println!("{}", json!({ "params": Params::knobs() }));
        return;
    }
    println!(
        "Set one with --set KEY=VALUE, or many in a TOML file with --params FILE.toml ([room] and name = value).\n\
         A table [run] in that file says what is no parameter: technique, size, passes, gaze. `render` and `replay` take it where the\n\
         command line says nothing; `macula cost --budget-ms` writes such a file.\n"
    );
    let mut room = "";
    for knob in Params::knobs() {
        let (this_room, _) = knob.key.split_once('.').unwrap_or((knob.key, ""));
        if this_room != room {
            println!("[{this_room}]");
            room = this_room;
        }
        println!(
            "  {:<34} {} {}, {}",
            knob.key, knob.default, knob.unit, knob.range
        );
        println!("      {}", knob.doc);
        println!("      Default: {}.", knob.source);
    }
}
