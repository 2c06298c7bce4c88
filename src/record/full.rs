//! Every tick and every frame, in blocks of half a second: protobuf with a column for each field. A block gives back the chunks that
//! it was made of, each datagram bit for bit; instants to the microsecond.
//!
//! A frame that its fields do not make again is kept octet by octet, as are poses for links.

use prost::Message as _;

use super::chunk::{Asked, ChunkWriter, Handed, SentFrame, TickHead, longest_frame};
use super::columns::{Column, ColumnReaders};
use super::seat::{FrameKind, RecordedSeat};
use crate::motion::{MAX_AXES, Pulses};
use crate::state::State;
use crate::time::{MonoTime, ShowTime};
use crate::wire::{Code, FrameNo, MAX_LEN, MotionRequest, PerAxis, Timing, Vibration};

/// Ticks of a block, and frames of a lane in it: five seconds at the highest rate. More are damage.
const MOST: usize = 5_000;
/// Numbers of a tick: index, deadline ns, lateness µs, missed, film ns, state, dropped.
const OF_TICK: usize = 7;
/// Numbers of a frame, in the order of `FrameFields`.
pub(super) const OF_FRAME: usize = 17;

/// The numbers of a frame that a motion is made of: tick, what the kernel said, axes asked for, octets in `raw`, absolute Time, Time, positions.
const OF_MOTION: [bool; OF_FRAME] = {
    let mut wanted = [false; OF_FRAME];
    let mut at = [0, 2, 3, 6, 8, 12, 15].as_slice();
    while let [first, rest @ ..] = at {
        wanted[*first] = true;
        at = rest;
    }
    wanted
};

/// Half a second of ticks: `kinocue.Sent`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Sent {
    /// How many ticks.
    #[prost(uint32, tag = "1")]
    pub(super) ticks: u32,
    /// Index, deadline in ns, lateness in µs, ticks missed, show time in ns, number of the state, ticks dropped.
    #[prost(message, repeated, tag = "2")]
    pub(super) tick_columns: Vec<Column>,
    /// Lanes that had frames.
    #[prost(message, repeated, tag = "3")]
    pub(super) lanes: Vec<Lane>,
}

/// The frames of a lane: `kinocue.Lane`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Lane {
    /// Its place among the seats of the metadata.
    #[prost(uint32, tag = "1")]
    pub(super) lane: u32,
    /// How many frames.
    #[prost(uint32, tag = "2")]
    pub(super) frames: u32,
    /// Place of its tick in the block, instant in µs after the deadline and the lateness, what the kernel said, axes asked for, level as bits of a
    /// float, clamps, 1 and octets in `raw`, number, 1 for absolute Time, channel, accept, reply, Time in ms, outputs, Extend, positions,
    /// 1 with vibration.
    #[prost(message, repeated, tag = "3")]
    pub(super) frame_columns: Vec<Column>,
    /// Where each slot was sent, pulses.
    #[prost(message, repeated, tag = "4")]
    pub(super) positions: Vec<Column>,
    /// How much farther each axis was asked, pulses.
    #[prost(message, repeated, tag = "5")]
    pub(super) asked: Vec<Column>,
    /// Vibration of each slot: period in 0.125 ms, and amplitude in pulses, by turns.
    #[prost(message, repeated, tag = "6")]
    pub(super) vibration: Vec<Column>,
    /// Frames that the columns do not make.
    #[prost(bytes = "vec", tag = "7")]
    pub(super) raw: Vec<u8>,
}

