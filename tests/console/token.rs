//! Who is logged in, by a link or by hand, and out again.

use serde_json::json;

use crate::browser::Browser;
use crate::enter;
use crate::hall::{Hall, VISITOR};

#[test]
fn a_link_with_another_token_is_taken_in_words_if_the_server_knows_it_and_refused_in_words_if_not() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.reads("who", "booth, engineer");
    browser.eval("location.hash = 'token=nobody-knows-this'");
    browser.reads("show-reply", "a token that this server does not know: you are still booth, engineer");
    assert_eq!(browser.eval("return sessionStorage.getItem('kinocue-token')"), json!("booth-token"));
    assert_eq!(browser.eval("return location.hash"), json!(""));
    browser.eval(&format!("location.hash = 'token={VISITOR}'"));
    browser.reads("show-reply", "you are now visitor, view");
    browser.reads("who", "visitor, view");
    browser.press("#preflight-run"); // which is not for visitors
    browser.reads("preflight-reply", "not done");
    browser.wait("!document.getElementById('token').hidden");
}

#[test]
fn whoever_is_logged_in_logs_out_or_in_as_somebody_else_and_stop_stays_in_reach() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.reads("who-foot", "booth, engineer");
    browser.press("#token-other");
    browser.wait("!document.getElementById('token').hidden");
    browser.press("#token-text");
    browser.type_text(VISITOR);
    browser.press("#token [type=submit]");
    browser.reads("who-foot", "visitor, view");
    browser.press("#token-out");
    browser.wait("!document.getElementById('token').hidden"); // nobody is let in without one
    browser.wait(
        "document.getElementById('token-out').hidden && document.getElementById('who').textContent === ''",
    );
    assert_eq!(browser.eval("return sessionStorage.getItem('kinocue-token')"), json!(null));
    assert_eq!(browser.eval("return document.getElementById('stop').disabled"), json!(false));
}
