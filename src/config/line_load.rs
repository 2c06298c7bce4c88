//! What frames take of an Ethernet line.

use super::fit::MAX_VIBRATING_AXES;
use super::{BroadcastNetwork, Config, Controller, cue_axes};
use crate::time::Rate;
use crate::wire::{Dialect, motion_channel_and_slots, motion_len};

/// Octets of a datagram's IPv4 and UDP headers.
const HEADERS_LEN: usize = 20 + 8;
/// Of an Ethernet frame: header and checksum; the least that it has with them; preamble and the gap to the next.
const ETHERNET_LEN: usize = 14 + 4;
const LEAST_LEN: usize = 64;
const BETWEEN_LEN: usize = 8 + 12;

/// Octets of the line that a datagram of so many takes, until the next may begin.
const fn on_the_line(len: usize) -> usize {
    let framed = ETHERNET_LEN + HEADERS_LEN + len;
    BETWEEN_LEN + if framed < LEAST_LEN { LEAST_LEN } else { framed }
}

/// Millions of bits a second of so many datagrams in each tick.
#[expect(clippy::cast_precision_loss, reason = "some thousands")]
fn mbit_s(datagrams: usize, len: usize, rate: Rate) -> f64 {
    (8 * on_the_line(len) * datagrams) as f64 * rate.hz() / 1e6
}

/// Octets of the longest frame that a controller may be sent, with vibration where it has that.
fn longest_frame(controller: &Controller, cue_axes: usize) -> Option<usize> {
    let station = controller.station()?;
    let (_, slots) = motion_channel_and_slots(controller.frame_axes(cue_axes));
    let vibrates = station.dialect == Dialect::Smc && slots <= MAX_VIBRATING_AXES;
    Some(motion_len(slots, None).max(motion_len(slots, vibrates.then_some(station.vibration_port))))
}

/// What each network of `[broadcast]` takes of the line, in words: one datagram for all of it, and one for each.
pub(crate) fn in_words(config: &Config) -> Vec<String> {
    let axes = cue_axes(&config.controllers);
    let one = |one: &BroadcastNetwork| {
        let is_in = |other: &&Controller| one.members.contains(&other.name);
        let all = config.controllers.iter().filter(is_in);
        let (count, len) = (all.clone().count(), all.filter_map(|one| longest_frame(one, axes)).max()?);
        let (rate, every) = (Rate::from_hz(config.show.rate_hz), config.show.ack_every);
        let acks = mbit_s(count, len, rate) / f64::from(every);
        Some(format!(
            "[broadcast.{}]: frames to {count} controllers at {} Hz take {:.1} Mbit/s of the line one by one, {:.2} Mbit/s as one \
             datagram; their acks, of each of {every}, take {acks:.1} Mbit/s the other way",
            one.name,
            rate.hz(),
            mbit_s(count, len, rate),
            mbit_s(1, len, rate),
        ))
    };
    config.broadcasts.iter().filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_datagram_takes_its_headers_and_the_gap_and_a_short_one_no_less_than_the_shortest_frame() {
        // 38 octets of three axes: 14 + 20 + 8 + 38 + 4, 8 before and 12 behind.
        assert_eq!([0, 18, 38, 50].map(on_the_line), [84, 84, 104, 116]);
    }

    #[test]
    fn four_hundred_seats_take_a_third_of_a_line_of_100_mbit_s_one_by_one_and_a_thousandth_as_one() {
        let rate = Rate::from_hz(100.0);
        assert_eq!((mbit_s(400, 38, rate), mbit_s(1, 38, rate)), (33.28, 0.0832));
    }

    #[test]
    fn what_a_network_takes_of_the_line_is_told_in_both_ways() {
        let tos = ["127.0.0.1:7408".to_owned(), "127.0.0.2:7408".to_owned()];
        let mut config = crate::config::from_to_args(&tos, &[], 3).unwrap();
        assert_eq!(in_words(&config), [""; 0]);
        (config.show.rate_hz, config.show.ack_every) = (250.0, 5);
        config.broadcasts = vec![BroadcastNetwork::of_loopback(&["c1", "c2"])];
        // 46 octets with vibration, 112 on the line.
        assert_eq!(
            in_words(&config),
            [
                "[broadcast.stalls]: frames to 2 controllers at 250 Hz take 0.4 Mbit/s of the line one by one, 0.22 Mbit/s as one \
                 datagram; their acks, of each of 5, take 0.1 Mbit/s the other way"
            ]
        );
    }
}
