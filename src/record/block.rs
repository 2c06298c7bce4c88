//! Ticks as they come, on their way into a block.

use prost::Message as _;

use super::chunk::{Chunk, SentFrame, TickHead};
use super::columns::ColumnSet;
use super::full::{Lane, Sent};
use super::seat::{FrameKind, RecordedAxis, RecordedSeat};
use crate::state::State;
use crate::time::MonoTime;
use crate::wire::{MAX_LEN, MotionRequest, Timing};

/// Ticks that become a block. Its memory is used again for the next.
#[derive(Debug, Default)]
pub(crate) struct Block {
    first: Option<MonoTime>,
    ticks: usize,
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
        self.columns.push(self.ticks, row);
        self.lanes.resize_with(seats.len(), LaneWriter::default);
        let woken = (deadline.as_nanos() / 1_000).wrapping_add(late_ns / 1_000);
        for frame in chunk.frames() {
            if let (Some(lane), Some(seat)) = (self.lanes.get_mut(frame.lane), seats.get(frame.lane)) {
                lane.push(&frame, seat, self.ticks as i64, woken);
            }
        }
        self.ticks += 1;
        full
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
    fn push(&mut self, frame: &SentFrame<'_>, seat: &RecordedSeat, tick: i64, woken: u64) {
        let asked = &frame.asked;
        let after = (frame.at.as_nanos() / 1_000).wrapping_sub(woken).cast_signed();
        #[expect(clippy::cast_possible_truncation, reason = "a chunk has it in so many bits")]
        let (level, handed) = (i64::from((asked.level as f32).to_bits()), frame.handed as i64);
        let request = request(seat.frames, frame.datagram);
        let in_raw = if request.is_some() { 0 } else { frame.datagram.len() as i64 + 1 };
        let of_all = [tick, after, handed, asked.slots as i64, level, asked.clamps.cast_signed(), in_raw];
        let row = self.frames;
        self.frames += 1;
        self.fields.push(row, of_all.into_iter().chain(request.iter().flat_map(fields)));
        let wanted = seat.asked(asked);
        let sent = request.map_or_else(|| seat.sent(frame), |request| seat.measured(&request.positions));
        let farther = |(axis, (geometry, wanted)): (usize, (&RecordedAxis, &f64))| {
            geometry.pulses(*wanted) - sent.get(axis).map_or(0, |place| geometry.pulses(*place))
        };
        self.asked.push(row, seat.axes().iter().zip(wanted.iter()).enumerate().map(farther));
        let Some(request) = request else {
            self.raw.extend_from_slice(frame.datagram);
            return;
        };
        self.positions.push(row, request.positions.iter().map(|at| at.0.into()));
        let shakes = request.vibration.iter().flat_map(|all| all.iter());
        self.vibration.push(row, shakes.flat_map(|one| [one.period.into(), one.amplitude.into()]));
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
fn request(kind: FrameKind, datagram: &[u8]) -> Option<MotionRequest> {
    let FrameKind::Datagram(port) = kind else { return None };
    let request = MotionRequest::parse_as(port, datagram).ok()?;
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
