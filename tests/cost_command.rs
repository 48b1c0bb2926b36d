//! `macula cost` as a user meets it: tables, a run that goes on, a budget and its parameter file, and what is refused.

#[path = "common/program.rs"]
mod program;

use std::fs;
use std::path::Path;

use program::{Run, asset, command, macula, run};
use serde_json::Value;

/// `cost` of the bundled cornell box, as quick as it gets, into `out`.
fn cost(out: &Path, more: &str) -> Run {
    let mut command = command(["cost"]);
    command
        .arg(asset("scenes/cornell.glb"))
        .arg("--out")
        .arg(out);
    command.args(["--size", "12x12", "--reference-seconds", "0.2"]);
    command.args(["--point-seconds", "0.05", "--json"]);
    run(command.args(more.split_whitespace()))
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn rows(out: &Path) -> Vec<std::collections::HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(out.join("cost.csv")).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_sweep_leaves_a_table_whose_first_columns_are_the_contract() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let done = cost(&out, "--sweep technique=pm,path --sweep photons=100,200");
    assert_eq!(done.code, Some(0), "{}", done.complaint);
    let head = fs::read_to_string(out.join("cost.csv")).unwrap();
    assert!(
        head.starts_with(
            "scene,technique,estimator,photons,foveated_share,radius_m,passes,size,frame_ms,frame_ms_p95,mse_fovea,mse_transition,\
             mse_periphery,relmse_fovea,bias_fovea,mse_temporal_fovea,reuse_share,"
        ),
        "{head}"
    );
    let rows = rows(&out);
    assert_eq!(rows.len(), 3, "paths are not swept by photons");
    for row in &rows {
        assert_eq!(
            (row["scene"].as_str(), row["size"].as_str()),
            ("cornell", "12x12")
        );
        for column in [
            "frame_ms",
            "relmse_fovea",
            "mse_periphery",
            "mse_temporal_fovea",
        ] {
            assert!(
                row[column].parse::<f64>().unwrap() > 0.0,
                "{column}: {row:?}"
            );
        }
        assert_eq!(row["photons"].is_empty(), row["technique"] == "path");
        assert_eq!(
            (row["estimator"].as_str(), row["reuse_share"].as_str()),
            ("", "")
        );
    }
    for name in [
        "cost.json",
        "report.html",
        "run.json",
        "reference.exr",
        "reference.se.exr",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let all = json(&out.join("cost.json"));
    assert_eq!(all["points"].as_array().unwrap().len(), 3);
    assert!(all["points"][0]["time"]["q25_ms"].is_number());
    assert_eq!(all["complete"], true);
    assert!(all["drift"]["anchor_ms"].as_array().unwrap().len() > 1);
}

#[test]
fn a_sweep_tells_which_of_its_points_are_one_picture_because_the_radius_is_capped() {
    let home = tempfile::tempdir().unwrap();
    let told = |name: &str, sweep: &str| {
        let done = cost(&home.path().join(name), sweep);
        assert_eq!(done.code, Some(0), "{}", done.complaint);
        let rows = rows(&home.path().join(name));
        let errors = rows.iter().map(|row| row["mse_fovea"].clone()).collect();
        let sentences = done.json()["sentences"].to_string();
        (sentences.contains("make the same picture"), errors)
    };
    let of = |photons: u32| {
        format!("--sweep photons={photons} --sweep gather.photons_per_estimate=40,160")
    };
    let (is_told, errors): (bool, Vec<String>) = told("few", &of(100));
    assert!(is_told);
    assert_eq!(errors.len(), 2, "what was asked for is measured");
    let (is_told, errors) = told("many", &of(100_000));
    assert!(!is_told);
    assert_ne!(errors[0], errors[1]);
}

#[test]
fn a_search_measures_no_setting_whose_like_it_knows() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let searched = "--sweep technique=pm --sweep photons=500 --equal-time 400 --search-seconds 8";
    assert_eq!(cost(&out, searched).code, Some(0));
    let mut pictures: Vec<(String, String)> = rows(&out)
        .iter()
        .map(|row| {
            let others = row["changed"].split(' ');
            let others =
                others.filter(|change| !change.starts_with("gather.photons_per_estimate="));
            let others: Vec<&str> = others.collect();
            (
                format!("{} {}", row["size"], others.join(" ")),
                row["radius_m"].clone(),
            )
        })
        .collect();
    assert!(pictures.len() > 3, "it searched: {pictures:?}");
    let count = pictures.len();
    pictures.sort();
    pictures.dedup();
    assert_eq!(pictures.len(), count, "{pictures:?}");
}

