//! One question to a time server, and what its answer tells of our own clock (NTP, RFC 5905, client and server mode). Pure: the instants
//! come from whoever asks.

use std::time::Duration;

/// Octets of a packet without extensions.
pub(crate) const LEN: usize = 48;
/// No leap second is announced, version 4, client.
const CLIENT: u8 = 4 << 3 | 3;
/// The mode of a server's answer.
const SERVER: u8 = 4;
/// From 1900, where the time of NTP begins, to 1970, seconds.
const SINCE_1900: u64 = 2_208_988_800;

/// Where fields are.
mod field {
    use std::ops::Range;

    pub(super) const STRATUM: usize = 1;
    pub(super) const REFERENCE: Range<usize> = 12..16;
    pub(super) const ORIGIN: Range<usize> = 24..32;
    pub(super) const RECEIVED: Range<usize> = 32..40;
    pub(super) const SENT: Range<usize> = 40..48;
}

/// What one question and its answer tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClockSample {
    /// How far our clock is ahead of the server's, ns, to within half of the trip.
    pub(crate) offset_ns: i64,
    /// How long both were under way, ns.
    pub(crate) trip_ns: u64,
}

/// Why an answer tells nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NtpFault {
    /// It is shorter than a packet, or says that it is none of a server.
    #[error("that is no answer of a time server")]
    NoAnswer,
    /// It answers another question: an old one, or one that somebody else made up.
    #[error("it answers another question")]
    NotAsked,
    /// The server wants to be asked no more, or less often, by its own code.
    #[error("the server does not want to be asked ({0}); let this machine ask it, or name another")]
    Kiss(String),
    /// The server does not know the time itself.
    #[error("the server does not know the time itself")]
    NotSynchronised,
    /// Its times go backwards, or further apart than the answer took.
    #[error("its times contradict each other")]
    Absurd,
}

/// A question that only its answer can repeat: instead of our time it carries a number that nobody else knows.
#[must_use]
pub(crate) fn question(nonce: u64) -> [u8; LEN] {
    let mut packet = [0; LEN];
    packet[0] = CLIENT;
    packet[field::SENT].copy_from_slice(&nonce.to_be_bytes());
    packet
}

/// What an answer tells that came `took` after its question, which left as our clock showed `asked_ns`, ns since 1970.
///
/// # Errors
/// Where it tells nothing.
pub(crate) fn answer(
    octets: &[u8],
    nonce: u64,
    asked_ns: u64,
    took: Duration,
) -> Result<ClockSample, NtpFault> {
    let packet = octets.first_chunk::<LEN>().ok_or(NtpFault::NoAnswer)?;
    let (leap, version, mode) = (packet[0] >> 6, packet[0] >> 3 & 7, packet[0] & 7);
    if mode != SERVER || !(3..=4).contains(&version) {
        return Err(NtpFault::NoAnswer);
    }
    // Before all else: of what nobody asked not even a refusal is believed.
    if stamp(packet, field::ORIGIN) != nonce {
        return Err(NtpFault::NotAsked);
    }
    let stratum = packet[field::STRATUM];
    if stratum == 0 {
        let code = packet[field::REFERENCE].iter().filter(|octet| octet.is_ascii_alphanumeric());
        return Err(NtpFault::Kiss(code.map(|&octet| char::from(octet)).collect()));
    }
    let (received, sent) = (stamp(packet, field::RECEIVED), stamp(packet, field::SENT));
    if leap == 3 || stratum > 15 || received == 0 || sent == 0 {
        return Err(NtpFault::NotSynchronised);
    }
    let took_ns = i128::try_from(took.as_nanos()).map_err(|_| NtpFault::Absurd)?;
    let kept_ns = between_ns(received, sent);
    if kept_ns < 0 || kept_ns > took_ns {
        return Err(NtpFault::Absurd);
    }
    let asked = of_unix(asked_ns);
    // Both differences are ours less theirs, each with one way in it; half of their sum is free of both.
    let there_ns = -between_ns(asked, received);
    let back_ns = took_ns - between_ns(asked, sent);
    let offset_ns = (there_ns + back_ns) / 2;
    let narrow = |ns: i128| i64::try_from(ns).map_err(|_| NtpFault::Absurd);
    Ok(ClockSample { offset_ns: narrow(offset_ns)?, trip_ns: narrow(took_ns - kept_ns)?.unsigned_abs() })
}

fn stamp(packet: &[u8; LEN], at: std::ops::Range<usize>) -> u64 {
    let mut octets = [0; 8];
    octets.copy_from_slice(&packet[at]);
    u64::from_be_bytes(octets)
}

/// A time of NTP: seconds since 1900 in the upper half, which begin anew in 2036, and parts of a second in the lower.
fn of_unix(ns: u64) -> u64 {
    let (seconds, ns) = (ns / 1_000_000_000, ns % 1_000_000_000);
    // To the nearest part, of which there are four in a nanosecond.
    let parts = ((ns << 32) + 500_000_000) / 1_000_000_000;
    (seconds.wrapping_add(SINCE_1900) << 32).wrapping_add(parts)
}

/// How much later the second is, ns; right across 2036 for what is less than 68 years apart.
fn between_ns(first: u64, second: u64) -> i128 {
    i128::from(second.wrapping_sub(first).cast_signed()) * 1_000_000_000 / (1 << 32)
}

