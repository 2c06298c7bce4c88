//! What fits where: in every language, at every size, with any number of seats out; measured by the geometry of the page.

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::hall::Hall;
use crate::page::{LARGE, out_of_reach, pretend};
use crate::{arm, enter, go};

/// Screens of a booth, tablets and telephones, on their sides too, each with how many fields of 64 seats are in view at least.
const SIZES: [((u32, u32), u64); 5] =
    [((1280, 800), 64), ((1024, 768), 64), ((768, 1024), 56), ((390, 844), 24), ((844, 390), 48)];
const LANGUAGES: [(&str, &str); 6] = [
    ("en", "playing"),
    ("de", "läuft"),
    ("es", "en marcha"),
    ("fr", "en cours"),
    ("ja", "再生中"),
    ("zh", "运行中"),
];
/// In reach at every size.
const ALWAYS: &str =
    "#state, #in-play, #position, #remaining, #seek, #mark, #gravest, .transport button, #stop";

/// What is wider than its place, or stands out of the page, and how many fields can be pressed.
const MEASURE: &str = "
    const name = (one) => one.id || one.dataset.controller || one.textContent.trim().slice(0, 30);
    const wrong = [...document.querySelectorAll('button, .state-word, .in-play, .badge, .clock, .zone, .film-title, .cause, .next, .gravest-words')]
      .filter((one) => one.checkVisibility({ visibilityProperty: true }) && one.clientWidth > 0 && one.scrollWidth > one.clientWidth + 1)
      .map((one) => `${name(one)}: ${one.scrollWidth} in ${one.clientWidth}`);
    const over = [...document.querySelectorAll('.top *')].filter((one) => one.checkVisibility() && !one.closest('.off-screen'))
      .filter((one) => one.getBoundingClientRect().right > innerWidth + 1).map((one) => `${name(one)} leaves the page`);
    if (document.documentElement.scrollWidth > innerWidth) wrong.push('it is wider than the screen');
    const pressed = [...document.querySelectorAll('.field')].filter((field) => {
      const { left, right, top, bottom } = field.getBoundingClientRect();
      return field.contains(document.elementFromPoint((left + right) / 2, (top + bottom) / 2));
    }).length;
    return [wrong.concat(over), pressed];";

/// `LARGE` with so many seats out, all of them at one instant where it is all, in every setting that is not as planned.
fn hall_with(out: usize) -> String {
    let silent = if out == 64 {
        "status.warnings = [{ id: 'all-silent', severity: 'error', controller: null, text: 'all 64 seats fell silent at one instant',
           coded: { code: 'all-silent', of: ['64'] }, remedy: 'check the switch', remedy_code: 'all-silent' }];"
    } else {
        "status.warnings = status.controllers.filter(({ health }) => health === 'lost').map(({ name }) => ({ id: 'controller-lost',
           severity: 'error', controller: name, text: 'lost: no answer for 4 s', remedy: 'check its power' }));"
    };
    format!(
        "{LARGE} status.controllers.forEach((one, at) => {{ one.health = at < {out} ? 'lost' : 'ok'; }}); {silent}
         if ({out} === 0) status.warnings = [{{ id: 'link', severity: 'warning', controller: null, text: 'no port', remedy: 'plug it in' }}];
         Object.assign(status.levels, {{ vibration: 0.5 }}); status.trim_ms = -80;
         Object.assign(status.playlist.entries[1], {{ starts_in_s: 4000 }});"
    )
}