#[test]
fn a_view_without_periphery_has_empty_columns() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let wide = "--sweep photons=100 --set fovea.radius_deg=90 --set fovea.transition_deg=90";
    assert_eq!(cost(&out, wide).code, Some(0));
    let row = &rows(&out)[0];
    assert_eq!(
        (
            row["mse_transition"].as_str(),
            row["mse_periphery"].as_str()
        ),
        ("", "")
    );
    assert!(!row["mse_fovea"].is_empty());
}

#[test]
fn a_finished_run_goes_on_and_measures_no_point_twice() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    assert_eq!(cost(&out, "--sweep photons=100,200").json()["reused"], 0);
    let reference = fs::read(out.join("reference.exr")).unwrap();
    let first = rows(&out);
    let wider = cost(&out, "--sweep photons=100,200,400").json();
    assert_eq!((&wider["points"], &wider["reused"]), (&3.into(), &2.into()));
    let second = rows(&out);
    assert_eq!(
        first[0]["frame_ms"], second[0]["frame_ms"],
        "it is the same measurement"
    );
    assert_eq!(fs::read(out.join("reference.exr")).unwrap(), reference);
    assert!(!home.path().join("out.partial").exists());
    let anew = cost(&out, "--sweep photons=100 --force").json();
    assert_eq!((&anew["points"], &anew["reused"]), (&1.into(), &0.into()));
}

#[test]
fn a_finished_run_that_measures_nothing_new_still_knows_how_steady_the_machine_was() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    cost(&out, "--sweep photons=100,200").json();
    cost(&out, "--sweep photons=100,200").json();
    let drift = || json(&out.join("cost.json"))["drift"]["anchor_ms"].clone();
    let known = drift();
    assert!(!known.as_array().unwrap().is_empty(), "{known}");
    // Each timing counts once, however often the folder is gone on with.
    cost(&out, "--sweep photons=100,200,300").json();
    let (more, before) = (drift(), known.as_array().unwrap().len());
    let more = more.as_array().unwrap();
    assert_eq!(&more[..before], known.as_array().unwrap());
    assert!(more.len() > before);
}

#[test]
fn a_folder_without_points_blocks_no_other_question_and_lends_it_no_reference() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    assert_eq!(cost(&out, "--sweep photons=100").code, Some(0));
    let partial = home.path().join("out.partial");
    fs::rename(&out, &partial).unwrap();
    fs::remove_dir_all(partial.join("points")).unwrap();
    let reference = fs::read(partial.join("reference.exr")).unwrap();
    let other = cost(&out, "--sweep photons=100 --gaze 5,0 --set random.seed=3");
    assert_eq!(other.code, Some(0), "{}", other.complaint);
    assert_ne!(fs::read(out.join("reference.exr")).unwrap(), reference);
}

