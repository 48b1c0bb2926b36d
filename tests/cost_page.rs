//! The page of `macula cost` in a real browser: it loads in silence, shows the front, answers the keyboard and sorts its table.

#[path = "common/chromium.rs"]
mod chromium;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use chromium::{browser, drive, result, screenshot, visit};
use macula::report::cost::{Comparison, CostPage, Crop, PlotPoint};
use macula::report::{Fact, Picture};

/// A setting of a technique that trades time for error.
fn point(technique: &str, ms: f64, error: f64, on_front: bool) -> PlotPoint {
    PlotPoint {
        technique: technique.into(),
        label: format!("{technique}, 64x64, {ms} ms worth of photons"),
        size: "64x64".into(),
        paths: format!("{} photons", ms * 100.0),
        effort: (ms * 100.0) as u32,
        passes: 1,
        others: "gather.photons_per_estimate = 80".into(),
        ms,
        quartiles_ms: [0.92 * ms, 1.1 * ms],
        relmse_fovea: Some(error),
        relmse_fovea_se: 0.1 * error,
        bias_share: 0.3,
        mse_fovea: Some(0.5 * error),
        mse_transition: Some(0.6 * error),
        mse_periphery: None,
        pass_ms: vec![
            ("photon tracing".into(), 0.4 * ms),
            ("density estimate".into(), 0.6 * ms),
        ],
        on_front,
        is_chosen: technique == "pm-direct" && ms == 45.0,
    }
}

fn picture(seed: u8) -> Picture {
    let rgb: Vec<u8> = (0..32 * 32 * 3)
        .map(|i: u32| (i * 7 % 200) as u8 ^ seed)
        .collect();
    Picture::png_of(32, 32, &rgb).unwrap()
}

/// A page of two techniques, of which one beats the other.
fn page() -> CostPage {
    let times = [12.0, 45.0, 160.0, 640.0];
    let mut points: Vec<PlotPoint> = times
        .iter()
        .flat_map(|&ms| {
            [
                point("pm-direct", ms, 1.0 / ms, true),
                point("pm", 1.2 * ms, 4.0 / ms, false),
            ]
        })
        .collect();
    points.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let crop = |name: &str, error: Option<Picture>| Crop {
        name: name.into(),
        caption: "44.8 ms, foveal error 0.022".into(),
        picture: picture(1),
        error,
    };
    CostPage {
        title: "50 ms buy a foveal error of 0.022 in a room".into(),
        subtitle: vec!["scene a room".into(), "8 points of pm-direct, pm".into()],
        sentences: vec![(
            "What accuracy costs".into(),
            vec!["Half the foveal error costs 2 times the time.".into()],
        )],
        next: vec![(
            "See one frame of it".into(),
            "macula render scenes/a-room-with-a-long-name.glb --camera viewer --params out/budget/best.toml --out frame.png".into(),
        )],
        techniques: ["pm-direct", "pm", "path"].map(str::to_owned).to_vec(),
        shared: "direct.shadow_rays = 4".into(),
        budget_ms: Some(50.0),
        crops: vec![crop("reference", None), crop("chosen", Some(picture(9)))],
        comparisons: vec![Comparison {
            name: "Techniques at a foveal error of 0.02".into(),
            ratio_name: "times the fastest".into(),
            rows: vec![["pm", "240", "0.02", "4.8", "pm, 64x64"].map(str::to_owned)],
        }],
        facts: vec![Fact {
            name: "device".into(),
            value: "a device".into(),
        }],
        points,
        ..CostPage::default()
    }
}

fn written(folder: &Path, page: &CostPage) -> PathBuf {
    let path = folder.join("report.html");
    page.write(&path).unwrap();
    path
}

#[test]
fn the_page_shows_the_front_the_levels_and_the_budget_without_a_complaint() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &page());
    assert_eq!(visit(browser, &page, "", 2000).console, [""; 0]);
    let script = r##"
        await wait(200);
        const texts = [...page.querySelectorAll("#chart text")].map((text) => text.textContent);
        return {
            marks: page.querySelectorAll("#chart .mark").length, on: page.querySelectorAll("#chart .mark.on").length,
            corners: page.querySelector("#chart .front").getAttribute("d").split("L").length,
            levels: texts.filter((text) => text.startsWith("error ")), budget: texts.some((text) => text === "budget 50 ms"),
            chosen: page.querySelectorAll("#chart .chosen").length, bars: page.querySelectorAll("#stages .bar").length,
            images: page.querySelectorAll(".crop img").length,
        };"##;
    let seen = result(&visit(
        browser,
        &drive(folder.path(), &page, "", script),
        "",
        4000,
    ));
    assert_eq!((&seen["marks"], &seen["on"]), (&8.into(), &4.into()));
    assert_eq!(seen["corners"], 4, "the front is pm-direct's four points");
    let levels = seen["levels"].as_array().unwrap();
    assert!(!levels.is_empty());
    for level in levels {
        let text = level.as_str().unwrap();
        assert!(text.find("pm-direct") < text.find("pm "), "{text}");
    }
    assert_eq!(seen["budget"], true);
    assert_eq!((&seen["chosen"], &seen["bars"]), (&1.into(), &4.into()));
    assert_eq!(seen["images"], 3, "the reference has no error picture");
}

