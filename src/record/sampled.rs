//! Many ticks into few samples. Of each window the worst is kept, so that nothing that lasted a tick is smoothed away.

use serde::{Deserialize, Serialize};

use super::ack_record::{AckRecord, standing_number};
use super::chunk::{Chunk, Handed};
use super::notes::Note;
use super::seat::ReadFrame;
use super::{RecordedSeat, TickHead};
use crate::state::State;
use crate::time::MonoTime;
use crate::tracker::Fate;
use crate::wire::{PerAxis, ReplyCode};

/// A seat in a window: its frame in which asked and sent differ most, the last of these, and sums of all its frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct SeatSample {
    /// Show time of that frame, seconds; that of the last tick where there was none.
    pub(crate) film_s: f64,
    /// Where each axis was asked to be, mm, or degrees where it turns.
    #[serde(with = "places")]
    pub(crate) asked_mm: PerAxis<f64>,
    /// Where it was sent.
    #[serde(with = "places")]
    pub(crate) sent_mm: PerAxis<f64>,
    /// The level of motion, 0 to 1.
    pub(crate) level: f64,
    /// Frames that the kernel took.
    pub(crate) sent: u32,
    /// Frames that it did not take.
    pub(crate) unsent: u32,
    /// How often the limiter held the seat back.
    pub(crate) clamps: u64,
    /// Where its axes were measured to be last; none where nobody was asked.
    #[serde(with = "places")]
    pub(crate) measured_mm: PerAxis<f64>,
    /// Frames that were acked.
    pub(crate) acked: u32,
    /// Frames that were refused.
    pub(crate) refused: u32,
    /// Frames that were given up as lost.
    pub(crate) lost: u64,
    /// Latency of the last ack, µs; none where there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ack_us: Option<f64>,
    /// The greatest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ack_max_us: Option<f64>,
    /// How its group stands, by number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) standing: Option<u8>,
}

/// What a sample comes to, without places: of long recordings most is read for that alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeatSum {
    pub(crate) film_s: f64,
    pub(crate) sent: u32,
    pub(crate) unsent: u32,
    pub(crate) clamps: u64,
    pub(crate) standing: Option<u8>,
    /// It was sent somewhere, by a tick that asked for it.
    pub(crate) is_sent: bool,
    /// How far asked and sent are apart at most, mm or degrees.
    pub(crate) apart: f64,
}

impl SeatSample {
    pub(crate) fn sum(&self) -> SeatSum {
        let Self { film_s, ref asked_mm, ref sent_mm, sent, unsent, clamps, standing, .. } = *self;
        let apart = asked_mm.iter().zip(sent_mm.iter()).map(|(asked, sent)| (asked - sent).abs());
        let is_sent = sent > 0 && !asked_mm.is_empty();
        SeatSum { film_s, sent, unsent, clamps, standing, is_sent, apart: apart.fold(0.0, f64::max) }
    }
}

/// All ticks of a window.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct TickSample {
    /// Show time of the last, seconds.
    pub(crate) film_s: f64,
    /// Its lateness, µs.
    pub(crate) late_us: f64,
    /// The greatest.
    pub(crate) late_max_us: f64,
    /// How many there were.
    pub(crate) ticks: u32,
    /// How many were slept through.
    pub(crate) missed: u64,
    /// How many were not recorded.
    pub(crate) dropped: u64,
}

/// Something to be written.
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all of them are samples, which a box each would make slower"
)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Message {
    /// Of the seat of a lane.
    Seat(usize, SeatSample),
    /// Of the ticks.
    Tick(TickSample),
    /// The hall's state, from now on.
    State(State),
    /// What the service tells.
    Note(Note),
    /// A block of whole ticks, of which the last was then.
    Ticks(Vec<u8>),
    /// What the ack thread took, packed.
    Drains(Vec<u8>),
}

