//! The page as a whole: what is in view, what its header says, what is next, and who can read and reach it. Statuses that are rare
//! are made of real ones, in the browser, before the page sees them.

use serde_json::{Value, json};

use crate::browser::{Browser, ESCAPE};
use crate::hall::Hall;
use crate::{arm, enter, go};

/// What stands out too little from what is around it.
const CONTRAST: &str = include_str!("contrast.js");
const RIGHT: &str = "\u{e014}";
const DOWN: &str = "\u{e015}";
const END: &str = "\u{e010}";

/// Of the elements of a selector those that cannot be seen and pressed where they are.
const OUT_OF_REACH: &str = "
    const reached = (one) => {
      const { left, top, right, bottom } = one.getBoundingClientRect();
      const at = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
      return left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight && at !== null && (one.contains(at) || at.contains(one));
    };
    const all = [...document.querySelectorAll(SELECTOR)].filter((one) => !one.hidden);
    return all.filter((one) => !reached(one)).map((one) => one.id || one.textContent);";

/// Has the page see each status as a script makes it, a body of a function of `status`.
pub(crate) fn pretend(browser: &Browser, script: &str) {
    browser.eval(&format!(
        "const parse = window.honest ??= JSON.parse;
         JSON.parse = (text) => {{
           const parsed = parse(text);
           const status = parsed?.status ?? parsed;
           if (status?.controllers) {{ {script} }}
           return parsed;
         }};"
    ));
}

/// A hall of 64 seats in eight rows that follows a film, nine seats of it lost, and that is not as planned.
pub(crate) const LARGE: &str = "
    const [first] = status.controllers;
    status.controllers = [...'ABCDEFGH'].flatMap((row) => Array.from({ length: 8 }, (_, seat) => ({
      ...first, name: row + (seat + 1), row, group: row + (seat + 1), health: row === 'A' || row + seat === 'B0' ? 'lost' : 'ok',
      commanded: [0.2, 0.5, 0.8],
    })));
    const lost = status.controllers.filter(({ health }) => health === 'lost');
    status.warnings = lost.map(({ name }) => ({ id: 'controller-lost', severity: 'error', controller: name, text: 'lost: no answer for 4 s', remedy: 'check its power' }));
    status.film = { state: 'locked', cause: '', next: '', leads: true, source: 'artnet:10.0.0.20', position_s: 1, rate_ppm: 0, error_ms: 0.42,
      timecode: '01:00:00:00', disagrees: null, chosen: null, switches: 0, joins: 1, sources: [] };
    Object.assign(status.levels, { motion: 0.6, effects: { water: false } });
    const entry = { cue: 'swell', title: 'Swell', length_s: 120, preset: null, level: null, trim_ms: null, movie: null, then: 'hold', at: null, note: 'Close the doors, then GO after the trailer; row C at half motion only' };
    status.playlist = { id: 'day', title: 'Day', current: 0, next_start: null, entries: [entry, { ...entry, title: 'Kids', at: '23:45' }] };";

/// Those of a selector that are out of reach at a size.
pub(crate) fn out_of_reach(browser: &Browser, (width, height): (u32, u32), selector: &str) -> Value {
    browser.resize(width, height);
    browser.wait(&format!("innerWidth === {width} && document.fonts.status === 'loaded'"));
    browser.shot(&format!("80-large-{width}x{height}"));
    let look = OUT_OF_REACH.replace("SELECTOR", &json!(selector).to_string());
    // The page lays its seats out once it has seen how wide it is; a hundred looks take about a second.
    let mut looks = (0..100).map(|_| browser.eval(&look));
    looks.find(|out| *out == json!([])).unwrap_or_else(|| browser.eval(&look))
}

