//! A heartbeat in octets: the beat, how the leader's show is, and what people have set there, with a code that only the other machine of
//! the pair can make. Whatever else comes is none.

use super::mac::CODE;
use super::{Beat, PairKey};

/// What it begins with, the version among it.
const MAGIC: &[u8; 4] = b"kcp3";
/// The octets before the settings.
const HEAD: usize = 4 + 6 * 8 + 1 + 4 + 8 + 4;
/// The longest text of settings that is carried: a datagram takes no more.
pub(crate) const LONGEST: usize = 48 << 10;

const LEADS: u8 = 1;
const WANTS: u8 = 2;
const MOVES: u8 = 4;
const ON_CUE: u8 = 8;
const RUNS: u8 = 16;

/// What a machine that leads tells beside its beat.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Carried {
    /// No frame of it has a number above that.
    pub(crate) frame: u32,
    /// Where its show is, ms.
    pub(crate) film_ms: i64,
    /// True if its seats move or may.
    pub(crate) moves: bool,
    /// True if a show is under way, paused or not: then it may go on at `film_ms`.
    pub(crate) is_on_cue: bool,
    /// True if its film runs.
    pub(crate) runs: bool,
    /// How often people have set something there since it started.
    pub(crate) revision: u32,
    /// What people have set, the text of the file; not in each beat.
    pub(crate) settings: Option<String>,
}

/// What one machine sends the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    /// The beat.
    pub(crate) beat: Beat,
    /// How the show is.
    pub(crate) carried: Carried,
}

impl Message {
    /// Its octets. Settings that are longer than [`LONGEST`] stay out.
    pub(crate) fn emit(&self, key: &PairKey) -> Vec<u8> {
        let Self { beat, carried } = self;
        let mut octets = Vec::with_capacity(HEAD + CODE);
        octets.extend(MAGIC);
        for number in [beat.from, beat.to, beat.number, beat.echo, beat.word, beat.print] {
            octets.extend(number.to_be_bytes());
        }
        let flags = [
            (beat.leads, LEADS),
            (beat.wants, WANTS),
            (carried.moves, MOVES),
            (carried.is_on_cue, ON_CUE),
            (carried.runs, RUNS),
        ];
        octets.push(flags.into_iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum());
        octets.extend(carried.frame.to_be_bytes());
        octets.extend(carried.film_ms.to_be_bytes());
        octets.extend(carried.revision.to_be_bytes());
        let settings = carried.settings.as_deref().filter(|text| text.len() <= LONGEST);
        octets.extend(settings.unwrap_or_default().as_bytes());
        octets.extend(key.code(&octets));
        octets
    }

    /// Reads octets; `None` where they are no message by that key.
    pub(crate) fn parse(octets: &[u8], key: &PairKey) -> Option<Self> {
        let (text, code) = octets.split_last_chunk::<CODE>()?;
        if !key.is_code_of(code, text) {
            return None;
        }
        let rest = &mut &*text;
        if take::<4>(rest)? != *MAGIC {
            return None;
        }
        let mut number = || Some(u64::from_be_bytes(take(rest)?));
        let (from, to, nth) = (number()?, number()?, number()?);
        let (echo, word, print) = (number()?, number()?, number()?);
        let [flags] = take(rest)?;
        let is = |flag: u8| flags & flag != 0;
        let beat = Beat { from, to, number: nth, echo, leads: is(LEADS), wants: is(WANTS), word, print };
        let (frame, film_ms) = (u32::from_be_bytes(take(rest)?), i64::from_be_bytes(take(rest)?));
        let revision = u32::from_be_bytes(take(rest)?);
        let settings = str::from_utf8(rest).ok()?;
        let settings = (!settings.is_empty()).then(|| settings.to_owned());
        let (moves, is_on_cue, runs) = (is(MOVES), is(ON_CUE), is(RUNS));
        Some(Self { beat, carried: Carried { frame, film_ms, moves, is_on_cue, runs, revision, settings } })
    }
}

fn take<const N: usize>(from: &mut &[u8]) -> Option<[u8; N]> {
    let (taken, rest) = from.split_first_chunk::<N>()?;
    *from = rest;
    Some(*taken)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn key(octet: &str) -> PairKey {
        PairKey::parse(&octet.repeat(CODE)).unwrap()
    }

    fn message() -> Message {
        let beat = Beat { from: 1, to: 2, number: 3, echo: 6, leads: true, wants: false, word: 4, print: 5 };
        let settings = Some("{\"levels\":1}".to_owned());
        let (moves, is_on_cue, runs) = (true, true, false);
        let carried = Carried { frame: 70, film_ms: -5, moves, is_on_cue, runs, revision: 6, settings };
        Message { beat, carried }
    }

    #[test]
    fn a_message_comes_as_it_was_sent_and_from_nobody_without_the_key() {
        let (message, octets) = (message(), message().emit(&key("a1")));
        assert_eq!(Message::parse(&octets, &key("a1")), Some(message));
        assert_eq!(Message::parse(&octets, &key("a2")), None);
        for at in 0..octets.len() {
            let mut bent = octets.clone();
            bent[at] ^= 1;
            assert_eq!(Message::parse(&bent, &key("a1")), None, "octet {at}");
            assert_eq!(Message::parse(&octets[..at], &key("a1")), None, "the first {at}");
        }
    }

    #[test]
    fn settings_that_do_not_fit_stay_out_and_what_the_key_has_signed_may_be_anything() {
        let mut long = message();
        long.carried.settings = Some("x".repeat(LONGEST + 1));
        let read = Message::parse(&long.emit(&key("a1")), &key("a1")).unwrap();
        assert_eq!(read.carried, Carried { settings: None, ..message().carried });
        for text in
            [&b""[..], b"kcp3", b"kcp2 and more than that, much more than there has to be in such a message"]
        {
            let mut octets = text.to_vec();
            octets.extend(key("a1").code(text));
            assert_eq!(Message::parse(&octets, &key("a1")), None);
        }
    }

    proptest! {
        #[test]
        fn no_octets_panic(octets in proptest::collection::vec(any::<u8>(), 0..200), signed: bool) {
            let mut octets = octets;
            if signed {
                octets.extend(key("a1").code(&octets.clone()));
            }
            drop(Message::parse(&octets, &key("a1")));
        }
    }
}
