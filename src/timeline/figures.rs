//! What a cue asks of a seat at most, and what it switches: the figures that people judge it by. Control thread.

use std::sync::Arc;
use std::time::Duration;

use super::Timeline;
use crate::cue::{Effects, Step, Steps};
use crate::motion::{self, Peak, SeatType};
use crate::time::ShowTime;

/// The most that something reaches, and where.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Figure {
    /// In mm, mm/s, mm/s² or mm/s³.
    pub value: f64,
    /// Show time of the worst.
    pub at: ShowTime,
    /// The line of the row at or before it; the number of its message where the file has no lines.
    pub line: u64,
}

/// What one axis does at most, on the seat that takes it.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisFigures {
    /// The seat that it was judged for.
    pub seat: Arc<SeatType>,
    /// The lowest position of the curve, mm from the stroke's lower end.
    pub lowest: Figure,
    /// The highest position of the curve, mm from the stroke's lower end.
    pub highest: Figure,
    /// The greatest speed, mm/s.
    pub velocity: Figure,
    /// The greatest acceleration, mm/s².
    pub acceleration: Figure,
    /// The greatest jerk, mm/s³.
    pub jerk: Figure,
}

/// How much an effect or an output is used.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectUse {
    /// The effect's name; `Y01` to `Y12` for a bit of a raw output word.
    pub name: String,
    /// How often it goes on.
    pub times: usize,
    /// How long it is on in all.
    pub on: Duration,
    /// When it first goes on.
    pub first: Option<ShowTime>,
}

impl Timeline {
    /// What each axis does at most, in frames of `rate_hz` (1 to 1,000): positions are those of the curve itself,
    /// also between rows; the rest is measured over the poses of the frames. `seats` has the seat of each axis.
    #[must_use]
    pub fn figures(&self, rate_hz: f64, seats: &[Arc<SeatType>]) -> Vec<AxisFigures> {
        let unit = self.unit();
        let mut hint = super::Hint::default();
        let peaks = motion::scan(self.axes(), rate_hz, self.duration(), |at| {
            let mut pose = self.sample(at, &mut hint);
            for (position, seat) in pose.iter_mut().zip(seats) {
                *position = (*position * unit.to_stroke(seat)).clamp(0.0, 1.0) * seat.stroke_mm;
            }
            pose
        });
        let axes = peaks.iter().zip(seats).zip(self.extremes());
        let figures = axes.map(|((peaks, seat), extremes)| {
            let mm = unit.to_stroke(seat) * seat.stroke_mm;
            let extreme = |e: super::Extreme| Figure { value: e.value * mm, at: e.at, line: e.line };
            AxisFigures {
                seat: Arc::clone(seat),
                lowest: extreme(extremes.min),
                highest: extreme(extremes.max),
                velocity: self.figure(peaks.velocity),
                acceleration: self.figure(peaks.acceleration),
                jerk: self.figure(peaks.jerk),
            }
        });
        figures.collect()
    }

    fn figure(&self, peak: Peak) -> Figure {
        let cue = self.cue();
        Figure { value: peak.value, at: peak.at, line: cue.line(self.row_before(peak.at)) }
    }

    /// How much each effect that the cue names, or each bit of its raw output words, is used.
    #[must_use]
    pub fn effect_uses(&self) -> Vec<EffectUse> {
        let end = self.duration();
        match self.cue().effects() {
            Effects::Named { names, steps } => names
                .iter()
                .enumerate()
                .map(|(bit, name)| usage(name.clone(), steps, end, |on| on >> bit & 1))
                .collect(),
            Effects::Words(steps) => (0..12)
                .map(|bit| usage(format!("Y{:02}", bit + 1), steps, end, |word| u32::from(word) >> bit & 1))
                .filter(|usage| usage.times > 0)
                .collect(),
        }
    }

    /// The median time between rows.
    #[must_use]
    pub fn row_interval(&self) -> Duration {
        let times = self.cue().times();
        let mut spans: Vec<u64> =
            times.windows(2).map(|pair| pair[1].as_nanos().abs_diff(pair[0].as_nanos())).collect();
        let middle = spans.len() / 2;
        if spans.is_empty() {
            return Duration::ZERO;
        }
        Duration::from_nanos(*spans.select_nth_unstable(middle).1)
    }
}

