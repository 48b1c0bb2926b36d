//! What `macula cost` leaves: tables, the page, the chosen parameters.

use std::fs;
use std::path::Path;

use super::super::{CliError, CliResult, Globals};
use super::{Args, page};
use crate::cost::fit;
use crate::cost::judge::Judge;
use crate::cost::sentences::number;
use crate::cost::setting::Setting;
use crate::cost::store::{BEST_FILE, Store};
use crate::cost::table::{self, Budget, Outcome};

/// Writes everything into the folder.
pub(super) fn all(
    outcome: &Outcome,
    next: &[(String, String)],
    store: &Store,
    judge: &Judge,
    folder: &Path,
) -> CliResult {
    outcome.write(folder)?;
    match (&outcome.budget, outcome.kept_budget()) {
        (_, Some(budget)) => best(outcome, budget, folder)?,
        (Some(_), None) => remove_best(folder)?,
        // What an earlier run chose stays.
        (None, None) => {}
    }
    page::of(outcome, next.to_vec(), store, judge)?.write(&folder.join("report.html"))?;
    Ok(())
}

/// What a user may want to do next, and the command that does it; `out` is the finished folder.
pub(super) fn next_steps(outcome: &Outcome, args: &Args, out: &Path) -> Vec<(String, String)> {
    let scene = shell_word(&args.scene.to_string_lossy());
    let best = shell_word(&out.join(BEST_FILE).to_string_lossy());
    let camera = shell_word(&args.camera);
    let step = |what: &str, command: String| (what.to_owned(), command);
    let mut steps = Vec::new();
    if let Some(budget) = outcome.kept_budget() {
        steps.push(step(
            "Check that the chosen setting keeps its budget, here or on another machine",
            format!(
                "macula cost {scene} --camera {camera} --params {best} --check-budget {}",
                budget.budget_ms
            ),
        ));
        steps.push(step(
            "See its picture (the first frame takes longer, as shaders are compiled)",
            format!("macula render {scene} --camera {camera} --params {best} --out frame.png"),
        ));
    } else if outcome.budget.is_none() {
        let front = fit::front(&outcome.points);
        let same = this_command();
        steps.extend(front.get(front.len() / 2).map(|middle| {
            let budget_ms = number(middle.frame_ms());
            step(
                "Let the best setting for a frame time be found, such as this one; every point measured here counts",
                format!("{same} --budget-ms {budget_ms}"),
            )
        }));
    }
    steps.push(step(
        "Look at every point in a notebook or a spreadsheet",
        shell_word(&out.join("cost.csv").to_string_lossy()),
    ));
    steps
}

/// The command that runs now, to be typed again: it goes on where this one ends.
fn this_command() -> String {
    let words = std::env::args().skip(1);
    let words = words.filter(|word| word != "--force" && word != "--json");
    let words: Vec<String> = words.map(|word| shell_word(&word)).collect();
    format!("macula {}", words.join(" "))
}

/// A text as a shell takes it for one word.
fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@".contains(c);
    match (
        !text.is_empty() && text.chars().all(is_plain),
        cfg!(windows),
    ) {
        (true, _) => text.to_owned(),
        (false, true) => format!("\"{text}\""),
        (false, false) => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Takes away what an earlier run chose for a budget.
fn remove_best(folder: &Path) -> CliResult {
    let path = folder.join(BEST_FILE);
    match path.exists() {
        true => fs::remove_file(&path)
            .map_err(|error| CliError::because(format!("cannot remove {}", path.display()), error)),
        false => Ok(()),
    }
}

/// Writes the chosen setting as a parameter file.
fn best(outcome: &Outcome, budget: &Budget, folder: &Path) -> CliResult {
    let chosen = outcome
        .points
        .iter()
        .find(|point| point.key == budget.point);
    let Some(chosen) = chosen else { return Ok(()) };
    let command: Vec<String> = std::env::args().collect();
    let notes = [
        format!(
            "The best setting found for {} ms a frame, by:",
            budget.budget_ms
        ),
        format!("    {}", command.join(" ")),
        format!(
            "macula {}; scene {}, SHA-256 {}",
            env!("CARGO_PKG_VERSION"),
            outcome.scene,
            outcome.study.scene_sha256
        ),
        format!(
            "Measured after it was chosen: {:.2} ms (half of the frames between {:.2} and {:.2}), foveal relative MSE {:.3e}, on {}",
            budget.frame_ms, budget.q25_ms, budget.q75_ms, budget.relmse, outcome.machine.device
        ),
        format!(
            "Check it: macula cost SCENE --params best.toml --check-budget {}",
            budget.budget_ms
        ),
    ];
    let text = table::parameter_file(&Setting::of(chosen)?, outcome.study.gaze_deg, &notes);
    let path = folder.join(BEST_FILE);
    fs::write(&path, text)
        .map_err(|error| CliError::because(format!("cannot write {}", path.display()), error))
}

/// Says what was found and where it is.
pub(super) fn tell(folder: &Path, outcome: &Outcome, next: &[(String, String)], globals: &Globals) {
    let best = outcome.kept_budget().map(|_| folder.join(BEST_FILE));
    if globals.json {
        println!(
            "{}",
            serde_json::json!({
                "out": folder,
                "report": folder.join("report.html"),
                "best": best,
                "points": outcome.points.len(),
                "reused": outcome.reused,
                "title": outcome.title,
                "sentences": outcome.sentences,
                "budget": outcome.budget,
                "comparisons": outcome.comparisons,
            })
        );
        return;
    }
    for warning in &outcome.warnings {
        eprintln!("warning: {warning}");
    }
    println!("{}", outcome.title);
    for paragraph in &outcome.sentences {
        println!("{}:", paragraph.heading);
        for sentence in &paragraph.sentences {
            println!("  {sentence}");
        }
    }
    println!(
        "{} points, {} of them known before: {}",
        outcome.points.len(),
        outcome.reused,
        folder.join("report.html").display()
    );
    for (what, command) in next {
        println!("{what}:\n  {command}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_shell_takes_any_name_for_one_word() {
        for name in ["out/a", "d$HOME/o", "it's `here`", "two words", ""] {
            let echoed = std::process::Command::new("sh")
                .args(["-c", &format!("printf %s {}", shell_word(name))])
                .output()
                .unwrap();
            assert_eq!(String::from_utf8(echoed.stdout).unwrap(), name);
        }
    }
}
