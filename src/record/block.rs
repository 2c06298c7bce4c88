//! Ticks as they come, on their way into a block.

use prost::Message as _;

use super::chunk::{Chunk, TickHead};
use super::columns::ColumnSet;
use super::full::{Lane, OF_FRAME, Sent};
use super::seat::{FrameKind, ReadFrame, RecordedSeat};
use crate::motion::MAX_AXES;
use crate::state::State;
use crate::time::MonoTime;
use crate::wire::{MAX_LEN, MotionRequest, PerAxis, Timing};

/// Ticks that become a block. Its memory is used again for the next.
#[derive(Debug, Default)]
pub(crate) struct Block {
    first: Option<MonoTime>,
    ticks: usize,
    /// When the last tick woke, µs.
    woken: u64,
    columns: ColumnSet,
    lanes: Vec<LaneWriter>,
}

#[derive(Debug, Default)]
struct LaneWriter {
    frames: usize,
    fields: ColumnSet,
    positions: ColumnSet,
    asked: ColumnSet,
    vibration: ColumnSet,
    raw: Vec<u8>,
}

impl Block {
    /// Adds a tick. Gives the block before it where that is full.
    pub(crate) fn add(&mut self, chunk: &Chunk<'_>, seats: &[RecordedSeat]) -> Option<(MonoTime, Vec<u8>)> {
        let full = self.begin(chunk, seats.len());
        for frame in chunk.frames() {
            if let Some(seat) = seats.get(frame.lane) {
                self.frame(&seat.read(frame), seat);
            }
        }
        full
    }

    /// A tick of so many lanes begins. Gives the block before it where that is full.
    pub(super) fn begin(&mut self, chunk: &Chunk<'_>, lanes: usize) -> Option<(MonoTime, Vec<u8>)> {
        const LONGEST_NS: u128 = 500_000_000;
        let TickHead { index, deadline, late_ns, missed, film, state } = chunk.head;
        let is_full = self
            .first
            .is_some_and(|first| deadline.since(first).as_nanos() >= LONGEST_NS || deadline < first);
        let full = if is_full { self.close() } else { None };
        self.first.get_or_insert(deadline);
        let state = State::ALL.iter().position(|one| *one == state).unwrap_or_default() as i64;
        let [index, due, late, missed] =
            [index, deadline.as_nanos(), late_ns / 1_000, missed].map(u64::cast_signed);
        let row = [index, due, late, missed, film.as_nanos(), state, chunk.dropped.into()];
        self.columns.push(self.ticks, &row);
        self.lanes.resize_with(lanes, LaneWriter::default);
        self.woken = (deadline.as_nanos() / 1_000).wrapping_add(late_ns / 1_000);
        self.ticks += 1;
        full
    }

    /// Adds a frame of that tick.
    pub(super) fn frame(&mut self, read: &ReadFrame<'_>, seat: &RecordedSeat) {
        let (tick, woken) = (self.ticks as i64 - 1, self.woken);
        if let Some(lane) = self.lanes.get_mut(read.frame.lane) {
            lane.push(read, seat, tick, woken);
        }
    }

    /// Gives what there is, and the instant of its first tick.
    pub(crate) fn close(&mut self) -> Option<(MonoTime, Vec<u8>)> {
        let first = self.first.take()?;
        let lane = |(lane, writer): (usize, &mut LaneWriter)| (writer.frames > 0).then(|| writer.take(lane));
        let lanes = self.lanes.iter_mut().enumerate().filter_map(lane).collect();
        let ticks = count(std::mem::take(&mut self.ticks));
        Some((first, Sent { ticks, tick_columns: self.columns.take(), lanes }.encode_to_vec()))
    }
}

fn count(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}

impl LaneWriter {
    /// Adds a frame of that tick, which woke at `woken`, µs.
    fn push(&mut self, read: &ReadFrame<'_>, seat: &RecordedSeat, tick: i64, woken: u64) {
        let ReadFrame { frame, asked: wanted, motion } = read;
        let asked = &frame.asked;
        let after = (frame.at.as_nanos() / 1_000).wrapping_sub(woken).cast_signed();
        #[expect(clippy::cast_possible_truncation, reason = "a chunk has it in so many bits")]
        let (level, handed) = (i64::from((asked.level as f32).to_bits()), frame.handed as i64);
        let request =
            motion.as_ref().and_then(|motion| whole(seat.frames, motion.request.as_ref()?, frame.datagram));
        let in_raw = if request.is_some() { 0 } else { frame.datagram.len() as i64 + 1 };
        let of_all = [tick, after, handed, asked.slots as i64, level, asked.clamps.cast_signed(), in_raw];
        let mut all = [0; OF_FRAME];
        all[..of_all.len()].copy_from_slice(&of_all);
        let told = request.map_or(of_all.len(), |request| {
            all[of_all.len()..].copy_from_slice(&fields(request));
            OF_FRAME
        });
        let row = self.frames;
        self.frames += 1;
        self.fields.push(row, &all[..told]);
        let sent = read.sent();
        let farther = |axis: usize| {
            let geometry = &seat.axes()[axis];
            geometry.pulses(wanted[axis]) - sent.get(axis).map_or(0, |place| geometry.pulses(*place))
        };
        self.asked.push(row, &PerAxis::from_fn(wanted.len(), farther));
        let Some(request) = request else {
            self.raw.extend_from_slice(frame.datagram);
            return;
        };
        let positions = &request.positions;
        self.positions.push(row, &PerAxis::from_fn(positions.len(), |axis| positions[axis].0.into()));
        let mut shakes = [[0; 2]; MAX_AXES];
        let shaken = request.vibration.map_or(0, |all| all.len());
        for (shake, one) in shakes.iter_mut().zip(request.vibration.iter().flat_map(|all| all.iter())) {
            *shake = [one.period.into(), one.amplitude.into()];
        }
        self.vibration.push(row, shakes[..shaken].as_flattened());
    }

    fn take(&mut self, lane: usize) -> Lane {
        Lane {
            lane: count(lane),
            frames: count(std::mem::take(&mut self.frames)),
            frame_columns: self.fields.take(),
            positions: self.positions.take(),
            asked: self.asked.take(),
            vibration: self.vibration.take(),
            raw: std::mem::take(&mut self.raw),
        }
    }
}

/// The fields of a datagram, where these make it again.
fn whole<'a>(kind: FrameKind, request: &'a MotionRequest, datagram: &[u8]) -> Option<&'a MotionRequest> {
    let FrameKind::Datagram(port) = kind else { return None };
    (request.emit_as(port, &mut [0; MAX_LEN]) == datagram).then_some(request)
}

/// As they stand behind what is known of every frame.
fn fields(request: &MotionRequest) -> [i64; 10] {
    [
        request.frame.0.into(),
        (request.timing == Timing::Absolute).into(),
        request.channel.into(),
        request.accept.0.into(),
        request.reply.0.into(),
        request.time_ms.into(),
        request.outputs.into(),
        request.extend.into(),
        request.positions.len() as i64,
        request.vibration.is_some().into(),
    ]
}
