//! What frames take of an Ethernet line, their acks, and what is read beside them.

use std::time::Duration;

use super::fit::MAX_VIBRATING_AXES;
use super::{Config, Controller, cue_axes};
use crate::time::Rate;
use crate::wire::{
    Code, Dialect, MAX_LEN, ReadRequest, motion_channel_and_slots, motion_len, position_reads,
};

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

/// Octets of the longest read of where a seat of so many axes is, and of its answer.
fn longest_read(axes: usize) -> [usize; 2] {
    let reads = position_reads(axes, Code::ALL, Code::ALL);
    let both = |read: ReadRequest| {
        let asks = read.emit(&mut [0; MAX_LEN]).len();
        [asks, asks + 2 * usize::from(read.num)]
    };
    reads.map(both).max_by_key(|[_, answer]| *answer).unwrap_or_default()
}

/// What the network of `[broadcast]` takes of the line where each controller is read so often, in words: one datagram for all of it, and
/// one for each.
pub(crate) fn in_words(config: &Config, read_every: Duration) -> Option<String> {
    let (network, axes) = (config.broadcast.as_ref()?, cue_axes(&config.controllers));
    let all: Vec<_> = config.controllers.iter().filter(|one| network.members.contains(&one.name)).collect();
    let (count, len) = (all.len(), all.iter().filter_map(|one| longest_frame(one, axes)).max()?);
    let (rate, every) = (Rate::from_hz(config.show.rate_hz), config.show.ack_every);
    let acks = mbit_s(count, len, rate) / f64::from(every);
    // They have one seat type.
    let looks = Rate::from_hz(read_every.as_secs_f64().recip());
    let [asked, answered] = longest_read(all[0].seat.axes).map(|len| mbit_s(count, len, looks));
    let [each, one] = [count, 1].map(|datagrams| mbit_s(datagrams, len, rate));
    Some(format!(
        "[broadcast.{}]: frames to {count} controllers at {} Hz take {each:.1} Mbit/s of the line one by one, {one:.2} Mbit/s as one \
         datagram; their acks, of each of {every}, take {acks:.1} Mbit/s the other way. With the reads of each every {} ms it is {:.1} \
         Mbit/s one by one, {:.1} as one datagram, and {:.1} the other way",
        network.name,
        rate.hz(),
        read_every.as_millis(),
        each + asked,
        one + asked,
        acks + answered,
    ))
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
    fn what_a_network_takes_of_the_line_is_told_in_both_ways_with_what_is_read_of_each() {
        assert_eq!([1, 3, 6].map(|axes| longest_read(axes).map(on_the_line)), [[84, 86], [84, 94], [84, 94]]);
        let tos: Vec<String> = (1..=200).map(|seat| format!("127.0.0.{seat}:7408")).collect();
        let mut config = crate::config::from_to_args(&tos, &[], 3).unwrap();
        let read_every = Duration::from_millis(40);
        assert_eq!(in_words(&config, read_every), None);
        (config.show.rate_hz, config.show.ack_every) = (250.0, 5);
        let names: Vec<_> = config.controllers.iter().map(|one| one.name.as_str()).collect();
        config.broadcast = Some(crate::config::BroadcastNetwork::of_loopback(&names));
        // 46 octets with vibration, 112 on the line; and 84 and 94 a read.
        assert_eq!(
            in_words(&config, read_every).unwrap(),
            "[broadcast.stalls]: frames to 200 controllers at 250 Hz take 44.8 Mbit/s of the line one by one, 0.22 Mbit/s as one \
             datagram; their acks, of each of 5, take 9.0 Mbit/s the other way. With the reads of each every 40 ms it is 48.2 Mbit/s one \
             by one, 3.6 as one datagram, and 12.7 the other way"
        );
    }
}
