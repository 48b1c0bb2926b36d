//! The report in a real browser: it loads in silence, asks nobody for anything, and its controls move the pictures.

#[path = "common/chromium.rs"]
mod chromium;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use chromium::{browser, drive, result, screenshot, visit};
use macula::report::{
    Effect, Eye, Fact, Frame, Outline, OutlinedRegion, Parameter, Picture, Report,
};

const SIDE: u32 = 320;
const FRAMES: usize = 100;

/// A report of 100 frames, made once.
fn report() -> Report {
    static REPORT: LazyLock<Report> = LazyLock::new(make_report);
    REPORT.clone()
}

/// A shaded ball before a wall, seen by one eye, with the grain that few photons leave.
fn picture(frame: usize, eye: usize) -> Picture {
    let mut grain = 0x9e37_79b9_u32 ^ (frame as u32 * 7919 + eye as u32);
    let mut noise = || {
        grain ^= grain << 13;
        grain ^= grain >> 17;
        grain ^= grain << 5;
        (grain >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let center_u = 0.5 + 0.25 * (frame as f32 * 0.08).sin() - 0.02 * eye as f32;
    let mut rgba = Vec::with_capacity((SIDE * SIDE * 4) as usize);
    for pixel in 0..SIDE * SIDE {
        let (u, v) = (
            (pixel % SIDE) as f32 / SIDE as f32,
            (pixel / SIDE) as f32 / SIDE as f32,
        );
        let (x, y) = ((u - center_u) / 0.18, (v - 0.58) / 0.18);
        let height = 1.0 - x * x - y * y;
        let [r, g, b] = if height > 0.0 {
            let light = (0.25 + 0.75 * (-0.5 * x - 0.6 * y + 0.62 * height.sqrt())).max(0.08);
            [0.85 * light, 0.6 * light, 0.35 * light]
        } else {
            let wall = 0.75 - 0.45 * v;
            [wall * (1.15 - 0.4 * u), wall * 0.85, wall * (0.6 + 0.5 * u)]
        };
        for channel in [r, g, b] {
            let shown = (channel + 0.06 * noise()).clamp(0.0, 1.0);
            rgba.push((shown.powf(1.0 / 2.2) * 255.0) as u8);
        }
        rgba.push(255);
    }
    Picture::jpeg(SIDE, SIDE, &rgba).unwrap()
}

fn outline(region: OutlinedRegion, center: [f32; 2], radius: f32) -> Outline {
    let point = |i: usize| {
        let (sin, cos) = (i as f32 / 48.0 * std::f32::consts::TAU).sin_cos();
        [center[0] + 1.15 * radius * cos, center[1] + radius * sin]
    };
    Outline {
        region,
        points_uv: (0..=48).map(point).collect(),
    }
}

fn frame(i: usize) -> Frame {
    let t = i as f32 / 90.0;
    // Fixations of a third of a second, a stretch of lost tracking, and a slow first frame.
    let fixation = (t * 3.0).floor();
    let gaze_uv = [
        0.5 + 0.22 * (fixation * 2.4).sin(),
        0.5 + 0.14 * (fixation * 1.3).cos(),
    ];
    let (state, age) = match i {
        40..48 => ("held", 5.0 + 11.0 * (i - 39) as f64),
        48..54 => ("fallback", 0.0),
        _ => ("tracked", 3.0 + (i % 3) as f64),
    };
    let lost = state == "fallback";
    let wobble = |phase: f64| 1.0 + 0.15 * (i as f64 * 0.7 + phase).sin();
    let passes = [
        "primary rays",
        "emit",
        "trace",
        "sort",
        "gather",
        "caustics",
        "direct light",
        "filter",
        "tone map",
        "copy",
    ];
    let cost = [14.0, 3.0, 61.0, 22.0, 88.0, 17.0, 35.0, 12.0, 2.0, 1.0];
    let first = if i == 0 { 6.0 } else { 1.0 };
    Frame {
        index: 200 + i as u64,
        display_time_ns: 81_234_567_890 + i as i64 * 11_111_111,
        eyes: [0, 1].map(|eye| {
            let at = [gaze_uv[0] - 0.015 * eye as f32, gaze_uv[1]];
            Eye {
                picture: Some(picture(i, eye)),
                gaze_uv: (!lost).then_some(at),
                outlines: vec![
                    outline(OutlinedRegion::Fovea, at, 0.12),
                    outline(OutlinedRegion::Transition, at, 0.19),
                ],
            }
        }),
        gaze_state: state.into(),
        gaze_age_ms: (!lost).then_some(age),
        gaze_angles_deg: (!lost).then(|| gaze_uv.map(|x| f64::from(x - 0.5) * 90.0)),
        pass_ms: passes
            .iter()
            .zip(cost)
            .enumerate()
            .map(|(p, (name, ms))| (name.to_string(), first * ms * wobble(p as f64)))
            .collect(),
        counts: vec![
            ("photons stored".into(), 181_000 + 97 * i as u64),
            ("negative clamped".into(), 0),
        ],
    }
}

fn make_report() -> Report {
    let text = |texts: &[&str]| texts.iter().map(|text| text.to_string()).collect();
    let effect = |name: &str, active, why: &str| Effect {
        name: name.into(),
        active,
        why: why.into(),
    };
    let parameter = |key: &str, value: &str, unit: &str| Parameter {
        key: key.into(),
        value: value.into(),
        unit: unit.into(),
    };
    let fact = |name: &str, value: &str| Fact {
        name: name.into(),
        value: value.into(),
    };
    Report {
        title: "Replay of natural-look in cornell".into(),
        subtitle: text(&["technique pm-direct", "simulated runtime"]),
        picture_size: [SIDE, SIDE],
        frames: (0..FRAMES).map(frame).collect(),
        effects: vec![
            effect(
                "caustics",
                true,
                "a glass sphere (material `glass`, ior 1.5) lies in the light of `lamp`",
            ),
            effect(
                "mirror chains",
                true,
                "material `mirror` is metallic 1, roughness 0",
            ),
            effect("moving objects", true, "node `ball` is animated"),
            effect("textures", false, "no material has one"),
        ],
        parameters: vec![
            parameter("photon.count", "200000", "paths a frame"),
            parameter("gather.radius_m", "0.025", "m"),
            parameter("fovea.radius_deg", "9.78", "deg"),
            parameter("fovea.transition_deg", "14.78", "deg"),
            parameter("seed", "1", ""),
        ],
        provenance: vec![
            fact("device", "llvmpipe (LLVM 15.0.6, 256 bits)"),
            fact("driver", "Mesa 22.3.6"),
            fact("runtime", "macula xr-sim 0.1.0"),
            fact(
                "scene hash",
                "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
            ),
        ],
        warnings: text(&["3 gaze samples have no valid direction and were skipped"]),
    }
}

/// What the page shows now.
const LOOK: &str = r#"const look = () => ({
    left: page.querySelector('[data-eye="0"] img').src, right: page.querySelector('[data-eye="1"] img').src,
    decoded: page.querySelector('[data-eye="0"] img').naturalWidth,
    fovea: page.querySelector('[data-eye="0"] path.fovea')?.getAttribute("d") ?? null,
    cross: page.querySelectorAll("path.gaze").length,
    frame: page.querySelector('#facts dd').textContent, position: page.getElementById("position").textContent,
    state: page.querySelectorAll('#facts dd')[3].textContent,
  });"#;