#[test]
fn sixty_four_seats_the_film_the_buttons_and_the_gravest_warning_are_in_view_together_in_play() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    go(&browser);
    pretend(&browser, LARGE);
    browser.wait("document.querySelectorAll('.field').length === 64");
    let always = "#state, #in-play, #position, #remaining, #seek, #mark, #gravest, .transport button, #stop";
    for size in [(1280, 800), (1024, 768)] {
        assert_eq!(out_of_reach(&browser, size, &format!("{always}, .field")), json!([]), "{size:?}");
    }
    for size in [(768, 1024), (390, 844)] {
        assert_eq!(out_of_reach(&browser, size, always), json!([]), "{size:?}");
        let wide = browser.eval("return document.documentElement.scrollWidth > innerWidth");
        assert_eq!(wide, json!(false), "{size:?}");
    }
    browser.reads("in-play", "55 of 64 seats");
    browser.reads("settings-badge", "motion 60%, water off");
    browser.reads("follow-badge", "film locked, artnet, +0.4 ms");
    browser.reads("film-next", "then Kids, at 23:45");
    browser.reads("remaining", "−01:");
    browser.wait("/^\\d\\d:\\d\\d:\\d\\d$/.test(document.getElementById('clock').textContent)");
    browser.reads("gravest", "A1, A2");
    pretend(&browser, &format!("{LARGE} status.film.error_ms = -0.04;"));
    browser.reads("follow-badge", "film locked, artnet, 0 ms");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn what_is_next_is_a_button_arm_says_what_it_waits_for_and_what_is_over_goes() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.reads("arm-note", "load a cue first");
    browser.wait("document.getElementById('arm').disabled");
    browser.reads("next-actions", "load swell");
    browser.press("#next-actions [data-do=load]");
    browser.reads("arm-note", "preflight first");
    browser.shot("81-next-preflight");
    browser.press("#next-actions [data-do=preflight]");
    browser.wait("document.querySelector('#arm[data-next=true]:enabled') !== null");
    browser.wait("document.getElementById('next-actions').children.length === 0");
    browser.press("#arm");
    browser.wait("document.querySelector('#go[data-next=true]:enabled') !== null");

    // A seek that is refused is told of as long as the hall is the one that refused it.
    browser.eval(
        "import('/js/press.js').then(({ say }) => say(document.getElementById('go'), 'Not done', true))",
    );
    browser.reads("show-reply", "not done");
    browser.type_text(ESCAPE);
    browser.reads("state", "stopped");
    browser.wait("!document.getElementById('show-reply').textContent.includes('Not done')");
    browser.wait("document.querySelector('#clear[data-next=true]:enabled') !== null");
    pretend(
        &browser,
        "status.state = 'boot'; status.may_clear = false; status.controllers[2].health = 'lost';",
    );
    browser.press("#next-actions [data-do=disable]");
    browser.reads("next-actions", "sure?"); // a second press does it
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_button_that_is_marked_is_the_one_that_the_words_name() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    // A seat whose emergency stop holds until a reset: it says that it knows its position, and is homed all the same.
    for (code, button) in [("home", "home"), ("park-or-home", "park"), ("clear", "clear"), ("release", "")] {
        let state = if ["clear", "release"].contains(&code) { "stopped" } else { "recovering" };
        pretend(
            &browser,
            &format!(
                "Object.assign(status, {{ state: '{state}', may_clear: '{state}' === 'stopped', next_coded: {{ code: '{code}' }} }});
                 Object.assign(status.controllers[0], {{ emergency_stop: true, homed: true }});"
            ),
        );
        let marked = "[...document.querySelectorAll('[data-next=true]:enabled')].map((one) => one.id).join()";
        browser.wait(&format!(
            "document.documentElement.dataset.state === '{state}' && {marked} === '{button}'"
        ));
    }
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn whoever_left_the_question_for_a_token_finds_the_way_back_to_it() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    browser.resize(390, 844);
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    browser.press("#token-leave");
    browser.wait("document.getElementById('log-in').getClientRects().length > 0");
    browser.press("#log-in");
    browser.wait("!document.getElementById('token').hidden");
    browser.press("#token-text");
    browser.type_text(crate::hall::TOKEN);
    browser.press("#token [type=submit]");
    browser.reads("state", "parked");
    browser.wait("document.getElementById('lost').hidden");
}

