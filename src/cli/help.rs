//! `macula help`: the commands, one of them, or the parameters.

use std::iter;

use serde_json::json;

use super::{CliError, CliResult, Globals, commands};
use crate::params::{Knob, Params, nearest};

/// The topic that is no command.
const PARAMS: &str = "params";

/// Explain a command, or list every parameter with `help params`, those of one room with `help params photon`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// A command and those under it (`session import`), or `params` and a room (`params photon`).
    #[arg(value_name = "TOPIC")]
    pub topic: Vec<String>,
}

/// Prints help; on a command, what its own `--help` prints.
///
/// # Errors
/// There is no such topic.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    match args.topic.as_slice() {
        [topic] if topic == PARAMS => print_params(&Params::knobs(), globals),
        [topic, room] if topic == PARAMS => print_params(&knobs_of(room)?, globals),
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
            let meant = nearest(word, topics.filter(|topic| topic != word))
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

/// The room of a knob.
fn room_of(key: &str) -> &str {
    key.split_once('.').map_or(key, |(room, _)| room)
}

/// The knobs of one room, or the one knob of that key.
///
/// # Errors
/// There is neither; the message names what is most like it, and all rooms.
fn knobs_of(wanted: &str) -> Result<Vec<Knob>, CliError> {
    let knobs = Params::knobs();
    let mut rooms = Vec::from_iter(knobs.iter().map(|knob| room_of(knob.key)));
    rooms.dedup();
    let keys = knobs.iter().map(|knob| knob.key);
    let meant = nearest(wanted, rooms.iter().copied().chain(keys))
        .map(|key| format!(" (did you mean `{key}`?)"))
        .unwrap_or_default();
    let rooms = rooms.join(", ");
    let is_wanted = |knob: &Knob| knob.key == wanted || room_of(knob.key) == wanted;
    let wanted_knobs = Vec::from_iter(knobs.into_iter().filter(is_wanted));
    if wanted_knobs.is_empty() {
        return Err(CliError::new(format!(
            "no parameter and no room of parameters is called `{wanted}`{meant}; the rooms are: {rooms}"
        ))
        .in_arguments());
    }
    Ok(wanted_knobs)
}

fn print_params(knobs: &[Knob], globals: &Globals) {
    if globals.json {
        println!("{}", json!({ "params": knobs }));
        return;
    }
    println!(
        "Set one with --set KEY=VALUE, or many in a TOML file with --params FILE.toml ([room] and name = value).\n\
         A table [run] in that file says what is no parameter: technique, size, passes, gaze. `render` and `replay` take it where the\n\
         command line says nothing; `macula cost --budget-ms` writes such a file.\n"
    );
    let mut room = "";
    for knob in knobs {
        let this_room = room_of(knob.key);
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
