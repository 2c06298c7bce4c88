//! Every door at which octets come in that somebody else made: files, datagrams, lines, sounds. What they are given must never panic, and
//! what is read must stand what is done with it at once, and be what its reader promises. Behind three doors octets are no message, but
//! choices: what happens to a machine that the outside can reach. `fuzz/` and the tests go through the same doors.

mod cues;
mod films;
mod machines;
mod requests;
mod script;
mod served;
mod texts;
mod wires;

use std::hint::black_box;

pub use cues::{assert_read, is_plain};

use crate::app::film::doors as film;
use crate::cue::{DeclaredUnit, Source};
use crate::{api, app, journal};

/// A door: its name, and what takes octets there.
pub type Door = (&'static str, fn(&[u8]));

/// All of them.
pub const DOORS: &[Door] = &[
    ("controller", wires::controller),
    ("message", wires::message),
    ("silvermax", wires::silvermax),
    ("sixpack2", wires::sixpack2),
    ("cue-csv", |octets| cues::read("c.csv", octets, &Source::Native)),
    ("cue-mcap", |octets| cues::read("c.mcap", octets, &Source::Native)),
    ("cue-spreadsheet", |octets| cues::read("c.csv", octets, &Source::Spreadsheet)),
    ("cue-rows", |octets| cues::read("c", octets, &Source::Rows { unit: DeclaredUnit::Millimetre })),
    ("cue-u8", |octets| cues::read("c", octets, &Source::U8 { axes: 3, rate_hz: 50.0 })),
    ("config", |octets| with_text(octets, texts::config)),
    ("playlist", |octets| with_text(octets, texts::playlist)),
    ("settings", |octets| with_text(octets, texts::settings)),
    ("registers", |octets| with_text(octets, texts::registers)),
    ("label", |octets| with_text(octets, texts::label)),
    ("journal", journal::try_file),
    ("osc", requests::osc),
    ("text", requests::line),
    ("http", requests::http),
    ("buttons", app::buttons::try_records),
    ("ntp", crate::fleet::try_ntp),
    ("letter", |octets| with_text(octets, api::try_letter)),
    ("wish", |octets| with_text(octets, api::try_wish)),
    ("order", |octets| with_text(octets, api::try_order)),
    ("told", requests::told),
    ("ltc", films::ltc),
    ("mtc", films::mtc),
    ("artnet", films::artnet),
    ("mpv", films::mpv),
    ("film-wav", film::wav),
    ("film-relay", film::relayed),
    ("film-position", film::position),
    ("film-index", films::index),
    ("recording", texts::recording),
    ("replay", texts::replay),
    ("capture", texts::captured),
    ("latency", texts::latency),
    ("tracker", machines::tracker),
    ("health", machines::health),
    ("hall", machines::hall),
];

/// What it comes to is looked at, and let go: else it would not be worked out.
fn seen<T>(what: T) {
    let _ = black_box(what);
}

fn with_text(octets: &[u8], door: impl FnOnce(&str)) {
    if let Ok(text) = std::str::from_utf8(octets) {
        door(text);
    }
}
