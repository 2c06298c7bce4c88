//! What is worth a file of its own: the last minute, and what comes after.

use std::collections::VecDeque;
use std::time::Duration;

use super::chunk::{Handed, SentFrame};
use super::{AckRecord, TickHead};
use crate::health::HealthState;
use crate::state::State;
use crate::time::MonoTime;
use crate::tracker::Fate;

/// How long an incident goes on after what it is of.
const AFTER: Duration = Duration::from_secs(10);
/// How long one may last; what happens later is another.
const LONGEST: Duration = Duration::from_secs(300);
/// So many an hour that nobody asked for.
const AN_HOUR: usize = 6;
const HOUR: Duration = Duration::from_secs(3_600);
/// What nobody asked for tries no file for so long after one has failed.
const AGAIN: Duration = Duration::from_secs(30);
/// Ticks that leave no frame for longer than this leave seats without a lead.
const GAP: Duration = Duration::from_millis(50);

/// What an incident is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum IncidentCause {
    /// The hall was stopped.
    Stop,
    /// The hall is at fault.
    Fault,
    /// An emergency stop.
    EmergencyStop,
    /// The limiter held a seat back.
    Clamp,
    /// A seat fell out while frames went.
    LostSeat,
    /// The kernel did not take a frame, or a controller refused it.
    RefusedFrame,
    /// No frame left for more than 50 ms while seats moved.
    Gap,
    /// Somebody marked a moment.
    Mark,
    /// Somebody asks for what there is.
    Dump,
    /// The program before this one was killed.
    Crash,
}

impl IncidentCause {
    /// The word for it in names of files and figures.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Fault => "fault",
            Self::EmergencyStop => "emergency-stop",
            Self::Clamp => "clamp",
            Self::LostSeat => "lost-seat",
            Self::RefusedFrame => "refused-frame",
            Self::Gap => "gap",
            Self::Mark => "mark",
            Self::Dump => "dump",
            Self::Crash => "crash",
        }
    }

    /// True if somebody asked for it: such is never one too many.
    const fn is_asked_for(self) -> bool {
        matches!(self, Self::Mark | Self::Dump)
    }
}

/// Finds them in what crosses the taps.
#[derive(Debug)]
pub(crate) struct Watchman {
    period: Duration,
    state: Option<State>,
    /// The last tick sent frames.
    is_moving: bool,
    clamps: Vec<u64>,
    may_move: Vec<bool>,
}

impl Watchman {
    /// One of so many lanes, of ticks so far apart.
    pub(crate) fn new(lanes: usize, period: Duration) -> Self {
        Self { period, state: None, is_moving: false, clamps: vec![0; lanes], may_move: vec![false; lanes] }
    }

    /// Looks at a tick that begins; gives what it finds to `found`.
    pub(crate) fn begin(&mut self, head: &TickHead, found: &mut impl FnMut(IncidentCause, MonoTime)) {
        let before = self.state.replace(head.state);
        if before.is_some_and(|before| before != head.state) {
            match head.state {
                State::Fault => found(IncidentCause::Fault, head.deadline),
                State::Stopping => found(IncidentCause::Stop, head.deadline),
                State::Stopped if before != Some(State::Stopping) => {
                    found(IncidentCause::Stop, head.deadline);
                }
                _ => {}
            }
        }
        let missed = self.period * u32::try_from(head.missed).unwrap_or(u32::MAX);
        if self.is_moving && missed > GAP {
            found(IncidentCause::Gap, head.deadline);
        }
        self.is_moving = false;
    }

    /// Looks at a frame of that tick; also gives how often the limiter held the seat back since its last.
    pub(super) fn frame(
        &mut self,
        head: &TickHead,
        frame: &SentFrame<'_>,
        found: &mut impl FnMut(IncidentCause, MonoTime),
    ) -> u64 {
        self.is_moving = true;
        if frame.handed == Handed::Refused {
            found(IncidentCause::RefusedFrame, head.deadline);
        }
        // A frame that no tick asked for, and a show that was exchanged, begin anew.
        let Some(clamps) = self.clamps.get_mut(frame.lane).filter(|_| frame.asked.slots > 0) else {
            return 0;
        };
        let more = frame.asked.clamps.saturating_sub(std::mem::replace(clamps, frame.asked.clamps));
        if more > 0 {
            found(IncidentCause::Clamp, head.deadline);
        }
        more
    }

    /// Looks at something that the ack thread took in the drain of that instant.
    pub(super) fn ack(
        &mut self,
        at: MonoTime,
        record: &AckRecord<'_>,
        found: &mut impl FnMut(IncidentCause, MonoTime),
    ) {
        match *record {
            AckRecord::Fate(_, _, Fate::Answered(code), _) if code.refused() => {
                found(IncidentCause::RefusedFrame, at);
            }
            AckRecord::Standing(lane, standing) => {
                let Some(may_move) = self.may_move.get_mut(lane) else { return };
                let could = std::mem::replace(may_move, standing.may_move());
                let fell = matches!(
                    standing,
                    HealthState::Lost | HealthState::Stopped | HealthState::Error | HealthState::Excluded
                );
                if could && fell && self.is_moving {
                    found(IncidentCause::LostSeat, at);
                }
            }
            _ => {}
        }
    }
}