#[test]
fn in_every_language_at_every_size_with_any_number_of_seats_out_nothing_is_clipped_and_the_map_is_in_view() {
    let Some(browser) = Browser::start() else { return };
    let mut wrong = Vec::new();
    for (language, playing) in LANGUAGES {
        // A hall of its own, since a test's processes are ended after a minute.
        let hall = Hall::open();
        enter(&browser, &hall);
        arm(&browser);
        go(&browser);
        browser.eval(&format!("localStorage.setItem('kinocue-language', '{language}'); location.reload()"));
        browser.reads("state", playing);
        for out in [0, 1, 63, 64] {
            pretend(&browser, &hall_with(out));
            browser.wait(&format!(
                "document.querySelectorAll('.field').length === 64 && document.querySelectorAll('.field.look-bad').length === {out}"
            ));
            for ((width, height), least) in SIZES {
                let at = format!("{language}, {out} out, {width}x{height}");
                let unreached = out_of_reach(&browser, (width, height), ALWAYS);
                let found = browser.eval(MEASURE);
                let (clipped, pressed) = (&found[0], &found[1]);
                browser.shot(&format!("90-{language}-{out}-{width}x{height}"));
                if (&unreached, clipped) != (&json!([]), &json!([])) || pressed.as_u64() < Some(least) {
                    wrong.push(format!(
                        "{at}: out of reach {unreached}, clipped {clipped}, {pressed} of 64 fields in view"
                    ));
                }
            }
        }
        let settings = browser.eval("return document.getElementById('settings-badge').textContent");
        assert!(settings.as_str().expect("text").contains("water"), "{language}: {settings}");
        browser.open("about:blank"); // before its hall is gone
    }
    assert_eq!(wrong, Vec::<String>::new());
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn before_a_show_too_whatever_is_next_stop_and_all_buttons_are_in_reach_at_every_size() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    for (language, parked) in [("en", "parked"), ("de", "geparkt"), ("es", "en reposo"), ("fr", "au repos")] {
        browser.eval(&format!("localStorage.setItem('kinocue-language', '{language}'); location.reload()"));
        browser.reads("state", parked);
        pretend(
            &browser,
            &format!("{} Object.assign(status, {{ state: 'parked', show: null }});", hall_with(1)),
        );
        browser.wait("document.querySelectorAll('#next-actions button').length === 1");
        for (size, _) in SIZES {
            let always = "#state, #position, #next-actions button, .transport button, #stop, #stop-note";
            assert_eq!(out_of_reach(&browser, size, always), json!([]), "{language} {size:?}");
            assert_eq!(browser.eval(MEASURE)[0], json!([]), "{language} {size:?}");
            browser.shot(&format!("94-parked-{language}-{}x{}", size.0, size.1));
        }
    }
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

/// How many fields there are, and how many of them can be pressed.
fn fields(browser: &Browser) -> Value {
    browser.eval(MEASURE)[1].clone()
}

#[test]
fn two_hundred_seats_are_a_compact_map_that_is_in_view_and_four_are_fields_for_a_finger() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    pretend(
        &browser,
        "const [first] = status.controllers;
         status.controllers = [...'ABCDEFGHIJKLMNOPQRST'].flatMap((row) => Array.from({ length: 10 }, (_, seat) => ({
           ...first, name: row + (seat + 1), row, group: row + (seat + 1), health: row === 'C' ? 'lost' : 'ok' })));
         status.warnings = [];",
    );
    browser.wait("document.querySelectorAll('.field').length === 200");
    for ((width, height), least) in
        [((1280, 800), 200), ((1024, 768), 200), ((768, 1024), 180), ((844, 390), 60)]
    {
        browser.resize(width, height);
        browser.wait(&format!("innerWidth === {width} && document.querySelector('#map.compact') !== null"));
        browser.shot(&format!("93-two-hundred-{width}x{height}"));
        let pressed = fields(&browser).as_u64();
        assert!(pressed >= Some(least), "{width}x{height}: {pressed:?}");
    }
    // One that is out stands out by more than its colour, and has its name for whoever cannot see it.
    let out = "const [out, good] = ['C1', 'A1'].map((name) => document.querySelector(`[data-controller=${name}]`));
               return [getComputedStyle(out).borderTopWidth !== getComputedStyle(good).borderTopWidth, out.getAttribute('aria-label').includes('C1')]";
    assert_eq!(browser.eval(out), json!([true, true]));
    pretend(&browser, "");
    browser.wait(
        "document.querySelectorAll('.field').length === 4 && document.querySelector('#map.compact') === null",
    );
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn on_a_portrait_tablet_the_language_is_chosen_at_the_very_end() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.resize(768, 1024);
    let last = "const top = (one) => one.getBoundingClientRect().top;
                return [...document.querySelectorAll('.panel')].filter((one) => one.checkVisibility()).every((one) => top(one) < top(document.getElementById('language')));";
    assert_eq!(browser.eval(last), json!(true));
}

#[test]
fn a_film_that_the_cue_does_not_follow_is_a_line_and_one_that_nobody_follows_is_not_lost() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    let film = |leads: bool, state: &str| {
        format!(
            "{LARGE} Object.assign(status.film, {{ leads: {leads}, state: 'lost' }}); status.state = '{state}';"
        )
    };
    let looks =
        |look: &str| format!("document.getElementById('follow-badge').classList.contains('look-{look}')");
    pretend(&browser, &film(true, "playing"));
    browser.wait(&looks("bad"));
    let tall = "return document.getElementById('follow-panel').getBoundingClientRect().height";
    let whole = browser.eval(tall).as_f64().expect("a height");
    pretend(&browser, &film(false, "playing"));
    browser.reads("follow-apart", "does not follow it");
    browser.wait("document.getElementById('follow-panel').hasAttribute('data-aside')");
    let aside = browser.eval(tall).as_f64().expect("a height");
    assert!(aside < 130.0 && aside < whole / 2.0, "{aside} of {whole} px");
    // It came to its end, and the seats to park.
    pretend(&browser, &film(true, "parked"));
    browser.wait(&looks("away"));
    browser.reads("follow-word", "absent");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
