//! Marks, events and requests as flags on the axis of a picture, each at its own instant. Where the film was then is known from the ticks
//! before and after it, which are in the file later than it.

use std::collections::VecDeque;

use super::film_axis::FilmAxis;
use crate::plot::Flag;
use crate::time::MonoTime;

/// SeatFlags of a picture; more are counted in one.
const FLAGS: usize = 100;
/// Samples of ticks that are held: what is told was no longer ago.
const HELD: usize = 64;

/// Those of a picture.
#[derive(Debug, Default)]
pub(super) struct SeatFlags {
    flags: Vec<Flag>,
    /// How many have no flag.
    pub(super) more: u64,
    /// Instants and show times, s, of the newest ticks.
    ticks: VecDeque<(MonoTime, f64)>,
    /// What no tick followed yet.
    waiting: Vec<Noted>,
    /// Where on the axis the last tick was that is on it, s.
    last_s: Option<f64>,
    /// How long a sample is at the most, s.
    sample_s: f64,
}

/// What is to be a flag.
#[derive(Debug)]
pub(super) struct Noted {
    /// When.
    pub(super) at: MonoTime,
    /// Show time, s, where it says so itself.
    pub(super) film_s: Option<f64>,
    /// Its name.
    pub(super) name: String,
    /// Whether a person has marked it.
    pub(super) is_mark: bool,
}

impl SeatFlags {
    /// None yet, of samples that long.
    pub(super) fn of_samples(sample_s: f64) -> Self {
        Self { sample_s, ..Self::default() }
    }

    /// Takes the next sample of the ticks.
    pub(super) fn tick(&mut self, axis: &FilmAxis, at: MonoTime, film_s: f64) {
        self.ticks.push_back((at, film_s));
        if self.ticks.len() > HELD {
            self.ticks.pop_front();
        }
        if let Some(moment) = axis.moment(at, film_s, self.sample_s) {
            self.last_s = Some(moment.at_s);
        }
        if !self.waiting.is_empty() {
            let (known, waiting) = self.waiting.drain(..).partition(|noted| noted.at <= at);
            self.waiting = waiting;
            self.put(axis, known);
        }
    }

    /// Takes what is told.
    pub(super) fn note(&mut self, noted: Noted) {
        if self.flags.len() + self.waiting.len() < FLAGS {
            self.waiting.push(noted);
        } else {
            self.more += 1;
        }
    }

    /// All of them.
    pub(super) fn close(&mut self, axis: &FilmAxis) -> Vec<Flag> {
        let waiting = std::mem::take(&mut self.waiting);
        self.put(axis, waiting);
        std::mem::take(&mut self.flags)
    }

    fn put(&mut self, axis: &FilmAxis, all: Vec<Noted>) {
        for Noted { at, film_s, name, is_mark } in all {
            let film_s = film_s.or_else(|| self.film_s(at));
            // What happens once the film is over stands at its end.
            let moment =
                film_s.filter(|_| axis.runs(at)).and_then(|film_s| axis.moment(at, film_s, self.sample_s));
            match moment.map(|moment| moment.at_s).or(self.last_s) {
                Some(at_s) => self.flags.push(Flag { at_s, name, is_mark }),
                None => self.more += 1,
            }
        }
    }

    /// Where the film was, s: between two ticks on the line between them.
    fn film_s(&self, at: MonoTime) -> Option<f64> {
        let next = self.ticks.partition_point(|(tick, _)| *tick < at);
        let Some((after, then_s)) = self.ticks.get(next) else { return Some(self.ticks.back()?.1) };
        let Some((before, film_s)) = next.checked_sub(1).and_then(|place| self.ticks.get(place)) else {
            return Some(*then_s);
        };
        let (passed, between) = (at.since(*before).as_secs_f64(), after.since(*before).as_secs_f64());
        // Where it leapt meanwhile, it leapt at the later one.
        let is_run = (then_s - film_s).abs() <= 2.0 * between;
        Some(if is_run { film_s + (then_s - film_s) * passed / between } else { film_s + passed })
    }
}
