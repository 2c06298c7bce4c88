//! Where in the cue the lanes are, frame by frame, and where they should be by the film.

use std::time::Duration;

use super::millis;
use super::slew::Slew;
use crate::time::{Rate, ShowTime, TRIM_MS};

/// How quickly show time may run in a frame.
#[derive(Debug, Clone, Copy)]
pub(super) enum Pace {
    /// As in the frame before.
    Kept,
    /// Faster or slower than the clock by so much at the most.
    Within(f64),
}

/// Show time of one play.
#[derive(Debug)]
pub struct Playhead {
    rate: Rate,
    /// Frames so far.
    frames: u64,
    /// The show time of the next tick.
    at: ShowTime,
    /// The show time of the pose sent last.
    reached: ShowTime,
    /// How much later than the film the motion is to be, milliseconds.
    trim_ms: i32,
    slew: Slew,
}

impl Playhead {
    pub(super) fn new(rate: Rate, start: ShowTime) -> Self {
        Self { rate, frames: 0, at: start, reached: start, trim_ms: 0, slew: Slew::new(rate) }
    }

    /// The show time of the next tick: where in the cue the lanes are.
    #[must_use]
    pub const fn at(&self) -> ShowTime {
        self.at
    }

    /// Where the film is: what the playhead will be at once all lag and trim are slewed in, and the trim.
    #[must_use]
    pub fn film(&self) -> ShowTime {
        let ahead = self.slew.owed_s() + f64::from(self.trim_ms) * 1e-3;
        ShowTime::from_nanos(self.at.as_nanos() + ShowTime::from_secs_f64(ahead).as_nanos())
    }

    /// How long the frame of the next tick takes.
    #[must_use]
    pub fn frame_time(&self) -> Duration {
        millis(self.rate.time_ms(self.frames))
    }

    /// The Time of the next frame, ms, which is counted.
    pub(super) fn next_frame(&mut self) -> u32 {
        let time_ms = self.rate.time_ms(self.frames);
        self.frames += 1;
        time_ms
    }

    pub(super) const fn frames(&self) -> u64 {
        self.frames
    }

    pub(super) const fn reached(&self) -> ShowTime {
        self.reached
    }

    /// A pose is sent that is reached there.
    pub(super) const fn reach(&mut self) -> ShowTime {
        self.reached = self.at;
        self.reached
    }

    /// Where in the cue the lanes are to be at a time of the film.
    pub(super) fn cue_time(&self, film: ShowTime) -> ShowTime {
        ShowTime::from_nanos(film.as_nanos() - i64::from(self.trim_ms) * 1_000_000)
    }

    /// It was made for that trim: nothing has to be slewed in.
    pub(super) fn begin_trimmed(&mut self, ms: i32) {
        self.trim_ms = ms.clamp(-TRIM_MS, TRIM_MS);
    }

    /// Sets how much later than the film the motion is, ±[`TRIM_MS`]; it is slewed in. Says whether that is another trim.
    pub(super) fn trim(&mut self, ms: i32) -> bool {
        let ms = ms.clamp(-TRIM_MS, TRIM_MS);
        let sooner_s = f64::from(self.trim_ms - ms) * 1e-3;
        self.trim_ms = ms;
        self.slew.owe(sooner_s);
        sooner_s != 0.0
    }

    /// Show time goes on from where it should be: what was still to be slewed in is met by the next join.
    pub(super) fn catch_up(&mut self) {
        let owed = ShowTime::from_secs_f64(self.slew.owed_s());
        self.at = ShowTime::from_nanos(self.at.as_nanos() + owed.as_nanos());
        self.slew.reset();
    }

    /// Show time runs on with the film, be it that no lane follows.
    pub(super) fn run(&mut self, span: Duration) {
        self.at += span;
    }

    /// Ticks were missed: the lanes fall behind the film.
    pub(super) fn miss(&mut self, gap: Duration) {
        self.slew.fall_behind(gap);
    }

    /// The film that is chased wants the frame to begin there: it is slewed to.
    pub(super) fn follow(&mut self, film: ShowTime) {
        let owed = ShowTime::from_nanos(film.as_nanos() - self.at.as_nanos());
        self.slew.set_owed_s(owed.as_secs_f64());
    }

    /// The lanes, which rest, go on from elsewhere in the cue.
    pub(super) const fn set(&mut self, at: ShowTime) {
        self.at = at;
    }

    /// The same, and nothing is to be slewed in.
    pub(super) fn restart(&mut self, at: ShowTime) {
        self.at = at;
        self.slew.reset();
    }

    /// The course of these lanes changes: show time goes on there, by so many seconds nearer to the film.
    pub(super) fn skip(&mut self, to: ShowTime, seconds: f64) {
        self.at = to;
        self.slew.skip(seconds);
    }

    /// Moves on by a frame.
    pub(super) fn pass(&mut self, time: Duration, pace: impl FnOnce() -> Pace) {
        let passed = if self.slew.is_done() && self.slew.is_calm() {
            time
        } else {
            match pace() {
                Pace::Kept => self.slew.coast(time),
                Pace::Within(ceiling) => self.slew.advance(time, ceiling),
            }
        };
        self.at += passed;
    }

    /// How fast show time runs, as a multiple of the clock.
    pub(super) fn pace(&self) -> f64 {
        self.slew.pace()
    }

    /// Whether no change of pace is left in what the measure sees.
    pub(super) fn is_calm(&self) -> bool {
        self.slew.is_calm()
    }

    /// How far missed ticks have put the lanes behind the film.
    pub(super) fn lag(&self) -> Duration {
        self.slew.lag()
    }

    /// How far the lanes are behind the film.
    pub(super) fn owed(&self) -> Duration {
        Duration::from_secs_f64(self.slew.owed_s().max(0.0))
    }
}
