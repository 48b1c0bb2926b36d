//! The measuring of `macula cost`: the sweep, then the searches.

use std::cell::RefCell;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::super::common;
use super::super::compare::GazeAngles;
use super::super::output::{OutputDir, interrupt_flag};
use super::super::progress::Progress;
use super::super::run_record::RunRecord;
use super::super::{CliError, CliResult, Globals};
use super::{Args, bench, prepare, write};
use crate::cost::campaign::{Campaign, Findings};
use crate::cost::judge::Judge;
use crate::cost::ladder::Ladder;
use crate::cost::level::{self, Goal};
use crate::cost::measure::Bench;
use crate::cost::plan::Axis;
use crate::cost::point::Point;
use crate::cost::reference::Origin;
use crate::cost::search::{self, Trial};
use crate::cost::setting::{SIZE, Setting};
use crate::cost::store::{Store, Study};
use crate::cost::table::{self, Budget, Comparison, Machine, Outcome};
use crate::cost::{CostError, alike, fit, sentences};
use crate::gpu::GpuDevice;
use crate::scene::Scene;
use crate::scene::loaded::LoadedScene;
use crate::technique::radius::RadiusRule;

/// The whole command, but for `--check-budget`.
pub(super) fn run(
    args: &Args,
    out: &Path,
    base: &Setting,
    gaze: GazeAngles,
    globals: &Globals,
) -> CliResult {
    let settings = prepare::settings(args, base)?;
    let scene = Scene::load(&args.scene)?;
    let camera = common::find_camera(&scene, &args.camera, &args.scene)?;
    let study = prepare::study(args, base, &settings, &scene, &camera, gaze)?;
    let mut record = RunRecord::new(std::env::args());
    let output = OutputDir::resume(out, globals.force, &record, &Store::CARRIED, |folder| {
        prepare::check_study(folder, &study)
    })?;
    let interrupted = interrupt_flag()?;
    let gpu = common::headless_device(globals)?;
    record.describe(&base.params, &gpu, &scene, &args.scene);
    let loaded = LoadedScene::new(&gpu, scene)?;
    record.warnings.extend(loaded.scene.warnings.clone());

    let angles_rad = prepare::angles_rad(base, &study, &camera, gaze)?;
    let device = format!("{}, {}", gpu.info.name, gpu.info.driver_info);
    let started = Instant::now();
    let reference = prepare::reference(
        args,
        base,
        &study,
        &loaded,
        &camera,
        output.path(),
        interrupted,
    )?;
    let Some(reference) = reference else {
        output.keep_partial(&record)?;
        let message = "stopped before the reference was done: the same command starts it anew";
        return Err(CliError::new(message));
    };
    let timed = started.elapsed().as_secs_f64();
    record.timings_s.insert("reference".into(), timed);
    let store = Store::open(output.path(), study.clone(), device, reference.sha256())?;
    let origin = reference.origin.clone();
    let judge = Judge::new(reference, &angles_rad, prepare::limits(base))?;
    let bench = bench(&gpu, &loaded, &camera, gaze, args, interrupted);

    let measuring = Instant::now();
    let found = measure(args, &settings, &bench, &judge, &store)?;
    let timed = measuring.elapsed().as_secs_f64();
    record.timings_s.insert("measuring".into(), timed);
    let is_complete = !interrupted.load(Ordering::SeqCst);
    let outcome = outcome(
        found,
        &loaded.scene,
        study,
        origin,
        machine(&gpu),
        is_complete,
        &bench.radius(),
    );
    record.warnings.extend(outcome.warnings.clone());
    if outcome.points.is_empty() {
        output.keep_partial(&record)?;
        let message =
            "stopped before the first point; the reference is kept: the same command goes on";
        return Err(CliError::new(message));
    }
    let next = write::next_steps(&outcome, args, out);
    write::all(&outcome, &next, &store, &judge, output.path())?;
    if !is_complete {
        let points = outcome.points.len();
        let kept = output.keep_partial(&record)?.unwrap_or_default();
        return Err(CliError::new(format!(
            "stopped after {points} points, which are in {}: the same command goes on from there",
            kept.display()
        )));
    }
    let folder = output.finish(&record)?;
    write::tell(&folder, &outcome, &next, globals);
    match &outcome.budget {
        Some(budget) if !budget.is_met => Err(CliError::new(format!(
            "no setting kept {} ms; there is no best.toml. {} tells what was tried",
            budget.budget_ms,
            folder.join("report.html").display()
        ))),
        _ => Ok(()),
    }
}