/// The chunks of a block, one behind the other, with the frames of one lane or of all; `None` where it is none.
pub(crate) fn unpack(block: &[u8], seats: &[RecordedSeat], only: Option<usize>) -> Option<Vec<u8>> {
    let sent = Sent::decode(block).ok()?;
    let mut lanes = lanes(&sent, seats, only)?;
    let mut columns = ColumnReaders::new(&sent.tick_columns);
    let mut chunks = Vec::new();
    for tick in 0..ticks(&sent)? {
        let (head, dropped) = next_head(&mut columns)?;
        let frames: Vec<OwnedFrame> =
            lanes.iter_mut().flat_map(|lane| std::iter::from_fn(|| lane.next(tick, &head))).collect();
        let room = frames.iter().map(|frame| longest_frame(MAX_AXES, frame.datagram.len())).sum();
        let mut writer = ChunkWriter::with_room(room);
        frames.iter().for_each(|frame| writer.frame(&frame.as_sent()));
        chunks.extend_from_slice(writer.close(&head, dropped)?);
    }
    all_taken(&lanes).then_some(chunks)
}

/// Ticks of a block, and where each seat was sent: all that a measure needs, without a frame made.
#[derive(Debug)]
pub(crate) struct BlockMotions {
    /// Each tick, how many were dropped before it, and where its motions end.
    pub(super) ticks: Vec<(TickHead, u32, usize)>,
    /// In the order of the ticks.
    pub(super) motions: Vec<SeatMotion>,
}

/// A motion of a seat.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeatMotion {
    pub(super) lane: usize,
    pub(super) handed: Handed,
    /// True where a tick asked for it.
    pub(super) is_asked: bool,
    /// Where to, and its Time; none where its octets are no frame.
    pub(super) to: Option<(PerAxis<f64>, Timing, u32)>,
}

impl BlockMotions {
    /// The ticks.
    pub(crate) fn heads(&self) -> impl Iterator<Item = &TickHead> {
        self.ticks.iter().map(|(head, ..)| head)
    }
}

/// The motions of a block; `None` where it is none.
pub(super) fn motions(block: &[u8], seats: &[RecordedSeat]) -> Option<BlockMotions> {
    let sent = Sent::decode(block).ok()?;
    let mut lanes = lanes(&sent, seats, None)?;
    let mut columns = ColumnReaders::new(&sent.tick_columns);
    let mut block = BlockMotions { ticks: Vec::new(), motions: Vec::new() };
    for tick in 0..ticks(&sent)? {
        let (head, dropped) = next_head(&mut columns)?;
        for lane in &mut lanes {
            block.motions.extend(std::iter::from_fn(|| lane.next_motion(tick)));
        }
        block.ticks.push((head, dropped, block.motions.len()));
    }
    all_taken(&lanes).then_some(block)
}

fn ticks(sent: &Sent) -> Option<usize> {
    usize::try_from(sent.ticks).ok().filter(|ticks| *ticks <= MOST)
}

fn lanes<'a>(sent: &'a Sent, seats: &'a [RecordedSeat], only: Option<usize>) -> Option<Vec<LaneReader<'a>>> {
    let is_sorted = sent.lanes.is_sorted_by(|one, other| one.lane < other.lane);
    let is_wanted = |lane: &&Lane| is_sorted && only.is_none_or(|only| only == lane.lane as usize);
    sent.lanes.iter().filter(is_wanted).map(|lane| LaneReader::new(lane, seats)).collect()
}

/// The next tick, and how many were dropped before it.
fn next_head(columns: &mut ColumnReaders<'_>) -> Option<(TickHead, u32)> {
    let [index, deadline, late, missed, film, state, dropped] = columns.next::<OF_TICK>();
    let head = TickHead {
        index: index.cast_unsigned(),
        deadline: MonoTime::from_nanos(deadline.cast_unsigned()),
        late_ns: late.cast_unsigned().saturating_mul(1_000),
        missed: missed.cast_unsigned(),
        film: ShowTime::from_nanos(film),
        state: *State::ALL.get(usize::try_from(state).ok()?)?,
    };
    Some((head, u32::try_from(dropped).ok()?))
}

