//! One drain of the ack thread as it crosses to the recorder: what was heard and told of frames, in the order in which books, observer
//! and health took it, and what they made of it. All numbers are little-endian.

use std::net::{Ipv4Addr, SocketAddrV4};

use rtrb::{Consumer, Producer, RingBuffer};

use super::cursor::Cursor;
use crate::belief::Fall;
use crate::health::HealthState;
use crate::motion::{MAX_AXES, Pulses};
use crate::net::Origin;
use crate::time::{MonoTime, Rate, nanos};
use crate::tracker::{Fate, Reply};
use crate::wire::{FrameNo, PerAxis, ReplyCode};

/// Octets of a head: length and records dropped before it u32, the instant u64, whether the drain is over u8.
const HEAD_LEN: usize = 17;
/// Octets that are put together before they cross; of a drain that needs more the rest crosses by itself.
const ROOM: usize = 32 << 10;
/// Octets of a reply and of its fate, with some of what comes beside them.
const PER_FRAME: usize = 64;
/// Seconds of drains that the ring holds: a disk may take so long.
const HELD_S: f64 = 2.0;

const FATES: [Fate; 3] = [Fate::Duplicate, Fate::Stale, Fate::Stray];
const FALLS: [Fall; 5] = [Fall::Gap, Fall::Astray, Fall::PutBack, Fall::Stale, Fall::Stopped];
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
    /// The books have the records of so many frames more, in the order in which these were handed over.
    Posted(u32),
    /// The kernel did not take that frame of a controller.
    Failed(usize, FrameNo),
    /// The lane of a controller is where the others are again.
    Joined(usize),
    /// Nothing goes to the lane of a controller any more; and the amplitude with which its seat may vibrate on, strokes.
    FellOut(usize, Fall, f64),
    /// Not all axes of a controller that was found tell where they are.
    Unread(usize),
    /// A link confirms the frames of a controller from the one to the other.
    Confirmed(usize, FrameNo, FrameNo),
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
}

/// How a controller stands when a drain is over.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AckStanding {
    /// Frames that were lost.
    pub(crate) lost: u64,
    /// How often its port was found closed.
    pub(crate) closed: u64,
    /// Where its axes were measured to be last.
    pub(crate) measured: Option<(MonoTime, PerAxis<Pulses>)>,
    /// How its group stands.
    pub(crate) standing: Option<HealthState>,
}

/// Copies what the ack thread takes. Never waits, never allocates: what finds no room is lost, and the next says how much.
#[derive(Debug)]
pub struct AckTap {
    ring: Producer<u8>,
    octets: Vec<u8>,
    /// Records in `octets`.
    records: u32,
    /// Records lost since the last that found room.
    dropped: u32,
    told: Vec<AckStanding>,
}

/// A tap of so many controllers, of each of which `rate` frames a second may be answered, and the end from which its chunks are read.
#[must_use]
pub fn ack_tap(controllers: usize, rate: Rate) -> (AckTap, Consumer<u8>) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a thousand a second")]
    let frames = (rate.hz() * HELD_S).ceil() as usize * controllers;
    let (ring, end) = RingBuffer::new(PER_FRAME * frames + 2 * ROOM);
    let mut octets = Vec::with_capacity(ROOM);
    octets.resize(HEAD_LEN, 0);
    let told = vec![AckStanding::default(); controllers];
    (AckTap { ring, octets, records: 0, dropped: 0, told }, end)
}

