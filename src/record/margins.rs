//! What was sent, measured as the proof measures: the greatest speed, acceleration and jerk of each axis, and when.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::chunk::{Chunk, Handed};
use super::seat::{FrameMotion, ReadFrame};
use super::{RecordedSeat, TickHead};
use crate::motion::{MAX_AXES, MeasurePlaces, MeasureTimes, Reading, Spacing};
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
    axes: Vec<AxisMargins>,
}

/// The greatest of an axis so far, and the show time of each.
#[derive(Debug, Clone, Copy)]
struct AxisMargins([(f64, ShowTime); 3]);

/// What one frame showed of an axis, each as a part of its limit, and at which show time that was.
pub(crate) type Parts = [(ShowTime, f64); 3];

impl Margins {
    /// A measure of frames at that rate.
    pub(crate) fn new(seats: &[RecordedSeat], rate: Rate) -> Self {
        let spacing = Spacing::at_rate(rate.hz());
        let lane = |seat: &RecordedSeat| LaneMargins {
            last: None,
            reached: ShowTime::ZERO,
            time_ms: 0,
            times: MeasureTimes::new(spacing),
            places: MeasurePlaces::NONE,
            axes: vec![AxisMargins([(0.0, ShowTime::ZERO); 3]); seat.axes().len()],
        };
        Self { spacing, lanes: seats.iter().map(lane).collect() }
    }

    /// Takes a tick.
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

    /// A tick begins. A seat is measured anew behind ticks that are not there, and behind a frame that no tick asked for.
    pub(super) fn begin(&mut self, chunk: &Chunk<'_>) {
        if chunk.dropped > 0 {
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
        let frame = &read.frame;
        let Some(lane) = self.lanes.get_mut(frame.lane) else { return };
        if frame.handed == Handed::Refused {
            return;
        }
        if frame.asked.slots == 0 {
            lane.last = None;
            return;
        }
        let is_next =
            |last: MonoTime| head.deadline > last && head.deadline.since(last).as_nanos() < APART_NS.into();
        let goes_on = lane.last.replace(head.deadline).is_some_and(is_next);
        let Some(FrameMotion { places, timing, time_ms, .. }) = &read.motion else { return };
        let before = std::mem::replace(&mut lane.time_ms, *time_ms);
        let lasts = if *timing == Timing::Relative { *time_ms } else { time_ms.saturating_sub(before) };
        lane.reached += Duration::from_millis(u64::from(lasts.max(1)));
        if !goes_on {
            lane.times = MeasureTimes::new(self.spacing);
        }
        let now = lane.reached;
        let all = lane.places.push(&lane.times.push(now), places);
        for (index, (axis, seen)) in lane.axes.iter_mut().zip(&all[..places.len()]).enumerate() {
            let shown = [seen.velocity, seen.acceleration, seen.jerk];
            axis.keep(shown, now, head.film);
            tell(frame.lane, index, parts(shown, now, head.film, seat.axes()[index].limits()));
        }
    }

    /// The most of each axis.
    pub(crate) fn most(&self, seats: &[RecordedSeat]) -> Vec<Margin> {
        let of_axis = |seat: &RecordedSeat, index: usize, axis: &AxisMargins| {
            let limits = seat.axes()[index].limits();
            let name = seat.name.clone();
            let margin = move |(quantity, (value, film)): (Quantity, (f64, ShowTime))| Margin {
                seat: name.clone(),
                axis: index + 1,
                quantity,
                value,
                limit: limits[quantity as usize],
                film_s: film.as_secs_f64(),
            };
            Quantity::ALL.into_iter().zip(axis.0).map(margin).collect::<Vec<_>>()
        };
        let of_lane = |(lane, seat): (&LaneMargins, &RecordedSeat)| {
            lane.axes
                .iter()
                .enumerate()
                .flat_map(|(index, axis)| of_axis(seat, index, axis))
                .collect::<Vec<_>>()
        };
        self.lanes.iter().zip(seats).flat_map(of_lane).collect()
    }
}

impl AxisMargins {
    /// Keeps what is greater than all before.
    fn keep(&mut self, shown: [Reading; 3], now: ShowTime, film: ShowTime) {
        for (most, reading) in self.0.iter_mut().zip(shown) {
            if reading.value.abs() > most.0 {
                *most = (reading.value.abs(), then(reading, now, film));
            }
        }
    }
}

/// What was shown as parts of the limits. Nobody asks for it while it is recorded, and it costs nothing there.
#[inline]
fn parts(shown: [Reading; 3], now: ShowTime, film: ShowTime, limits: [f64; 3]) -> Parts {
    std::array::from_fn(|order| (then(shown[order], now, film), shown[order].value.abs() / limits[order]))
}

/// The show time of what was seen: it was half a difference ago, and the film went on since.
#[inline]
fn then(reading: Reading, now: ShowTime, film: ShowTime) -> ShowTime {
    if reading.value == 0.0 { film } else { film.since(now.since(reading.at)) }
}