#[test]
fn a_refusal_that_comes_late_asks_nobody_who_has_given_a_token_meanwhile() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    browser.eval(
        "const real = window.real = fetch;
         window.late = [];
         window.fetch = async (...asked) => {
           const reply = await real(...asked);
           if (reply.status === 401) await new Promise((come) => late.push(come));
           return reply;
         };",
    );
    browser.wait("late.length > 0");
    browser.press("#token-text");
    browser.type_text(crate::hall::TOKEN);
    browser.press("#token [type=submit]");
    browser.eval("window.fetch = window.real; late.forEach((come) => come())");
    browser.reads("state", "parked");
    assert_eq!(browser.eval("return document.getElementById('token').hidden"), json!(true));
}

#[test]
fn the_map_is_one_tab_stop_and_the_arrow_keys_lead_from_seat_to_seat() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.resize(1280, 800);
    let stops = "return [...document.querySelectorAll('.field')].filter((one) => one.tabIndex === 0).length";
    assert_eq!(browser.eval(stops), json!(1));
    browser.eval("document.querySelector('.field').focus()");
    for (key, seat) in [(DOWN, "B1"), (RIGHT, "B2"), (RIGHT, "B2"), (DOWN, "B2"), (END, "B2")] {
        browser.type_text(key);
        browser.wait(&format!("document.activeElement.dataset.controller === '{seat}'"));
    }
    assert_eq!(browser.eval(stops), json!(1));
    browser.type_text(" ");
    browser.reads("controller", "seat B2, row B");
    browser.shot("82-seat-beside-the-map");
    let beside = "const [seat, map] = ['controller', 'map'].map((id) => document.getElementById(id).getBoundingClientRect());
                  return seat.left >= map.right && seat.top < map.bottom";
    assert_eq!(browser.eval(beside), json!(true));
    let levels = browser
        .eval("return [...document.querySelectorAll('h1, h2, h3')].map((one) => one.tagName).join(' ')");
    let levels = levels.as_str().expect("text").to_owned();
    assert_eq!(levels.matches("H1").count(), 1);
    assert!(levels.starts_with("H1 H2"), "{levels}");
}

#[test]
fn words_stand_out_four_and_a_half_to_one_edges_three_and_the_question_under_a_mouse_too() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    browser.resize(1280, 800);
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    assert_eq!(browser.eval(CONTRAST), json!([]), "before the token");
    enter(&browser, &hall);
    browser.press("[data-controller=A1]");
    assert_eq!(browser.eval(CONTRAST), json!([]), "parked");
    browser.press("#home");
    browser.reads("home", "seats empty?");
    assert_eq!(browser.eval(CONTRAST), json!([]), "the question, and the mouse on it");
    pretend(&browser, LARGE);
    browser.reads("in-play", "55 of 64");
    assert_eq!(browser.eval(CONTRAST), json!([]), "nine seats lost");
    browser.eval("document.documentElement.style.setProperty('--edge', '#3a4552')");
    assert_ne!(browser.eval(CONTRAST), json!([]), "it measures");
}

#[test]
fn seats_that_do_not_take_part_each_have_a_mark_a_word_and_a_colour_of_their_own() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    pretend(
        &browser,
        "const [first] = status.controllers;
         const all = ['lost', 'error', 'stopped', 'excluded', 'ok'];
         status.state = 'playing';
         status.controllers = all.map((health) => ({ ...first, name: health, group: health, health, enabled: health !== 'ok' }));",
    );
    browser.wait("document.querySelectorAll('.field').length === 5");
    browser.shot("83-seats-that-are-out");
    let looks = browser.eval(
        "const looks = [...document.querySelectorAll('.field')].map((one) => [
           one.querySelector('.field-figure').textContent, one.querySelector('.mark').innerHTML, getComputedStyle(one).borderTopColor]);
         return [0, 1, 2].map((part) => new Set(looks.map((look) => look[part])).size);",
    );
    assert_eq!(looks, json!([5, 5, 5]));
    browser.reads("map", "disabled");
    browser.reads("in-play", "0 of 5 seats");
    browser.reads("state", "playing, no seat");
}