/// What was measured, and what was chosen from it.
struct Found {
    findings: Findings,
    budget: Option<Budget>,
    comparisons: Vec<Comparison>,
}

/// The sweep, then what else was asked for; ends early where it is interrupted.
fn measure(
    args: &Args,
    settings: &[Setting],
    bench: &Bench<'_>,
    judge: &Judge,
    store: &Store,
) -> Result<Found, CliError> {
    let count = settings.len() as u64;
    let progress = RefCell::new(Progress::new("measuring", count, "points"));
    let Some(anchor) = settings.first() else {
        return Err(CliError::new("the sweep holds no point"));
    };
    let mut tell = |setting: &Setting| progress.borrow().set_message(setting.words());
    let mut campaign = Campaign::new(bench, judge, store, anchor.clone(), &mut tell)?;
    let mut found = (None, Vec::new());
    let mut is_whole = true;
    for setting in settings {
        is_whole = campaign.point(setting)?.is_some();
        if !is_whole {
            break;
        }
        progress.borrow().advance(1);
    }
    if is_whole {
        let further = |what: &str| {
            progress.replace(Progress::new(what, None, "points"));
        };
        found = search_on(args, judge, &mut campaign, &further, &progress)?;
    }
    Ok(Found {
        findings: campaign.finish()?,
        budget: found.0,
        comparisons: found.1,
    })
}

/// The budget, then equal errors and equal times.
fn search_on(
    args: &Args,
    judge: &Judge,
    campaign: &mut Campaign<'_>,
    further: &dyn Fn(&str),
    progress: &RefCell<Progress>,
) -> Result<(Option<Budget>, Vec<Comparison>), CliError> {
    let mut budget = None;
    if let Some(budget_ms) = args.budget_ms {
        further(&format!(
            "searching for {} ms",
            sentences::number(budget_ms)
        ));
        let limit = args.search_seconds;
        let chosen = choose(args, campaign, judge, budget_ms, limit, progress)?;
        let Some(chosen) = chosen else {
            return Ok((None, Vec::new()));
        };
        budget = Some(Budget::new(budget_ms, &chosen));
    }
    let mut goals = Vec::new();
    if let Some(relmse) = args.equal_error {
        goals.push(Goal::Relmse(relmse));
        further("bringing techniques to one error");
        if !equal_error(campaign, relmse, progress)? {
            return Ok((budget, Vec::new()));
        }
    }
    if let Some(frame_ms) = args.equal_time {
        goals.push(Goal::FrameMs(frame_ms));
        further("bringing techniques to one time");
        if !equal_time(args, campaign, judge, frame_ms, progress)? {
            return Ok((budget, Vec::new()));
        }
    }
    let comparisons = goals.into_iter().map(|goal| Comparison {
        goal,
        levels: level::levels(campaign.points(), goal),
    });
    Ok((budget, comparisons.collect()))
}

