//! Pages in a headless Chromium: what the document became, what the console said.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What came of a page.
pub struct Visit {
    /// The document after its scripts ran, as HTML.
    pub document: String,
    /// The lines that the console got, errors among them.
    pub console: Vec<String>,
}

/// The browser's name, or `None`, said on stderr, where there is none.
pub fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let found = names.into_iter().find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        eprintln!("SKIPPED: no Chromium on this machine to open the page with");
    }
    found
}

/// Opens a local page, lets it run for `milliseconds` of its own time, and reads what it became.
pub fn visit(browser: &str, page: &Path, fragment: &str, milliseconds: u32) -> Visit {
    let budget = format!("--virtual-time-budget={milliseconds}");
    let flags = [
        "--dump-dom",
        "--enable-logging=stderr",
        // The page that drives another one may look into it.
        "--allow-file-access-from-files",
        &budget,
    ];
    let (document, log) = run(browser, &flags, page, fragment);
    let console = log.lines().filter(|line| line.contains(":CONSOLE"));
    Visit {
        document,
        console: console.map(str::to_owned).collect(),
    }
}

/// A picture of the page, as PNG.
pub fn screenshot(browser: &str, page: &Path, fragment: &str, size: [u32; 2], png: &Path) {
    let file = format!("--screenshot={}", png.display());
    let [width, height] = size;
    let window = format!("--window-size={width},{height}");
    let flags = [
        &file,
        &window,
        "--hide-scrollbars",
        "--virtual-time-budget=2000",
    ];
    run(browser, &flags, page, fragment);
    assert!(png.exists(), "no screenshot of {}", page.display());
}

/// Writes a page beside a report that loads it in a frame, runs `script` there (`page` is its document, `wait(ms)` waits), and
/// shows what it returns.
pub fn drive(folder: &Path, report: &Path, fragment: &str, script: &str) -> PathBuf {
    let harness = folder.join("harness.html");
    let html = format!(
        r#"<!doctype html><title>harness</title><iframe src="{}{fragment}" width="1200" height="900"></iframe><pre id="result">nothing</pre>
<script>
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
document.querySelector("iframe").addEventListener("load", async () => {{
  const window_ = document.querySelector("iframe").contentWindow, page = window_.document;
  const result = await (async () => {{ {script} }})();
  document.getElementById("result").textContent = JSON.stringify(result);
}});
</script>"#,
        report.file_name().unwrap().to_str().unwrap()
    );
    std::fs::write(&harness, html).unwrap();
    harness
}

/// What the script of [`drive`] returned.
pub fn result(visit: &Visit) -> serde_json::Value {
    let (_, rest) = visit.document.split_once(r#"<pre id="result">"#).unwrap();
    let (json, _) = rest.split_once("</pre>").unwrap();
    let json = json
        .replace("&amp;", "&")
        .replace("&lt;", "<")
        .replace("&gt;", ">");
    serde_json::from_str(&json).unwrap_or_else(|_| panic!("{json}\n{:?}", visit.console))
}

fn run(browser: &str, flags: &[&str], page: &Path, fragment: &str) -> (String, String) {
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            // Nothing listens there: neither a page nor the browser itself reaches anybody from a test.
            "--proxy-server=http://127.0.0.1:9",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(flags)
        .arg(format!("file://{}{fragment}", page.display()))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let [document, log] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert!(output.status.success(), "{log}");
    (document, log)
}