#[test]
fn the_headline_is_the_worst_that_is_true_of_the_seats_and_what_is_next_deals_with_it() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    let worst = "document.documentElement.dataset.worst";
    let colour =
        |browser: &Browser| browser.eval("return getComputedStyle(document.getElementById('state')).color");
    browser.wait(&format!("{worst} === ''"));
    browser.reads("next", "load");
    let calm = colour(&browser);

    // One seat of four is out while the others are parked: arming is not what comes first.
    pretend(
        &browser,
        "Object.assign(status, { state: 'parked', may_clear: false, next: 'arm', next_coded: { code: 'arm' } });
         status.controllers[2].health = 'lost';",
    );
    browser.wait(&format!("{worst} === 'weak'"));
    browser.reads("next", "see to B1: disable or mend. Then:");
    browser.reads("next-actions", "disable B1");
    assert_eq!(browser.eval("return document.querySelectorAll('[data-next=true]').length"), json!(0));
    assert_ne!(colour(&browser), calm);
    browser.shot("84-parked-but-for-one");

    pretend(
        &browser,
        "status.controllers.forEach((one) => { one.health = 'lost'; }); status.state = 'parked';",
    );
    browser.wait(&format!("{worst} === 'bad'"));
    browser.reads("next", "see to A1, A2, B1, B2");

    pretend(
        &browser,
        "status.controllers.forEach((one) => { one.health = 'lost'; }); status.state = 'playing';",
    );
    browser.reads("state", "playing, no seat");
    browser.reads("next", "stop or park: the film leads no seat");
    browser.wait(&format!("{worst} === 'bad'"));
    browser.shot("85-playing-without-a-seat");

    // A seat that a person has taken out, or that has to be homed, is no news.
    pretend(&browser, "status.controllers[0].enabled = false; status.controllers[1].health = 'excluded';");
    browser.wait(&format!("{worst} === ''"));
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn seats_that_all_fell_silent_at_one_instant_have_one_cause_and_one_button() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    pretend(
        &browser,
        "status.state = 'parked'; status.may_clear = false; status.next = 'arm'; status.next_coded = { code: 'arm', of: [] };
         status.controllers.forEach((one) => { one.health = 'lost'; });
         status.warnings = [{ id: 'all-silent', severity: 'error', controller: null, text: 'all 4 seats fell silent at one instant',
           coded: { code: 'all-silent', of: ['4'] }, remedy: 'check the network switch', remedy_code: 'all-silent' }];",
    );
    browser.reads("next", "check the network switch and the cable of this machine: all 4 seats");
    browser.reads("gravest", "all 4 seats fell silent at one instant");
    assert_eq!(browser.eval("return document.querySelectorAll('#warnings .warning').length"), json!(1));
    assert_eq!(browser.eval("return document.querySelectorAll('#next-actions button').length"), json!(1));
    browser.shot("86-all-silent");
    browser.press("#next-actions [data-do=disable-all]");
    browser.reads("next-actions", "sure?");
    browser.wait("(window.allPressed ??= performance.now()) + 400 < performance.now()");
    browser.press("#next-actions [data-do=disable-all]");
    browser.wait("document.querySelectorAll('.disabled-seat').length === 4");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn parked_is_not_all_where_a_seat_stands_up_and_park_is_next() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    pretend(
        &browser,
        "status.state = 'parked'; status.may_clear = false; status.next = 'park: B1 not at park'; status.next_coded = { code: 'park-first', of: ['B1'] };
         status.warnings = [{ id: 'not-at-park', severity: 'error', controller: 'B1', text: 'not at park', coded: { code: 'not-at-park', of: [] },
           remedy: 'park it', remedy_code: 'park-it' }];",
    );
    browser.reads("state", "parked, not all");
    browser.reads("cause", "B1: not at park");
    browser.reads("next", "park: B1");
    browser.wait("document.documentElement.dataset.worst === 'bad'");
    browser.wait("document.querySelector('#park[data-next=true]:enabled') !== null");
    // Whoever is taken out there stays up there.
    let out = "return [...document.querySelectorAll('#warnings button, #next-actions button')].some((one) => /disable/i.test(one.textContent))";
    assert_eq!(browser.eval(out), json!(false));
    browser.shot("87-parked-not-all");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