fn written(folder: &Path, report: &Report) -> PathBuf {
    let path = folder.join("report.html");
    report.write(&path).unwrap();
    path
}

#[test]
fn the_page_loads_in_silence_and_asks_nobody() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let requests = "await wait(500); return window_.performance.getEntriesByType('resource').map((entry) => entry.name);";
    let load = |page: &Path| {
        let seen = visit(browser, &drive(folder.path(), page, "", requests), "", 3000);
        (result(&seen), seen.console)
    };
    let page = written(folder.path(), &report());
    let (requests, console) = load(&page);
    assert_eq!(requests, serde_json::json!([]));
    assert_eq!(console, [""; 0]);
    let seen = visit(browser, &page, "", 3000);
    assert_eq!(seen.console, [""; 0]);
    assert!(
        seen.document.contains("photons stored"),
        "the viewer is filled"
    );
    assert!(
        seen.document.contains("class=\"cursor\""),
        "the plots are drawn"
    );

    // The same check hears a page that complains and calls home.
    let loud = folder.path().join("loud.html");
    let html = "<!doctype html><title>x</title><img src=\"http://example.invalid/x.png\"><script>undefined_function()</script>";
    std::fs::write(&loud, html).unwrap();
    let (requests, console) = load(&loud);
    assert_eq!(
        requests,
        serde_json::json!(["http://example.invalid/x.png"])
    );
    assert!(
        console
            .iter()
            .any(|line| line.contains("undefined_function"))
    );

    // And the page forbids itself what that one did: an address smuggled into it is refused, and said so.
    let smuggled = std::fs::read_to_string(&page).unwrap();
    let smuggled = smuggled.replace(
        "</header>",
        "<img src=\"http://example.invalid/x.png\"></header>",
    );
    std::fs::write(&loud, smuggled).unwrap();
    let (_, console) = load(&loud);
    assert!(
        console
            .iter()
            .any(|line| line.contains("Content Security Policy"))
    );
}

