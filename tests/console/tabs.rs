//! Many pages at once: a browser has six connections to a server for the requests of all of them. STOP gets through in each, a page that
//! could not send one says so before it is asked, and one that nobody sees holds nothing.

use rustix::process::Signal;
use serde_json::json;

use crate::browser::{Browser, ESCAPE};
use crate::hall::{Hall, TOKEN};
use crate::page::out_of_reach;
use crate::{arm, enter, go};

/// A browser that takes no WebSocket, as an old one, or one behind an old proxy.
const NO_SOCKETS: &str = "window.WebSocket = class { constructor() { throw new Error('none here'); } };";

/// Opens the console in one more window or tab.
fn one_more(browser: &Browser, hall: &Hall, kind: &str) {
    browser.begin(kind);
    browser.open(&format!("{}#token={TOKEN}", hall.url()));
    browser.reads("link", "connected");
}

/// Brings a stopped hall back into play.
fn play_again(browser: &Browser) {
    browser.press("#clear");
    browser.reads("next", "park, or home");
    browser.press("#park");
    browser.reads("state", "parked");
    browser.press("#arm");
    browser.reads("state", "armed");
    browser.eval("delete window.goPressed");
    go(browser);
}

#[test]
fn stop_gets_through_by_mouse_from_six_windows_and_by_key_from_twelve() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    go(&browser);
    for _ in 1..6 {
        one_more(&browser, &hall, "window");
    }
    browser.reads("state", "playing");
    browser.press("#stop");
    browser.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");

    play_again(&browser);
    for _ in 6..12 {
        one_more(&browser, &hall, "window");
    }
    browser.reads("state", "playing");
    browser.type_text(ESCAPE);
    browser.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");
    browser.shot("95-the-twelfth-window");
}

#[test]
fn stop_gets_through_from_the_fortieth_tab_and_from_another_browser() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    let other = browser.another();
    one_more(&other, &hall, "tab");
    for _ in 1..40 {
        one_more(&browser, &hall, "tab");
    }
    browser.press("#stop");
    browser.reads("stop-reply", "STOP was received");
    other.reads("state", "stopped");
    other.press("#clear");
    browser.reads("state", "recovering");
    browser.wait("document.getElementById('stop-reply').hidden"); // what was received is over
    other.press("#stop");
    other.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");
}

#[test]
fn a_page_that_could_not_send_a_stop_says_so_before_it_is_asked() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    hall.signal(Signal::STOP);
    browser.reads("stop-reach", "a stop from here would not arrive: no reply");
    browser.wait("document.documentElement.hasAttribute('data-no-stop')");
    browser.shot("96-no-stop-from-here");
    for size in [(390, 844), (844, 390), (768, 1024)] {
        assert_eq!(out_of_reach(&browser, size, "#stop, #stop-reach"), json!([]), "{size:?}");
        browser.shot(&format!("96-no-stop-from-here-{}", size.0));
    }
    hall.signal(Signal::CONT);
    browser.wait("document.getElementById('stop-reach').hidden");
    browser.reads("link", "connected");

    // Requests that wait for ever, as behind those of other pages, leave the channel.
    browser.eval(
        "window.fetch = (_, { signal }) => new Promise((_, end) => signal.addEventListener('abort', () => end(signal.reason)))",
    );
    browser.wait("(window.heldAt ??= performance.now()) + 3500 < performance.now()");
    assert_eq!(browser.eval("return document.getElementById('stop-reach').hidden"), json!(true));
    browser.press("#preflight-run");
    browser.reads("preflight-reply", "not done after 1 s");
    browser.type_text(ESCAPE);
    browser.reads("stop-reply", "STOP was received");
    browser.reads("state", "stopped");

    // Whoever takes no WebSocket has the stream of events, and six of those leave no connection for a stop.
    for _ in 0..6 {
        browser.begin("window");
        browser.begin_with(NO_SOCKETS);
        browser.open(&format!("{}#token={TOKEN}", hall.url()));
        browser.reads("link", "connected");
    }
    browser.reads("stop-reach", "a stop from here would not arrive");
    browser.reads("state", "stopped"); // what it shows is true, and of now
}

#[test]
fn a_page_that_nobody_sees_lets_go_claims_nothing_and_is_back_when_it_is_seen() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.wait("document.title.toLowerCase().startsWith('parked')");
    let first = browser.page();
    browser.eval(
        "window.seen = [];
         return import('/js/channel.js').then(({ channelAnswers }) => {
           setInterval(() => seen.push({ hidden: document.hidden, open: channelAnswers(), title: document.title }), 50);
         });",
    );
    one_more(&browser, &hall, "tab");
    browser.type_text(ESCAPE);
    browser.reads("state", "stopped");
    browser.wait("(window.hereAt ??= performance.now()) + 1200 < performance.now()");
    browser.turn_to(&first);
    browser.reads("link", "connected");
    browser.reads("state", "stopped");
    let held = browser.eval("return seen.filter(({ hidden, open }) => hidden && open).length");
    assert_eq!(held, json!(0), "it holds no channel");
    let titles =
        browser.eval("return [...new Set(seen.filter(({ hidden }) => hidden).map(({ title }) => title))]");
    assert_eq!(titles, json!(["Hall 1 – kinocue"]), "the state is not known there");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_press_that_gets_no_answer_within_a_second_says_so_and_can_be_made_again() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    go(&browser);
    browser.eval(
        "const real = fetch;
         window.asked = 0;
         window.fetch = (path, ...rest) => path.endsWith('show/pause') && (asked += 1) < 3 ? new Promise(() => {}) : real(path, ...rest);",
    );
    for press in 1..3 {
        browser.press("#pause");
        browser.wait(&format!("asked === {press}"));
        let took = browser.reads("show-reply", "PAUSE: not done after 1 s, and may still be done");
        browser.wait("!document.getElementById('pause').hasAttribute('aria-busy')");
        assert!(took.as_secs() < 10, "{took:?}");
    }
    browser.shot("97-no-answer");
    browser.press("#pause");
    browser.reads("state", "paused");
    browser.reads("show-reply", "PAUSE: done");
}
