//! The console as a technician uses it: in a real browser, against a real `kinocue serve` and virtual controllers. Pictures of
//! what was seen are kept in `target/console-shots`.

#[path = "../common/process.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod process;
#[path = "../common/programs.rs"]
mod programs;
#[path = "../common/serving.rs"]
#[expect(dead_code, reason = "each test uses its own part")]
mod serving;

mod browser;
mod hall;
mod instants;
mod languages;
mod layout;
mod page;
mod show_mode;
mod tabs;
mod timeline;
mod token;

use std::path::Path;
use std::time::Duration;

use serde_json::json;

use browser::{Browser, ESCAPE};
use hall::{Hall, TOKEN, film};

/// A screen of the booth, landscape and portrait tablets, and a phone.
const SIZES: [(u32, u32); 4] = [(1280, 800), (1024, 768), (768, 1024), (390, 844)];

/// Opens the page and tells it the token that it asks for.
fn enter(browser: &Browser, hall: &Hall) {
    browser.resize(1024, 768);
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    browser.shot("00-token");
    browser.press("#token-text");
    browser.type_text(TOKEN);
    browser.press("#token [type=submit]");
    browser.reads("state", "parked");
    browser.reads("link", "connected");
}

/// Loads the cue, checks the hall and arms it.
fn arm(browser: &Browser) {
    browser.wait("document.getElementById('cues').value === 'swell'");
    browser.press("#cue-load");
    browser.reads("film-title", "swell");
    browser.press("#preflight-run");
    browser.reads("preflight-verdict", "of 4 controllers answered");
    browser.wait("document.getElementById('preflight-reply').textContent.includes('done')");
    browser.press("#arm");
    browser.reads("state", "armed");
}

/// Presses GO twice, as a person who means it.
fn go(browser: &Browser) {
    browser.press("#go");
    browser.reads("go-word", "sure?");
    browser.wait("(window.goPressed ??= performance.now()) + 400 < performance.now()");
    browser.press("#go");
    browser.reads("state", "playing");
}

