//! A picture as a person opens it: in a real browser, on a light and a dark screen, narrow and wide. What was seen is kept in
//! `target/console-shots`.

#[path = "console/browser.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod browser;
#[path = "common/programs.rs"]
mod programs;

use std::path::Path;
use std::process::{Command, Output};

use kinocue::harness::motion::{MAX_AXES, Pulses, SeatType, Slot, Window};
use kinocue::harness::net::Delivery;
use kinocue::harness::record::{Asked, FrameKind, RecordedSeat, TickHead};
use kinocue::harness::recording::recorded_show;
use kinocue::harness::time::{MonoTime, Rate, ShowTime};
use kinocue::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, Timing, VibrationPort};
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

/// A recording of a seat with that name; the film ran over the same two seconds three times, with the seat higher each time.
fn recorded(path: &Path, name: &str) {
    recorded_in_passes(path, name, 3);
}

/// The same in so many passes.
fn recorded_in_passes(path: &Path, name: &str, passes: u64) {
    let seat = SeatType::bench3(3);
    let window = Window::new((0..3).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    let seats = vec![RecordedSeat::new(name, &window, FrameKind::Datagram(VibrationPort::Two))];
    recorded_show(seats, Rate::from_hz(100.0), path, 200 * passes, |tap, _, tick| {
        let (at, film) = (MonoTime::from_nanos(tick * 10_000_000), tick % 200);
        // A stroke of 150 mm is 300,000 pulses.
        let pulses = i32::try_from(30_000 + 75_000 * (tick / 200 % 3) + 150 * film).expect("in the stroke");
        let (positions, place) = ([Pulses(pulses); 3], f64::from(pulses) / 300_000.0);
        let motion = Motion {
            timing: Timing::Relative,
            channel: 0,
            accept: Code::ALL,
            reply: Code::NONE,
            frame: FrameNo(u32::try_from(tick).expect("few")),
            time_ms: 10,
            positions: &positions,
            outputs: 0,
            analogue: Analogue::default(),
            vibration: None,
        };
        let mut pose = [0.0; MAX_AXES];
        pose[..3].fill(place);
        tap.asked(Asked::of(pose, 3));
        tap.frame(0, motion.emit(&mut [0; MAX_LEN]), at, Delivery::Sent);
        tap.tick(&TickHead::of(tick, at).showing(ShowTime::from_millis(10 * film.cast_signed())));
    });
}

#[test]
fn a_page_of_a_recording_shows_each_pass_of_the_film_beside_the_last_and_fits_its_window() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (file, page) = (folder.path().join("thrice.mcap"), folder.path().join("thrice.html"));
    recorded(&file, TITLE);
    for theme in ["light", "dark", "print"] {
        let run = kinocue(&[text(&file), "-o", text(&page), "--theme", theme, "--force"]);
        assert!(run.status.success(), "{run:?}");
        browser.open(&format!("file://{}", page.display()));
        assert!(
            browser
                .eval("return document.querySelector('h1').textContent")
                .to_string()
                .contains("window.harmed")
        );
        assert_eq!(browser.eval("return window.harmed ?? null"), json!(null));
        assert_eq!(browser.eval("return performance.getEntriesByType('resource').length"), json!(0));
        for width in [400, 1600] {
            browser.resize(width, 900);
            browser.wait("document.querySelectorAll('.times .tick').length >= 3");
            let fits = browser.eval("return document.documentElement.scrollWidth <= innerWidth");
            assert_eq!(fits, json!(true), "{theme} {width}");
            let flags = browser
                .eval("return [...document.querySelectorAll('.flags span')].map((one) => one.textContent)");
            assert_eq!(flags, json!(["pass 2", "pass 3"]));
            browser.shot(&format!("plot-recording-{theme}-{width}"));
        }
    }
    // The clock begins anew with each pass, also in a part that is shown larger.
    let clocks = "return [...document.querySelector('.times').querySelectorAll('.tick span')].map((one) => one.textContent)";
    let begins = |clocks: &serde_json::Value| {
        let all: Vec<String> = serde_json::from_value(clocks.clone()).expect("texts");
        all.windows(2).filter(|pair| pair[1] < pair[0]).count()
    };
    let whole = browser.eval(clocks);
    assert_eq!(begins(&whole), 2, "{whole}");
    browser.press("[data-does=in]");
    let part = browser.eval(clocks);
    assert_ne!(part, whole);
    assert!(begins(&part) <= 2, "{part}");
    assert_eq!(browser.complaints(), Vec::<String>::new());
    let svg = folder.path().join("thrice.svg");
    assert!(kinocue(&[text(&file), "-o", text(&svg)]).status.success());
    browser.open(&format!("file://{}", svg.display()));
    browser.shot("plot-recording-svg");
}

