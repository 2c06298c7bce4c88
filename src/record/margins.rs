//! What was sent, measured as the proof measures: the greatest speed, acceleration and jerk of each axis, and when.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::chunk::{Chunk, Handed, SentFrame};
use super::full::{BlockMotions, SeatMotion};
use super::seat::{ReadFrame, RecordedAxis};
use super::{RecordedSeat, TickHead};
use crate::motion::{MAX_AXES, MeasurePlaces, MeasureTimes, PoseReadings, Reading, Readings, Spacing};
use crate::plain::escaped;
use crate::time::{MonoTime, Rate, ShowTime};
use crate::wire::Timing;

/// After so long without a frame a seat is taken to rest, and is measured anew.
const APART_NS: u64 = 500_000_000;

/// What is measured, in the order of [`Margins`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Quantity {
    /// Speed.
    Speed,
    /// Acceleration.
    Acceleration,
    /// Jerk.
    Jerk,
}

impl Quantity {
    /// All three.
    pub(crate) const ALL: [Self; 3] = [Self::Speed, Self::Acceleration, Self::Jerk];

    /// The word for it.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
        }
    }
}

/// The most that an axis was sent to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Margin {
    /// The seat.
    pub(crate) seat: String,
    /// Its axis, from 1.
    pub(crate) axis: usize,
    /// Of what.
    pub(crate) quantity: Quantity,
    /// How much, in the axis's unit per second, second squared or second cubed.
    pub(crate) value: f64,
    /// What it may do.
    pub(crate) limit: f64,
    /// Show time at which it was sent, seconds.
    pub(crate) film_s: f64,
}

impl Margin {
    /// As a part of the limit; 1 is the limit.
    pub(crate) fn part(&self) -> f64 {
        self.value / self.limit
    }

    /// In words: which axis of which seat, when, and how near.
    pub(crate) fn in_words(&self) -> String {
        let Self { seat, axis, quantity, value, limit, film_s } = self;
        let (seat, at) = (escaped(seat, 200), ShowTime::from_secs_f64(*film_s));
        let (word, percent) = (quantity.word(), 100.0 * self.part());
        format!("{word} of {seat} a{axis} at {at}, {value:.0} of {limit:.0}, {percent:.0} %")
    }
}

/// A measure of what each seat is sent.
#[derive(Debug)]
pub(crate) struct Margins {
    spacing: Spacing,
    lanes: Vec<LaneMargins>,
}

#[derive(Debug)]
struct LaneMargins {
    last: Option<MonoTime>,
    /// When its last frame is reached by the Times of its frames, which seats go by; and the Time of that.
    reached: ShowTime,
    time_ms: u32,
    times: MeasureTimes,
    places: MeasurePlaces<MAX_AXES>,
    /// The greatest of each quantity and axis so far, and the show time of each.
    most: [[f64; MAX_AXES]; 3],
    most_at: [[ShowTime; MAX_AXES]; 3],
}

/// What one frame showed of an axis, each as a part of its limit, and at which show time that was.
pub(crate) type Parts = [(ShowTime, f64); 3];

impl Margins {
    /// A measure of frames at that rate.
    pub(crate) fn new(seats: &[RecordedSeat], rate: Rate) -> Self {
        let spacing = Spacing::at_rate(rate.hz());
        Self { spacing, lanes: seats.iter().map(|_| LaneMargins::new(spacing)).collect() }
    }

    /// Takes a tick.
    #[cfg(test)]
    pub(crate) fn take(
        &mut self,
        chunk: &Chunk<'_>,
        seats: &[RecordedSeat],
        tell: &mut impl FnMut(usize, usize, Parts),
    ) {
        self.begin(chunk);
        for frame in chunk.frames() {
            if let Some(seat) = seats.get(frame.lane) {
                self.frame(&chunk.head, &seat.read(frame), seat, tell);
            }
        }
    }

    /// Takes what a tick has of one seat alone.
    pub(crate) fn take_lane(
        &mut self,
        chunk: &Chunk<'_>,
        (lane, seat): (usize, &RecordedSeat),
        tell: &mut impl FnMut(usize, usize, Parts),
    ) {
        self.begin(chunk);
        for frame in chunk.frames().filter(|frame| frame.lane == lane) {
            self.frame(&chunk.head, &seat.read(frame), seat, tell);
        }
    }

    /// A tick begins. A seat is measured anew behind ticks that are not there, and behind a frame that no tick asked for.
    pub(super) fn begin(&mut self, chunk: &Chunk<'_>) {
        self.forget_after(chunk.dropped);
    }

    fn forget_after(&mut self, dropped: u32) {
        if dropped > 0 {
            self.lanes.iter_mut().for_each(|lane| lane.last = None);
        }
    }

