//! One drain of the ack thread as it crosses to the recorder: what was heard and told of frames, in the order in which books, observer
//! and health took it, and what they made of it. All numbers are little-endian.

use rtrb::{Consumer, Producer, RingBuffer};

use super::AckRecord;
use super::cursor::Cursor;
use super::tap::DroppedAtEnd;
use crate::health::HealthState;
use crate::motion::{MAX_AXES, Pulses};
use crate::time::{MonoTime, Rate};
use crate::wire::{FrameNo, PerAxis};

/// Octets of a head: length and records dropped before it u32, the instant u64, whether the drain is over u8.
const HEAD_LEN: usize = 17;
/// Octets that are put together before they cross; of a drain that needs more the rest crosses by itself.
const ROOM: usize = 32 << 10;
/// Octets of a reply and of its fate, with some of what comes beside them.
const PER_FRAME: usize = 64;
/// Seconds of drains that the ring holds: a disk may take so long.
const HELD_S: f64 = 2.0;

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
    at_end: DroppedAtEnd,
    told: Vec<AckStanding>,
}

impl Drop for AckTap {
    fn drop(&mut self) {
        self.at_end.put(self.dropped);
    }
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
    (AckTap { ring, octets, records: 0, dropped: 0, at_end: DroppedAtEnd::default(), told }, end)
}

impl AckTap {
    /// What is lost at its end.
    pub(super) fn at_end(&self) -> DroppedAtEnd {
        self.at_end.clone()
    }

    /// The next frame of each controller has that number: so far nothing was taken.
    pub(crate) fn begin(&mut self, firsts: &[FrameNo]) {
        for (controller, first) in firsts.iter().enumerate() {
            self.take(&AckRecord::First(controller, *first));
        }
    }

    /// So many records were lost before they came here.
    pub(crate) const fn lose(&mut self, records: u32) {
        self.dropped = self.dropped.saturating_add(records);
    }

    /// Takes what comes next.
    pub(crate) fn take(&mut self, record: &AckRecord<'_>) {
        let len = match record {
            AckRecord::Heard(_, _, octets) => 17 + octets.len(),
            _ => 16 + 4 * MAX_AXES,
        };
        if self.octets.len() + len > ROOM {
            // The instant is that of the drain, which is not over.
            self.post(None);
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
        self.post(Some(began));
    }

    fn post(&mut self, drained: Option<MonoTime>) {
        let Self { ring, octets, records, dropped, .. } = self;
        let len = octets.len();
        write_head(octets, len, *dropped, drained);
        // The instant of a drain counts as a record, so that none is lost unseen.
        let is_posted = ring.push_entire_slice(octets).is_ok();
        *dropped = if is_posted { 0 } else { dropped.saturating_add(*records).saturating_add(1) };
        *records = 0;
        octets.truncate(HEAD_LEN);
    }
}

fn write_head(octets: &mut [u8], len: usize, dropped: u32, drained: Option<MonoTime>) {
    octets[..4].copy_from_slice(&u32::try_from(len).unwrap_or_default().to_le_bytes());
    octets[4..8].copy_from_slice(&dropped.to_le_bytes());
    octets[8..16].copy_from_slice(&drained.unwrap_or_default().as_nanos().to_le_bytes());
    octets[16] = u8::from(drained.is_some());
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

    /// Writes one with these records.
    pub(super) fn write(
        out: &mut Vec<u8>,
        dropped: u32,
        drained: Option<MonoTime>,
        records: &[AckRecord<'_>],
    ) {
        let from = out.len();
        out.resize(from + HEAD_LEN, 0);
        records.iter().for_each(|record| record.write(out));
        let len = out.len() - from;
        write_head(&mut out[from..], len, dropped, drained);
    }

    /// The same with other records, which `write` makes of these.
    pub(super) fn rewritten(&self, out: &mut Vec<u8>, mut write: impl FnMut(&AckRecord<'_>, &mut Vec<u8>)) {
        let from = out.len();
        out.resize(from + HEAD_LEN, 0);
        self.records().for_each(|record| write(&record, out));
        let len = out.len() - from;
        write_head(&mut out[from..], len, self.dropped, self.drained);
    }

    /// What it took, in that order; less where it is damaged.
    pub(crate) fn records(&self) -> impl Iterator<Item = AckRecord<'a>> + use<'a> {
        let mut from = Cursor(self.body);
        std::iter::from_fn(move || AckRecord::read(&mut from))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::belief::Fall;
    use crate::health::{Continuity, HealthInput, Identity, Sighting};
    use crate::net::Origin;
    use crate::observe::{Look, StopSign};
    use crate::tracker::{Fate, Reply};
    use crate::wire::ReplyCode;

    const AT: MonoTime = MonoTime::from_nanos(7_000_000_001);

    #[test]
    fn what_health_was_told_reads_as_it_was() {
        use HealthInput::{
            Alive, Ambiguous, Answered, BeatKept, BeatSent, Count, Counted, FellOut, Homed, Joined, Killed,
            LookAnew, LostZero, Moved, OtherAxes, OtherSent, Outside, Part, Pushed, ReadSent, Refused, Seen,
            Wide, Zero,
        };
        let (mut tap, mut ring) = ack_tap(3, Rate::from_hz(100.0));
        let identity = Identity { version: 7, minor_version: 8, work_mode: 2, axes: 3 };
        let sighting = |continuity| Sighting { identity, error: 11, alarm: 12, continuity, homed: true };
        let inputs = [
            Part(1, true),
            Refused(2),
            Alive(0, AT),
            Answered(1, AT),
            ReadSent(1, 3),
            OtherSent(1, 70_000),
            BeatSent(2, AT),
            BeatKept(2, AT),
            Zero(1, false),
            Killed(1, 3, 513),
            LostZero(2),
            Wide(0),
            Seen(1, sighting(Continuity::Packets(65_535)), AT),
            Seen(1, sighting(Continuity::Answers), AT),
            Seen(1, sighting(Continuity::Mark), AT),
            OtherAxes(1, 6),
            Count(1, 40_000),
            Counted(2),
            Moved(1),
            FellOut(1, Fall::Stale),
            Outside(1, Some((5, Pulses(-3)))),
            Outside(1, None),
            Pushed(1, Some(crate::health::Pushed { axis: 2, at: 1_400, held: -200 })),
            Pushed(1, None),
            Ambiguous(1, true),
            Homed(1),
            Joined(1),
            LookAnew(2),
        ];
        let records = inputs.map(AckRecord::Health);
        records.iter().for_each(|record| tap.take(record));
        tap.drained(AT);
        let held = take(&mut ring);
        assert_eq!(read(&held)[0].2, records);
    }

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
            AckRecord::Posted(64, 2, FrameNo(7)),
            AckRecord::First(1, FrameNo(1)),
            AckRecord::Watched,
            AckRecord::Events,
            AckRecord::Judged,
            AckRecord::Code(1, ReplyCode::EmergencyStop, AT),
            AckRecord::Look(1, Look { stop: StopSign::Held, inputs: Some(513) }, AT),
            AckRecord::Failed(1, FrameNo(3)),
            AckRecord::Skipped(1, FrameNo(9)),
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
