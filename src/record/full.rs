//! Every tick and every frame, in blocks of half a second: protobuf with a column for each field. A block gives back the chunks that
//! it was made of, each datagram bit for bit; instants to the microsecond.
//!
//! A frame that its fields do not make again is kept octet by octet, as are poses for links.

use prost::Message as _;

use super::chunk::{Asked, Chunk, ChunkWriter, Handed, SentFrame, TickHead, longest_frame};
use super::columns::{fold, unfold};
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
const OF_FRAME: usize = 17;

/// Half a second of ticks: `kinocue.Sent`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Sent {
    /// How many ticks.
    #[prost(uint32, tag = "1")]
    ticks: u32,
    /// Index, deadline in ns, lateness in µs, ticks missed, show time in ns, number of the state, ticks dropped.
    #[prost(message, repeated, tag = "2")]
    tick_columns: Vec<Column>,
    /// Lanes that had frames.
    #[prost(message, repeated, tag = "3")]
    lanes: Vec<Lane>,
}

/// The frames of a lane: `kinocue.Lane`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Lane {
    /// Its place among the seats of the metadata.
    #[prost(uint32, tag = "1")]
    lane: u32,
    /// How many frames.
    #[prost(uint32, tag = "2")]
    frames: u32,
    /// Place of its tick in the block, instant in µs after the deadline, what the kernel said, axes asked for, level as bits of a
    /// float, clamps, 1 and octets in `raw`, number, 1 for absolute Time, channel, accept, reply, Time in ms, outputs, Extend, positions,
    /// 1 with vibration.
    #[prost(message, repeated, tag = "3")]
    frame_columns: Vec<Column>,
    /// Where each slot was sent, pulses.
    #[prost(message, repeated, tag = "4")]
    positions: Vec<Column>,
    /// How much farther each axis was asked, pulses.
    #[prost(message, repeated, tag = "5")]
    asked: Vec<Column>,
    /// Vibration of each slot: period in 0.125 ms, and amplitude in pulses, by turns.
    #[prost(message, repeated, tag = "6")]
    vibration: Vec<Column>,
    /// Frames that the columns do not make.
    #[prost(bytes = "vec", tag = "7")]
    raw: Vec<u8>,
}

/// Second differences: `kinocue.Column`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Column {
    /// Those up to the last that is not 0.
    #[prost(sint64, repeated, tag = "1")]
    second_differences: Vec<i64>,
}

impl Column {
    /// One of these second differences.
    pub(super) const fn of(second_differences: Vec<i64>) -> Self {
        Self { second_differences }
    }

    /// Its second differences.
    pub(super) fn numbers(&self) -> &[i64] {
        &self.second_differences
    }
}

fn column(numbers: impl IntoIterator<Item = i64>) -> Column {
    Column { second_differences: fold(numbers) }
}

fn columns<'a, const N: usize>(rows: impl Iterator<Item = &'a [i64; N]> + Clone) -> Vec<Column> {
    (0..N).map(|at| column(rows.clone().map(move |row| row[at]))).collect()
}

/// A frame on its way into columns.
struct LaneRow {
    fields: [i64; OF_FRAME],
    positions: [i64; MAX_AXES],
    asked: [i64; MAX_AXES],
    vibration: [i64; 2 * MAX_AXES],
}

/// Ticks that become a block.
#[derive(Debug, Default)]
pub(crate) struct Block {
    octets: Vec<u8>,
    first: Option<MonoTime>,
}

impl Block {
    /// Adds a tick, as it came. Gives the block before it where that is full.
    pub(crate) fn add(
        &mut self,
        chunk: &Chunk<'_>,
        octets: &[u8],
        seats: &[RecordedSeat],
    ) -> Option<(MonoTime, Vec<u8>)> {
        const LONGEST_NS: u128 = 500_000_000;
        let at = chunk.head.deadline;
        let is_full = self.first.is_some_and(|first| at.since(first).as_nanos() >= LONGEST_NS || at < first);
        let full = if is_full { self.close(seats) } else { None };
        self.first.get_or_insert(at);
        self.octets.extend_from_slice(octets);
        full
    }

    /// Gives what there is, and the instant of its first tick.
    pub(crate) fn close(&mut self, seats: &[RecordedSeat]) -> Option<(MonoTime, Vec<u8>)> {
        let first = self.first.take()?;
        let block = pack(&self.octets, seats).encode_to_vec();
        self.octets.clear();
        Some((first, block))
    }
}

