//! What the ack thread took, record by record, as octets: all numbers are little-endian.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::ack_inputs::{read_input, read_look, write_input, write_look};
use super::ack_words::{FALLS, of, place};
use super::cursor::Cursor;
use crate::belief::Fall;
use crate::health::{HealthInput, HealthState};
use crate::motion::{MAX_AXES, Pulses};
use crate::net::Origin;
use crate::observe::Look;
use crate::time::{MonoTime, nanos};
use crate::tracker::{Fate, Reply};
use crate::wire::{FrameNo, PerAxis, ReplyCode};

const FATES: [Fate; 3] = [Fate::Duplicate, Fate::Stale, Fate::Stray];
const STANDINGS: [HealthState; 8] = [
    HealthState::Ok,
    HealthState::Degraded,
    HealthState::Lost,
    HealthState::Rejoining,
    HealthState::Stopped,
    HealthState::Error,
    HealthState::Excluded,
    HealthState::Unwatched,
];

/// Something that the ack thread took, or made of it. Controllers are counted from 0 in the order of their lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum AckRecord<'a> {
    /// A reply to a frame, as it was received.
    Reply(Reply),
    /// A datagram that is no reply to a frame, bit for bit, and when the kernel received it.
    Heard(Origin, MonoTime, &'a [u8]),
    /// The next frame of a controller; all that was before it is unknown here.
    First(usize, FrameNo),
    /// The books have the records of so many frames more, in the order in which these were handed over; and the lane and the number of
    /// the last of them.
    Posted(u32, usize, FrameNo),
    /// The kernel did not take that frame of a controller.
    Failed(usize, FrameNo),
    /// The next frame of a controller has that number, and none has those between it and the last.
    Skipped(usize, FrameNo),
    /// The lane of a controller is where the others are again.
    Joined(usize),
    /// Nothing goes to the lane of a controller any more; and the amplitude with which its seat may vibrate on, strokes.
    FellOut(usize, Fall, f64),
    /// Not all axes of a controller that was found tell where they are.
    Unread(usize),
    /// A link confirms the frames of a controller from the one to the other.
    Confirmed(usize, FrameNo, FrameNo),
    /// The frames of a controller from the one to the other are not executed, as it was told to stop. Stands behind the fates of its drain.
    Withdrawn(usize, FrameNo, FrameNo),
    /// What a reply to that frame of a controller turned out to be, and how long after the frame it came, nanoseconds; 0 where that is
    /// not known.
    Fate(usize, FrameNo, Fate, u32),
    /// Frames of a controller that were lost so far.
    Lost(usize, u64),
    /// How often the port of a controller was found closed so far.
    Closed(usize, u64),
    /// Where the axes of a controller were measured to be, and when.
    Measured(usize, MonoTime, PerAxis<Pulses>),
    /// How the group of a controller stands from now on.
    Standing(usize, HealthState),
    /// From now on health is judged.
    Watched,
    /// Health was told something beside frames, acks and the observer's events.
    Health(HealthInput),
    /// Health has the observer's events. Stands before what it was told next in the same look.
    Events,
    /// All groups were judged. Stands before what health was told next in the same look.
    Judged,
    /// The observer was told the reply code of an answer, and when that came.
    Code(usize, ReplyCode, MonoTime),
    /// The observer was told what a look at a controller says, and when that was over.
    Look(usize, Look, MonoTime),
}

