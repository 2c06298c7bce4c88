//! Labels as they come into places in the film. A label does not say how long its frame lasts: unless that is configured it is
//! measured, by how long the labels take.

#[cfg(test)]
mod tests;

use std::time::Duration;

use super::timecode::{FrameRate, Label, Timecode, TimecodeError};
use crate::time::{MonoTime, ShowTime};

/// Deviations by which the times of two labels differ by chance at the most.
const SIGMAS: f64 = 4.0;
/// After so long the rate is guessed from what cannot be told apart yet: 24 and 23.976 are a millisecond apart after a second,
/// a network's jitter is ten.
const GUESS_AFTER: Duration = Duration::from_secs(1);
/// Labels that are off by more are not late, they jumped, seconds: twice the longest block of sound whose labels a player sends at once.
const LATEST_S: f64 = 0.2;
/// How much of the worst lateness is left after each label, and by how much an instant may be off beyond it.
const LATE_KEPT: f64 = 0.999;
const LATE_MARGIN: f64 = 1.5;
/// After so long without a rate a person has to say it.
const FIND_WITHIN: Duration = Duration::from_secs(5);
/// So many seconds in a row that end with the same frame contradict what is configured.
const CONTRADICTS: u32 = 2;

/// What is known of the labels of one source.
#[derive(Debug, Clone)]
pub(crate) struct LabelClock {
    configured: Option<FrameRate>,
    start: Label,
    /// Deviation of the time of a label, seconds.
    sigma_s: f64,
    /// The first label since they count on, and the quarters of a frame that had passed.
    first: Option<(MonoTime, Label, i64)>,
    newest: Option<(MonoTime, Label, i64)>,
    /// How unevenly labels have come of late, seconds.
    late_s: f64,
    /// Since when labels come of which no rate is known.
    unfound: Option<MonoTime>,
    highest: u8,
    found: Option<FrameRate>,
    is_sure: bool,
    contradictions: u32,
    refused: Option<TimecodeError>,
}

impl LabelClock {
    /// A source whose frames last as `configured` says, or as is found; the label `start` is time 0 of the film.
    pub(crate) const fn new(configured: Option<FrameRate>, start: Label, sigma_s: f64) -> Self {
        Self {
            configured,
            start,
            sigma_s,
            first: None,
            newest: None,
            late_s: 0.0,
            unfound: None,
            highest: 0,
            found: None,
            is_sure: false,
            contradictions: 0,
            refused: None,
        }
    }

    /// How frames are labelled, as far as that is known.
    pub(crate) fn rate(&self) -> Option<FrameRate> {
        let drops = self.newest.is_some_and(|(_, label, _)| label.drops);
        self.configured.map_or(self.found, |rate| rate.dropping(drops))
    }

    /// The label of the film's time 0, once it is known how frames are labelled.
    pub(crate) fn start(&self) -> Option<Timecode> {
        self.start_at(self.rate()?).ok()
    }

    /// Why the labels are none that can be used.
    pub(crate) const fn refused(&self) -> Option<&TimecodeError> {
        self.refused.as_ref()
    }

    /// Where the film was at an instant at which so many quarters of a frame had passed since the begin of the one that a label
    /// names; `labels` is how many there are in a second, if the source says so.
    pub(crate) fn media(
        &mut self,
        at: MonoTime,
        label: Label,
        quarters: i64,
        labels: Option<u32>,
    ) -> Option<ShowTime> {
        self.hold_against_configured(at, label, labels);
        self.highest = self.highest.max(label.frames);
        if self.configured.is_none() && !self.is_sure {
            self.find((at, label, quarters), labels);
        }
        self.newest = Some((at, label, quarters));
        let placed = match (self.configured, self.rate()) {
            (_, Some(rate)) => self.place(rate, label, quarters),
            (Some(rate), None) => Err(TimecodeError::Drops { label, rate }),
            (None, None) => return self.unfound(at),
        };
        self.unfound = None;
        // What was refused for how its seconds end is refused until one ends otherwise.
        match placed {
            Ok(media) if self.contradictions < CONTRADICTS => {
                self.refused = None;
                Some(media)
            }
            Ok(_) => None,
            Err(error) => {
                // The first is as good as those after it, and whoever reads it has the time to.
                if !self.is_refused_alike(&error) {
                    self.refused = Some(error);
                }
                None
            }
        }
    }

    fn unfound(&mut self, at: MonoTime) -> Option<ShowTime> {
        let since = *self.unfound.get_or_insert(at);
        self.refused = (at.since(since) > FIND_WITHIN).then_some(TimecodeError::Unfound);
        None
    }

    /// Whether that adds nothing to what is said already: another label that is refused for the same, or for how seconds end.
    fn is_refused_alike(&self, error: &TimecodeError) -> bool {
        self.refused.as_ref().is_some_and(|said| {
            let ends = matches!(said, TimecodeError::SecondEnds { .. } | TimecodeError::Says { .. });
            (ends && matches!(error, TimecodeError::Range { .. }))
                || std::mem::discriminant(said) == std::mem::discriminant(error)
        })
    }

    fn start_at(&self, rate: FrameRate) -> Result<Timecode, TimecodeError> {
        Timecode::of(Label { drops: rate.drops(), ..self.start }, rate)
    }

