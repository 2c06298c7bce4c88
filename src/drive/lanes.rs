//! Builds the lanes of a play from configuration and cue.

use std::time::Duration;

use super::Lane;
use super::lane::Codec;
use super::link::StreamTerms;
use super::mbox::{MotionCodec, Wiring};
use super::rates::LinkLoad;
use super::sixpack2;
use crate::config::drive::DriveFamily;
use crate::config::{Config, Connection, Controller, Drives, FanOut, FansOut as _};
use crate::motion::{SeatType, Slot, Window};
use crate::timeline::Timeline;
use crate::wire::{Code, FrameNo, motion_channel_and_slots};

/// The object channel of frames of more than six axes, as programs send it.
const WIDE: u16 = 2;

/// How a play is sent, whatever the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manner {
    /// Intensity of motion and vibration, 0 to 1, about the seats' neutral poses.
    pub level: f64,
    /// True if no frame asks for a reply.
    pub silent: bool,
}

impl Manner {
    /// In each of how many frames a reply is asked for; 0 never.
    #[must_use]
    pub(crate) fn ack_every(&self, config: &Config) -> u32 {
        if self.silent { 0 } else { config.show.ack_every }
    }
}

/// The lanes of every controller, in the configuration's order, for a cue without a [`crate::config::Misfit`].
#[must_use]
pub(crate) fn lanes(config: &Config, timeline: &Timeline, manner: Manner) -> Vec<Lane> {
    config.controllers.iter().map(|controller| lane(config, controller, timeline, manner)).collect()
}

fn lane(config: &Config, controller: &Controller, timeline: &Timeline, manner: Manner) -> Lane {
    let (channel, slots) = motion_channel_and_slots(controller.frame_axes(timeline.axes()));
    let window = match controller.connection.fan_out() {
        FanOut::Slice => slice(controller, slots, timeline, manner.level),
        FanOut::Shared => shared(config, controller, slots, timeline, manner.level),
    };
    let shake = controller.seat.vibration;
    let shaken = |axis| shake > 0.0 && timeline.vibrates(axis);
    let vibrates = window.moving().filter_map(|(_, slot)| slot.axis).any(shaken);
    let (lead, later) = lead(config, controller);
    let window = window.led_ahead(lead).acked_later(later);
    let codec = match &controller.connection {
        Connection::Udp(station) => Codec::Mbox(MotionCodec {
            channel: if station.counts_axes { counting(channel, slots) } else { channel },
            code: Code(station.code()),
            vibrates,
            shake,
            vibration_port: station.vibration_port,
            wiring: wiring(config, controller, timeline),
        }),
        Connection::Link(drives) => Codec::Link { shake: shake * drives.drive.vibration },
    };
    Lane {
        window,
        codec,
        ack_every: manner.ack_every(config),
        longest_ms: controller.seat.max_interval_ms,
        next_frame: FrameNo::FIRST,
    }
}

/// The object channel of a frame with so many places, where that of more than six axes is their number.
fn counting(channel: u16, slots: usize) -> u16 {
    if channel == WIDE { u16::try_from(slots).unwrap_or(WIDE) } else { channel }
}

/// How long before its seat is there its poses have to come, and how much later it may be known that it was.
fn lead(config: &Config, controller: &Controller) -> (Duration, Duration) {
    let lead = |drives: &Drives| {
        let link = config.links.iter().find(|link| link.name == drives.link)?;
        let terms = StreamTerms::of(link, config).ok().flatten()?;
        let on_it = config.named().filter_map(Controller::drives).filter(|one| one.link == link.name);
        let (seats, axes) = (u32::try_from(on_it.count()).ok()?, LinkLoad::of(link, config)?.axes);
        let later = match drives.motors.family() {
            DriveFamily::SilverMax => Duration::ZERO,
            DriveFamily::Sixpack2 => sixpack2::read_every(terms.period, seats, axes),
        };
        Some((terms.lead(drives.motors.family()), later))
    };
    controller.drives().and_then(lead).unwrap_or_default()
}

/// Just the controller's own axes, the first of them in the first slot; padding rests.
fn slice(controller: &Controller, slots: usize, timeline: &Timeline, level: f64) -> Window {
    let own_slot = |index: usize| {
        let axis = controller.axis_offset + index;
        let own = (index < controller.seat.axes && axis < timeline.axes()).then_some(axis);
        let slot = slot(&controller.seat, index, own, timeline, level);
        if index < controller.seat.axes { slot } else { slot.of_others() }
    };
    Window::new((0..slots).map(own_slot).collect())
}