#[test]
fn the_scrubber_the_keys_and_a_plot_move_the_pictures() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &report());
    let script = format!(
        r#"{LOOK}
        const seen = {{ start: look() }};
        await wait(100);
        seen.untouched = look();
        const scrubber = page.getElementById("scrubber");
        scrubber.value = 60; scrubber.dispatchEvent(new window_.Event("input", {{ bubbles: true }}));
        await wait(100);
        seen.scrubbed = look();
        const press = (key, shiftKey = false) => page.body.dispatchEvent(new window_.KeyboardEvent("keydown", {{ key, shiftKey, bubbles: true }}));
        press("ArrowRight"); seen.stepped = look();
        press("ArrowLeft", true); seen.leapt = look();
        press("End"); seen.end = look();
        press("ArrowRight"); seen.beyond = look();
        const plot = page.querySelector('#plots svg'), box = plot.getBoundingClientRect();
        const click = {{ clientX: box.left + 44 + (box.width - 52) * 0.255, clientY: box.top + 50, bubbles: true }};
        plot.dispatchEvent(new window_.MouseEvent("pointerdown", click)); seen.clicked = look();
        scrubber.value = 50; scrubber.dispatchEvent(new window_.Event("input")); seen.lost = look();
        page.querySelector("[data-overlay=fovea]").click(); seen.hidden = look();
        await wait(1000);
        seen.link = window_.location.hash;
        press("Home"); press(" ");
        await wait(500);
        seen.playing = look();
        press(" "); seen.paused = look();
        await wait(200);
        seen.still = look();
        return seen;"#
    );
    let seen = result(&visit(
        browser,
        &drive(folder.path(), &page, "", &script),
        "",
        10_000,
    ));
    let frame = |moment: &str| -> u64 { seen[moment]["frame"].as_str().unwrap().parse().unwrap() };
    assert_eq!((frame("start"), frame("untouched")), (200, 200));
    assert_eq!(
        seen["start"]["left"], seen["untouched"]["left"],
        "nothing moves unasked"
    );
    assert_eq!(seen["untouched"]["decoded"], SIDE);
    assert_ne!(seen["start"]["left"], seen["start"]["right"]);

    assert_eq!(frame("scrubbed"), 260);
    assert_ne!(seen["scrubbed"]["left"], seen["start"]["left"]);
    assert_ne!(seen["scrubbed"]["right"], seen["start"]["right"]);
    assert_ne!(
        seen["scrubbed"]["fovea"], seen["start"]["fovea"],
        "the outline follows the gaze"
    );
    assert_eq!(seen["scrubbed"]["decoded"], SIDE);

    assert_eq!([frame("stepped"), frame("leapt")], [261, 251]);
    assert_eq!([frame("end"), frame("beyond")], [299, 299]);
    assert_eq!(frame("clicked"), 225);
    assert_eq!(seen["lost"]["cross"], 0, "no cross where there is no gaze");
    assert_eq!(seen["lost"]["state"], "fallback");
    assert_eq!(seen["clicked"]["cross"], 2);
    assert_eq!(seen["hidden"]["fovea"], serde_json::Value::Null);
    assert_eq!(seen["link"], "#frame=250");
    assert!(
        (201..299).contains(&frame("playing")),
        "{}",
        frame("playing")
    );
    assert_eq!(frame("paused"), frame("still"));
}