/// Brings each technique of the sweep near an error. `false` if it was interrupted.
fn equal_error(
    campaign: &mut Campaign<'_>,
    relmse: f64,
    progress: &RefCell<Progress>,
) -> Result<bool, CostError> {
    let points = campaign.points().to_vec();
    for technique in fit::techniques(&points) {
        let mut measure = |setting: &Setting| {
            progress.borrow().advance(1);
            campaign.point_alike(setting)
        };
        if !level::approach(technique, &points, relmse, &mut measure)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Searches each technique of the sweep for its least error within a time, all of them equally long. `false` if it was interrupted.
fn equal_time(
    args: &Args,
    campaign: &mut Campaign<'_>,
    judge: &Judge,
    frame_ms: f64,
    progress: &RefCell<Progress>,
) -> Result<bool, CostError> {
    let starts = starts(campaign, frame_ms)?;
    let share = args.search_seconds.div_f64(starts.len().max(1) as f64);
    for start in starts {
        let started = Instant::now();
        let is_over = || started.elapsed() > share;
        let ladders = ladders(args, &start, judge);
        let mut try_it = |setting: &Setting| try_known(campaign, setting, progress);
        if search::descend(start, &ladders, frame_ms, &mut try_it, &is_over)?.is_none() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Settings that are measured again because they seem to beat the one chosen.
const MAX_CHALLENGERS: usize = 6;
/// The most promising techniques are searched; so much of the time is over when each has had its share.
const SHARES: [f64; 2] = [0.65, 1.0];

/// The best setting for a frame time: from the best points of the most promising techniques, within the time. `None` if it was
/// interrupted.
fn choose(
    args: &Args,
    campaign: &mut Campaign<'_>,
    judge: &Judge,
    budget_ms: f64,
    limit: Duration,
    progress: &RefCell<Progress>,
) -> Result<Option<Point>, CostError> {
    let started = Instant::now();
    let starts = starts(campaign, budget_ms)?;
    let mut found: Vec<Trial> = Vec::new();
    for (start, share) in starts.into_iter().zip(SHARES) {
        let end = limit.mul_f64(share);
        let is_over = || started.elapsed() > end;
        let ladders = ladders(args, &start, judge);
        let mut try_it = |setting: &Setting| try_known(campaign, setting, progress);
        match search::descend(start, &ladders, budget_ms, &mut try_it, &is_over)? {
            Some(trial) => found.push(trial),
            None => return Ok(None),
        }
    }
    // Whatever was measured may be the best: a point of the sweep, or of an earlier run.
    for point in campaign.points() {
        found.push(campaign.trial(point)?);
    }
    let Some(best) = search::best(found, search::FILL_AIM * budget_ms) else {
        return Ok(None);
    };
    let mut try_afresh = |setting: &Setting| try_fresh(campaign, setting, progress);
    let knobs = ladders(args, &best, judge);
    let chosen = search::confirm(&best.setting, &knobs, budget_ms, &mut try_afresh)?;
    let Some(mut chosen) = chosen else {
        return Ok(None);
    };
    let radius = campaign.radius();
    let mut challenged = vec![chosen.setting.clone()];
    for _ in 0..MAX_CHALLENGERS {
        let known = campaign.points().iter();
        let known = known.map(|point| campaign.trial_at_best(point));
        let known: Vec<Trial> = known.collect::<Result<_, _>>()?;
        let fresh = known.into_iter().filter(|trial| {
            let is_known = |known| alike::make_one_picture(known, &trial.setting, &radius);
            !challenged.iter().any(is_known)
        });
        let Some(challenger) = search::challenger(&chosen, fresh, budget_ms) else {
            break;
        };
        let Some(trial) = try_fresh(campaign, &challenger.setting, progress)? else {
            return Ok(None);
        };
        challenged.push(challenger.setting);
        if search::is_better(&trial, &chosen, budget_ms) {
            chosen = trial;
        }
    }
    // What decided was the best of several measurements, and so a little too good: it is measured once more, and told as it comes out.
    for aim_ms in [budget_ms, search::FILL_AIM * budget_ms] {
        let knobs = ladders(args, &chosen, judge);
        let Some(last) = campaign.fresh_point(&chosen.setting)? else {
            return Ok(None);
        };
        if last.frame_ms() <= budget_ms {
            return Ok(Some(last));
        }
        let mut try_afresh = |setting: &Setting| try_fresh(campaign, setting, progress);
        match search::confirm(&chosen.setting, &knobs, aim_ms, &mut try_afresh)? {
            Some(trial) => chosen = trial,
            None => return Ok(None),
        }
    }
    // What was measured to keep the budget is better than nothing.
    let kept = campaign.points().iter();
    let kept = kept.filter(|point| point.frame_ms() <= budget_ms);
    let kept = kept.min_by(|a, b| a.relmse().total_cmp(&b.relmse()));
    match kept.cloned() {
        Some(kept) => Ok(Some(kept)),
        None => campaign.point(&chosen.setting),
    }
}

/// The trial of a setting, from the store, from its like or measured. `None` if it was interrupted.
fn try_known(
    campaign: &mut Campaign<'_>,
    setting: &Setting,
    progress: &RefCell<Progress>,
) -> Result<Option<Trial>, CostError> {
    progress.borrow().advance(1);
    let Some(point) = campaign.point_alike(setting)? else {
        return Ok(None);
    };
    Ok(Some(Trial {
        setting: setting.clone(),
        ..campaign.trial(&point)?
    }))
}

/// The trial of a setting, measured now. `None` if it was interrupted.
fn try_fresh(
    campaign: &mut Campaign<'_>,
    setting: &Setting,
    progress: &RefCell<Progress>,
) -> Result<Option<Trial>, CostError> {
    progress.borrow().advance(1);
    let point = campaign.fresh_point(setting)?;
    point.map(|point| campaign.trial(&point)).transpose()
}

/// The knobs that a search may turn: the size only where the user left it open.
fn ladders(args: &Args, start: &Trial, judge: &Judge) -> Vec<Ladder> {
    let mut ladders = Ladder::all(start.setting.technique, judge.size());
    let of_size = |sweep: &String| Axis::parse(sweep).is_ok_and(|axis| axis.key == SIZE);
    if args.size.is_some() || args.sweep.iter().any(of_size) {
        ladders.retain(|ladder| ladder.key() != SIZE);
    }
    ladders
}

/// The most promising point of each technique, the most promising technique first.
fn starts(campaign: &Campaign<'_>, budget_ms: f64) -> Result<Vec<Trial>, CostError> {
    let promise = |trial: &Trial| search::promise(trial, budget_ms);
    let mut starts: Vec<Trial> = Vec::new();
    for technique in fit::techniques(campaign.points()) {
        let own = campaign.points().iter();
        let own = own.filter(|point| point.technique == technique);
        let trials = own.map(|point| campaign.trial(point));
        let trials = trials.collect::<Result<Vec<_>, _>>()?.into_iter();
        starts.extend(trials.min_by(|a, b| promise(a).total_cmp(&promise(b))));
    }
    starts.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
    Ok(starts)
}

fn outcome(
    found: Found,
    scene: &Scene,
    study: Study,
    reference: Origin,
    machine: Machine,
    complete: bool,
    radius: &RadiusRule,
) -> Outcome {
    let Findings {
        points,
        reused,
        drift,
    } = found.findings;
    let budget = found.budget;
    let mut warnings: Vec<String> = Vec::new();
    for warning in points.iter().flat_map(|point| &point.warnings) {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    Outcome {
        title: sentences::title(&scene.name, &points, budget.as_ref(), &drift),
        sentences: sentences::all(&points, budget.as_ref(), &found.comparisons, &drift, radius),
        scene: scene.name.clone(),
        study,
        reference,
        machine,
        drift,
        complete,
        reused,
        front: fit::front(&points)
            .iter()
            .map(|point| point.key.clone())
            .collect(),
        fits: table::fits(&points),
        budget,
        comparisons: found.comparisons,
        warnings,
        points,
    }
}

fn machine(gpu: &GpuDevice) -> Machine {
    // Linux says it here; elsewhere the name is left out.
    let processors = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = processors
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    Machine {
        device: gpu.info.name.clone(),
        driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info),
        is_software: gpu.info.device_type == wgpu::DeviceType::Cpu,
        processor: name.map(|name| name.trim_start_matches([' ', '\t', ':']).to_owned()),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        system: format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH),
    }
}
