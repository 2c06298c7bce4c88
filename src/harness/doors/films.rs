//! What timecode and players tell of a film.

use std::time::Duration;

use sha2::{Digest as _, Sha256};

use super::seen;
use crate::film::artnet::ArtNetReader;
use crate::film::ltc::LtcReader;
use crate::film::mpv::MpvClient;
use crate::film::mtc::MtcReader;
use crate::film::observation::{FilmWord, Observation};
use crate::film::sound::SoundIndex;
use crate::film::timecode::{FrameRate, Label};
use crate::time::MonoTime;

const BEGUN: MonoTime = MonoTime::from_nanos(1_000_000_000);

/// No reader says that something was so after it was told, nor a speed that is none.
fn stands(told: Observation, now: MonoTime) {
    assert!(told.at <= now, "{told:?} is told at {now:?}");
    if let FilmWord::Speed(speed) = told.word {
        assert!(speed.is_finite(), "{told:?}");
    }
    seen(told);
}

/// Gives octets to a reader bit by bit, each a millisecond after the one before.
fn in_pieces(octets: &[u8], mut take: impl FnMut(&[u8], MonoTime, &mut dyn FnMut(Observation))) {
    let mut now = BEGUN;
    for piece in octets.chunks(7) {
        take(piece, now, &mut |heard| stands(heard, now));
        now = now + Duration::from_millis(1);
    }
}

/// The first octet says how fast the samples come.
pub(super) fn ltc(octets: &[u8]) {
    let Some((rate, octets)) = octets.split_first() else { return };
    let rate = [48_000, 44_100, 96_000, 8_000][usize::from(*rate) % 4];
    let mut reader = LtcReader::new(rate, Duration::ZERO, None, Label::default());
    let samples: Vec<i16> =
        octets.chunks_exact(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect();
    reader.hear(&samples, BEGUN, &mut |heard| stands(heard, BEGUN));
}

pub(super) fn mtc(octets: &[u8]) {
    let mut reader = MtcReader::new(Some(FrameRate::F25), Label::default());
    in_pieces(octets, |piece, now, out| {
        reader.hear(piece, now, &mut |heard| out(heard));
    });
}

/// Datagrams, each behind an octet that says how long it is.
pub(super) fn artnet(octets: &[u8]) {
    let mut reader = ArtNetReader::new(Some(FrameRate::F25), Label::default());
    let (mut rest, mut now) = (octets, BEGUN);
    while let Some((len, more)) = rest.split_first() {
        let (datagram, more) = more.split_at(more.len().min(usize::from(*len)));
        reader.hear(datagram, now, &mut |heard| stands(heard, now));
        (rest, now) = (more, now + Duration::from_millis(40));
    }
}

pub(super) fn mpv(octets: &[u8]) {
    let mut client = MpvClient::new(BEGUN);
    in_pieces(octets, |piece, now, out| {
        seen(client.poll(now));
        client.hear(piece, now, &mut |heard| out(heard));
    });
}

/// With the sum that its content has as well: else all that is wrong would end there.
pub(super) fn index(octets: &[u8]) {
    let content = octets.split_last_chunk::<32>().map_or(octets, |(content, _)| content);
    seen(SoundIndex::of_octets(octets));
    seen(SoundIndex::of_octets(&[content, &Sha256::digest(content)[..]].concat()));
}