    /// Takes a frame of that tick.
    pub(super) fn frame(
        &mut self,
        head: &TickHead,
        read: &ReadFrame<'_>,
        seat: &RecordedSeat,
        tell: &mut impl FnMut(usize, usize, Parts),
    ) {
        let to = read.motion.as_ref().map(|motion| (motion.places, motion.timing, motion.time_ms));
        let SentFrame { lane, handed, asked, .. } = read.frame;
        self.motion(head, &SeatMotion { lane, handed, is_asked: asked.slots != 0, to }, seat, tell);
    }

    /// Takes the ticks of a block.
    pub(super) fn take_motions(&mut self, block: &BlockMotions, seats: &[RecordedSeat]) {
        let mut from = 0;
        for (head, dropped, until) in &block.ticks {
            self.forget_after(*dropped);
            for motion in &block.motions[from..*until] {
                if let Some(seat) = seats.get(motion.lane) {
                    self.motion(head, motion, seat, &mut |_, _, _| ());
                }
            }
            from = *until;
        }
    }

    fn motion(
        &mut self,
        head: &TickHead,
        motion: &SeatMotion,
        seat: &RecordedSeat,
        tell: &mut impl FnMut(usize, usize, Parts),
    ) {
        let Some(lane) = self.lanes.get_mut(motion.lane) else { return };
        if motion.handed == Handed::Refused {
            return;
        }
        if !motion.is_asked {
            lane.last = None;
            return;
        }
        let is_next =
            |last: MonoTime| head.deadline > last && head.deadline.since(last).as_nanos() < APART_NS.into();
        let goes_on = lane.last.replace(head.deadline).is_some_and(is_next);
        let Some((places, timing, time_ms)) = &motion.to else { return };
        let before = std::mem::replace(&mut lane.time_ms, *time_ms);
        let lasts = if *timing == Timing::Relative { *time_ms } else { time_ms.saturating_sub(before) };
        lane.reached += Duration::from_millis(u64::from(lasts.max(1)));
        if !goes_on {
            lane.times = MeasureTimes::new(self.spacing);
        }
        let now = lane.reached;
        lane.times.push(now);
        let shown = lane.places.push(&lane.times, places);
        lane.keep(&shown, now, head.film);
        for (index, axis) in seat.axes().iter().enumerate().take(places.len()) {
            tell(motion.lane, index, parts(&shown.of(index), now, head.film, axis.limits()));
        }
    }

    /// The most of each axis.
    pub(crate) fn most(&self, seats: &[RecordedSeat]) -> Vec<Margin> {
        let of_lane = |(lane, seat): (&LaneMargins, &RecordedSeat)| {
            let of_axis = |(axis, recorded): (usize, &RecordedAxis)| {
                let limits = recorded.limits();
                Quantity::ALL.map(|quantity| Margin {
                    seat: seat.name.clone(),
                    axis: axis + 1,
                    quantity,
                    value: lane.most[quantity as usize][axis],
                    limit: limits[quantity as usize],
                    film_s: lane.most_at[quantity as usize][axis].as_secs_f64(),
                })
            };
            seat.axes().iter().enumerate().flat_map(of_axis).collect::<Vec<_>>()
        };
        self.lanes.iter().zip(seats).flat_map(of_lane).collect()
    }
}

impl LaneMargins {
    const fn new(spacing: Spacing) -> Self {
        Self {
            last: None,
            reached: ShowTime::ZERO,
            time_ms: 0,
            times: MeasureTimes::new(spacing),
            places: MeasurePlaces::NONE,
            most: [[0.0; MAX_AXES]; 3],
            most_at: [[ShowTime::ZERO; MAX_AXES]; 3],
        }
    }

    /// Keeps what is greater than all before, which next to nothing is.
    fn keep(&mut self, shown: &PoseReadings<MAX_AXES>, now: ShowTime, film: ShowTime) {
        for (quantity, (sizes, most)) in shown.sizes().iter().zip(&mut self.most).enumerate() {
            if !sizes.iter().zip(&*most).fold(false, |any, (size, most)| any | (size > most)) {
                continue;
            }
            for (axis, most) in most.iter_mut().enumerate().filter(|(axis, most)| sizes[*axis] > **most) {
                *most = sizes[axis];
                self.most_at[quantity][axis] = then(of_quantities(&shown.of(axis))[quantity], now, film);
            }
        }
    }
}

/// In the order of [`Quantity`].
fn of_quantities(readings: &Readings) -> [Reading; 3] {
    [readings.velocity, readings.acceleration, readings.jerk]
}

/// What was shown as parts of the limits. Nobody asks for it while it is recorded, and it costs nothing there.
#[inline]
fn parts(readings: &Readings, now: ShowTime, film: ShowTime, limits: [f64; 3]) -> Parts {
    let shown = of_quantities(readings);
    std::array::from_fn(|order| (then(shown[order], now, film), shown[order].value.abs() / limits[order]))
}

/// The show time of what was seen: it was half a difference ago, and the film went on since.
#[inline]
fn then(reading: Reading, now: ShowTime, film: ShowTime) -> ShowTime {
    if reading.value == 0.0 { film } else { film.since(now.since(reading.at)) }
}

#[cfg(test)]
mod tests;
