//! Show mode: what is left to press, how the page is unlocked, who is logged in, and the note of an entry.

use serde_json::json;

use crate::browser::Browser;
use crate::hall::Hall;
use crate::page::{LARGE, pretend};
use crate::{arm, enter, go};

/// The elements that a finger, a mouse or the keyboard reaches, by their ids or words.
const REACHED: &str = "
    const all = [...document.querySelectorAll('button, select, input, summary, a')];
    return all.filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.closest('[inert]') && !one.disabled)
      .map((one) => one.id || one.textContent).filter((name) => !name.startsWith('Skip'));";

/// Two fingers touch the lock and leave it: how many long presses are still waited for.
const TWO_FINGERS: &str = "
    const [lock, set, clear, waits] = [document.getElementById('lock'), setTimeout, clearTimeout, new Set()];
    window.setTimeout = (what, ms) => { const id = set(what, ms); if (ms === 1500) waits.add(id); return id; };
    window.clearTimeout = (id) => { waits.delete(id); clear(id); };
    for (const kind of ['pointerdown', 'pointerdown', 'pointerup', 'pointerup']) lock.dispatchEvent(new PointerEvent(kind));
    [window.setTimeout, window.clearTimeout] = [set, clear];
    return waits.size;";

#[test]
fn a_locked_page_leaves_stop_pause_resume_park_and_go_until_the_lock_is_held() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.reads("who", "booth, engineer");
    arm(&browser);
    browser.press("#lock");
    browser.wait("document.documentElement.hasAttribute('data-locked')");
    assert_eq!(browser.eval(REACHED), json!(["lock", "park", "go", "stop"]), "armed");
    go(&browser);
    browser.wait("document.getElementById('pause').disabled === false");
    assert_eq!(browser.eval(REACHED), json!(["lock", "pause", "park", "stop"]), "in play");
    browser.shot("91-locked");

    // A short press says how; a key that would mark, and a page that is read again, change nothing of it.
    browser.press("#lock");
    browser.reads("show-reply", "hold the lock");
    browser.eval("document.activeElement.blur()");
    browser.type_text("m");
    browser.eval("location.reload()");
    browser.wait("document.getElementById('lock')?.getAttribute('aria-pressed') === 'true'");
    browser.reads("state", "playing");
    browser.wait("document.getElementById('pause').disabled === false");
    assert_eq!(browser.eval(REACHED), json!(["lock", "pause", "park", "stop"]), "read again");
    browser.wait("document.getElementById('recordings').hidden"); // nothing was marked

    browser.press("#pause");
    browser.reads("state", "paused");
    browser.wait("document.getElementById('resume').disabled === false");
    assert_eq!(browser.eval(REACHED), json!(["lock", "resume", "park", "stop"]), "paused");
    assert_eq!(browser.eval(TWO_FINGERS), json!(0), "no press goes on when all fingers are off");
    browser.touch("#lock");
    browser.wait("!document.documentElement.hasAttribute('data-locked')");
    browser.let_go();
    browser.press("#resume"); // it is there again, and the end of the long press has not locked the page anew
    browser.reads("state", "playing");
    browser.wait("document.getElementById('next-locked').hidden");
    browser.press("#lock");
    browser.touch("#stop");
    browser.reads("state", "stopped");
    // CLEAR is next, which show mode leaves to whoever unlocks: that is what is next on this page.
    browser.wait("document.querySelector('#lock[data-next=true]') !== null");
    browser.wait("document.getElementById('next-locked').checkVisibility()");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_note_of_the_entry_that_is_loaded_is_in_view_and_those_of_all_stand_in_the_list() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    arm(&browser);
    pretend(&browser, LARGE);
    browser.reads("entry-note", "Close the doors");
    browser.wait("document.querySelectorAll('#entries .note-words').length === 2");
    browser.wait("document.getElementById('entry-note').getBoundingClientRect().bottom <= innerHeight");
    browser.eval(
        "import('/js/press.js').then(({ say }) => say(document.getElementById('go'), 'Not done', true))",
    );
    browser.wait("!document.getElementById('entry-note').checkVisibility()"); // what came of a press goes first
    pretend(&browser, &format!("{LARGE} status.playlist.entries[0].cue = 'another';"));
    browser.wait("document.getElementById('entry-note').hidden"); // another cue is loaded by hand
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
