//! What any octets come to that readers of a film take: sound, what a relay sends, positions of players. For tests and fuzzing.

use super::network::osc_position;
use super::relayed::RelayedRead;
use super::riff::{Channels, SampleStream};
use crate::film::message::{FilmPosition, PositionReader};
use crate::film::source::LineKind;
use crate::json;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime};

/// A recording, and the same as a stream that comes in pieces.
pub(crate) fn wav(octets: &[u8]) {
    let _ = SampleStream::of(Channels::Mixed).check(octets);
    let (mut stream, mut samples) = (SampleStream::of(Channels::One(2)), Vec::new());
    let _ = octets.chunks(7).try_for_each(|piece| stream.push(piece, &mut samples));
}

/// What somebody sends who is asked as a relay.
pub(crate) fn relayed(octets: &[u8]) {
    let Ok(mut relayed) = RelayedRead::begin(octets, LineKind::Ltc) else { return };
    while let Ok(Some(_)) = relayed.next() {}
}

/// A position by OSC, or by HTTP.
pub(crate) fn position(octets: &[u8]) {
    let by_http = json::from_slice::<FilmPosition>(octets).ok();
    for told in osc_position(octets).into_iter().chain(by_http) {
        PositionReader::new(ShowTime::ZERO).hear(&told, Monotonic.now(), &mut drop);
    }
}
