//! A picture as a person opens it: in a real browser, on a light and a dark screen, narrow and wide. What was seen is kept in
//! `target/console-shots`.

#[path = "console/browser.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod browser;
#[path = "common/programs.rs"]
mod programs;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::json;

use browser::Browser;

/// A title that is anything but.
const TITLE: &str = "</title><script>window.harmed = 1</script><img src=x onerror='window.harmed = 1'>";

fn kinocue(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kinocue")).arg("plot").args(arguments).output().expect("it runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn a_page_fits_its_window_loads_nothing_and_shows_parts_larger() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (cue, page) = (folder.path().join("ride.csv"), folder.path().join("ride.html"));
    let rows: String = (0..500)
        .map(|row| format!("{},{:.4}\n", 20 * row, 0.5 + 0.2 * (f64::from(row) / 25.0).sin()))
        .collect();
    std::fs::write(&cue, format!("# title: {TITLE}\ntime_ms,a1\n{rows}")).expect("written");
    for theme in ["light", "dark", "print"] {
        let run = kinocue(&[text(&cue), "-o", text(&page), "--theme", theme, "--force"]);
        assert!(run.status.success() && run.stdout.ends_with(b".\n"), "{run:?}");
        browser.open(&format!("file://{}", page.display()));
        assert_eq!(browser.eval("return document.querySelector('h1').textContent"), json!(TITLE));
        assert_eq!(browser.eval("return window.harmed ?? null"), json!(null));
        assert_eq!(browser.eval("return performance.getEntriesByType('resource').length"), json!(0));
        for width in [400, 1600] {
            browser.resize(width, 900);
            browser.wait("document.querySelectorAll('.times .tick').length >= 2");
            assert_eq!(
                browser.eval("return document.documentElement.scrollWidth <= innerWidth"),
                json!(true),
                "{theme} {width}"
            );
            browser.shot(&format!("plot-{theme}-{width}"));
        }
    }
    let shown = "document.querySelector('svg').getAttribute('viewBox').split(' ')[2]";
    let whole = browser.eval(&format!("return Number({shown})")).as_f64().expect("columns");
    browser.press("[data-does=in]");
    assert_eq!(browser.eval(&format!("return Number({shown})")).as_f64(), Some(whole / 2.0));
    browser.press("[data-does=whole]");
    assert_eq!(browser.eval(&format!("return Number({shown})")).as_f64(), Some(whole));
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_examples_of_the_help_run_and_a_file_is_replaced_only_if_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("jerk.svg");
    let coaster = ["cues/coaster.csv", "--at", "00:32.5", "--theme", "print", "-o", text(&out)];
    assert!(kinocue(&coaster).status.success());
    let again = kinocue(&coaster);
    assert!(
        !again.status.success() && String::from_utf8_lossy(&again.stderr).contains("--force"),
        "{again:?}"
    );
    let braille = kinocue(&["cues/coaster.csv"]);
    let told = String::from_utf8(braille.stdout).expect("text");
    let sentence =
        "Speed comes nearest to its limit: a3 at 00:31.499 (coaster.csv:1264), 207 of 240 mm/s, 14 % left.";
    assert_eq!(told.lines().nth(1), Some(sentence));
    let curves = told.lines().filter(|line| line.contains(['\u{2800}', '⣀', '▬']));
    assert!(
        curves.clone().count() > 12 && curves.into_iter().all(|line| line.chars().count() <= 100),
        "{told}"
    );
    let json = kinocue(&["cues/storm.mcap", "--from", "0:10", "--to", "0:20", "--json"]);
    let picture: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert!(
        picture["time"]["until_s"].as_f64().is_some_and(|until| (20.0..20.2).contains(&until)),
        "{picture}"
    );
    assert!(!kinocue(&["cues/coaster.csv", "--from", "2:00"]).status.success(), "beyond the end");
}