/// These chunks as a block.
fn pack(octets: &[u8], seats: &[RecordedSeat]) -> Sent {
    let mut ticks: Vec<[i64; OF_TICK]> = Vec::new();
    let mut lanes: Vec<(Vec<LaneRow>, Vec<u8>)> = seats.iter().map(|_| (Vec::new(), Vec::new())).collect();
    let mut rest = octets;
    while let Some((chunk, behind)) = Chunk::parse(rest) {
        rest = behind;
        let TickHead { index, deadline, late_ns, missed, film, state } = chunk.head;
        let state = State::ALL.iter().position(|one| *one == state).unwrap_or_default() as i64;
        let [index, deadline, late, missed] =
            [index, deadline.as_nanos(), late_ns / 1_000, missed].map(u64::cast_signed);
        let tick = ticks.len() as i64;
        ticks.push([index, deadline, late, missed, film.as_nanos(), state, chunk.dropped.into()]);
        for frame in chunk.frames() {
            if let (Some((rows, raw)), Some(seat)) = (lanes.get_mut(frame.lane), seats.get(frame.lane)) {
                rows.push(row(&frame, seat, tick, chunk.head.deadline, raw));
            }
        }
    }
    let lane = |(lane, (rows, raw)): (usize, (Vec<LaneRow>, Vec<u8>))| {
        (!rows.is_empty()).then(|| lane_of(lane, &rows, raw))
    };
    let lanes = lanes.into_iter().enumerate().filter_map(lane).collect();
    Sent { ticks: count(ticks.len()), tick_columns: columns(ticks.iter()), lanes }
}

fn count(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}

fn lane_of(lane: usize, rows: &[LaneRow], raw: Vec<u8>) -> Lane {
    // Columns at the end that hold nothing are none.
    let trimmed = |mut columns: Vec<Column>| {
        let used = columns.iter().rposition(|column| !column.second_differences.is_empty());
        columns.truncate(used.map_or(0, |last| last + 1));
        columns
    };
    Lane {
        lane: count(lane),
        frames: count(rows.len()),
        frame_columns: columns(rows.iter().map(|row| &row.fields)),
        positions: trimmed(columns(rows.iter().map(|row| &row.positions))),
        asked: trimmed(columns(rows.iter().map(|row| &row.asked))),
        vibration: trimmed(columns(rows.iter().map(|row| &row.vibration))),
        raw,
    }
}

fn row(
    frame: &SentFrame<'_>,
    seat: &RecordedSeat,
    tick: i64,
    deadline: MonoTime,
    raw: &mut Vec<u8>,
) -> LaneRow {
    let asked = frame.asked;
    let after = (frame.at.as_nanos() / 1_000).wrapping_sub(deadline.as_nanos() / 1_000).cast_signed();
    #[expect(clippy::cast_possible_truncation, reason = "a chunk has it in so many bits")]
    let (level, handed) = (i64::from((asked.level as f32).to_bits()), frame.handed as i64);
    let mut row = LaneRow {
        fields: [0; OF_FRAME],
        positions: [0; MAX_AXES],
        asked: [0; MAX_AXES],
        vibration: [0; 2 * MAX_AXES],
    };
    row.fields[..6].copy_from_slice(&[
        tick,
        after,
        handed,
        asked.slots as i64,
        level,
        asked.clamps.cast_signed(),
    ]);
    match request(seat.frames, frame.datagram) {
        Some(request) => fields(&mut row, &request),
        None => {
            row.fields[6] = frame.datagram.len() as i64 + 1;
            raw.extend_from_slice(frame.datagram);
        }
    }
    let (wanted, sent) = (seat.asked(&asked), seat.sent(frame));
    for (axis, (geometry, wanted)) in seat.axes().iter().zip(wanted).enumerate() {
        row.asked[axis] = geometry.pulses(wanted) - sent.get(axis).map_or(0, |place| geometry.pulses(*place));
    }
    row
}

/// The fields of a datagram, where these make it again.
fn request(kind: FrameKind, datagram: &[u8]) -> Option<MotionRequest> {
    let FrameKind::Datagram(port) = kind else { return None };
    let request = MotionRequest::parse_as(port, datagram).ok()?;
    (request.emit_as(port, &mut [0; MAX_LEN]) == datagram).then_some(request)
}

fn fields(row: &mut LaneRow, request: &MotionRequest) {
    let MotionRequest {
        timing,
        channel,
        accept,
        reply,
        frame,
        time_ms,
        positions,
        outputs,
        extend,
        vibration,
    } = request;
    row.fields[7..].copy_from_slice(&[
        frame.0.into(),
        (*timing == Timing::Absolute).into(),
        (*channel).into(),
        accept.0.into(),
        reply.0.into(),
        (*time_ms).into(),
        (*outputs).into(),
        (*extend).into(),
        positions.len() as i64,
        vibration.is_some().into(),
    ]);
    row.positions.iter_mut().zip(positions.iter()).for_each(|(to, from)| *to = from.0.into());
    for (axis, one) in vibration.iter().flat_map(|all| all.iter()).enumerate() {
        row.vibration[2 * axis] = one.period.into();
        row.vibration[2 * axis + 1] = one.amplitude.into();
    }
}