/// What no tick took was of none.
fn all_taken(lanes: &[LaneReader<'_>]) -> bool {
    lanes.iter().all(|lane| lane.left == 0 && !lane.is_damaged)
}

/// A frame out of a block.
struct OwnedFrame {
    lane: usize,
    at: MonoTime,
    handed: Handed,
    asked: Asked,
    datagram: Vec<u8>,
}

impl OwnedFrame {
    fn as_sent(&self) -> SentFrame<'_> {
        let Self { lane, at, handed, asked, ref datagram } = *self;
        SentFrame { lane, at, handed, asked, datagram }
    }
}

/// Takes frames out of a lane, tick by tick.
struct LaneReader<'a> {
    lane: usize,
    seat: &'a RecordedSeat,
    left: u32,
    is_damaged: bool,
    next: Option<[i64; OF_FRAME]>,
    fields: ColumnReaders<'a>,
    positions: ColumnReaders<'a>,
    asked: ColumnReaders<'a>,
    vibration: ColumnReaders<'a>,
    raw: &'a [u8],
}

impl<'a> LaneReader<'a> {
    fn new(lane: &'a Lane, seats: &'a [RecordedSeat]) -> Option<Self> {
        let index = usize::try_from(lane.lane).ok()?;
        (lane.frames as usize <= MOST).then_some(())?;
        Some(Self {
            lane: index,
            seat: seats.get(index)?,
            left: lane.frames,
            is_damaged: false,
            next: None,
            fields: ColumnReaders::new(&lane.frame_columns),
            positions: ColumnReaders::new(&lane.positions),
            asked: ColumnReaders::new(&lane.asked),
            vibration: ColumnReaders::new(&lane.vibration),
            raw: &lane.raw,
        })
    }

    /// The fields of the next frame, if it is of that tick.
    fn next_fields(&mut self, tick: usize, wanted: [bool; OF_FRAME]) -> Option<[i64; OF_FRAME]> {
        if self.next.is_none() && self.left > 0 {
            self.next = Some(self.fields.next_of(wanted));
        }
        let fields = self.next.take_if(|fields| usize::try_from(fields[0]).is_ok_and(|of| of <= tick))?;
        self.left -= 1;
        Some(fields)
    }

    /// The next motion, if it is of that tick.
    fn next_motion(&mut self, tick: usize) -> Option<SeatMotion> {
        let fields = self.next_fields(tick, OF_MOTION)?;
        let motion = self.motion(&fields);
        self.is_damaged |= motion.is_none();
        motion
    }

    fn motion(&mut self, fields: &[i64; OF_FRAME]) -> Option<SeatMotion> {
        let positions: [i64; MAX_AXES] = self.positions.next();
        let [_, _, handed, slots, _, _, raw, _, absolute, .., time_ms, _, _, axes, _] = *fields;
        let to = if raw == 0 {
            matches!(self.seat.frames, FrameKind::Datagram(_)).then_some(())?;
            let axes = usize::try_from(axes).ok().filter(|axes| *axes <= MAX_AXES)?;
            let mut pulses = [Pulses(0); MAX_AXES];
            for (to, at) in pulses.iter_mut().zip(&positions[..axes]) {
                *to = Pulses(i32::try_from(*at).ok()?);
            }
            let timing = if absolute == 0 { Timing::Relative } else { Timing::Absolute };
            Some((self.seat.measured(&pulses[..axes]), timing, u32::try_from(time_ms).ok()?))
        } else {
            let datagram = self.raw(raw)?;
            self.seat.motion_of(datagram).map(|motion| (motion.places, motion.timing, motion.time_ms))
        };
        let handed = *Handed::ALL.get(usize::try_from(handed).ok()?)?;
        Some(SeatMotion { lane: self.lane, handed, is_asked: slots != 0, to })
    }

