//! What may be on at a controller that nobody asks for: outputs, and vibration. A belief about the controller and no memory of what this
//! program sent: unknown counts as on. Ack thread; pure: told the time; allocates nothing.

use crate::config::ALL_OUTPUTS;
use crate::drive::{LeftOn, SentFrame};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// The amplitude, strokes, with which a seat may vibrate by frames that another program sent: no cue is known to ask for more.
const FOREIGN: f64 = 0.1;
/// So many answers in a row have to say that outputs are off: the network may repeat one from before.
const TIMES: u32 = 2;

/// Of one controller.
#[derive(Debug, Clone, Copy)]
pub(in crate::drive) struct OnBelief {
    /// Its outputs when it told them last, bit 0 = Y01.
    told: Option<u16>,
    /// Whether they may be on, and whether they were read off since anybody but our frames switched them: only then do our frames alone
    /// say how they are.
    lit: bool,
    obeys: bool,
    /// Answers in a row that say that they are off.
    dark_reads: u32,
    /// The first frame without outputs that none with any follows.
    dark_from: Option<FrameNo>,
    /// When the newest frame with any was sent.
    lit_at: MonoTime,
    /// The amplitude, strokes, with which its seat may vibrate.
    shakes: f64,
    /// The first frame without vibration that none with any follows.
    still_from: Option<FrameNo>,
    /// It is not by default, but by something that was sent or told.
    is_known: bool,
    /// PA05: outputs are told the other way round; none while that was not told.
    inverted: Option<bool>,
}

impl OnBelief {
    /// Nothing is known; `vibrates` where its dialect has vibration.
    pub(super) const fn unknown(vibrates: bool) -> Self {
        Self {
            told: None,
            lit: true,
            obeys: false,
            dark_reads: 0,
            dark_from: None,
            lit_at: MonoTime::from_nanos(0),
            shakes: if vibrates { FOREIGN } else { 0.0 },
            still_from: None,
            is_known: false,
            inverted: None,
        }
    }

    /// A frame goes to it.
    pub(super) fn on_sent(&mut self, sent: &SentFrame) {
        if sent.lights {
            (self.lit, self.dark_from, self.dark_reads) = (true, None, 0);
            (self.lit_at, self.is_known) = (sent.at, true);
        } else {
            self.dark_from.get_or_insert(sent.frame);
        }
        if sent.shakes > 0.0 {
            (self.shakes, self.still_from, self.is_known) = (self.shakes.max(sent.shakes), None, true);
        } else {
            self.still_from.get_or_insert(sent.frame);
        }
    }

    /// It has acked a frame.
    pub(super) fn on_ack(&mut self, acked: FrameNo) {
        let has = |from: Option<FrameNo>| from.is_some_and(|from| acked.since(from) >= 0);
        if has(self.dark_from) && self.obeys {
            self.lit = false;
        }
        if has(self.still_from) {
            self.shakes = 0.0;
        }
    }

    /// It has told how its outputs are told.
    pub(super) const fn on_polarity(&mut self, word: u16) {
        self.inverted = Some(word == 1);
    }

    /// Its outputs were read, by an answer that is no older than `made`. Gives those that are on, where that is known.
    pub(super) fn on_outputs(&mut self, word: u16, made: MonoTime) -> Option<u16> {
        let inverted = self.inverted.filter(|_| made > self.lit_at)?;
        let on = if inverted { !word } else { word } & ALL_OUTPUTS;
        self.told = Some(on);
        if on != 0 {
            self.on_lit();
            return self.told;
        }
        self.dark_reads += 1;
        if self.dark_reads >= TIMES {
            (self.lit, self.obeys) = (false, true);
        }
        self.told
    }

    /// It reports its outputs unasked, past frames that are held back on their way: that they are off is no proof.
    pub(super) fn on_reported(&mut self, word: u16) {
        if word & ALL_OUTPUTS != 0 && self.inverted == Some(false) && !self.lit {
            self.told = Some(word & ALL_OUTPUTS);
            self.on_lit();
        }
    }