/// A window of a seat that is not over.
#[derive(Debug, Clone, Default)]
struct SeatWindow {
    /// The worst so far: when, how far asked and sent differ in it, and these.
    worst: Option<(MonoTime, f64, [PerAxis<f64>; 2])>,
    sample: SeatSample,
    /// Clamps until the window before.
    clamps: u64,
    /// Lost frames until the window before.
    lost: u64,
    /// What lasts: how its group stands, what of that was told last, and where its axes were measured to be.
    standing: Option<u8>,
    told: Option<u8>,
    measured_mm: PerAxis<f64>,
}

/// The fold of ticks into samples.
#[derive(Debug)]
pub(crate) struct Sampled {
    seats: Vec<RecordedSeat>,
    windows: Vec<SeatWindow>,
    tick: TickSample,
    state: Option<State>,
    hz: u32,
    /// The last tick, of the window that is not over.
    last: Option<TickHead>,
    /// When the last tick of a window that is over was due, and its show time, seconds.
    closed: (MonoTime, f64),
}

impl Sampled {
    /// A fold into so many samples a second.
    pub(crate) fn new(seats: Vec<RecordedSeat>, hz: u32) -> Self {
        let windows = vec![SeatWindow::default(); seats.len()];
        Self {
            seats,
            windows,
            tick: TickSample::default(),
            state: None,
            hz,
            last: None,
            closed: (MonoTime::default(), 0.0),
        }
    }

    /// Takes a tick, and tells what is over by it.
    pub(crate) fn take(&mut self, chunk: &Chunk<'_>, tell: &mut impl FnMut(MonoTime, Message)) {
        self.begin(chunk, tell);
        for frame in chunk.frames() {
            if let Some(read) = self.seats.get(frame.lane).map(|seat| seat.read(frame)) {
                self.frame(&chunk.head, &read);
            }
        }
    }

    /// A tick begins: tells what is over by it.
    pub(super) fn begin(&mut self, chunk: &Chunk<'_>, tell: &mut impl FnMut(MonoTime, Message)) {
        let head = chunk.head;
        if self.last.is_some_and(|last| self.window(last.deadline) != self.window(head.deadline)) {
            self.close(tell);
        }
        if self.state.replace(head.state) != Some(head.state) {
            tell(head.deadline, Message::State(head.state));
        }
        self.tick = TickSample {
            film_s: head.film.as_secs_f64(),
            late_us: micros(head.late_ns),
            late_max_us: micros(head.late_ns).max(self.tick.late_max_us),
            ticks: self.tick.ticks + 1,
            missed: self.tick.missed + head.missed,
            dropped: self.tick.dropped + u64::from(chunk.dropped),
        };
        self.last = Some(head);
    }

    /// Tells of the window that is not over, and of acks that came since there was one.
    pub(crate) fn close(&mut self, tell: &mut impl FnMut(MonoTime, Message)) {
        let last = self.last.take();
        self.closed = last.map_or(self.closed, |last| (last.deadline, last.film.as_secs_f64()));
        let (closed_at, closed_s) = self.closed;
        for (lane, window) in self.windows.iter_mut().enumerate() {
            let mut sample = std::mem::take(&mut window.sample);
            let worst = window.worst.take();
            // Of a seat that falls out there may be nothing more than that.
            let is_news = window.standing != window.told;
            let is_heard = sample.acked > 0 || sample.refused > 0 || sample.lost > 0 || is_news;
            match &worst {
                Some((_, _, [asked, sent])) => {
                    (sample.asked_mm, sample.sent_mm) = (round(asked), round(sent));
                }
                None => sample.film_s = closed_s,
            }
            if let Some(at) = worst.map(|(at, ..)| at).or_else(|| is_heard.then_some(closed_at)) {
                (sample.standing, sample.measured_mm) = (window.standing, window.measured_mm);
                window.told = window.standing;
                tell(at, Message::Seat(lane, sample));
            }
        }
        // Last: by it a file knows that all samples up to then are told.
        if last.is_some() || self.tick.dropped > 0 {
            let tick = std::mem::take(&mut self.tick);
            tell(closed_at, Message::Tick(TickSample { film_s: closed_s, ..tick }));
        }
    }

