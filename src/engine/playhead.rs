//! Where in the cue the lanes are, frame by frame, and where they should be by the film.

use std::time::Duration;

use super::millis;
use super::slew::{Slew, Slewing};
use crate::time::{Rate, ShowTime, TRIM_MS};

/// How quickly show time may run in a frame.
#[derive(Debug, Clone, Copy)]
pub(super) enum FramePace {
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
    /// Where it should be: by the show's own film, which runs by the frames' Times, whatever the clock does, so that an undisturbed grid
    /// leaves no error; or by the one that is chased. The trim is taken off.
    due: ShowTime,
    /// How much of what it is behind that missed ticks have made, seconds.
    missed_s: f64,
    /// How much further than the clock the film that is chased goes in the next frame, seconds.
    film_s: f64,
    /// How much later than the film the motion is to be, milliseconds.
    trim_ms: i32,
    slew: Slew,
}

impl Playhead {
    pub(super) fn new(rate: Rate, start: ShowTime, slewing: Slewing) -> Self {
        let slew = Slew::new(rate, slewing);
        let (at, reached, due) = (start, start, start);
        Self { rate, frames: 0, at, reached, due, missed_s: 0.0, film_s: 0.0, trim_ms: 0, slew }
    }

    /// The show time of the next tick: where in the cue the lanes are.
    #[must_use]
    pub const fn at(&self) -> ShowTime {
        self.at
    }

    /// Where the film is: what the playhead will be at once all lag and trim are slewed in, and the trim.
    #[must_use]
    pub(crate) fn film(&self) -> ShowTime {
        self.film_at(self.due)
    }

    /// Where the film is while the motion is to be there in the cue.
    pub(super) fn film_at(&self, cue: ShowTime) -> ShowTime {
        ShowTime::from_nanos(cue.as_nanos() + trim_ns(self.trim_ms))
    }

    /// How long the frame of the next tick takes.
    #[must_use]
    pub(crate) fn frame_time(&self) -> Duration {
        millis(self.rate.time_ms(self.frames))
    }

    /// The Time of the next frame, ms, which is counted.
    pub(super) fn next_frame(&mut self) -> u32 {
        let time_ms = self.rate.time_ms(self.frames);
        self.frames += 1;
        time_ms
    }

    pub(crate) const fn frames(&self) -> u64 {
        self.frames
    }

    pub(crate) const fn reached(&self) -> ShowTime {
        self.reached
    }

    /// A pose is sent that is reached there.
    pub(super) const fn reach(&mut self) -> ShowTime {
        self.reached = self.at;
        self.reached
    }

    /// Where in the cue the lanes are to be at a time of the film.
    pub(super) fn cue_time(&self, film: ShowTime) -> ShowTime {
        ShowTime::from_nanos(film.as_nanos() - trim_ns(self.trim_ms))
    }

    /// It was made for that trim: nothing has to be slewed in.
    pub(super) fn begin_trimmed(&mut self, ms: i32) {
        self.trim_ms = ms.clamp(-TRIM_MS, TRIM_MS);
    }

    /// Sets how much later than the film the motion is, ±[`TRIM_MS`]; it is slewed in. Says whether that is another trim.
    pub(super) fn trim(&mut self, ms: i32) -> bool {
        let film = self.film();
        let before = std::mem::replace(&mut self.trim_ms, ms.clamp(-TRIM_MS, TRIM_MS));
        // The film is where it was; what is owed to it is another.
        self.due = self.cue_time(film);
        before != self.trim_ms
    }

    /// Show time goes on from where it should be: what was still to be slewed in is met by the next join.
    pub(super) const fn catch_up(&mut self) {
        self.restart(self.due);
    }

    /// Show time runs on with the film, even if no lane follows.
    pub(super) fn run(&mut self, span: Duration) {
        self.at += span;
        self.due += span;
    }

    /// Ticks were missed: the film ran on, and the lanes fall behind it.
    pub(super) fn miss(&mut self, gap: Duration) {
        self.due += gap;
        // Counted apart from a trim, which is never a reason to hold, however much of it is still to come.
        self.missed_s += gap.as_secs_f64();
    }

    /// The film that is chased wants the frame to begin there: it is slewed to.
    pub(super) fn follow(&mut self, due: ShowTime) {
        self.film_s = ShowTime::from_nanos(due.as_nanos() - self.due.as_nanos()).as_secs_f64();
        self.due = due;
        self.missed_s = self.owed_s().max(0.0);
    }