impl AckTap {
    /// Takes what comes next.
    pub(crate) fn take(&mut self, record: &AckRecord<'_>) {
        let len = match record {
            AckRecord::Heard(_, _, octets) => 17 + octets.len(),
            _ => 16 + 4 * MAX_AXES,
        };
        if self.octets.len() + len > ROOM {
            // The instant is that of the drain, which is not over.
            self.post(MonoTime::default(), false);
        }
        if self.octets.len() + len <= ROOM {
            record.write(&mut self.octets);
            self.records += 1;
        } else {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// Takes what has changed of how a controller stands.
    pub(crate) fn stands(&mut self, controller: usize, now: AckStanding) {
        let Some(told) = self.told.get_mut(controller) else { return };
        let before = std::mem::replace(told, now);
        if before.lost != now.lost {
            self.take(&AckRecord::Lost(controller, now.lost));
        }
        if before.closed != now.closed {
            self.take(&AckRecord::Closed(controller, now.closed));
        }
        if let Some((at, pulses)) = now.measured.filter(|_| before.measured != now.measured) {
            self.take(&AckRecord::Measured(controller, at, pulses));
        }
        if let Some(standing) = now.standing.filter(|_| before.standing != now.standing) {
            self.take(&AckRecord::Standing(controller, standing));
        }
    }

    /// A drain that began at `began` is over: up to that instant all was told.
    pub(crate) fn drained(&mut self, began: MonoTime) {
        self.post(began, true);
    }

    fn post(&mut self, at: MonoTime, is_over: bool) {
        let Self { ring, octets, records, dropped, .. } = self;
        let len = u32::try_from(octets.len()).unwrap_or_default();
        octets[..4].copy_from_slice(&len.to_le_bytes());
        octets[4..8].copy_from_slice(&dropped.to_le_bytes());
        octets[8..16].copy_from_slice(&at.as_nanos().to_le_bytes());
        octets[16] = u8::from(is_over);
        // The instant of a drain counts as a record, so that none is lost unseen.
        let is_posted = ring.push_entire_slice(octets).is_ok();
        *dropped = if is_posted { 0 } else { dropped.saturating_add(*records).saturating_add(1) };
        *records = 0;
        octets.truncate(HEAD_LEN);
    }
}

/// Some of what a drain took, or all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AckChunk<'a> {
    /// When the drain began; `None` where it is not over.
    pub(crate) drained: Option<MonoTime>,
    /// Records before it that found no room.
    pub(crate) dropped: u32,
    body: &'a [u8],
}

impl<'a> AckChunk<'a> {
    /// Reads the first of some chunks, and gives what is behind it; `None` where there is no whole one.
    pub(crate) fn parse(octets: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let len = u32::from_le_bytes(*octets.first_chunk()?);
        let (chunk, rest) = octets.split_at_checked(usize::try_from(len).ok()?)?;
        let mut from = Cursor(chunk.get(4..)?);
        let (dropped, at, is_over) = (from.u32()?, from.time()?, from.u8()? != 0);
        Some((Self { drained: is_over.then_some(at), dropped, body: from.0 }, rest))
    }