/// The whole cue's axes, as every controller that shares the frame sees them; each takes its own window by PA95.
fn shared(config: &Config, controller: &Controller, slots: usize, timeline: &Timeline, level: f64) -> Window {
    let any_slot = |axis: usize| {
        let takes = |other: &&Controller| other.connection.fan_out() == FanOut::Shared && other.takes(axis);
        let taker = if controller.takes(axis) { Some(controller) } else { config.named().find(takes) };
        let taker = taker.unwrap_or(controller);
        let own = (axis < timeline.axes()).then_some(axis);
        let slot = slot(&taker.seat, axis.saturating_sub(taker.axis_offset), own, timeline, level);
        if controller.takes(axis) { slot } else { slot.of_others() }
    };
    Window::new((0..slots).map(any_slot).collect())
}

fn slot(seat: &SeatType, seat_axis: usize, axis: Option<usize>, timeline: &Timeline, level: f64) -> Slot {
    timeline.unit(axis.unwrap_or(0)).slot(seat, seat_axis, axis).at_level(level)
}

fn wiring(config: &Config, controller: &Controller, timeline: &Timeline) -> Wiring {
    let outputs = |name: &String| config.effect_outputs(controller, name).unwrap_or(0);
    Wiring {
        named: timeline.effect_names().iter().map(outputs).collect(),
        raw: config.allowed_outputs(controller),
        at_most: controller.at_most,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config;
    use crate::cue::{self, Source};
    use crate::engine::{Beat, Mix};
    use crate::wire::{MAX_LEN, MotionRequest, Timing};

    /// What the one controller of a hall with such keys is sent of a cue of so many axes that vibrates.
    fn sent(seat: &str, controller: &str, axes: usize) -> MotionRequest {
        let hall = format!(
            "[show]\nbind = \"127.0.0.1:8410\"\n[seat.s]\naxes = {axes}\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n{seat}\n[[controller]]\n\
             name = \"A1\"\nseat = \"s\"\naddress = \"127.0.0.1:7408\"\n{controller}\n"
        );
        let config = config::parse(Path::new("hall.toml"), &hall).unwrap();
        let names: Vec<_> = (1..=axes).map(|axis| format!("a{axis}")).collect();
        let row = vec!["0"; axes].join(",");
        let cue = format!("time_s,{},v1_hz,v1_amp\n0,{row},20,0.01\n1,{row},20,0.01\n", names.join(","));
        let cue = cue::read(Path::new("test.csv"), cue.as_bytes(), &Source::Native).unwrap();
        let manner = Manner { level: 1.0, silent: false };
        let mut lane = lanes(&config, &Timeline::new(cue), manner).remove(0);
        let mut buf = [0; MAX_LEN];
        let (park, beat) = (lane.window.park(), Beat::still(Timing::Relative, 10));
        let (_, octets) = lane.encode(&beat, &park, Mix::STILL, &mut buf);
        MotionRequest::parse(octets).unwrap()
    }

    #[test]
    fn frames_of_more_than_six_axes_have_the_object_channel_that_the_controller_takes() {
        for (axes, of_programs, of_manual) in [(3, 0, 0), (6, 1, 1), (7, 2, 10), (10, 2, 10), (12, 2, 12)] {
            for (key, channel) in [
                ("", of_programs),
                ("wide_channel = \"2\"", of_programs),
                ("wide_channel = \"axes\"", of_manual),
            ] {
                let request = sent("vibration = \"0%\"", key, axes);
                assert_eq!(request.channel, channel, "{axes} {key}");
                assert_eq!(request.positions.len(), motion_channel_and_slots(axes).1);
            }
        }
    }

    #[test]
    fn a_seat_type_that_leaves_vibration_out_gets_plain_frames() {
        assert!(sent("", "", 3).vibration.is_some());
        assert!(sent("vibration = \"40%\"", "", 3).vibration.is_some());
        assert!(sent("vibration = \"0%\"", "", 3).vibration.is_none());
        assert!(sent("vibration = \"0%\"", "dialect = \"mbox\"", 3).vibration.is_none());
    }
}