#[test]
fn a_show_is_armed_played_paused_turned_down_and_stopped_from_the_page() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.shot("01-parked");
    assert_eq!(
        browser
            .eval("return ['follow-panel', 'follow-badge', 'links-panel'].map((id) => document.getElementById(id).hidden)"),
        json!([true, true, true]),
        "this hall follows no film, and has no serial links"
    );
    assert_eq!(browser.eval("return document.getElementById('go').disabled"), json!(true), "behind ARM");

    arm(&browser);
    browser.shot("03-armed");

    browser.press("#go");
    browser.reads("go-word", "sure?");
    browser.shot("04-go-sure");
    browser.wait("document.getElementById('go-word').textContent === 'GO'");
    browser.reads("state", "armed"); // one press alone does nothing
    go(&browser);
    browser.wait("document.querySelectorAll('#map .look-good').length === 4");
    browser.wait("document.querySelector('#curves canvas') !== null");
    browser.shot("05-playing");

    browser.press("#pause");
    browser.reads("state", "paused");
    browser.press("#seek"); // in its middle
    browser.press("#seek-go");
    browser.reads("show-reply", "done");
    browser.wait("/^(00:59|01:00)/.test(document.getElementById('position').textContent)");
    browser.press("#resume");
    browser.reads("state", "playing");

    browser.press("[aria-label='Motion less']");
    browser.reads("levels-reply", "motion 95%: done");
    browser.press("#presets button");
    browser.wait("document.getElementById('level-motion').value === '60'");
    browser.wait("document.querySelector('[data-effect=water]').getAttribute('aria-checked') === 'false'");
    browser.press("[data-trim='10']");
    browser.reads("levels-reply", "trim +10 ms: done");
    browser.reads("settings-badge", "motion 60%, vibration 50%, water off, trim +10 ms");
    browser.shot("06-levels");

    browser.press("[data-controller=A2]");
    browser.press("#controller-disable");
    browser.wait("document.querySelector('[data-controller=A2]').classList.contains('look-away')");
    browser.shot("07-seat-out");

    browser.touch("#stop");
    browser.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");
    browser.shot("08-stopped");
    browser.press("#clear");
    browser.reads("state", "recovering");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_seat_is_taken_out_with_a_reason_and_a_stopped_show_goes_on_where_it_was_left() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    go(&browser);
    browser.press("[data-controller=A2]");
    browser.press("#controller-why");
    browser.type_text("broken leg");
    browser.press("#controller-disable");
    browser.reads("controller", "by booth: broken leg");
    browser.wait("/^00:0[3-9]/.test(document.getElementById('position').textContent)");
    browser.touch("#stop");
    browser.reads("state", "stopped");
    browser.wait("/^00:(0[3-9]|[1-5])/.test(document.getElementById('position').textContent)"); // where the film stopped
    browser.press("#clear");
    browser.reads("next", "park, or home");
    browser.wait("/^00:(0[3-9]|[1-5])/.test(document.getElementById('position').textContent)");
    browser.press("#park");
    browser.reads("state", "parked");
    browser.press("#arm");
    browser.reads("show-reply", "a2: out since");
    browser.wait("document.getElementById('resume').hidden");
    browser.reads("go-from", "from 00:");
    browser.shot("09-go-from");
    browser.press("#go-from");
    browser.reads("go-from", "sure?");
    browser.wait("(window.fromPressed ??= performance.now()) + 400 < performance.now()");
    browser.press("#go-from");
    browser.reads("state", "playing");
    browser.wait("document.getElementById('go-from').hidden && !document.getElementById('resume').hidden");
    browser.wait("/^00:(0[3-9]|[1-5])/.test(document.getElementById('position').textContent)");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_escape_key_stops_wherever_the_focus_is_and_a_pulled_plug_is_named_first() {
    let Some(browser) = Browser::start() else { return };
    let mut hall = Hall::open();
    enter(&browser, &hall);
    browser.eval("Date.now = () => 1000"); // a tablet's clock may be wrong
    arm(&browser);
    go(&browser);
    hall.pull(1);
    let took = browser.reads("warnings", "B1");
    browser.wait("document.querySelector('[data-controller=B1]').classList.contains('look-bad')");
    browser.reads("gravest", "B1"); // the list itself is scrolled away
    browser.wait("!document.getElementById('gravest').hidden");
    browser.shot("10-plug-pulled");
    browser.eval("document.getElementById('journal').scrollIntoView()");
    browser.wait("document.querySelector('.top').getBoundingClientRect().top === 0 && scrollY === 0");
    assert!(took < Duration::from_secs(3), "{took:?}");

    browser.press("#level-vibration");
    browser.type_text(ESCAPE);
    browser.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");
}

#[test]
fn the_page_says_at_once_that_the_server_is_gone_still_tries_to_stop_and_comes_back_by_itself() {
    let Some(browser) = Browser::start() else { return };
    let mut hall = Hall::open();
    enter(&browser, &hall);
    hall.kill();
    let took = browser.wait("document.documentElement.dataset.link === 'lost'");
    browser.wait("!document.getElementById('lost').hidden && document.getElementById('main').querySelector('.live').inert");
    assert!(took < Duration::from_secs(3), "{took:?}");
    browser.touch("#stop");
    browser.reads("stop-reply", "could not be delivered");
    browser.reads("stop-reply", "hard-wired");
    browser.shot("20-server-gone");

    hall.start_again();
    browser.reads("link", "connected");
    browser.reads("state", "recovering"); // nothing moves by itself
    browser.wait("document.getElementById('lost').hidden && !document.querySelector('main .live').inert");
    browser.wait("document.getElementById('stop-reply').hidden"); // the seats are at rest
    browser.shot("21-server-back");
}