    const fn on_lit(&mut self) {
        (self.lit, self.obeys, self.dark_reads, self.is_known) = (true, false, 0, true);
    }

    /// No frame goes to it any more, and its seat may vibrate by so much.
    pub(super) const fn on_cut_off(&mut self, shakes: f64) {
        self.shakes = self.shakes.max(shakes);
    }

    /// Its seat was read in one place for long enough.
    pub(super) const fn on_still(&mut self) {
        self.shakes = 0.0;
    }

    /// Whether its outputs are told the other way round was not told yet.
    pub(super) const fn wants_polarity(&self) -> bool {
        self.inverted.is_none()
    }

    pub(super) const fn shakes(&self) -> f64 {
        self.shakes
    }

    pub(in crate::drive) const fn left_on(&self) -> LeftOn {
        LeftOn { outputs: self.lit, told: self.told, shakes: self.shakes, is_known: self.is_known }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn sent(frame: u32, lights: bool, shakes: f64, at: u64) -> SentFrame {
        SentFrame { frame: FrameNo(frame), lights, shakes, at: ms(at) }
    }

    /// One of which it is known that nothing is on.
    fn dark() -> OnBelief {
        let mut on = OnBelief::unknown(true);
        on.on_polarity(0);
        assert_eq!([1, 2].map(|at| on.on_outputs(0, ms(at))), [Some(0); 2]);
        on.on_still();
        assert!(!on.left_on().is_any());
        on
    }

    #[test]
    fn unknown_counts_as_on_until_two_answers_say_that_outputs_are_off_and_the_seat_was_read_still() {
        let mut on = OnBelief::unknown(true);
        assert_eq!([1, 2].map(|at| on.on_outputs(0, ms(at))), [None, None]);
        assert!(on.left_on().outputs, "which way round they are told is not known");
        on.on_polarity(1);
        for (word, at, outputs) in
            [(0x0fff, 3, true), (0x0ffe, 4, true), (0x0fff, 5, true), (0x0fff, 6, false)]
        {
            assert_eq!(on.on_outputs(word, ms(at)), Some(!word & 0x0fff));
            assert_eq!(on.left_on().outputs, outputs, "at {at} ms");
        }
        assert!(on.left_on().shakes > 0.0 && !on.left_on().outputs);
        on.on_still();
        assert!(!on.left_on().is_any());
        assert!(OnBelief::unknown(false).left_on().shakes == 0.0, "its dialect has no vibration");
    }

    #[test]
    fn what_frames_switched_on_is_off_once_one_without_is_acked_or_it_is_read_since() {
        let mut on = dark();
        on.on_sent(&sent(5, true, 0.01, 10));
        assert_eq!(on.on_outputs(0, ms(9)), None, "made before");
        on.on_sent(&sent(6, false, 0.0, 20));
        on.on_ack(FrameNo(5));
        assert!(on.left_on().outputs && on.left_on().shakes > 0.0);
        on.on_ack(FrameNo(6));
        assert!(!on.left_on().is_any());
        on.on_sent(&sent(7, true, 0.0, 30));
        assert_eq!([40, 41].map(|at| on.on_outputs(0, ms(at))), [Some(0); 2]);
        assert!(!on.left_on().is_any(), "no frame said so");
    }

    #[test]
    fn outputs_that_somebody_else_switches_are_on_whatever_our_frames_say_until_they_are_read_off() {
        let mut on = dark();
        on.on_sent(&sent(5, false, 0.0, 10));
        on.on_reported(0b100);
        on.on_ack(FrameNo(5));
        assert_eq!((on.left_on().outputs, on.left_on().told), (true, Some(0b100)));
        on.on_reported(0);
        assert!(on.left_on().outputs, "it comes unasked, and may be older");
        assert_eq!([11, 12].map(|at| on.on_outputs(0, ms(at))), [Some(0); 2]);
        assert!(!on.left_on().is_any());
    }
}