#[test]
fn what_another_command_made_is_not_replaced_without_force() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    assert_eq!(cost(&out, "--sweep photons=100").code, Some(0));
    // A replay: macula's mark, and frames.
    for name in ["replay", "other.partial"] {
        let replay = home.path().join(name);
        fs::create_dir(&replay).unwrap();
        fs::copy(out.join("run.json"), replay.join("run.json")).unwrap();
        fs::write(replay.join("frames.csv"), "frame\n1\n").unwrap();
    }
    for name in ["replay", "other"] {
        let refused = cost(&home.path().join(name), "--sweep photons=100");
        assert_eq!(refused.code, Some(1));
        assert!(
            refused.complaint.contains("what another command made"),
            "{}",
            refused.complaint
        );
    }
    assert!(home.path().join("replay/frames.csv").is_file());
    assert!(home.path().join("other.partial/frames.csv").is_file());
    // What macula never wrote is not even cleared away.
    let foreign = home.path().join("foreign.partial");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("run.json"), "{\"program\": \"other\"}").unwrap();
    let refused = cost(&home.path().join("foreign"), "--sweep photons=100");
    assert_eq!(refused.code, Some(1));
    assert!(foreign.join("run.json").is_file());
}

#[test]
fn a_copy_that_was_cut_short_blocks_no_run_and_is_not_taken_for_the_whole() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    assert_eq!(cost(&out, "--sweep photons=100,200").code, Some(0));
    let copying = home.path().join("out.copying");
    fs::create_dir(&copying).unwrap();
    fs::copy(out.join("run.json"), copying.join("run.json")).unwrap();
    let again = cost(&out, "--sweep photons=100,200").json();
    assert_eq!((&again["points"], &again["reused"]), (&2.into(), &2.into()));
    assert!(!copying.exists());
}

#[test]
fn a_choice_stays_until_another_budget_is_asked_for() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let budget = cost(
        &out,
        "--sweep photons=100 --budget-ms 300 --search-seconds 1",
    );
    assert_eq!(budget.code, Some(0), "{}", budget.complaint);
    let best = fs::read(out.join("best.toml")).unwrap();
    assert_eq!(cost(&out, "--sweep photons=100,200").code, Some(0));
    assert_eq!(fs::read(out.join("best.toml")).unwrap(), best);
    let missed = cost(
        &out,
        "--sweep photons=100 --budget-ms 0.0001 --search-seconds 1",
    );
    assert_eq!(missed.code, Some(1));
    assert!(!out.join("best.toml").exists());
}

#[test]
fn points_of_another_study_and_folders_of_others_are_refused() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    assert_eq!(cost(&out, "--sweep photons=100").code, Some(0));
    let other = cost(&out, "--sweep photons=100 --gaze 5,0");
    assert_eq!(other.code, Some(1));
    assert!(
        other.errors()[0].contains("the gaze differs"),
        "{}",
        other.complaint
    );
    let foreign = home.path().join("photos");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("holiday.jpg"), "dear").unwrap();
    for more in ["--sweep photons=100", "--sweep photons=100 --force"] {
        let refused = cost(&foreign, more);
        assert_eq!(refused.code, Some(1));
        assert!(
            refused.errors()[0].contains("not an output of macula"),
            "{}",
            refused.complaint
        );
    }
    assert_eq!(
        fs::read_to_string(foreign.join("holiday.jpg")).unwrap(),
        "dear"
    );
}

