//! Instants: all in the zone of the hall, whatever zone the tablet is in, with a countdown beside each automatic start.

use serde_json::json;

use crate::browser::Browser;
use crate::hall::Hall;
use crate::page::{LARGE, pretend};
use crate::{arm, enter};

/// A hall in Berlin, armed, with a start at 19:13 of its clock in 78 s.
const IN_BERLIN: &str = "
    Object.assign(status, { timezone: 'Europe/Berlin', state: 'armed', lapses_s: 500 });
    status.playlist.next_start = '2026-11-28T19:13:00.000+01:00';
    Object.assign(status.playlist.entries[1], { at: '19:13', starts_in_s: 78 });
    status.journal = [{ at: '2026-11-28T17:59:30.000+00:00', who: 'anna', what: 'arm', result: 'done', times: 1 }];
    status.warnings = [{ id: 'seat-out', severity: 'info', controller: 'A1', text: 'out', remedy: '', coded: { code: 'seat-out', of: ['2026-11-27T23:30:00.000+00:00', 'anna'] } }];";

#[test]
fn every_instant_is_in_the_zone_of_the_hall_and_an_automatic_start_counts_down_and_says_what_prevents_it() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    browser.live_in("Asia/Tokyo");
    enter(&browser, &hall);
    arm(&browser);
    let clock = |browser: &Browser, zone: &str| {
        let format = format!("new Intl.DateTimeFormat('sv', {{ timeStyle: 'medium', timeZone: '{zone}' }})");
        browser.wait(&format!(
            "[-1e3, 0, 1e3].some((off) => {format}.format(Date.now() + off) === document.getElementById('clock').textContent)"
        ));
    };
    pretend(&browser, &format!("{LARGE}{IN_BERLIN}"));
    browser.reads("zone", "Berlin");
    clock(&browser, "Europe/Berlin");
    browser.reads("starts", "starts by itself at 19:13:00, in 78 s");
    browser.reads("film-next", "starts at 19:13:00, in 78 s");
    browser.reads("playlist-head", "19:13:00, in 78 s");
    browser.reads("entries", "at 19:13, in 78 s");
    browser.reads("journal", "18:59:30");

    // Arming is over before: nothing will start, which is said wherever the start is.
    pretend(&browser, &format!("{LARGE}{IN_BERLIN} status.lapses_s = 60;"));
    browser.reads("starts", "arming lapses in 60 s, before the start at 19:13:00");
    browser.reads("film-next", "if armed");
    browser.reads("playlist-head", "arming lapses in 60 s");

    // A zone of which this browser has no name is told in UTC, and called that.
    pretend(&browser, &format!("{LARGE}{IN_BERLIN} status.timezone = 'Moon/Crater';"));
    browser.reads("zone", "UTC");
    clock(&browser, "UTC");
    browser.reads("starts", "at 18:13:00, in 78 s");
    browser.reads("journal", "17:59:30");
    browser.eval("localStorage.setItem('kinocue-language', 'de'); location.reload()");
    browser.reads("state", "freigegeben");
    pretend(&browser, &format!("{LARGE}{IN_BERLIN}"));
    browser.reads("starts", "um 19:13:00, in 78 s");
    browser.reads("warnings", "28.11.26 00:30"); // half an hour past midnight there
    assert_eq!(browser.complaints(), Vec::<String>::new());
    assert_eq!(browser.eval("return Intl.DateTimeFormat().resolvedOptions().timeZone"), json!("Asia/Tokyo"));
}