    /// The octets of a frame that its fields do not make; they are 1 and as many as that.
    fn raw(&mut self, count: i64) -> Option<&'a [u8]> {
        let (octets, rest) = self.raw.split_at_checked(usize::try_from(count.wrapping_sub(1)).ok()?)?;
        self.raw = rest;
        Some(octets)
    }

    /// The next frame, if it is of that tick.
    fn next(&mut self, tick: usize, head: &TickHead) -> Option<OwnedFrame> {
        let fields = self.next_fields(tick, [true; OF_FRAME])?;
        let frame = self.frame(&fields, head);
        self.is_damaged |= frame.is_none();
        frame
    }

    fn frame(&mut self, fields: &[i64; OF_FRAME], head: &TickHead) -> Option<OwnedFrame> {
        let datagram = self.datagram(fields)?;
        let [_, after, handed, slots, level, clamps, ..] = *fields;
        let woken = (head.deadline.as_nanos() / 1_000).saturating_add(head.late_ns / 1_000);
        let at = woken.saturating_add_signed(after).saturating_mul(1_000);
        let mut frame = OwnedFrame {
            lane: self.lane,
            at: MonoTime::from_nanos(at),
            handed: *Handed::ALL.get(usize::try_from(handed).ok()?)?,
            asked: Asked {
                slots: usize::try_from(slots).ok().filter(|slots| *slots <= MAX_AXES)?,
                level: f32::from_bits(u32::try_from(level).ok()?).into(),
                clamps: clamps.cast_unsigned(),
                ..Asked::NOTHING
            },
            datagram,
        };
        let farther: [i64; MAX_AXES] = self.asked.next();
        if slots > 0 {
            let sent = self.seat.sent(&frame.as_sent());
            let wanted = |(axis, geometry): (usize, &super::seat::RecordedAxis)| {
                let sent = sent.get(axis).map_or(0, |place| geometry.pulses(*place));
                as_place(sent.wrapping_add(farther[axis])) * geometry.pulse
            };
            frame.asked.pose =
                self.seat.pose(&self.seat.axes().iter().enumerate().map(wanted).collect::<Vec<_>>());
        }
        Some(frame)
    }

    fn datagram(&mut self, fields: &[i64; OF_FRAME]) -> Option<Vec<u8>> {
        let positions: [i64; MAX_AXES] = self.positions.next();
        let vibration: [i64; 2 * MAX_AXES] = self.vibration.next();
        if fields[6] != 0 {
            return self.raw(fields[6]).map(<[u8]>::to_vec);
        }
        let FrameKind::Datagram(port) = self.seat.frames else { return None };
        let [frame, absolute, channel, accept, reply, time_ms, outputs, extend, axes, shakes] =
            *fields.last_chunk::<10>()?;
        let axes = usize::try_from(axes).ok().filter(|axes| *axes <= MAX_AXES)?;
        let u16 = |number: i64| u16::try_from(number).ok();
        let shake = |axis: usize| {
            Some(Vibration { period: u16(vibration[2 * axis])?, amplitude: u16(vibration[2 * axis + 1])? })
        };
        let shakes = (shakes != 0).then(|| (0..axes).map(shake).collect::<Option<Vec<_>>>());
        let positions = positions[..axes].iter().map(|at| i32::try_from(*at).ok().map(Pulses));
        let request = MotionRequest {
            timing: if absolute == 0 { Timing::Relative } else { Timing::Absolute },
            channel: u16(channel)?,
            accept: Code(u16(accept)?),
            reply: Code(u16(reply)?),
            frame: FrameNo(u32::try_from(frame).ok()?),
            time_ms: u32::try_from(time_ms).ok()?,
            positions: PerAxis::new(&positions.collect::<Option<Vec<_>>>()?),
            outputs: u16(outputs)?,
            extend: u32::try_from(extend).ok()?,
            vibration: shakes
                .map(|all| all.map(|all| PerAxis::new(&all)))
                .map_or(Some(None), |all| all.map(Some))?,
        };
        Some(request.emit_as(port, &mut [0; MAX_LEN]).to_vec())
    }
}

#[expect(clippy::cast_precision_loss, reason = "pulses of a stroke")]
fn as_place(pulses: i64) -> f64 {
    pulses as f64
}