    /// So many ticks were lost, and no other comes that would say so.
    pub(super) fn lose(&mut self, ticks: u32) {
        self.tick.dropped += u64::from(ticks);
    }

    /// Takes something that the ack thread took before the next tick.
    pub(super) fn ack(&mut self, record: &AckRecord<'_>) {
        let (AckRecord::Fate(controller, ..)
        | AckRecord::Lost(controller, _)
        | AckRecord::Measured(controller, ..)
        | AckRecord::Standing(controller, _)) = *record
        else {
            return;
        };
        let (Some(seat), Some(window)) = (self.seats.get(controller), self.windows.get_mut(controller))
        else {
            return;
        };
        let SeatWindow { sample, lost, standing, measured_mm, .. } = window;
        match record {
            AckRecord::Fate(_, _, Fate::Answered(ReplyCode::Running), latency_ns) => {
                sample.acked += 1;
                let us = Some(micros((*latency_ns).into())).filter(|us| *us > 0.0);
                (sample.ack_us, sample.ack_max_us) = (us.or(sample.ack_us), max(us, sample.ack_max_us));
            }
            AckRecord::Fate(_, _, Fate::Answered(_), _) => sample.refused += 1,
            AckRecord::Lost(_, total) => {
                sample.lost += total.saturating_sub(std::mem::replace(lost, *total));
            }
            AckRecord::Measured(_, _, pulses) => *measured_mm = round(&seat.measured(pulses)),
            AckRecord::Standing(_, now) => *standing = Some(standing_number(*now)),
            _ => {}
        }
    }

    fn window(&self, at: MonoTime) -> u128 {
        u128::from(at.as_nanos()) * u128::from(self.hz) / 1_000_000_000
    }

    /// Takes a frame of that tick.
    pub(super) fn frame(&mut self, head: &TickHead, read: &ReadFrame<'_>) {
        let frame = &read.frame;
        let Some(window) = self.windows.get_mut(frame.lane) else { return };
        let SeatWindow { worst, sample, clamps, .. } = window;
        let is_taken = frame.handed != Handed::Refused;
        sample.sent += u32::from(is_taken);
        sample.unsent += u32::from(!is_taken);
        let (asked, sent) = (read.asked, read.sent());
        if !asked.is_empty() {
            sample.clamps += frame.asked.clamps.saturating_sub(std::mem::replace(clamps, frame.asked.clamps));
        }
        let apart =
            asked.iter().zip(sent.iter()).map(|(asked, sent)| (asked - sent).abs()).fold(0.0, f64::max);
        if worst.is_none_or(|(_, most, _)| apart >= most) {
            *worst = Some((head.deadline, apart, [asked, sent]));
            sample.film_s = head.film.as_secs_f64();
            sample.level = rounded(frame.asked.level);
        }
    }
}

fn max(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    one.map_or(other, |one| Some(other.map_or(one, |other| one.max(other))))
}

#[expect(clippy::cast_precision_loss, reason = "less than an hour")]
fn micros(ns: u64) -> f64 {
    ns as f64 / 1e3
}

/// To a ten-thousandth: a pulse of the finest axis is longer, and a line is shorter for it.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn round(values: &[f64]) -> PerAxis<f64> {
    PerAxis::from_fn(values.len(), |axis| rounded(values[axis]))
}

/// A place for each axis, as a list.
mod places {
    use serde::de::Error as _;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    use crate::motion::MAX_AXES;
    use crate::wire::PerAxis;

    pub(super) fn serialize<S: Serializer>(places: &PerAxis<f64>, to: S) -> Result<S::Ok, S::Error> {
        places[..].serialize(to)
    }

    pub(super) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<PerAxis<f64>, D::Error> {
        let places = Vec::<f64>::deserialize(from)?;
        if places.len() > MAX_AXES {
            return Err(D::Error::custom(format!(
                "places of {} axes; a seat has at most {MAX_AXES}",
                places.len()
            )));
        }
        Ok(PerAxis::new(&places))
    }
}
