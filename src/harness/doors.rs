//! Every door at which octets come in that somebody else made: files, datagrams, lines, sounds. What they are given must never panic, and
//! what is read must stand what is done with it at once. `fuzz/` and the tests go through the same doors.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::app::film::doors as film;
use crate::film::artnet::ArtNetReader;
use crate::film::ltc::LtcReader;
use crate::film::mpv::MpvClient;
use crate::film::mtc::MtcReader;
use crate::film::observation::Observation;
use crate::film::sound::SoundIndex;
use crate::film::timecode::{FrameRate, Label};
use crate::time::MonoTime;
use crate::wire::silvermax::{Collected, LineCollector};
use crate::wire::sixpack2::FrameCollector;
use crate::wire::{FromController, Message, VibrationPort};
use crate::{
    api, app, capture, config, cue, device, latency, osc, playlist, record, replay, settings, text_port,
};

/// A door: its name, and what takes octets there.
pub type Door = (&'static str, fn(&[u8]));

/// All of them.
pub const DOORS: &[Door] = &[
    ("controller", controller),
    ("message", message),
    ("silvermax", silvermax),
    ("sixpack2", sixpack2),
    ("cue-csv", |octets| cue_file("c.csv", octets)),
    ("cue-mcap", |octets| cue_file("c.mcap", octets)),
    ("cue-rows", |octets| imported(octets, &cue::Source::Rows { unit: cue::DeclaredUnit::Millimetre })),
    ("cue-u8", |octets| imported(octets, &cue::Source::U8 { axes: 3, rate_hz: 50.0 })),
    ("config", |octets| with_text(octets, |text| seen(config::parse(Path::new("h.toml"), text)))),
    ("playlist", |octets| {
        with_text(octets, |text| seen(playlist::Playlist::parse(Path::new("p.toml"), text)))
    }),
    ("settings", |octets| with_text(octets, |text| seen(settings::Settings::parse(text)))),
    ("registers", |octets| with_text(octets, |text| seen(device::settings::parse(text)))),
    ("label", |octets| with_text(octets, |text| seen(text.parse::<Label>()))),
    ("osc", osc::try_datagram),
    ("text", text_port::try_line),
    ("buttons", app::buttons::try_records),
    ("ntp", crate::fleet::try_ntp),
    ("letter", |octets| with_text(octets, api::try_letter)),
    ("ltc", ltc),
    ("mtc", mtc),
    ("artnet", artnet),
    ("mpv", mpv),
    ("film-wav", film::wav),
    ("film-relay", film::relayed),
    ("film-position", film::position),
    ("film-index", film_index),
    ("recording", |octets| seen(record::summarize(octets))),
    ("replay", |octets| seen(replay::replay(octets))),
    ("capture", captured),
    ("latency", |octets| seen(latency::read(octets))),
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

fn controller(octets: &[u8]) {
    for port in [VibrationPort::Two, VibrationPort::Four] {
        seen(FromController::parse(port, octets));
    }
}

fn message(octets: &[u8]) {
    for port in [VibrationPort::Two, VibrationPort::Four] {
        seen(Message::parse_as(port, octets));
    }
}

fn silvermax(octets: &[u8]) {
    let mut collector = LineCollector::of_replies();
    for octet in octets {
        if let Some(Collected::Line(line)) = collector.push(*octet) {
            seen(crate::wire::silvermax::Reply::parse(line));
        }
    }
}

fn sixpack2(octets: &[u8]) {
    let mut collector = FrameCollector::new(None);
    for octet in octets {
        if let Some(frame) = collector.push(*octet, Duration::ZERO) {
            seen(frame.octets());
        }
    }
}

fn cue_file(name: &str, octets: &[u8]) {
    seen(cue::read(Path::new(name), octets, &cue::Source::Native));
}

fn imported(octets: &[u8], source: &cue::Source) {
    seen(cue::read(Path::new("c"), octets, source));
}

/// Gives octets to a reader bit by bit, each a millisecond after the one before.
fn in_pieces(octets: &[u8], mut take: impl FnMut(&[u8], MonoTime, &mut dyn FnMut(Observation))) {
    let mut now = MonoTime::from_nanos(1_000_000_000);
    for piece in octets.chunks(7) {
        take(piece, now, &mut |heard| seen(heard));
        now = now + Duration::from_millis(1);
    }
}

fn ltc(octets: &[u8]) {
    let mut reader = LtcReader::new(48_000, Duration::ZERO, None, Label::default());
    let samples: Vec<i16> =
        octets.chunks_exact(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect();
    reader.hear(&samples, MonoTime::from_nanos(1_000_000_000), &mut |heard| seen(heard));
}

fn mtc(octets: &[u8]) {
    let mut reader = MtcReader::new(Some(FrameRate::F25), Label::default());
    in_pieces(octets, |piece, now, out| {
        piece.iter().for_each(|octet| reader.hear(*octet, now, &mut |heard| out(heard)));
    });
}

fn artnet(octets: &[u8]) {
    let mut reader = ArtNetReader::new(Some(FrameRate::F25), Label::default());
    reader.hear(octets, MonoTime::from_nanos(1_000_000_000), &mut |heard| seen(heard));
}

fn mpv(octets: &[u8]) {
    let mut client = MpvClient::new(MonoTime::from_nanos(1_000_000_000));
    in_pieces(octets, |piece, now, out| {
        seen(client.poll(now));
        client.hear(piece, now, &mut |heard| out(heard));
    });
}

/// With the sum that its content has as well: else all that is wrong would end there.
fn film_index(octets: &[u8]) {
    let content = octets.split_last_chunk::<32>().map_or(octets, |(content, _)| content);
    seen(SoundIndex::of_octets(octets));
    seen(SoundIndex::of_octets(&[content, &Sha256::digest(content)[..]].concat()));
}

fn captured(octets: &[u8]) {
    let Ok(mut capture) = capture::Capture::open(octets) else { return };
    while let Ok(Some(packet)) = capture.packet() {
        seen(packet.content());
    }
}
