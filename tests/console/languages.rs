//! The page in other languages: chosen by the browser or by a person, by the codes of what the hall says, and still one that fits.

use crate::browser::Browser;
use crate::hall::{Hall, TOKEN};
use crate::page::pretend;

/// Opens the page in a browser that asks for these languages.
fn enter(browser: &Browser, hall: &Hall, languages: &[&str]) {
    browser.resize(1280, 800);
    browser.speak(languages);
    browser.open(hall.url());
    browser.wait("!document.getElementById('token').hidden");
    browser.press("#token-text");
    browser.type_text(TOKEN);
    browser.press("#token [type=submit]");
}

#[test]
fn the_page_speaks_as_the_browser_asks_and_as_a_person_chooses_and_says_what_has_no_code_in_english() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall, &["eo", "fr-CA", "de"]);
    browser.reads("state", "au repos");
    browser.wait("document.documentElement.lang === 'fr'");
    browser.reads("cause", "tous les sièges qui participent ont été trouvés au repos");
    browser.reads("stop-note", "Ce n’est pas l’arrêt d’urgence");
    browser.wait(r"/100\s%/.test(document.getElementById('levels').textContent)"); // with a narrow gap

    browser.eval("const list = document.getElementById('language'); list.value = 'de'; list.dispatchEvent(new Event('change'))");
    browser.reads("state", "geparkt");
    browser.reads("next", "Cue laden, dann freigeben");
    browser.eval("import('/js/api.js').then(({ change }) => change('POST', 'show/go')).catch((problem) => { window.refused = problem.words; })");
    browser.wait("window.refused === 'der Saal ist nicht freigegeben; erst freigeben'");
    browser.press("#controls #park");
    browser.reads("show-reply", "parken: ");
    pretend(
        &browser,
        "status.cause = 'the moon is full'; status.cause_coded = { code: 'moon' };
         status.warnings = [{ id: 'moon', severity: 'warning', controller: null, text: 'it is full', remedy: 'wait' },
                            { id: 'link', severity: 'warning', controller: null, text: 'no port', remedy: 'plug it in' }];",
    );
    browser.reads("cause", "The moon is full");
    browser.reads("warnings", "It is full");
    browser.reads("warnings", "Serielle Verbindung: no port");
    browser.reads("warnings-title", "2 Warnungen");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