impl<'a> AckRecord<'a> {
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        match *self {
            Self::Reply(reply) => write_reply(out, reply),
            Self::Heard(origin, at, octets) => write_heard(out, origin, at, octets),
            Self::Posted(frames, lane, last) => {
                of(out, 3, lane);
                out.extend_from_slice(&frames.to_le_bytes());
                out.extend_from_slice(&last.0.to_le_bytes());
            }
            Self::Failed(controller, frame) => write_numbered(out, 4, controller, frame),
            Self::First(controller, frame) => write_numbered(out, 14, controller, frame),
            Self::Skipped(controller, next) => write_numbered(out, 21, controller, next),
            Self::Joined(controller) => of(out, 5, controller),
            Self::FellOut(controller, why, shakes) => {
                of(out, 6, controller);
                out.push(place(&FALLS, &why));
                out.extend_from_slice(&shakes.to_le_bytes());
            }
            Self::Unread(controller) => of(out, 7, controller),
            Self::Confirmed(controller, first, last) | Self::Withdrawn(controller, first, last) => {
                of(out, if matches!(self, Self::Confirmed(..)) { 8 } else { 20 }, controller);
                out.extend_from_slice(&first.0.to_le_bytes());
                out.extend_from_slice(&last.0.to_le_bytes());
            }
            Self::Fate(controller, frame, fate, latency_ns) => {
                of(out, 9, controller);
                write_fate(out, frame, fate, latency_ns);
            }
            Self::Lost(controller, total) | Self::Closed(controller, total) => {
                of(out, if matches!(self, Self::Lost(..)) { 10 } else { 11 }, controller);
                out.extend_from_slice(&total.to_le_bytes());
            }
            Self::Measured(controller, at, pulses) => {
                of(out, 12, controller);
                out.extend_from_slice(&at.as_nanos().to_le_bytes());
                out.push(u8::try_from(pulses.len()).unwrap_or_default());
                pulses.iter().for_each(|at| out.extend_from_slice(&at.0.to_le_bytes()));
            }
            Self::Standing(controller, standing) => {
                of(out, 13, controller);
                out.push(place(&STANDINGS, &standing));
            }
            Self::Watched => out.push(15),
            Self::Events => out.push(16),
            Self::Judged => out.push(17),
            Self::Health(input) => write_input(out, input),
            Self::Code(controller, code, at) => {
                of(out, 18, controller);
                out.push(code as u8);
                out.extend_from_slice(&at.as_nanos().to_le_bytes());
            }
            Self::Look(controller, look, at) => {
                of(out, 19, controller);
                write_look(out, look);
                out.extend_from_slice(&at.as_nanos().to_le_bytes());
            }
        }
    }

    /// Reads the first of some records, and leaves the rest.
    pub(super) fn first_of(octets: &mut &'a [u8]) -> Option<Self> {
        let mut from = Cursor(octets);
        let record = Self::read(&mut from)?;
        *octets = from.0;
        Some(record)
    }

    pub(super) fn read(from: &mut Cursor<'a>) -> Option<Self> {
        let kind = from.u8()?;
        match kind {
            2 => {
                let ip = Ipv4Addr::from_octets(from.take()?);
                return heard(Origin::Stranger(SocketAddrV4::new(ip, from.u16()?)), from);
            }
            15 => return Some(Self::Watched),
            16 => return Some(Self::Events),
            17 => return Some(Self::Judged),
            _ => {}
        }
        let controller = usize::from(from.u16()?);
        Some(match kind {
            3 => Self::Posted(from.u32()?, controller, from.frame_no()?),
            14 => Self::First(controller, from.frame_no()?),
            21 => Self::Skipped(controller, from.frame_no()?),
            18 => Self::Code(controller, ReplyCode::from_byte(from.u8()?)?, from.time()?),
            19 => Self::Look(controller, read_look(from)?, from.time()?),
            0 => {
                let frame = from.frame_no()?;
                let code = ReplyCode::from_byte(from.u8()?)?;
                let (error, inputs, at) = (from.u16()?, from.u16()?, from.time()?);
                Self::Reply(Reply { controller, frame, code, error, inputs, at })
            }
            1 => return heard(Origin::Controller(controller), from),
            4 => Self::Failed(controller, from.frame_no()?),
            5 => Self::Joined(controller),
            6 => Self::FellOut(controller, *FALLS.get(usize::from(from.u8()?))?, from.f64()?),
            7 => Self::Unread(controller),
            8 => Self::Confirmed(controller, from.frame_no()?, from.frame_no()?),
            20 => Self::Withdrawn(controller, from.frame_no()?, from.frame_no()?),
            9 => {
                let (frame, fate) = (from.frame_no()?, from.u8()?);
                let fate = match fate.checked_sub(16) {
                    Some(other) => *FATES.get(usize::from(other))?,
                    None => Fate::Answered(ReplyCode::from_byte(fate)?),
                };
                Self::Fate(controller, frame, fate, from.u32()?)
            }
            10 => Self::Lost(controller, from.u64()?),
            11 => Self::Closed(controller, from.u64()?),
            12 => {
                let (at, axes) = (from.time()?, usize::from(from.u8()?));
                let mut pulses = [Pulses(0); MAX_AXES];
                for pulses in pulses.get_mut(..axes)? {
                    *pulses = Pulses(i32::from_le_bytes(from.take()?));
                }
                Self::Measured(controller, at, PerAxis::new(&pulses[..axes]))
            }
            13 => Self::Standing(controller, *STANDINGS.get(usize::from(from.u8()?))?),
            _ => Self::Health(read_input(kind, controller, from)?),
        })
    }
}