    /// The lanes, and the film of their own with them, go on from elsewhere in the cue.
    pub(super) const fn set(&mut self, at: ShowTime) {
        // Its film goes with it, so that a seek neither makes a debt nor settles one.
        self.due = ShowTime::from_nanos(self.due.as_nanos() + at.as_nanos() - self.at.as_nanos());
        self.at = at;
    }

    /// The same, and nothing is to be slewed in.
    pub(super) const fn restart(&mut self, at: ShowTime) {
        (self.at, self.due, self.missed_s) = (at, at, 0.0);
        self.slew.reset();
    }

    /// The course of these lanes changes: show time goes on there, which is by so much nearer to the film.
    pub(super) fn skip(&mut self, to: ShowTime, nearer: ShowTime) {
        self.set(to);
        self.due = ShowTime::from_nanos(self.due.as_nanos() - nearer.as_nanos());
        self.close_in(nearer.as_secs_f64());
        // The course was planned from that pace, and begins at the clock's.
        self.slew.end();
    }

    /// Moves on by a frame, at a pace that is asked for where it may be another than the clock's.
    pub(super) fn pass(&mut self, time: Duration, pace: impl FnOnce() -> FramePace) {
        let film_s = std::mem::take(&mut self.film_s);
        // In whole nanoseconds: an undisturbed show has no rounding that hours could add up.
        if self.at == self.due && self.slew.is_calm() {
            return self.run(time);
        }
        let owed_s = self.owed_s();
        self.at += match pace() {
            FramePace::Kept => self.slew.coast(time),
            FramePace::Within(ceiling) => self.slew.advance(time, ceiling, owed_s, film_s),
        };
        self.due += time;
        self.close_in(owed_s - self.owed_s());
    }

    /// So much of what was owed is made good.
    fn close_in(&mut self, seconds: f64) {
        // A trim in the other direction can cancel what was missed: no more lag is left than is owed.
        self.missed_s = (self.missed_s - seconds).clamp(0.0, self.owed_s().max(0.0));
    }

    /// How far the playhead is behind where it should be, seconds; below zero it is ahead.
    fn owed_s(&self) -> f64 {
        ShowTime::from_nanos(self.due.as_nanos() - self.at.as_nanos()).as_secs_f64()
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
        Duration::from_secs_f64(self.missed_s)
    }

    /// How far the lanes are behind the film.
    pub(super) fn owed(&self) -> Duration {
        Duration::from_secs_f64(self.owed_s().max(0.0))
    }
}

const fn trim_ns(ms: i32) -> i64 {
    ms as i64 * 1_000_000
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Duration = Duration::from_millis(10);

    #[test]
    fn an_undisturbed_grid_leaves_no_error_whatever_whole_milliseconds_make_of_the_rate() {
        for hz in [24.0, 60.0, 72.0, 333.0] {
            let mut playhead = Playhead::new(Rate::from_hz(hz), ShowTime::from_millis(500), Slewing::OWN);
            for _ in 0..10_000 {
                let time = millis(playhead.next_frame());
                playhead.pass(time, || unreachable!("the pace is the clock's"));
                assert_eq!(playhead.film(), playhead.at(), "{hz} Hz");
            }
        }
    }

    #[test]
    fn the_film_runs_on_through_missed_ticks_and_waits_while_lanes_rest() {
        let mut playhead = Playhead::new(Rate::from_hz(100.0), ShowTime::ZERO, Slewing::OWN);
        playhead.miss(3 * FRAME);
        assert_eq!((playhead.film(), playhead.lag()), (ShowTime::from_millis(30), 3 * FRAME));
        (0..1_000).for_each(|_| playhead.pass(FRAME, || FramePace::Within(0.01)));
        assert_eq!((playhead.film(), playhead.at()), (ShowTime::from_millis(10_030), playhead.film()));
        assert_eq!(playhead.lag(), Duration::ZERO);
        playhead.set(ShowTime::from_millis(2_000)); // a seek in a pause
        assert_eq!(playhead.film(), ShowTime::from_millis(2_000));
    }

    #[test]
    fn a_trim_moves_the_motion_against_the_film_and_is_no_lag() {
        let mut playhead = Playhead::new(Rate::from_hz(100.0), ShowTime::ZERO, Slewing::OWN);
        assert!(playhead.trim(-40) && !playhead.trim(-40));
        assert_eq!((playhead.film(), playhead.lag()), (ShowTime::ZERO, Duration::ZERO));
        assert_eq!(playhead.owed(), 4 * FRAME, "the motion is to be sooner");
        playhead.catch_up();
        assert_eq!(playhead.at(), playhead.cue_time(playhead.film()));
    }
}