/// What becomes of something that is worth one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IncidentStep {
    /// Another file is begun.
    Begin,
    /// It joins the one that is under way.
    Join,
    /// There were enough this hour.
    TooMany,
}

/// Which of them get a file. Pure: told the time.
#[derive(Debug, Default)]
pub(crate) struct Incidents {
    /// Since when one is under way, and until when.
    open: Option<(MonoTime, MonoTime)>,
    begun: VecDeque<MonoTime>,
    /// When what nobody asked for may try a file again.
    again_at: MonoTime,
}

impl Incidents {
    /// Something is worth one.
    pub(crate) fn on(&mut self, cause: IncidentCause, at: MonoTime) -> IncidentStep {
        if let Some((since, until)) = &mut self.open {
            *until = (*until).max((at + AFTER).min(*since + LONGEST));
            return IncidentStep::Join;
        }
        if !cause.is_asked_for() {
            while self.begun.front().is_some_and(|begun| at.since(*begun) > HOUR) {
                self.begun.pop_front();
            }
            if at < self.again_at || self.begun.len() >= AN_HOUR {
                return IncidentStep::TooMany;
            }
            self.begun.push_back(at);
        }
        self.open = Some((at, at + AFTER));
        IncidentStep::Begin
    }

    /// Nothing is under way: its file failed, and is none of those of the hour. What happens later begins another.
    pub(crate) fn give_up(&mut self, now: MonoTime) {
        let since = self.open.take().map(|(since, _)| since);
        self.begun.pop_back_if(|begun| Some(*begun) == since);
        self.again_at = now + AGAIN;
    }

    /// True once the one that is under way is over.
    pub(crate) fn take_over(&mut self, now: MonoTime) -> bool {
        let is_over = self.open.is_some_and(|(_, until)| now >= until);
        if is_over {
            self.open = None;
        }
        is_over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn s(s: u64) -> MonoTime {
        MonoTime::from_nanos(s * 1_000_000_000)
    }

    #[test]
    fn what_happens_while_one_is_under_way_joins_it_and_makes_it_longer() {
        let mut incidents = Incidents::default();
        assert_eq!(incidents.on(IncidentCause::Clamp, s(100)), IncidentStep::Begin);
        assert_eq!(incidents.on(IncidentCause::Stop, s(108)), IncidentStep::Join);
        assert!(!incidents.take_over(s(117)));
        assert!(incidents.take_over(s(118)));
        assert!(!incidents.take_over(s(119)), "it is over once");
    }

    #[test]
    fn what_happens_after_a_file_has_failed_gets_another() {
        let mut incidents = Incidents::default();
        assert_eq!(incidents.on(IncidentCause::Mark, s(100)), IncidentStep::Begin);
        incidents.give_up(s(100));
        assert_eq!(incidents.on(IncidentCause::Mark, s(103)), IncidentStep::Begin);
    }

    #[test]
    fn files_that_fail_take_none_from_the_hour_and_are_tried_each_half_a_minute() {
        let mut incidents = Incidents::default();
        let mut tried = Vec::new();
        for second in 100..400 {
            if incidents.on(IncidentCause::Clamp, s(second)) == IncidentStep::Begin {
                tried.push(second);
                incidents.give_up(s(second));
            }
        }
        assert_eq!(tried, (100..400).step_by(30).collect::<Vec<_>>());
        // The disk takes files again.
        let begun = (0..8).filter(|at| {
            let step = incidents.on(IncidentCause::Stop, s(400 + at * 60));
            incidents.take_over(s(410 + at * 60));
            step == IncidentStep::Begin
        });
        assert_eq!(begun.count(), AN_HOUR);
    }

    #[test]
    fn none_goes_on_for_ever() {
        let mut incidents = Incidents::default();
        let ends = (0..1_000).find(|at| {
            incidents.on(IncidentCause::Clamp, s(*at));
            incidents.take_over(s(*at))
        });
        assert_eq!(ends, Some(300));
    }

    #[test]
    fn there_are_six_an_hour_but_whoever_marks_a_moment_is_heard() {
        let mut incidents = Incidents::default();
        let steps: Vec<_> = (0..8)
            .map(|at| {
                let step = incidents.on(IncidentCause::Gap, s(at * 60));
                incidents.take_over(s(at * 60 + 10));
                step
            })
            .collect();
        let mut wanted = [IncidentStep::Begin; 8];
        wanted[6..].fill(IncidentStep::TooMany);
        assert_eq!(steps, wanted);
        assert_eq!(incidents.on(IncidentCause::Mark, s(490)), IncidentStep::Begin);
        assert!(incidents.take_over(s(500)));
        assert_eq!(
            incidents.on(IncidentCause::Gap, s(3_661)),
            IncidentStep::Begin,
            "the first is an hour old"
        );
    }
}