#[test]
fn the_keyboard_walks_the_points_and_a_region_without_pixels_says_so() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &page());
    let script = r##"
        await wait(200);
        const seen = {}, tip = page.getElementById("tip");
        page.querySelector('#chart .mark[tabindex="0"]').focus();
        seen.first = tip.textContent;
        const press = (key) => page.activeElement.dispatchEvent(new window_.KeyboardEvent("keydown", { key, bubbles: true }));
        press("ArrowRight"); seen.second = tip.textContent;
        press("End"); seen.last = tip.textContent;
        press("ArrowRight"); seen.beyond = tip.textContent;
        page.activeElement.blur(); seen.hidden = tip.hidden;
        const metric = page.getElementById("metric");
        metric.value = "mse_periphery"; metric.dispatchEvent(new window_.Event("change"));
        seen.empty = page.getElementById("chart").textContent;
        return seen;"##;
    let seen = result(&visit(
        browser,
        &drive(folder.path(), &page, "", script),
        "",
        4000,
    ));
    let has = |moment: &str, word: &str| seen[moment].as_str().unwrap().contains(word);
    assert!(
        has("first", "12 ms") && has("second", "14.4 ms") && has("last", "768 ms"),
        "{seen}"
    );
    assert_eq!(seen["last"], seen["beyond"]);
    assert_eq!(seen["hidden"], true);
    assert!(has("empty", "no pixel"), "{seen}");
}

#[test]
fn a_click_on_a_head_sorts_by_value_and_again_turns_it_round() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &page());
    let script = r##"
        await wait(100);
        const table = page.querySelector(".sortable");
        const column = (name) => [...table.tHead.rows[0].cells].findIndex((head) => head.textContent === name);
        const sorted = (name) => {
            table.tHead.rows[0].cells[column(name)].querySelector("button").click();
            return [...table.tBodies[0].rows].map((row) => row.cells[column(name)].textContent);
        };
        return { times: sorted("frame, ms"), back: sorted("frame, ms"), words: sorted("technique") };"##;
    let seen = result(&visit(
        browser,
        &drive(folder.path(), &page, "", script),
        "",
        4000,
    ));
    let column =
        |name: &str| -> Vec<String> { serde_json::from_value(seen[name].clone()).unwrap() };
    let mut times = column("times");
    // By letter 12.0 would come before 45.0 before 768.0, but 160.0 before 45.0.
    assert_eq!((times[0].as_str(), times[7].as_str()), ("12.0", "768.0"));
    assert!(times.iter().position(|ms| ms == "45.0") < times.iter().position(|ms| ms == "160.0"));
    times.reverse();
    assert_eq!(column("back"), times);
    assert_eq!(column("words")[..4], ["pm"; 4]);
}

#[test]
fn a_technique_has_its_colour_and_shape_whatever_else_the_page_shows() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = r##"
        await wait(200);
        return [...page.querySelectorAll("#chart .mark")].map((mark) =>
            [mark.getAttribute("style"), mark.querySelector(".shape").getAttribute("d")]);"##;
    let looks = |points: Vec<PlotPoint>| {
        let page = CostPage { points, ..page() };
        let page = written(folder.path(), &page);
        let harness = drive(folder.path(), &page, "", script);
        result(&visit(browser, &harness, "", 3000))
    };
    let point = |technique: &str| point(technique, 45.0, 0.02, true);
    let alone = looks(vec![point("path")]);
    let among = looks(vec![point("path"), point("pm"), point("pm-direct")]);
    assert_eq!(alone[0], among[0], "path");
    assert_eq!(alone[0][0], "--color: var(--tech-2)");
    assert_ne!(among[1], among[0]);
    assert_ne!(among[2], among[1]);
}

#[test]
fn the_page_fits_wide_and_narrow_windows_and_one_of_nothing_opens() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let nothing = written(folder.path(), &CostPage::default());
    assert_eq!(visit(browser, &nothing, "", 2000).console, [""; 0]);
    let page = written(folder.path(), &page());
    for width in [1400, 700, 420] {
        let png = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cost-{width}.png"));
        screenshot(browser, &page, "", [width, 1900], &png);
        let shot = image::open(&png).unwrap().to_rgb8();
        let colors: HashSet<_> = shot.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > 200, "a page with pictures, not a blank one");
        eprintln!("look at {}", png.display());
        let script = r##"
            const root = page.documentElement, dd = page.querySelector(".next dd"), code = dd.querySelector("code");
            return [root.scrollWidth - root.clientWidth, Math.max(code.getBoundingClientRect().right - dd.getBoundingClientRect().right, 0)];"##;
        let harness = drive(folder.path(), &page, "", script);
        let sized = std::fs::read_to_string(&harness)
            .unwrap()
            .replace("width=\"1200\"", &format!("width=\"{width}\""));
        std::fs::write(&harness, sized).unwrap();
        let beyond = result(&visit(browser, &harness, "", 3000));
        assert_eq!(
            beyond,
            serde_json::json!([0, 0]),
            "page and command: nothing is wider than {width} pixels"
        );
    }
}
