//! What crosses from the tick thread to the thread of a serial link: where the seat of a lane is led, tick by tick.
//!
//! A lane on a link writes a record of this program's own in place of a datagram, so that everything before the sink stays the same for all
//! families; the thread of the link makes of poses what its drives are sent.

mod bus;
mod delays;
mod exchange;
mod homing;
mod led_lane;
mod line;
mod peer;
mod port;
mod stream;
mod streaming;
#[cfg(test)]
mod virtual_play;
#[cfg(test)]
mod virtual_port;

pub(crate) use delays::Delays;
pub(crate) use exchange::{LinkTalk, MOST_STRAY, Moment, TalkCounts, TalkState, TalkTerms};
pub(crate) use homing::{HomedAs, Step, canary, sum_of};
pub(crate) use led_lane::{LedLane, LinkAxis, STANDS_MM};
pub(crate) use line::LinkLine;
pub(crate) use peer::{AT_PARK, LaneWants, LinkPeer};
pub(crate) use port::{LinkFault, LinkPort};
pub(crate) use stream::{Family, IDLE, LinkPlay, Stream};
pub(crate) use streaming::{
    Account, AxisFigures, BrakeReason, Lead, LinkFigures, Stage, StreamEvent, StreamTerms, axis_number,
    lane_number,
};
#[cfg(test)]
pub(crate) use virtual_play::{TICK, VirtualPlay, back, ride_about, ride_for_a_minute, soaks, there};
#[cfg(test)]
pub(crate) use virtual_port::{Damage, Stalls, VirtualPort};

use crate::channel::ChannelId;
use crate::cue::Vibration;
use crate::engine::{Beat, Mix};
use crate::motion::{MAX_AXES, Pose, Window};
use crate::time::MonoTime;
use crate::wire::{FrameNo, MAX_LEN};

use super::Stamped;

/// Octets of a record: number and Time, a pose, and the vibration of each axis.
pub(crate) const RECORD_LEN: usize = 8 + 24 * MAX_AXES;
const _: () = assert!(RECORD_LEN <= MAX_LEN, "it is written where datagrams are");

/// Where the seat of a lane is led by a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinkPose {
    /// Its number, one more with each.
    pub(crate) frame: FrameNo,
    /// How long after the one before it is reached, ms.
    pub(crate) lasts_ms: u32,
    /// Where, as fractions of each axis's stroke.
    pub(crate) axes: Pose,
    /// What each axis is to swing by beside that, amplitudes as fractions of its stroke.
    pub(crate) vibration: [Vibration; MAX_AXES],
}

/// A pose on its way to the thread of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LedPose {
    /// The lane of the link, from 0.
    pub(crate) lane: u16,
    /// When the seat is to be there: the lane's lead after the tick.
    pub(crate) at: MonoTime,
    /// Where.
    pub(crate) pose: LinkPose,
}

impl LinkPose {
    /// What the frame of a tick says to a lane with that window.
    pub(super) fn of(window: &Window, beat: &Beat, pose: &Pose, mix: Mix, stamped: &mut Stamped) -> Self {
        let mut vibration = [Vibration { hz: 0.0, amplitude: 0.0 }; MAX_AXES];
        for (own, slot) in vibration.iter_mut().zip(window.slots()) {
            let Some(axis) = slot.axis else { continue };
            let Vibration { hz, amplitude } =
                mix.sample(ChannelId::Vibration, beat.samples.of(ChannelId::Vibration.on(axis))).into();
            *own = Vibration { hz, amplitude: amplitude * slot.to_stroke };
            stamped.shakes = stamped.shakes.max(own.amplitude);
        }
        Self { frame: stamped.frame, lasts_ms: beat.lasts_ms, axes: window.reached(pose), vibration }
    }

    /// Writes it.
    pub(super) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let numbers = self.axes.iter().copied();
        let numbers = numbers.chain(self.vibration.iter().flat_map(|one| [one.hz, one.amplitude]));
        buf[..4].copy_from_slice(&self.frame.0.to_le_bytes());
        buf[4..8].copy_from_slice(&self.lasts_ms.to_le_bytes());
        let (cells, _) = buf[8..RECORD_LEN].as_chunks_mut::<8>();
        cells.iter_mut().zip(numbers).for_each(|(cell, number)| *cell = number.to_le_bytes());
        &buf[..RECORD_LEN]
    }

    /// Reads what [`Self::emit`] wrote.
    #[must_use]
    pub(crate) fn parse(record: &[u8; RECORD_LEN]) -> Self {
        let (words, _) = record[..8].as_chunks::<4>();
        let (cells, _) = record[8..].as_chunks::<8>();
        let number = |index: usize| f64::from_le_bytes(cells[index]);
        let swing = |axis: usize| Vibration {
            hz: number(MAX_AXES + 2 * axis),
            amplitude: number(MAX_AXES + 2 * axis + 1),
        };
        Self {
            frame: FrameNo(u32::from_le_bytes(words[0])),
            lasts_ms: u32::from_le_bytes(words[1]),
            axes: std::array::from_fn(number),
            vibration: std::array::from_fn(swing),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_reads_as_it_was_written() {
        let axes: Pose = std::array::from_fn(|axis| 0.1 * f64::from(u8::try_from(axis).unwrap()));
        let swing = |axis: usize| Vibration { hz: 2.0 + axes[axis], amplitude: axes[axis] * 1e-3 };
        let written =
            LinkPose { frame: FrameNo(7), lasts_ms: 10, axes, vibration: std::array::from_fn(swing) };
        let mut buf = [0; MAX_LEN];
        let record = written.emit(&mut buf).try_into().expect("one record");
        assert_eq!(LinkPose::parse(record), written);
    }
}