    /// What it took, in that order; less where it is damaged.
    pub(crate) fn records(&self) -> impl Iterator<Item = AckRecord<'a>> + use<'a> {
        let mut from = Cursor(self.body);
        std::iter::from_fn(move || AckRecord::read(&mut from))
    }
}

impl<'a> AckRecord<'a> {
    fn write(&self, out: &mut Vec<u8>) {
        match *self {
            Self::Reply(reply) => write_reply(out, reply),
            Self::Heard(origin, at, octets) => write_heard(out, origin, at, octets),
            Self::Posted(frames) => {
                out.push(3);
                out.extend_from_slice(&frames.to_le_bytes());
            }
            Self::Failed(controller, frame) => {
                of(out, 4, controller);
                out.extend_from_slice(&frame.0.to_le_bytes());
            }
            Self::Joined(controller) => of(out, 5, controller),
            Self::FellOut(controller, why, shakes) => {
                of(out, 6, controller);
                out.push(place(&FALLS, &why));
                out.extend_from_slice(&shakes.to_le_bytes());
            }
            Self::Unread(controller) => of(out, 7, controller),
            Self::Confirmed(controller, first, last) => {
                of(out, 8, controller);
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
        }
    }

    fn read(from: &mut Cursor<'a>) -> Option<Self> {
        let kind = from.u8()?;
        if kind == 2 {
            let ip = Ipv4Addr::from_octets(from.take()?);
            let origin = Origin::Stranger(SocketAddrV4::new(ip, from.u16()?));
            return heard(origin, from);
        }
        if kind == 3 {
            return from.u32().map(Self::Posted);
        }
        let controller = usize::from(from.u16()?);
        Some(match kind {
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
            _ => return None,
        })
    }
}

/// Begins a record that is of a controller.
fn of(out: &mut Vec<u8>, kind: u8, controller: usize) {
    out.push(kind);
    out.extend_from_slice(&u16::try_from(controller).unwrap_or(u16::MAX).to_le_bytes());
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

fn place<T: PartialEq>(all: &[T], one: &T) -> u8 {
    all.iter().position(|other| other == one).and_then(|at| u8::try_from(at).ok()).unwrap_or(u8::MAX)
}

/// How a group stands, as viewers have it: a number that the schema names.
pub(super) fn standing_number(standing: HealthState) -> u8 {
    place(&STANDINGS, &standing)
}

/// The words of these numbers, from 0.
pub(super) fn standing_words() -> impl Iterator<Item = String> {
    STANDINGS.iter().map(ToString::to_string)
}

/// How long after a frame was handed over its reply came, nanoseconds, as [`AckRecord::Fate`] has it.
pub(crate) fn latency_ns(sent: Option<MonoTime>, received: MonoTime) -> u32 {
    sent.map_or(0, |sent| u32::try_from(nanos(received.since(sent))).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const AT: MonoTime = MonoTime::from_nanos(7_000_000_001);

    fn read(octets: &[u8]) -> Vec<(Option<MonoTime>, u32, Vec<AckRecord<'_>>)> {
        let (mut rest, mut chunks) = (octets, Vec::new());
        while let Some((chunk, behind)) = AckChunk::parse(rest) {
            rest = behind;
            chunks.push((chunk.drained, chunk.dropped, chunk.records().collect()));
        }
        assert!(rest.is_empty());
        chunks
    }

    fn take(ring: &mut Consumer<u8>) -> Vec<u8> {
        let mut held = vec![0; ring.slots()];
        ring.pop_entire_slice(&mut held).unwrap();
        held
    }

    #[test]
    fn what_the_ack_thread_took_reads_as_it_was_in_its_order() {
        let (mut tap, mut ring) = ack_tap(3, Rate::from_hz(100.0));
        let reply = Reply {
            controller: 2,
            frame: FrameNo(u32::MAX),
            code: ReplyCode::Fault,
            error: 513,
            inputs: 5,
            at: AT,
        };
        let octets = [1, 2, 3];
        let stranger = Origin::Stranger("192.0.2.7:4711".parse().unwrap());
        let records = [
            AckRecord::Reply(reply),
            AckRecord::Heard(Origin::Controller(1), AT, &octets),
            AckRecord::Heard(stranger, AT, &[]),
            AckRecord::Posted(64),
            AckRecord::Failed(1, FrameNo(3)),
            AckRecord::Joined(1),
            AckRecord::FellOut(0, Fall::Stopped, 0.125),
            AckRecord::Unread(2),
            AckRecord::Confirmed(2, FrameNo(9), FrameNo(12)),
            AckRecord::Fate(2, FrameNo(3), Fate::Answered(ReplyCode::EmergencyStop), 1_234),
            AckRecord::Fate(2, FrameNo(4), Fate::Stray, 0),
            AckRecord::Lost(0, 1 << 40),
            AckRecord::Closed(0, 3),
            AckRecord::Measured(1, AT, PerAxis::new(&[Pulses(-1), Pulses(i32::MAX)])),
            AckRecord::Standing(2, HealthState::Unwatched),
        ];
        records.iter().for_each(|record| tap.take(record));
        tap.drained(AT);
        tap.drained(AT + std::time::Duration::from_millis(1));
        let held = take(&mut ring);
        let chunks = read(&held);
        assert_eq!(chunks[0], (Some(AT), 0, records.to_vec()));
        assert_eq!(
            (chunks.len(), chunks[1].2.len()),
            (2, 0),
            "a drain that heard nothing is one all the same"
        );
    }

    #[test]
    fn how_a_controller_stands_is_told_when_it_changes() {
        let (mut tap, mut ring) = ack_tap(1, Rate::from_hz(100.0));
        let one = AckStanding { lost: 1, standing: Some(HealthState::Ok), ..AckStanding::default() };
        [one, one, AckStanding { lost: 2, ..one }, one].iter().for_each(|now| tap.stands(0, *now));
        tap.drained(AT);
        let held = take(&mut ring);
        let told = [
            AckRecord::Lost(0, 1),
            AckRecord::Standing(0, HealthState::Ok),
            AckRecord::Lost(0, 2),
            AckRecord::Lost(0, 1),
        ];
        assert_eq!(read(&held)[0].2, told);
    }

    #[test]
    fn what_finds_no_room_is_counted_and_a_flood_takes_no_memory() {
        let (mut tap, mut ring) = ack_tap(1, Rate::from_hz(1.0));
        let room = tap.octets.capacity();
        let datagram = [0; 1_400];
        for _ in 0..1_000 {
            tap.take(&AckRecord::Heard(Origin::Controller(0), AT, &datagram));
        }
        tap.drained(AT);
        assert_eq!(tap.octets.capacity(), room);
        let held = take(&mut ring);
        let before: usize = read(&held).iter().map(|(.., records)| records.len()).sum();
        tap.drained(AT);
        let held = take(&mut ring);
        let chunks = read(&held);
        let (after, dropped) = (chunks[0].2.len(), chunks[0].1);
        // Chunks that were cut off in the middle of a drain count as a record each.
        let lost = 1_000 - before - after;
        assert!(
            (lost..lost + 60).contains(&usize::try_from(dropped).unwrap()),
            "{lost} lost, {dropped} told"
        );
        // One that is larger than all the room is lost by itself.
        tap.take(&AckRecord::Heard(Origin::Controller(0), AT, &[0; 40_000]));
        tap.take(&AckRecord::Joined(0));
        tap.drained(AT);
        let held = take(&mut ring);
        let last = read(&held).pop().unwrap();
        assert_eq!((last.1, last.2), (1, vec![AckRecord::Joined(0)]));
    }

    proptest! {
        #[test]
        fn no_octets_panic(octets in prop::collection::vec(any::<u8>(), 0..300)) {
            if let Some((chunk, _)) = AckChunk::parse(&octets) {
                chunk.records().count();
            }
            AckRecord::read(&mut Cursor(&octets));
        }
    }
}
