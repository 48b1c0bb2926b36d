//! What `macula cost` leaves: tables, the page, the chosen parameters.

use std::fs;
use std::path::Path;

use super::super::{CliError, CliResult, Globals};
use super::page;
use crate::cost::judge::Judge;
use crate::cost::setting::Setting;
use crate::cost::store::Store;
use crate::cost::table::{self, Budget, Outcome};

/// Writes everything into the folder.
pub(super) fn all(outcome: &Outcome, store: &Store, judge: &Judge, folder: &Path) -> CliResult {
    outcome.write(folder)?;
    if let Some(budget) = outcome.kept_budget() {
        best(outcome, budget, folder)?;
    }
    page::of(outcome, store, judge)?.write(&folder.join("report.html"))?;
    Ok(())
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
    let path = folder.join("best.toml");
    fs::write(&path, text)
        .map_err(|error| CliError::because(format!("cannot write {}", path.display()), error))
}

/// Says what was found and where it is.
pub(super) fn tell(folder: &Path, outcome: &Outcome, globals: &Globals) {
    let best = outcome.kept_budget().map(|_| folder.join("best.toml"));
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
    for sentence in &outcome.sentences {
        println!("  {sentence}");
    }
    println!(
        "{} points, {} of them known before: {}",
        outcome.points.len(),
        outcome.reused,
        folder.join("report.html").display()
    );
    if let (Some(best), Some(budget)) = (best, &outcome.budget) {
        let best = best.display();
        println!("parameters: {best}");
        println!(
            "check them: macula cost SCENE --params {best} --check-budget {}",
            budget.budget_ms
        );
    }
}