#[test]
fn a_cue_is_taken_in_from_the_page_or_refused_with_every_fault() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    let folder = tempfile::tempdir().expect("a folder");
    let bad = folder.path().join("Too Far.csv");
    std::fs::write(&bad, "time_ms,a1,a2,a3\n0,0,0,0\n500,1.4,0,0\n400,0,0,0\n").expect("it can be written");
    browser.choose("#upload-file", &bad);
    browser.reads("upload", "upload as too-far");
    browser.press("#upload");
    browser.reads("playlist-reply", "not done");
    browser.reads("upload-faults", "1.4 is outside the stroke");
    browser.reads("upload-faults", "400 is not after");
    browser.shot("50-upload-refused");

    browser.choose("#upload-file", &Path::new(env!("CARGO_MANIFEST_DIR")).join("cues/bench-ride.csv"));
    browser.reads("upload", "upload as bench-ride");
    browser.press("#upload");
    browser.reads("playlist-reply", "done");
    browser.wait("document.getElementById('cues').value === 'bench-ride'");
    browser.wait("document.getElementById('upload-faults').children.length === 0");
}

/// Has the page draw a minute of errors of half a millisecond, then one that is far greater.
fn draw_errors(browser: &Browser) {
    let draw = |errors: &str| {
        let script = format!("return import('/js/error.js').then(({{ addError }}) => {{ {errors} }})");
        browser.eval(&script);
    };
    draw(
        "for (let at = -599; at <= 0; at += 1) addError(Math.sin(at / 30) / 2, performance.now() + at * 100);",
    );
    browser.reads("error-greatest", "0.50 ms");
    browser.reads("error-scale", "±1 ms");
    browser.shot("60-film-error");
    draw("addError(30);");
    browser.reads("error-greatest", "30.00 ms");
    browser.reads("error-scale", "±50 ms");
}

