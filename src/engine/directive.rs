//! What the hall wants, held against what the lanes do: one table. None of it waits: each is taken up by the tick it is told before.

use std::time::Duration;

use super::phase::{Holding, Phase, Rest};
use super::{Ending, Engine};
use crate::time::ShowTime;

/// What the hall wants of the engine: told every tick, so that none can be missed, and told again it changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Directive {
    /// Nothing is to begin: the hall is not ready.
    Off,
    /// Nothing is to begin until somebody lets the show go.
    Wait,
    /// The lanes are to follow the cue, from a pause as well.
    Play,
    /// They are to come to rest, and the film waits.
    Hold,
    /// The same for a moment: the film that is chased has jumped, and frames hold the lanes until it is known where it is.
    HoldBriefly,
    /// They are to come to rest, and nothing goes on from there.
    Stop,
    /// They are to park, and then the show is over.
    Park,
}

/// What that makes of a phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PhaseTurn {
    /// Nothing.
    Stay,
    /// A show that waits begins.
    Begin,
    /// The lanes come to rest, without the planner.
    ComeDown(Rest),
    /// They rest already, or will: of a course that was asked for from there nothing may begin any more.
    StayDown,
    /// The way to park is asked for as soon as there can be one.
    Depart,
    /// The same from where nothing was set in motion: no frame tells of this rest.
    DepartUntold,
}

impl Directive {
    #[rustfmt::skip] // As a table.
    const fn turns(self, phase: &Phase) -> PhaseTurn {
        use Phase::{Braking, Closing, Done, Following, Holding as Held, Parking, Settling, Waiting};
        use Rest::{Ended, Film, Late, Paused, Stopped};
        match (self, phase) {
            // One that waits goes on waiting through a stop.
            (Self::Stop | Self::Hold | Self::HoldBriefly | Self::Off | Self::Wait, Waiting(_) | Done) => PhaseTurn::Stay,
            (Self::Off | Self::Wait,
                Settling(_) | Following(_) | Braking(_) | Held(_) | Parking(_) | Closing(..)) => PhaseTurn::Stay,

            (Self::Play, Waiting(_)) => PhaseTurn::Begin,
            (Self::Play,
                Settling(_) | Following(_) | Braking(_) | Held(_) | Parking(_) | Closing(..) | Done) => PhaseTurn::Stay,

            (Self::Hold, Settling(_) | Following(_) | Braking(Ended)) => PhaseTurn::ComeDown(Paused),
            (Self::Hold, Held(Holding { why: Late | Film | Ended, .. })) => PhaseTurn::ComeDown(Paused),
            (Self::Hold, Held(Holding { why: Paused, .. })) => PhaseTurn::StayDown,
            (Self::Hold, Braking(Late | Film | Paused | Stopped)) => PhaseTurn::Stay,
            (Self::Hold, Held(Holding { why: Stopped, .. }) | Parking(_) | Closing(..)) => PhaseTurn::Stay,

            (Self::HoldBriefly, Settling(_) | Following(_) | Braking(Ended)) => PhaseTurn::ComeDown(Film),
            (Self::HoldBriefly, Held(Holding { why: Late | Ended, .. })) => PhaseTurn::ComeDown(Film),
            // Lanes to which nothing goes any more are not held anew: a frame would take a seat back that was moved by hand meanwhile.
            (Self::HoldBriefly, Held(Holding { why: Film | Paused, .. })) => PhaseTurn::StayDown,
            (Self::HoldBriefly, Braking(Late | Film | Paused | Stopped)) => PhaseTurn::Stay,
            (Self::HoldBriefly, Held(Holding { why: Stopped, .. }) | Parking(_) | Closing(..)) => PhaseTurn::Stay,

            (Self::Stop, Braking(Stopped) | Held(Holding { why: Stopped, .. })) => PhaseTurn::StayDown,
            (Self::Stop, Braking(Late | Film | Ended | Paused)) => PhaseTurn::ComeDown(Stopped),
            (Self::Stop, Held(Holding { why: Late | Film | Ended | Paused, .. })) => PhaseTurn::ComeDown(Stopped),
            (Self::Stop, Settling(_) | Following(_) | Parking(_) | Closing(..)) => PhaseTurn::ComeDown(Stopped),

            // Before the first frame, and after the last.
            (Self::Park, Waiting(_) | Done) => PhaseTurn::DepartUntold,
            (Self::Park, Settling(_) | Following(_) | Braking(_) | Held(_)) => PhaseTurn::Depart,
            (Self::Park, Parking(_) | Closing(..)) => PhaseTurn::Stay,
        }
    }
}