/// The names of flags stand beside each other on any screen, in the whole and in a part of it, and on paper.
#[test]
fn names_of_flags_do_not_run_into_each_other_however_narrow_the_page() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (file, page) = (folder.path().join("loop.mcap"), folder.path().join("loop.html"));
    recorded_in_passes(&file, "A1", 12);
    let shown = "return [...document.querySelectorAll('.flags span')].filter((one) => one.getClientRects().length).map((one) => { \
         const { left, right, top } = one.getBoundingClientRect(); return [left, right, top, innerWidth]; })";
    for theme in ["light", "dark", "print"] {
        let run = kinocue(&[text(&file), "-o", text(&page), "--theme", theme, "--force"]);
        assert!(run.status.success(), "{run:?}");
        browser.open(&format!("file://{}", page.display()));
        let mut counts = Vec::new();
        for width in [320, 400, 800, 1600] {
            browser.resize(width, 900);
            browser.wait(&format!(
                "innerWidth === {width} && document.querySelectorAll('.times .tick').length >= 3"
            ));
            for press in ["[data-does=whole]", "[data-does=in]", "[data-does=whole]"] {
                browser.press(press);
                let names: Vec<[f64; 4]> = serde_json::from_value(browser.eval(shown)).expect("places");
                for (index, [left, right, top, inside]) in names.iter().enumerate() {
                    let is_apart = |[from, to, other, _]: &[f64; 4]| {
                        (top - other).abs() > 10.0 || *to <= left + 0.5 || right - 0.5 <= *from
                    };
                    assert!(names[..index].iter().all(is_apart), "{theme} {width} {press}: {names:?}");
                    assert!(*left >= 0.0 && right <= inside, "{theme} {width} {press}: {names:?}");
                }
                counts.push(names.len());
            }
            browser.shot(&format!("plot-flags-{theme}-{width}"));
        }
        assert!(counts.iter().all(|count| *count >= 2) && counts.last() == Some(&11), "{counts:?}");
        // As it is printed, which no script sees.
        browser.eval("dispatchEvent(new Event('beforeprint'))");
        let printed = browser.eval("return document.querySelector('.flags span').style.maxWidth");
        assert_eq!(printed, json!(""));
    }
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn on_paper_each_of_twelve_axes_has_dashes_of_its_own_beside_its_name_and_names_stay_beside_their_panel() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("voyage.html");
    for (theme, keys) in [("print", 12), ("light", 0)] {
        assert!(
            kinocue(&["cues/voyage.csv", "-o", text(&page), "--theme", theme, "--force"]).status.success()
        );
        browser.open(&format!("file://{}", page.display()));
        let dashes = "const keys = [...document.querySelectorAll('section:first-of-type .name path')].filter((one) => one.getClientRects().length); \
             return new Set(keys.map((one) => getComputedStyle(one).strokeDasharray)).size";
        assert_eq!(browser.eval(dashes), json!(keys), "{theme}");
        let inside = "return [...document.querySelectorAll('.box')].every((box) => [...box.querySelectorAll('.name')].every((name) => \
             name.getBoundingClientRect().bottom <= box.getBoundingClientRect().bottom + 10 && name.getBoundingClientRect().right <= innerWidth))";
        assert_eq!(browser.eval(inside), json!(true), "{theme}");
        // Panels and effects may be on sheets of their own: times are below either.
        assert_eq!(browser.eval("return document.querySelectorAll('.box.times').length"), json!(2));
        browser.shot(&format!("plot-voyage-{theme}"));
    }
}

/// What is asked of a cue alone is refused of a recording, and what a film leaves of the limits is in the picture as in the check.
#[test]
fn options_of_a_cue_do_what_they_say_or_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("show.mcap");
    recorded(&file, "A1");
    for option in [&["--chase"][..], &["--rate", "50"], &["--config", "examples/hall.toml"]] {
        let run = kinocue(&[&[text(&file)], option].concat());
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(64) && told.contains("are for cues"), "{run:?}");
    }
    let sentence = |options: &[&str]| {
        let run = kinocue(&[&["cues/coaster.csv"], options].concat());
        String::from_utf8(run.stdout).expect("text").lines().nth(1).expect("a sentence").to_owned()
    };
    assert!(sentence(&[]).contains("of 240 mm/s"), "{}", sentence(&[]));
    let left = sentence(&["--chase"]);
    assert!(left.contains("of 237 mm/s") && left == sentence(&["--chase", "--seat", "bench3"]), "{left}");
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

/// The console of a kernel has no braille: what would be drawn with it is boxes there.
#[test]
fn a_picture_is_in_half_blocks_on_the_console_of_a_kernel_and_in_braille_on_other_terminals() {
    let drawn = |terminal: Option<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command
            .args(["plot", "cues/coaster.csv"])
            .env_remove("TERM")
            .envs(terminal.map(|word| ("TERM", word)));
        String::from_utf8(command.output().expect("it runs").stdout).expect("text")
    };
    let [console, other, none] = [Some("linux"), Some("xterm-256color"), None].map(drawn);
    let count = |text: &str, is_one: fn(char) -> bool| text.chars().filter(|c| is_one(*c)).count();
    let is_dot = |c| ('\u{2801}'..='\u{28ff}').contains(&c);
    let is_block = |c| "▀▄█".contains(c);
    assert!(count(&other, is_dot) > 200 && count(&other, is_block) == 0, "{other}");
    assert_eq!(none, other);
    // A character for each, and no braille at all: not even an empty one has a glyph there.
    assert_eq!(count(&console, is_block), count(&other, is_dot), "{console}");
    assert_eq!(count(&console, |c| ('\u{2800}'..='\u{28ff}').contains(&c)), 0, "{console}");
}