#[test]
fn the_film_that_leads_is_seen_with_its_error_and_its_source_is_chosen_by_two_presses() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open_to_a_film();
    enter(&browser, &hall);
    browser.wait("!document.getElementById('follow-panel').hidden");
    browser.reads("follow-word", "absent");
    browser.reads("follow-next", "start the film");
    browser.reads("timecode-of", "unknown");
    browser.reads("sources", "/nowhere/midi cannot be opened");
    assert_eq!(
        browser.eval("return document.getElementById('error-curve').hidden"),
        json!(true),
        "nothing is followed"
    );
    draw_errors(&browser);
    let reel = film("01:00:02:00");
    browser.reads("follow-word", "locked");
    browser.reads("follow-badge", "film locked");
    browser.press("[data-nudge='1']");
    browser.reads("levels-reply", "trim a frame later: done");
    browser.reads("trim", "+40 ms"); // of 25 a second
    browser.press("[data-trim='-10']");
    browser.reads("trim", "+30 ms");
    browser.press("[data-trim='0']");
    browser.reads("levels-reply", "trim 0 ms: done");
    arm(&browser);
    browser.wait("/^01:00:\\d\\d:\\d\\d$/.test(document.getElementById('timecode').textContent)");
    go(&browser);
    browser.wait("document.querySelector('#error-curve canvas') !== null");
    browser.reads("error-scale", " ms; positive");
    browser.wait("/^[+−]?\\d+\\.\\d\\d ms$/.test(document.getElementById('error-now').textContent)");
    for (width, height) in [(1600, 1000), (768, 1024), (390, 844)] {
        browser.resize(width, height);
        browser
            .wait(&format!("innerWidth === {width} && document.documentElement.scrollWidth <= innerWidth"));
        browser.eval("document.getElementById('follow-panel').scrollIntoView()");
        browser.shot(&format!("60-film-{width}x{height}"));
    }

    browser.press("#sources li:nth-child(2) button");
    browser.reads("follow-reply", "press again");
    assert_eq!(browser.eval("return document.getElementById('follow-word').textContent"), json!("locked"));
    browser.wait("(window.usePressed ??= performance.now()) + 400 < performance.now()");
    browser.press("#sources li:nth-child(2) button");
    browser.reads("follow-word", "absent");
    browser.wait(
        "document.querySelector('#sources li:nth-child(2) button').getAttribute('aria-pressed') === 'true'",
    );
    browser.reads("state", "waiting"); // seats follow what a person chose, though nothing is heard of it
    browser.shot("61-film-chosen");
    browser.press("#by-rank");
    browser.wait("(window.rankPressed ??= performance.now()) + 400 < performance.now()");
    browser.press("#by-rank");
    browser.reads("follow-word", "locked");
    drop(reel);
    browser.reads("follow-word", "lost");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn serial_links_and_their_axes_are_shown_in_words_and_a_port_that_vanishes_is_named() {
    let Some(browser) = Browser::start() else { return };
    let mut hall = Hall::open_beside_drives();
    browser.resize(1280, 800);
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    browser.press("#token-text");
    browser.type_text(TOKEN);
    browser.press("#token [type=submit]");
    for words in ["stalls, silvermax", "25.0 hz", "260 ms", "no cue", "open"] {
        browser.reads("links", words);
    }
    browser.wait("document.querySelectorAll('#links tbody tr').length === 3");
    browser.wait("document.querySelector('#links tbody .look-homeless b').textContent === 'excluded'"); // it is not home
    browser
        .wait("/^[1-9]\\d* of /.test(document.querySelector('#links dl div:nth-child(5) dd').textContent)");
    for (width, height) in [(1280, 800), (390, 844)] {
        browser.resize(width, height);
        browser
            .wait(&format!("innerWidth === {width} && document.documentElement.scrollWidth <= innerWidth"));
        let cut_off =
            "const words = document.getElementById('state'); return words.scrollWidth > words.clientWidth";
        assert_eq!(browser.eval(cut_off), json!(false), "the state is wider than its place at {width}");
        browser.eval("document.getElementById('links-panel').scrollIntoView()");
        browser.shot(&format!("70-links-{width}x{height}"));
    }
    hall.unplug();
    browser.wait("document.querySelector('#links .link-state').classList.contains('look-bad')");
    browser.reads("links", "there is no such port; plug the adapter in");
    browser.shot("71-links-gone");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn everything_is_large_enough_for_a_finger_and_stop_in_view_at_every_size() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    browser.press("[data-controller=B1]");
    for (width, height) in SIZES {
        browser.resize(width, height);
        browser.wait(&format!("innerWidth === {width} && document.fonts.status === 'loaded'"));
        let wrong = browser.eval(
            "const wrong = [];
             const box = (one) => one.getBoundingClientRect();
             const name = (one) => one.id || one.textContent || one.className;
             for (const one of document.querySelectorAll('button, select, input')) {
               const { width, height } = box(one);
               if (width > 0 && (height < 47.5 || width < 47.5)) wrong.push(`${name(one)} is ${width} x ${height}`);
             }
             for (const one of document.querySelectorAll('.controls button, #state, #position')) {
               const { left, top, right, bottom } = box(one);
               if (left < 0 || top < 0 || right > innerWidth || bottom > innerHeight) wrong.push(`${name(one)} is cut off`);
             }
             const [arm, go, stop] = ['arm', 'go', 'stop'].map((id) => box(document.getElementById(id)));
             if (Math.max(go.left - arm.right, go.top - arm.bottom) < 60) wrong.push('ARM and GO are close to each other');
             if (stop.left - go.right < 12) wrong.push('GO and STOP are close to each other');
             if (document.documentElement.scrollWidth > innerWidth) wrong.push('it is wider than the screen');
             return wrong;",
        );
        browser.shot(&format!("30-{width}x{height}"));
        assert_eq!(wrong, json!([]), "{width}x{height}");
    }
}

#[test]
fn everything_that_can_be_pressed_has_a_name_and_can_be_reached_by_the_keyboard() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    let nameless = browser.eval(
        "const text = (one) => one.getAttribute('aria-label') || one.textContent.trim() || one.labels?.[0]?.textContent;
         const all = [...document.querySelectorAll('button, select, input')].filter((one) => one.offsetParent);
         return all.filter((one) => !text(one) || (one.tabIndex < 0 && !one.matches('[role=radio], .field'))).map((one) => one.outerHTML);",
    );
    assert_eq!(nameless, json!([]));
    assert!(
        browser
            .eval("return document.querySelectorAll('[aria-live], [role=alert], [role=status]').length")
            .as_u64()
            > Some(5)
    );
}