#[test]
fn a_link_opens_the_page_at_its_frame() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &report());
    for (fragment, frame) in [
        ("", "200"),
        ("#frame=242", "242"),
        ("#frame=9999", "299"),
        ("#frame=x", "200"),
    ] {
        let harness = drive(
            folder.path(),
            &page,
            fragment,
            &format!("{LOOK} return look();"),
        );
        let seen = result(&visit(browser, &harness, "", 3000));
        assert_eq!(seen["frame"], frame, "{fragment}");
    }
}

#[test]
fn hostile_names_are_shown_as_text() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let hostile = "</script><img src=x onerror=\"document.title='owned'\"><!--";
    let mut report = Report {
        title: hostile.into(),
        frames: (0..3).map(frame).collect(),
        ..report()
    };
    for frame in &mut report.frames {
        frame.gaze_state = hostile.into();
        frame.pass_ms.push((hostile.into(), 500.0));
        frame.counts.push((hostile.into(), 1));
    }
    let page = written(folder.path(), &report);
    let script = "return { title: page.title, heading: page.querySelector('h1').textContent, images: page.images.length, facts: page.getElementById('facts').textContent };";
    let seen = visit(browser, &drive(folder.path(), &page, "", script), "", 3000);
    assert_eq!(seen.console, [""; 0]);
    let seen = result(&seen);
    assert_eq!(
        (&seen["title"], &seen["heading"]),
        (&hostile.into(), &hostile.into())
    );
    assert_eq!(seen["images"], 2, "one picture an eye and no more");
    assert!(seen["facts"].as_str().unwrap().contains(hostile));
}

#[test]
fn a_report_of_nothing_and_one_of_a_single_bare_frame_still_open() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let bare = Report {
        picture_size: [SIDE, SIDE],
        frames: vec![Frame::default()],
        ..Report::default()
    };
    for report in [Report::default(), bare] {
        let seen = visit(browser, &written(folder.path(), &report), "", 2000);
        assert_eq!(seen.console, [""; 0]);
        assert!(seen.document.contains("What the scene called for"));
    }
}

#[test]
fn a_hundred_frames_make_a_page_of_at_most_fifteen_megabytes() {
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &report());
    let bytes = std::fs::metadata(page).unwrap().len();
    assert!(bytes < 15_000_000, "{bytes}");
    assert!(bytes > 1_000_000, "the pictures are in it: {bytes}");
}

#[test]
fn the_page_fits_wide_and_narrow_windows() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = written(folder.path(), &report());
    let pictures = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for width in [1400, 700] {
        let png = pictures.join(format!("report-{width}.png"));
        screenshot(browser, &page, "#frame=242", [width, 1700], &png);
        let shot = image::open(&png).unwrap().to_rgb8();
        assert_eq!(shot.width(), width);
        let colors: std::collections::HashSet<_> = shot.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > 1000, "a page with pictures, not a blank one");
        eprintln!("look at {}", png.display());
    }
    let script = "return page.documentElement.scrollWidth - page.documentElement.clientWidth;";
    let harness = drive(folder.path(), &page, "", script);
    let narrow = std::fs::read_to_string(&harness)
        .unwrap()
        .replace("width=\"1200\"", "width=\"700\"");
    std::fs::write(&harness, narrow).unwrap();
    assert_eq!(
        result(&visit(browser, &harness, "", 3000)),
        0,
        "nothing is wider than the window"
    );
}