/// The chunks of a block, one behind the other; `None` where it is none.
pub(crate) fn unpack(block: &[u8], seats: &[RecordedSeat]) -> Option<Vec<u8>> {
    let sent = Sent::decode(block).ok()?;
    let ticks = usize::try_from(sent.ticks).ok().filter(|ticks| *ticks <= MOST)?;
    let is_sorted = sent.lanes.is_sorted_by(|one, other| one.lane < other.lane);
    let readers = sent.lanes.iter().filter(|_| is_sorted).map(|lane| LaneReader::new(lane, seats));
    let mut lanes = readers.collect::<Option<Vec<_>>>()?;
    let mut columns = unfolded(&sent.tick_columns);
    let mut chunks = Vec::new();
    for tick in 0..ticks {
        let [index, deadline, late, missed, film, state, dropped] = numbers(&mut columns);
        let head = TickHead {
            index: index.cast_unsigned(),
            deadline: MonoTime::from_nanos(deadline.cast_unsigned()),
            late_ns: late.cast_unsigned().saturating_mul(1_000),
            missed: missed.cast_unsigned(),
            film: ShowTime::from_nanos(film),
            state: *State::ALL.get(usize::try_from(state).ok()?)?,
        };
        let frames: Vec<OwnedFrame> =
            lanes.iter_mut().flat_map(|lane| std::iter::from_fn(|| lane.next(tick, &head))).collect();
        let room = frames.iter().map(|frame| longest_frame(MAX_AXES, frame.datagram.len())).sum();
        let mut writer = ChunkWriter::with_room(room);
        frames.iter().for_each(|frame| writer.frame(&frame.as_sent()));
        chunks.extend_from_slice(writer.close(&head, u32::try_from(dropped).ok()?)?);
    }
    // What no tick took was of none.
    lanes.iter().all(|lane| lane.left == 0 && !lane.is_damaged).then_some(chunks)
}

/// Iterators over columns that go on for ever.
type Unfolded<'a> = Vec<Box<dyn Iterator<Item = i64> + 'a>>;

fn unfolded(columns: &[Column]) -> Unfolded<'_> {
    columns.iter().map(|one| Box::new(unfold(&one.second_differences)) as Box<_>).collect()
}

/// The next of each column; 0 of those that are not there.
fn numbers<const N: usize>(columns: &mut Unfolded<'_>) -> [i64; N] {
    let mut row = [0; N];
    row.iter_mut().zip(columns).for_each(|(to, column)| *to = column.next().unwrap_or_default());
    row
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
    fields: Unfolded<'a>,
    positions: Unfolded<'a>,
    asked: Unfolded<'a>,
    vibration: Unfolded<'a>,
    raw: &'a [u8],
}

impl<'a> LaneReader<'a> {
    fn new(lane: &'a Lane, seats: &'a [RecordedSeat]) -> Option<Self> {
        let index = usize::try_from(lane.lane).ok()?;
        (lane.frames <= count(MOST)).then_some(())?;
        Some(Self {
            lane: index,
            seat: seats.get(index)?,
            left: lane.frames,
            is_damaged: false,
            next: None,
            fields: unfolded(&lane.frame_columns),
            positions: unfolded(&lane.positions),
            asked: unfolded(&lane.asked),
            vibration: unfolded(&lane.vibration),
            raw: &lane.raw,
        })
    }

    /// The next frame, if it is of that tick.
    fn next(&mut self, tick: usize, head: &TickHead) -> Option<OwnedFrame> {
        if self.next.is_none() && self.left > 0 {
            self.next = Some(numbers(&mut self.fields));
        }
        let fields = self.next.take_if(|fields| usize::try_from(fields[0]).is_ok_and(|of| of <= tick))?;
        self.left -= 1;
        let frame = self.frame(&fields, head);
        self.is_damaged |= frame.is_none();
        frame
    }

    fn frame(&mut self, fields: &[i64; OF_FRAME], head: &TickHead) -> Option<OwnedFrame> {
        let datagram = self.datagram(fields)?;
        let [_, after, handed, slots, level, clamps, ..] = *fields;
        let at = (head.deadline.as_nanos() / 1_000).saturating_add_signed(after).saturating_mul(1_000);
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
        let farther: [i64; MAX_AXES] = numbers(&mut self.asked);
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
        let positions: [i64; MAX_AXES] = numbers(&mut self.positions);
        let vibration: [i64; 2 * MAX_AXES] = numbers(&mut self.vibration);
        if fields[6] != 0 {
            let (octets, rest) =
                self.raw.split_at_checked(usize::try_from(fields[6].wrapping_sub(1)).ok()?)?;
            self.raw = rest;
            return Some(octets.to_vec());
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