impl Engine {
    /// Takes what the hall wants, as often as it is told.
    pub(crate) fn obey(&mut self, directive: Directive) {
        let before = std::mem::replace(&mut self.directive, directive);
        // Whoever has parked is done, and is not to park anew.
        if (before, directive) == (Directive::Park, Directive::Park) {
            return;
        }
        let turn = directive.turns(&self.phase);
        if turn != PhaseTurn::Stay && matches!(directive, Directive::Stop | Directive::Park) {
            self.ending = Ending::Stopped;
        }
        // A stop has the last word: no seek that was asked for before may set anything in motion after it.
        if turn != PhaseTurn::Stay && directive == Directive::Stop {
            self.planner.sought = None;
        }
        match turn {
            PhaseTurn::Stay => {}
            PhaseTurn::Begin => {
                let Self { show, phase, .. } = self;
                phase.carry(|course| Phase::first(show, course));
            }
            PhaseTurn::ComeDown(why) => self.come_down(why),
            PhaseTurn::StayDown => self.give_up_replans(),
            PhaseTurn::Depart => self.depart(),
            PhaseTurn::DepartUntold => self.rest_untold(),
        }
    }

    /// Parks, hold frames, and the end.
    ///
    /// Where no frame has left, only lanes that are astray are brought there, and where none is, it is the end, and no frame goes out:
    /// nothing has been set in motion, and the lanes may still be on a slow way to park, or where nobody knows.
    fn depart(&mut self) {
        if self.playhead.frames() > 0 || self.phase.rest().is_some() {
            return;
        }
        if self.is_astray() {
            self.rest_untold();
        } else {
            self.enter(Phase::Done);
        }
    }

    /// Brings lanes that are to park to rest without the planner, where it has not told the way: from there it is asked anew.
    pub(crate) fn rest_to_park(&mut self) {
        if self.is_to_park() && self.phase.is_following() {
            self.come_down(Rest::Ended);
        }
    }

    /// Ends the play where the lanes are.
    pub(crate) fn end(&mut self) {
        self.enter(Phase::Done);
    }

    /// Goes on elsewhere in the film, from a pause once it is resumed. A time after the end is the end.
    pub(crate) fn seek(&mut self, film: ShowTime) {
        let target = self.playhead.cue_time(film.min(self.timeline.duration()));
        match &self.phase {
            // Lanes at rest go on from there by whatever leads them on: of a hold after a gap the film runs meanwhile.
            Phase::Braking(Rest::Paused) | Phase::Holding(Holding { why: Rest::Paused | Rest::Late, .. }) => {
                self.give_up_replans();
                self.playhead.set(target);
            }
            Phase::Settling(_) | Phase::Following(_) if !self.is_to_park() => {
                self.planner.sought = Some(target);
            }
            _ => {}
        }
    }

    /// Lanes that rest before the way to where somebody seeks was known go on from there.
    pub(super) fn seek_at_rest(&mut self) {
        if let Some(target) = self.planner.sought.take() {
            self.playhead.restart(target);
        }
    }

    /// Sets how much later than the film the motion is to be; it is slewed in.
    pub(crate) fn trim(&mut self, ms: i32) {
        if self.playhead.trim(ms)
            && let Phase::Braking(Rest::Paused)
            | Phase::Holding(Holding { why: Rest::Paused, next: None, .. }) = self.phase
        {
            self.playhead.catch_up();
        }
    }

    /// Where in the cue the film that is chased wants a frame of that Time to lead.
    pub(super) fn chase(&mut self, target: ShowTime, time: Duration) {
        if self.directive != Directive::Play {
            return;
        }
        // The target is where this frame ends; show time here is where it begins.
        let before = ShowTime::from_nanos(target.as_nanos() - (ShowTime::ZERO + time).as_nanos());
        match &self.phase {
            // At the first frame, and out of a rest, the lanes join the film wherever it is.
            Phase::Settling(_) | Phase::Following(_) if self.playhead.frames() > 1 => {
                self.playhead.follow(before);
            }
            Phase::Settling(_) | Phase::Following(_) | Phase::Holding(Holding { why: Rest::Paused, .. }) => {
                self.halt(Rest::Film);
                self.playhead.restart(before);
            }
            // Once a course is asked for, show time runs on to where that begins.
            Phase::Holding(Holding { why: Rest::Late | Rest::Film, next: None, .. }) => {
                self.playhead.set(before);
            }
            _ => {}
        }
    }

    /// Whether the lanes are to park, come what may.
    pub(super) fn is_to_park(&self) -> bool {
        self.directive == Directive::Park
    }

    /// Goes over into another phase. What belonged to the one that is left is freed on another thread.
    pub(super) fn enter(&mut self, phase: Phase) {
        self.give_up_replans();
        let left = std::mem::replace(&mut self.phase, phase);
        left.into_course().into_iter().for_each(|course| self.planner.retired.put(course));
    }

    /// What was to lead on does no more.
    pub(super) fn give_up_replans(&mut self) {
        self.phase.take_replans().into_iter().flatten().for_each(|replan| self.planner.give_up(replan));
    }
}