#[test]
fn a_setting_that_no_device_holds_is_named_and_the_points_before_it_are_kept() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let broken = cost(&out, "--sweep photons=100,64000000");
    assert_eq!(broken.code, Some(1), "{}", broken.complaint);
    let error = broken.errors()[0];
    assert!(
        error.contains("64000000") && error.contains("leave it out"),
        "{error}"
    );
    assert!(
        broken.complaint.contains("caused by"),
        "{}",
        broken.complaint
    );
    assert_eq!(cost(&out, "--sweep photons=100").json()["reused"], 1);
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_measured_and_the_same_command_goes_on() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let scene = asset("scenes/cornell.glb");
    let start = || {
        let mut command = command(["cost"]);
        command.arg(&scene).arg("--out").arg(&out);
        command.args(["--size", "12x12", "--reference-seconds", "0.2", "--json"]);
        command.args(["--point-seconds", "0.5", "--sweep", "photons=100..3200*2"]);
        command
    };
    let points = home.path().join("out.partial/points");
    let mut child = start()
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let measured = || {
        let entries = fs::read_dir(&points).into_iter().flatten().flatten();
        let is_point = |entry: &fs::DirEntry| {
            entry
                .path()
                .extension()
                .is_some_and(|extension| extension == "json")
        };
        entries.filter(is_point).count()
    };
    let patience = std::time::Instant::now() + std::time::Duration::from_secs(120);
    while measured() < 2 {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was stopped"
        );
        assert!(
            std::time::Instant::now() < patience,
            "no point was measured"
        );
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(
        std::process::Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let stopped = Run::from(child.wait_with_output().unwrap());
    assert_eq!(stopped.code, Some(1), "{}", stopped.complaint);
    let error = stopped.errors()[0].to_owned();
    assert!(
        error.contains("out.partial") && error.contains("goes on"),
        "{error}"
    );
    let kept = json(&home.path().join("out.partial/cost.json"));
    let kept = kept["points"].as_array().unwrap().len();
    assert!((2..6).contains(&kept), "{kept}");
    assert!(home.path().join("out.partial/report.html").is_file());
    let done = run(&mut start()).json();
    assert_eq!(
        (&done["points"], &done["reused"]),
        (&6.into(), &kept.into())
    );
}

#[test]
fn a_budget_is_searched_confirmed_and_written_as_parameters_that_render_takes() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    // A budget that any machine meets, and a search that is over soon.
    let found = cost(
        &out,
        "--sweep photons=100,400 --budget-ms 800 --search-seconds 3 --set direct.shadow_rays=3",
    );
    assert_eq!(found.code, Some(0), "{}", found.complaint);
    let found = found.json();
    assert_eq!(found["budget"]["is_met"], true);
    assert!(
        found["title"].as_str().unwrap().starts_with("800 ms buy"),
        "{}",
        found["title"]
    );
    let best = out.join("best.toml");
    let text = fs::read_to_string(&best).unwrap();
    assert!(
        text.starts_with("# ") && text.contains("--budget-ms 800"),
        "{text}"
    );
    let key = found["budget"]["point"].as_str().unwrap();
    let all = json(&out.join("cost.json"));
    let points = all["points"].as_array().unwrap();
    let chosen = points.iter().find(|point| point["key"] == key).unwrap();

    let render = |more: &[&str]| {
        let mut command = command(["render"]);
        command
            .arg(asset("scenes/cornell.glb"))
            .arg("--params")
            .arg(&best);
        command.arg("--out").arg(home.path().join("a.exr"));
        run(command
            .args(["--json", "--force", "--passes", "3"])
            .args(more))
        .json()
    };
    let by_file = render(&[]);
    assert_eq!(by_file["technique"], chosen["technique"]);
    assert!(by_file["frame_ms_median"].as_f64().unwrap() > 0.0);
    assert_eq!(by_file["passes"], 3, "a flag wins over the file");
    assert_eq!(render(&["--technique", "path"])["technique"], "path");

    let check = |budget: &str| {
        let mut command = command(["cost"]);
        command
            .arg(asset("scenes/cornell.glb"))
            .arg("--params")
            .arg(&best);
        run(command.args(["--check-budget", budget, "--json"]))
    };
    let kept = check("60000");
    assert_eq!(
        (kept.code, &kept.json()["is_met"]),
        (Some(0), &true.into()),
        "{}",
        kept.complaint
    );
    let missed = check("0.001");
    assert_eq!(
        (missed.code, &missed.json()["is_met"]),
        (Some(1), &false.into())
    );
    assert!(
        missed.errors()[0].contains("--budget-ms"),
        "{}",
        missed.complaint
    );
}

#[test]
fn a_budget_that_nothing_keeps_ends_with_an_error_and_without_parameters() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let missed = cost(
        &out,
        "--sweep photons=100 --budget-ms 0.001 --search-seconds 1",
    );
    let errors = missed.errors();
    assert_eq!(missed.code, Some(1), "{errors:?}");
    assert!(
        errors.iter().any(|line| line.contains("0.001 ms")),
        "{errors:?}"
    );
    assert!(out.join("report.html").is_file() && !out.join("best.toml").exists());
}