/// Takes an answer apart that anybody may have sent.
#[cfg(feature = "harness")]
pub(crate) fn try_answer(octets: &[u8]) {
    // The one that was asked, too: what comes behind that is looked at.
    let asked =
        octets.get(field::ORIGIN).map(|_| stamp(octets.first_chunk().unwrap_or(&[0; LEN]), field::ORIGIN));
    for nonce in [0, asked.unwrap_or(1)] {
        let _ =
            std::hint::black_box(answer(octets, nonce, 1_795_306_800_000_000_000, Duration::from_millis(1)));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NONCE: u64 = 0x0123_4567_89ab_cdef;
    const NOW: u64 = 1_795_306_800_123_456_789;

    /// The answer of a server whose clock is so much behind ours; each way takes so long, and it keeps it for 20 µs.
    fn reply(behind_ns: i64, [there, back]: [u64; 2]) -> ([u8; LEN], Duration) {
        let kept = 20_000;
        let mut packet = [0; LEN];
        (packet[0], packet[1]) = (4 << 3 | SERVER, 2);
        packet[field::ORIGIN].copy_from_slice(&NONCE.to_be_bytes());
        let server = |ours: u64| of_unix(ours.saturating_add_signed(-behind_ns)).to_be_bytes();
        packet[field::RECEIVED].copy_from_slice(&server(NOW + there));
        packet[field::SENT].copy_from_slice(&server(NOW + there + kept));
        (packet, Duration::from_nanos(there + kept + back))
    }

    #[test]
    fn the_offset_is_within_half_of_the_trip_whichever_way_took_longer() {
        for behind_ns in [0, 1_500_000, -1_500_000, 86_400_000_000_000, -315_360_000_000_000_000] {
            for ways in [[100_000, 100_000], [10_000, 390_000], [390_000, 10_000], [0, 0]] {
                let (packet, took) = reply(behind_ns, ways);
                let sample = answer(&packet, NONCE, NOW, took).unwrap();
                let trip = ways[0] + ways[1];
                assert!(sample.trip_ns.abs_diff(trip) <= 2, "{sample:?} of {trip}");
                let off = sample.offset_ns.abs_diff(behind_ns);
                assert!(off <= sample.trip_ns / 2 + 2, "{behind_ns} ns, {ways:?}: {sample:?}");
                if ways[0] == ways[1] {
                    assert!(off <= 2, "{behind_ns} ns: {sample:?}");
                }
            }
        }
    }

    #[test]
    fn the_time_of_ntp_begins_anew_in_2036_and_nothing_is_off_by_that() {
        let (before, after) = (2_085_978_495_900_000_000, 2_085_978_496_100_000_000);
        assert!(of_unix(before) > of_unix(after));
        assert_eq!(between_ns(of_unix(before), of_unix(after)), 200_000_000);
        assert_eq!(between_ns(of_unix(after), of_unix(before)), -200_000_000);
    }

    #[test]
    fn an_answer_that_is_none_or_of_a_server_that_does_not_know_tells_nothing() {
        let (sound, took) = reply(0, [100_000; 2]);
        assert!(answer(&sound, NONCE, NOW, took).is_ok());
        let with = |change: &dyn Fn(&mut [u8; LEN])| {
            let mut packet = sound;
            change(&mut packet);
            answer(&packet, NONCE, NOW, took)
        };
        assert_eq!(answer(&sound[..47], NONCE, NOW, took), Err(NtpFault::NoAnswer), "short");
        assert_eq!(answer(&[], NONCE, NOW, took), Err(NtpFault::NoAnswer));
        assert_eq!(with(&|packet| packet[0] = CLIENT), Err(NtpFault::NoAnswer), "a question");
        assert_eq!(with(&|packet| packet[0] = 2 << 3 | SERVER), Err(NtpFault::NoAnswer), "of old");
        assert_eq!(answer(&sound, NONCE + 1, NOW, took), Err(NtpFault::NotAsked));
        assert_eq!(with(&|packet| packet[field::ORIGIN].fill(0)), Err(NtpFault::NotAsked));
        assert_eq!(with(&|packet| packet[0] |= 3 << 6), Err(NtpFault::NotSynchronised), "leap 3");
        assert_eq!(with(&|packet| packet[1] = 16), Err(NtpFault::NotSynchronised));
        assert_eq!(with(&|packet| packet[field::SENT].fill(0)), Err(NtpFault::NotSynchronised));
        let kiss = with(&|packet| {
            packet[1] = 0;
            packet[field::REFERENCE].copy_from_slice(b"RATE");
        });
        assert_eq!(kiss, Err(NtpFault::Kiss("RATE".to_owned())));
        let forged = with(&|packet| {
            packet[1] = 0;
            packet[field::ORIGIN].fill(7);
        });
        assert_eq!(forged, Err(NtpFault::NotAsked), "nobody else can have us stop to ask");
        assert_eq!(with(&|packet| packet[field::SENT].fill(0xff)), Err(NtpFault::Absurd));
        assert_eq!(with(&|packet| packet[field::RECEIVED].fill(0xff)), Err(NtpFault::Absurd));
    }

    proptest! {
        #[test]
        fn whatever_comes_for_an_answer_is_no_reason_to_end(
            octets in prop::collection::vec(any::<u8>(), 0..100),
            is_asked in any::<bool>(),
            asked_ns in any::<u64>(),
            took_ns in any::<u64>(),
        ) {
            let mut octets = octets;
            if is_asked && octets.len() >= LEN {
                octets[0] = 4 << 3 | SERVER;
                octets[field::ORIGIN].copy_from_slice(&NONCE.to_be_bytes());
            }
            let _ = answer(&octets, NONCE, asked_ns, Duration::from_nanos(took_ns));
        }
    }
}