#[test]
fn whoever_may_only_look_sees_all_is_asked_for_a_token_upon_a_press_and_can_stop_without_one() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open_to("view");
    browser.resize(1024, 768);
    browser.open(hall.url());
    browser.reads("state", "parked");
    browser.wait("document.getElementById('token').hidden");
    browser.press("#preflight-run");
    browser.wait("!document.getElementById('token').hidden");
    browser.reads("preflight-reply", "not done");
    browser.shot("40-viewer");
    browser.press("#token-leave");
    browser.type_text(ESCAPE);
    browser.reads("state", "stopped");
}

#[test]
fn a_moment_is_marked_by_a_key_and_its_recording_is_looked_at_seat_by_seat() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.wait("document.getElementById('recordings-none').textContent === 'Nothing was recorded yet.'");
    arm(&browser);
    go(&browser);
    // Bars say how each seat stands, in the map and large where one is looked at; points follow over the curves of the cue.
    browser.press("[data-controller=A1]");
    browser.wait("document.querySelectorAll('.pose.small i').length === 12");
    browser.wait("document.querySelectorAll('#controller .pose.large i').length === 3");
    browser.wait("parseFloat(document.querySelector('.pose.large i').style.getPropertyValue('--is')) > 5");
    browser.reads("curves-note", "where A1 was");
    browser.shot("30-seats-that-move");
    browser.type_text("m");
    browser.reads("show-reply", "mark");
    browser.wait("document.querySelectorAll('#recordings tbody tr').length === 1");
    assert!(text(&browser, "#recordings tbody tr").contains("incident"));
    browser.press("#park");
    browser.reads("state", "parked");
    browser.wait("document.querySelectorAll('#recordings tbody tr').length === 2");
    browser.wait("[...document.querySelectorAll('#recordings td')].some((cell) => cell.textContent.startsWith('stopped'))");
    // The show is in the history, with what its recording says of it, and its picture.
    browser.wait("/^stopped, .*1 marked/.test(document.querySelector('#history tbody tr td:nth-child(3)')?.textContent)");
    let margin = text(&browser, "#history tbody tr td:nth-child(3) p");
    assert!(margin.contains("% left, axis ") && margin.contains(" a"), "{margin}");
    assert!(text(&browser, "#history tbody tr td:nth-child(2)").to_lowercase().contains("swell"));
    // On a tablet the button of each is in view, however much else its table has.
    browser.resize(1024, 768);
    for table in ["history", "recordings"] {
        let is_seen = "const [button, panel] = [row.querySelector('button'), row.closest('.panel')].map((one) => one.getBoundingClientRect()); \
             return button.left > panel.left && button.right <= panel.right";
        let is_seen = format!("const row = document.querySelector('#{table} tbody tr'); {is_seen}");
        assert_eq!(browser.eval(&is_seen), true, "{table}");
    }
    browser.shot("33-recordings-on-a-tablet");
    browser.press("#history tbody tr button");
    browser.wait("document.getElementById('picture').naturalWidth > 500");
    let width = "return document.getElementById('picture').getBoundingClientRect().width";
    assert!(browser.eval(width).as_f64() < Some(700.0), "it fits its column");
    browser.press("#picture-large");
    assert_eq!(browser.eval(width).as_f64(), Some(1_200.0));
    browser.press("#picture-large");
    assert!(text(&browser, "#picture-title").contains("show"));
    browser.shot("32-history-of-shows");
    // The incident is the newer of the two.
    browser.press("#recordings tbody tr:nth-child(2) button");
    // The picture of before stays until this one is there.
    browser.wait("/^[AB]/.test(document.getElementById('picture-sentence').textContent)");
    browser.wait("document.getElementById('picture').naturalWidth > 500");
    browser.shot("31-picture-of-a-recording");
    browser.eval("const seat = document.getElementById('picture-seat'); seat.value = 'B2'; seat.dispatchEvent(new Event('change'))");
    browser.wait("document.getElementById('picture-sentence').textContent.startsWith('B2')");
    browser.press("#picture-close");
    browser.wait("document.getElementById('picture-panel').hidden");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// What an element says.
fn text(browser: &Browser, selector: &str) -> String {
    let said = browser.eval(&format!("return document.querySelector({selector:?}).textContent"));
    said.as_str().expect("it is text").to_owned()
}