#[test]
fn techniques_are_brought_to_one_error_and_to_one_time() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("out");
    let sweep = "--sweep technique=pm-direct,path --sweep photons=200,800";
    let done = cost(
        &out,
        &format!("{sweep} --equal-error 0.3 --equal-time 100 --search-seconds 4"),
    );
    assert_eq!(done.code, Some(0), "{}", done.complaint);
    let comparisons = &done.json()["comparisons"];
    assert!((comparisons[0]["relmse"].as_f64().unwrap() - 0.3).abs() < 1e-9);
    assert_eq!(comparisons[1]["frame_ms"], 100.0);
    for comparison in comparisons.as_array().unwrap() {
        let levels = comparison["levels"].as_array().unwrap();
        assert_eq!(levels.len(), 2);
        // A slow machine may reach a level with one technique only, or with none: then that is told.
        let ratios: Vec<f64> = levels
            .iter()
            .filter_map(|level| level["ratio"].as_f64())
            .collect();
        let least = ratios.iter().copied().reduce(f64::min);
        assert!(least.is_none_or(|least| least == 1.0), "{comparison}");
        for level in levels {
            assert_eq!(level["ratio"].is_null(), level["point"].is_null());
        }
    }
}

#[test]
fn a_table_run_that_says_nonsense_is_refused_by_name() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("p.toml");
    for (run_table, word) in [
        ("technique = 3", "technique"),
        ("size = \"64\"", "640x480"),
        ("colour = 1", "colour"),
        ("passes = 0", "passes"),
        ("gaze = \"10\"", "AZ,EL"),
    ] {
        fs::write(&file, format!("[run]\n{run_table}\n")).unwrap();
        let mut command = command(["render"]);
        command
            .arg(asset("scenes/cornell.glb"))
            .arg("--params")
            .arg(&file);
        let refused = run(command.arg("--out").arg(home.path().join("a.exr")));
        assert_eq!(refused.code, Some(1), "{run_table}: {}", refused.complaint);
        assert!(
            refused.complaint.contains(word),
            "{run_table}: {}",
            refused.complaint
        );
        assert!(refused.errors()[0].contains("p.toml"));
    }
}

#[test]
fn bad_sweeps_are_refused_with_the_nearest_key_or_the_mend() {
    for (sweep, words) in [
        ("--sweep photon=100", vec!["photons"]),
        ("--sweep gather.radius=1", vec!["gather.radius_m"]),
        ("--sweep photons", vec!["KEY=V1,V2"]),
        ("--sweep photons=1 --sweep photon.count=2", vec!["twice"]),
        ("--sweep technique=pmx", vec!["pmx", "pm-direct"]),
        ("--sweep photons=-5", vec!["photon.count"]),
        ("--sweep size=64", vec!["640x480"]),
        ("--sweep size=64x64,128x64", vec!["another shape"]),
        ("--sweep photons=9..1*2", vec!["FROM is above 0"]),
        ("--budget-ms 0", vec!["above 0"]),
        ("--check-budget 5 --budget-ms 5", vec!["--check-budget"]),
        (
            "--gaze 80,0 --reference-seconds 0.1 --size 8x8",
            vec!["--gaze"],
        ),
    ] {
        let home = tempfile::tempdir().unwrap();
        let out = home.path().join("out");
        let scene = asset("scenes/cornell.glb");
        let line = format!("cost {} --out {} {sweep}", scene.display(), out.display());
        let refused = macula(&line);
        let code = if sweep.starts_with("--gaze") { 1 } else { 2 };
        assert_eq!(refused.code, Some(code), "{sweep}: {}", refused.complaint);
        for word in words {
            assert!(
                refused.complaint.contains(word),
                "{sweep}: {}",
                refused.complaint
            );
        }
        assert!(!out.exists());
    }
    assert_eq!(macula("cost a.glb").code, Some(2), "--out is asked for");
}