fn write_numbered(out: &mut Vec<u8>, kind: u8, controller: usize, frame: FrameNo) {
    of(out, kind, controller);
    out.extend_from_slice(&frame.0.to_le_bytes());
}

fn write_reply(out: &mut Vec<u8>, Reply { controller, frame, code, error, inputs, at }: Reply) {
    of(out, 0, controller);
    out.extend_from_slice(&frame.0.to_le_bytes());
    out.push(code as u8);
    out.extend_from_slice(&error.to_le_bytes());
    out.extend_from_slice(&inputs.to_le_bytes());
    out.extend_from_slice(&at.as_nanos().to_le_bytes());
}

fn write_heard(out: &mut Vec<u8>, origin: Origin, at: MonoTime, octets: &[u8]) {
    match origin {
        Origin::Controller(controller) => of(out, 1, controller),
        Origin::Stranger(from) => {
            out.push(2);
            out.extend_from_slice(&from.ip().octets());
            out.extend_from_slice(&from.port().to_le_bytes());
        }
    }
    out.extend_from_slice(&at.as_nanos().to_le_bytes());
    let len = u16::try_from(octets.len()).unwrap_or(u16::MAX);
    out.extend_from_slice(&len.to_le_bytes());
    out.extend_from_slice(&octets[..usize::from(len)]);
}

fn write_fate(out: &mut Vec<u8>, frame: FrameNo, fate: Fate, latency_ns: u32) {
    out.extend_from_slice(&frame.0.to_le_bytes());
    out.push(match fate {
        Fate::Answered(code) => code as u8,
        other => 16 + place(&FATES, &other),
    });
    out.extend_from_slice(&latency_ns.to_le_bytes());
}

fn heard<'a>(origin: Origin, from: &mut Cursor<'a>) -> Option<AckRecord<'a>> {
    let (at, len) = (from.time()?, from.u16()?);
    Some(AckRecord::Heard(origin, at, from.slice(usize::from(len))?))
}

/// How a group stands, as viewers have it: a number that the schema names.
pub(super) fn standing_number(standing: HealthState) -> u8 {
    place(&STANDINGS, &standing)
}

/// How a group stands that has that number; `None` for none.
pub(crate) fn standing_of(number: u8) -> Option<HealthState> {
    STANDINGS.get(usize::from(number)).copied()
}

/// The words of these numbers, from 0.
pub(super) fn standing_words() -> impl Iterator<Item = String> {
    STANDINGS.iter().map(ToString::to_string)
}

/// How long after a frame was handed over its reply came, nanoseconds, as [`AckRecord::Fate`] has it.
pub(crate) fn latency_ns(sent: Option<MonoTime>, received: MonoTime) -> u32 {
    sent.map_or(0, |sent| u32::try_from(nanos(received.since(sent))).unwrap_or(u32::MAX))
}