fn usage<T: Copy + PartialEq + Default>(
    name: String,
    steps: &Steps<T>,
    end: ShowTime,
    is_on: impl Fn(T) -> u32,
) -> EffectUse {
    let mut usage = EffectUse { name, times: 0, on: Duration::ZERO, first: None };
    let mut since: Option<ShowTime> = None;
    let last = Step { at: end, value: T::default() };
    for step in steps.as_slice().iter().chain([&last]) {
        match (since, is_on(step.value) == 1) {
            (None, true) => {
                usage.times += 1;
                usage.first = usage.first.or(Some(step.at));
                since = Some(step.at);
            }
            (Some(start), false) => {
                usage.on += Duration::from_nanos(step.at.as_nanos().abs_diff(start.as_nanos()));
                since = None;
            }
            _ => {}
        }
    }
    usage
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cue::{self, Source};

    fn timeline(text: &str) -> Timeline {
        Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    #[test]
    fn a_steady_move_has_its_speed_in_mm_of_the_seat() {
        let cue = timeline("# interpolation: linear\ntime_s,a1,a2\n0,0,0.5\n1,0.5,0.5\n2,0.5,0.5\n");
        let seats = [0, 1].map(|_| Arc::new(SeatType::bench3(2)));
        let figures = cue.figures(100.0, &seats);
        assert!((figures[0].velocity.value - 75.0).abs() < 1e-6, "{figures:?}");
        assert_eq!((figures[0].velocity.line, figures[0].highest.line), (3, 4));
        assert_eq!((figures[0].lowest.value, figures[0].highest.value), (0.0, 75.0));
        assert!(figures[0].acceleration.value > 1000.0, "the corner at the end of the move shows");
        assert_eq!(figures[0].acceleration.line, 4);
        assert_eq!(figures[1].velocity.value, 0.0);
    }

    #[test]
    fn the_unit_of_the_file_makes_no_difference() {
        let rows = |unit: &str, full: f64| {
            format!("# units: {unit}\ntime_s,a1\n0,0\n1,{}\n2,{}\n3,0\n", 0.3 * full, 0.8 * full)
        };
        let seats = [Arc::new(SeatType::bench3(1))];
        let figures = |unit: &str, full: f64| timeline(&rows(unit, full)).figures(100.0, &seats)[0].clone();
        let (fraction, mm, pulse) =
            (figures("fraction", 1.0), figures("mm", 150.0), figures("pulse", 300_000.0));
        for other in [mm, pulse] {
            assert!((fraction.jerk.value / other.jerk.value - 1.0).abs() < 1e-3);
            assert!((fraction.highest.value - other.highest.value).abs() < 1e-3);
        }
    }

    #[test]
    fn an_effect_is_counted_each_time_it_goes_on() {
        let cue = timeline("time_s,a1,fx_air,fx_wind\n0,0,1,0\n1,0,0,0\n2,0,1,0\n3,0,1,0\n5,0,1,0\n");
        let uses = cue.effect_uses();
        assert_eq!((uses[0].times, uses[0].on), (2, Duration::from_secs(4)));
        assert_eq!((uses[0].first, uses[1].first), (Some(ShowTime::ZERO), None));
        assert_eq!((uses[1].times, uses[1].on), (0, Duration::ZERO));
    }

    #[test]
    fn bits_of_a_raw_word_are_outputs() {
        let uses = timeline("time_s,a1,io\n0,0,0x001\n1,0,0x801\n2,0,0\n").effect_uses();
        let names: Vec<_> = uses.iter().map(|usage| (usage.name.as_str(), usage.on.as_secs())).collect();
        assert_eq!(names, [("Y01", 2), ("Y12", 1)]);
    }

    #[test]
    fn the_row_interval_is_the_usual_one() {
        let cue = timeline("time_ms,a1\n0,0\n20,0\n40,0\n60,0\n1060,0\n");
        assert_eq!(cue.row_interval(), Duration::from_millis(20));
    }
}
