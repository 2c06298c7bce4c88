//! What is judged: where the axes of a seat really went, and how fast. Nothing that the program believes comes in here.

use std::fmt;

/// Losses, repeats and changes of order within this long are what README admits: what was to take so long is made up for in
/// one frame.
const ADMITTED_MS: f64 = 50.0;
/// How much faster than its type allows a seat may be that did not get some of its frames, or whose acks did not come, where each frame asks
/// for one and says itself how long it takes.
pub(crate) const FASTEST: f64 = 1.25;
/// Replies are read so often.
const UNREAD_MS: f64 = 5.0;
/// How much faster than its type allows a seat may be: roundings of pulses and milliseconds.
const SLACK: f64 = 1.01;
/// So long before its first frame, and two periods, a hall may have read a seat that is moved by hand meanwhile.
const READ_BEFORE_MS: f64 = 100.0;
/// Pulses that rounding may add to a distance.
const ROUNDING: f64 = 2.0;
/// Pulses of the axes that are judged: 5 mm a turn of 10,000 pulses.
pub(crate) const PULSES_PER_MM: f64 = 2_000.0;
/// So far outside of its stroke a seat may be found, and led back from, mm.
pub(crate) const OUTSIDE_MM: f64 = 11.0;
/// How closely the middle of a vibration is read, parts of its amplitude.
const READ_TO: f64 = 0.2;
/// What a seat may move by though nobody asked, mm.
const STILL_MM: f64 = 0.2;

/// One move that no seat may make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Breach {
    pub(crate) at_ns: u64,
    pub(crate) seat: usize,
    pub(crate) axis: usize,
    pub(crate) mm: f64,
    pub(crate) ms: f64,
    pub(crate) how: How,
    pub(crate) frame: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum How {
    Fast,
    Unasked,
    /// Led to a place that its stroke has not.
    Beyond,
    /// Outputs or vibration are on that nobody asks for; its number is the outputs.
    LeftOn,
}

impl Breach {
    pub(crate) fn mm_s(&self) -> f64 {
        self.mm / self.ms * 1_000.0
    }
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.at_ns as f64 * 1e-9;
        let (seat, axis, how) = (self.seat + 1, self.axis + 1, self.how);
        let (mm, ms, frame) = (self.mm, self.ms, self.frame);
        write!(
            f,
            "{at:.3} s: {how:?}: seat {seat}, axis {axis}: {mm:.2} mm in {ms:.0} ms, {:.0} mm/s, frame {frame}",
            self.mm_s()
        )
    }
}

/// How far apart two frames may have been sent that are executed one after the other, where what was in between is admitted.
/// It is twice as much where nobody told the hall which frames had come; where not each frame asks for an ack, the others come on top.
pub(crate) fn admitted_ms(period_ms: f64, asks_ms: f64, jitter_ms: f64, is_untold: bool) -> f64 {
    let lost = if is_untold { 2.0 * ADMITTED_MS } else { ADMITTED_MS };
    lost + UNREAD_MS + 2.0 * period_ms + (asks_ms - period_ms) + jitter_ms
}

/// How long before it sends the first frame of a motion a hall may have read the seat.
pub(crate) fn read_before_ns(period_ms: f64) -> u64 {
    ((READ_BEFORE_MS + 2.0 * period_ms) * 1e6) as u64
}

/// One move of one frame, as the seat executes it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Executed {
    /// How far each axis goes, pulses.
    pub(crate) far: [f64; 12],
    /// In how long.
    pub(crate) ms: f64,
    /// What its Time said.
    pub(crate) time_ms: f64,
    /// How long what was lost or repeated took that it makes up for, and that is admitted.
    pub(crate) makes_up_ms: f64,
    /// Whether the network brought frames closer together than they were sent.
    pub(crate) bunched: bool,
    /// How far each axis was moved by hand since it may have been read last, pulses.
    pub(crate) by_hand: [f64; 12],
    /// Whether somebody had asked for motion when it was sent.
    pub(crate) asked: bool,
    /// The greatest amplitude with which the seat vibrated until then, pulses: where it does so about is read as exactly as that.
    pub(crate) shook: f64,
}

impl Executed {
    /// The first axis that goes too far, how far, mm, and in which way.
    pub(crate) fn verdict(&self, mm_s: f64) -> Option<(usize, f64, How)> {
        // What was lost for a moment is made up for in one frame; what came in a heap is executed in haste, where the seat is
        // set to.
        let time = if self.bunched { self.time_ms } else { self.ms };
        let far = time.max(self.makes_up_ms) * mm_s * PULSES_PER_MM / 1_000.0 * SLACK + ROUNDING;
        let over = |axis: usize| self.far[axis].abs() - self.by_hand[axis];
        let axis = (0..12).max_by(|a, b| over(*a).total_cmp(&over(*b)))?;
        let mm = self.far[axis].abs() / PULSES_PER_MM;
        if over(axis) > far {
            return Some((axis, mm, How::Fast));
        }
        (!self.asked && over(axis) > STILL_MM * PULSES_PER_MM + READ_TO * self.shook).then_some((
            axis,
            mm,
            How::Unasked,
        ))
    }
}
