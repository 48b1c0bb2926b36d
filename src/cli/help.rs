//! `macula help`: the commands, one of them, or the parameters.

use serde_json::json;

use super::{CliError, CliResult, Globals, commands};
use crate::params::Params;

/// Explain a command, or list every parameter with `help params`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// A command, or `params`.
    #[arg(value_name = "TOPIC")]
    pub topic: Option<String>,
}

/// Prints help.
///
/// # Errors
/// There is no such topic.
pub fn run(args: Args, globals: &Globals) -> CliResult {
    let mut command = commands::command();
    match args.topic.as_deref() {
        None => println!("{}", command.render_long_help()),
        Some("params") if globals.json => println!("{}", json!({ "params": Params::knobs() })),
        Some("params") => print_params(),
        Some(topic) => match command.find_subcommand_mut(topic) {
            Some(found) => println!("{}", found.render_long_help()),
            None => {
                return Err(CliError::new(format!(
                    "there is no help on `{topic}`; try `macula help` or `macula help params`"
                )));
            }
        },
    }
    Ok(())
}

fn print_params() {
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