    fn place(&self, rate: FrameRate, label: Label, quarters: i64) -> Result<ShowTime, TimecodeError> {
        let start = self.start_at(rate)?;
        let frame = Timecode::of(label, rate)?;
        Ok(rate.quarters(frame.since(start).saturating_mul(4).saturating_add(quarters)))
    }

    fn hold_against_configured(&mut self, at: MonoTime, label: Label, labels: Option<u32>) {
        let Some(rate) = self.configured else { return };
        if let Some(said) = labels {
            self.contradictions = if said == rate.labels() { 0 } else { CONTRADICTS };
            self.refused = (said != rate.labels()).then_some(TimecodeError::Says { said, rate });
            return;
        }
        // A label that this rate cannot have says nothing of how its seconds end; it is refused for itself.
        if rate.dropping(label.drops).is_none() {
            self.newest = None;
        }
        let Some((before, last, _)) = self.newest else { return };
        // Of a source that loses some the last of a second may be any.
        let is_next = at.since(before).as_secs_f64() < 1.5 / f64::from(rate.labels());
        let ends = label.seconds == (last.seconds + 1) % 60 && label.frames <= 2;
        if !is_next || !ends {
            return;
        }
        if u32::from(last.frames) + 1 == rate.labels() {
            self.contradictions = 0;
        } else {
            self.contradictions += 1;
            if self.contradictions >= CONTRADICTS {
                self.refused = Some(TimecodeError::SecondEnds { last: last.frames, rate });
            }
        }
    }

    /// Looks which rate makes the labels take as long as they do.
    fn find(&mut self, told: (MonoTime, Label, i64), labels: Option<u32>) {
        let (at, label, quarters) = told;
        let highest = u32::from(self.highest);
        let may_be = |rate: &FrameRate| {
            rate.dropping(label.drops) == Some(*rate)
                && highest < rate.labels()
                && labels.is_none_or(|labels| labels == rate.labels())
        };
        let mut rates = FrameRate::ALL.into_iter().filter(may_be);
        // What a source says leaves no question at two of its four rates, however unevenly its labels come.
        if let (Some(_), Some(only), None) = (labels, rates.next(), rates.next()) {
            (self.found, self.is_sure) = (Some(only), true);
            return;
        }
        self.note_lateness(told, labels);
        let Some((since, first, begun)) = self.first.filter(|(_, first, _)| first.drops == label.drops)
        else {
            self.first = Some(told);
            return;
        };
        let passed = at.since(since);
        // Labels of 24 and of 23.976 are the same; how long they take is not.
        let off = |rate: FrameRate| -> Option<f64> {
            let frames = Timecode::of(label, rate).ok()?.since(Timecode::of(first, rate).ok()?);
            Some((rate.quarters(4 * frames + quarters - begun).as_secs_f64() - passed.as_secs_f64()).abs())
        };
        let (mut best, mut second) = (None, f64::INFINITY);
        for rate in FrameRate::ALL.into_iter().filter(may_be) {
            let off = off(rate).unwrap_or(f64::INFINITY);
            match best {
                Some((_, least)) if off >= least => second = second.min(off),
                _ => {
                    second = best.map_or(second, |(_, least)| least);
                    best = Some((rate, off));
                }
            }
        }
        // Two instants are compared, each off by its own noise: together by root two of it.
        let by_chance = (SIGMAS * std::f64::consts::SQRT_2 * self.sigma_s).max(LATE_MARGIN * self.late_s);
        match best {
            // Only if no other rate explains the labels as well. A wrong one is
            // 3.6 s off an hour into the film: seats would follow another scene.
            Some((rate, off)) if off < by_chance && second > off + 2.0 * by_chance => {
                (self.found, self.is_sure) = (Some(rate), true);
            }
            Some((rate, off)) if off < 2.0 * by_chance && passed >= GUESS_AFTER => {
                // Of two that cannot be told apart yet the whole number is likelier.
                let whole = if rate == FrameRate::F23_976 { FrameRate::F24 } else { rate };
                self.found.get_or_insert(if rate == FrameRate::F29_97 { FrameRate::F30 } else { whole });
            }
            Some((_, off)) if off > 2.0 * by_chance => self.first = Some(told), // it jumped, or is wound
            _ => {}
        }
    }

    /// Notes how far the instant of a label is from what the one before it makes of it. Only a source that says how many it has in a second
    /// sends them as it likes; of sound each has its own instant.
    fn note_lateness(&mut self, (at, label, quarters): (MonoTime, Label, i64), labels: Option<u32>) {
        let Some((labels, (before, last, begun))) = labels.zip(self.newest) else { return };
        let rate = FrameRate::whole(labels, label.drops);
        let code = |label| Timecode::of(label, rate).ok();
        let Some((here, there)) = code(label).zip(code(last)) else { return };
        let due = rate.quarters(4 * here.since(there) + quarters - begun).as_secs_f64();
        let off = (due - at.since(before).as_secs_f64()).abs();
        self.late_s *= LATE_KEPT;
        if off < LATEST_S {
            self.late_s = self.late_s.max(off);
        }
    }
}
