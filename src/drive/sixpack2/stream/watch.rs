//! What is asked of units while they play, and what the answers mean.

use std::time::Duration;

use super::axis::{Axis, OFF_COURSE_MM, READING};
use super::lane::SixpackLane;
use super::{PROBES, Sixpack2, TARGETS, Track, number};
use crate::drive::link::{LinkFault, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent, axis_number};
use crate::drive::sixpack2::ask::{WHO, at_waking_rate, searches, where_is, who_now};
use crate::drive::sixpack2::look::OUTSIDE_MM;
use crate::drive::sixpack2::scale::BESIDE_MM;
use crate::drive::sixpack2::talk::{ANSWER, TalkFault};
use crate::time::MonoTime;
use crate::wire::sixpack2::{ActionsTold, PositionTold, SixpackOrder, SixpackReply, UnitTold, action};

/// How often a unit is asked who it is.
const IDENTITY: Duration = Duration::from_secs(10);
/// From one look whether a motor still moves to the next.
const LOOKS: Duration = Duration::from_millis(20);
/// So many looks in a row at a motor that was told to stop long ago and moves put its lane out: an answer that is damaged looks like two.
const STRAYS: u32 = 3;
/// So often at the least motors are told to stop before nobody tells them anything, if they do not say that they do.
const SETTLES: u32 = 20;
/// So often where their unit does not answer at all.
const SILENT: u32 = 5;

/// What motors do that were told to stop.
#[derive(Debug, Clone, Copy)]
enum Stands {
    /// Nothing, all of them.
    All,
    /// This one does something.
    Not(usize),
    /// Their unit does not answer.
    Silent,
}

impl<P: LinkPort> Stream<Sixpack2, P> {
    /// True if there is time for a question: right behind a slice, which makes the next one late by no more than it takes, or later where
    /// it is over before the next. While somebody plays one in so many targets may make a slice late.
    pub(super) fn has_time(&mut self) -> bool {
        let is_fresh = std::mem::take(&mut self.own.is_fresh);
        let has_room = self.talk.question_over() <= self.own.next_slice;
        let is_urgent = self.own.targets >= TARGETS || !self.lanes.iter().any(SixpackLane::plays);
        has_room || is_fresh && is_urgent
    }

    /// Asks what is due; false where nothing is.
    pub(super) fn ask_next(&mut self, now: MonoTime) -> Result<bool, LinkFault> {
        let count = self.lanes.len();
        for step in 0..count {
            let index = (self.own.next_asked + step) % count;
            let lane = &self.lanes[index];
            let (is_due, targets) = (lane.own.not_before <= now, std::mem::take(&mut self.own.targets));
            match lane.stage {
                Stage::Lost if is_due => self.probe(index, now)?,
                Stage::Out if is_due && lane.own.known.is_none() => self.probe(index, now)?,
                Stage::Readying if is_due => self.look_at(index, now)?,
                Stage::Ready | Stage::Runs | Stage::Ends if targets > 0 => self.ask(index, now)?,
                _ => {
                    self.own.targets = targets;
                    continue;
                }
            }
            return Ok(true);
        }
        Ok(false)
    }

    /// Asks a lane that is led: its next motor, or who it is.
    fn ask(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        self.own.next_asked = (index + 1) % self.lanes.len();
        let lane = &mut self.lanes[index];
        let axis = lane.own.next_axis;
        // Once for all of its motors: whoever wants to know again and again keeps none of them from being read.
        if axis == 0 && !lane.own.asked_who && lane.own.known.is_none_or(|at| now.since(at) >= IDENTITY) {
            lane.own.asked_who = true;
            return self.ask_who(index, now);
        }
        lane.own.asked_who = false;
        lane.own.next_axis = (axis + 1) % lane.axes.len();
        if let Some(told) = self.place_of(index, axis)? {
            self.judge(index, axis, told)?;
        }
        Ok(())
    }

    /// Who it is, which tells that it was restarted.
    fn ask_who(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        let answer = self.talk.ask(self.lanes[index].own.unit, WHO);
        if let Some(SixpackReply::UnitTold(told)) = self.heard(index, answer)? {
            let own = &mut self.lanes[index].own;
            own.known = Some(now);
            if told.reset != 0 || own.is_another(told.serial) {
                return self.is_not_home(index, 0);
            }
            if self.lanes[index].is_led() {
                self.tell(StreamEvent::Homed { lane: number(index), homed: true });
            }
        }
        Ok(())
    }

    /// Where a motor is, if it answers.
    fn place_of(&mut self, index: usize, axis: usize) -> Result<Option<PositionTold>, LinkFault> {
        let (unit, motor) = (self.lanes[index].own.unit, self.lanes[index].axes[axis].motor);
        let answer = self.talk.ask(unit, where_is(motor));
        let Some(SixpackReply::PositionTold(told)) = self.heard(index, answer)? else {
            // By one bit the question is the order to search; by another a target far away, which the next slice ends.
            self.own.unanswered = Some((index, axis));
            return Ok(None);
        };
        let a = axis_number(axis);
        let axis = &mut self.lanes[index].axes[axis];
        let position = axis.scale.fraction(told.position.into());
        axis.figures.position = position;
        let at = self.talk.moment().sent;
        // It counts the steps that it asked for: that its motor is pushed off, it cannot know.
        self.tell(StreamEvent::Read { lane: number(index), axis: a, position, held: None, at });
        Ok(Some(told))
    }

    /// Whether a motor that is led is where it is led.
    fn judge(&mut self, index: usize, a: usize, told: PositionTold) -> Result<(), LinkFault> {
        let sent = self.talk.moment().sent;
        let lane = &mut self.lanes[index];
        let axis = &mut lane.axes[a];
        axis.run(sent);
        let (by_mm, mm_s) = axis.beside(told.position);
        axis.figures.error_mm = by_mm;
        let is_wrong = !is_ordered(told.action);
        let is_off = by_mm.abs() > OFF_COURSE_MM + mm_s * READING;
        if !is_off {
            axis.figures.off_course_mm = axis.figures.off_course_mm.max(by_mm.abs());
        }
        if !(is_off || is_wrong) {
            axis.strayed = 0;
            self.confirm(index, sent);
            return Ok(());
        }
        if axis.strayed == 0 {
            axis.strays_since = sent;
        }
        axis.strayed += 1;
        // What was damaged may be the answer: it is believed twice. A target that was brings it off its course for a while.
        let axis = &self.lanes[index].axes[a];
        let (low, high) = axis.scale.reach(BESIDE_MM);
        let is_lost = !(low..=high).contains(&f64::from(told.position));
        let is_for_good = is_wrong || is_lost || sent.since(axis.strays_since) > axis.heals_in();
        if axis.strayed > 1 && is_for_good {
            if is_lost {
                return self.is_not_home(index, a);
            }
            let (lane, axis) = (number(index), axis_number(a));
            self.put_out(index, StreamEvent::OffCourse { lane, axis, by_mm });
            return Ok(());
        }
        // It is asked again next.
        (self.own.next_asked, self.lanes[index].own.next_axis) = (index, a);
        Ok(())
    }

    /// A motor was read where it was led at that instant.
    fn confirm(&mut self, index: usize, at: MonoTime) {
        if let Some((first, last)) = self.lanes[index].confirm(at) {
            self.tell(StreamEvent::Confirmed { lane: number(index), first, last });
        }
    }

    /// Looks whether all motors of a lane stand, and where.
    fn look_at(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        self.own.next_asked = (index + 1) % self.lanes.len();
        let lane = &mut self.lanes[index];
        if lane.own.known.is_none() {
            return self.ask_who(index, now);
        }
        let Some(a) = lane.axes.iter().position(|axis| !axis.rests) else {
            self.is_ready_now(index, now);
            return Ok(());
        };
        let Some(told) = self.place_of(index, a)? else { return Ok(()) };
        let lane = &mut self.lanes[index];
        let has_braked = lane.own.stops * self.terms.period > lane.axes[a].brakes;
        let axis = &mut lane.axes[a];
        let went_mm = axis.went(told.position, self.talk.moment().sent);
        // One that is told to stop turns at a speed of 0.
        let stands = is_ordered(told.action) || !axis.holds && told.action == action::ROTATION;
        if !stands || went_mm != Some(0.0) {
            lane.own.not_before = now + LOOKS;
            let strays = has_braked && (!stands || went_mm.is_some_and(|mm| mm > OFF_COURSE_MM));
            axis.strayed = if strays || searches(told.action) { axis.strayed + 1 } else { 0 };
            if axis.strayed >= STRAYS {
                let (lane, by_mm) = (number(index), axis.figures.error_mm);
                self.put_out(index, StreamEvent::OffCourse { lane, axis: axis_number(a), by_mm });
            }
            return Ok(());
        }
        let (low, high) = axis.scale.reach(OUTSIDE_MM);
        if !(low..=high).contains(&f64::from(told.position)) {
            // Its counter says nothing of where it is.
            return self.is_not_home(index, a);
        }
        let is_there = axis.beside(told.position).0.abs() <= OFF_COURSE_MM;
        axis.rest_at(told.position, self.talk.now());
        if is_there {
            self.confirm(index, now);
        }
        Ok(())
    }

    /// All of its motors stand: it follows poses from here.
    fn is_ready_now(&mut self, index: usize, now: MonoTime) {
        let tick = self.terms.tick;
        let lane = &mut self.lanes[index];
        let axes = lane.places();
        lane.own.track = Track::at_rest(tick, axes, now);
        (lane.stage, lane.moves, lane.own.is_home) = (Stage::Ready, false, true);
        self.tell(StreamEvent::Rests { lane: number(index), axes, at: now });
        self.tell(StreamEvent::Homed { lane: number(index), homed: true });
    }

    /// Whether a unit answers.
    fn heard(
        &mut self,
        index: usize,
        answer: Result<SixpackReply, TalkFault>,
    ) -> Result<Option<SixpackReply>, LinkFault> {
        let lane = &mut self.lanes[index];
        match answer {
            Ok(reply) => {
                (lane.own.is_failing, lane.own.was_heard) = (false, true);
                Ok(Some(reply))
            }
            Err(TalkFault::Link(fault)) => Err(fault),
            Err(TalkFault::Silent { .. }) => {
                // One answer may be lost. Whoever hears no targets stands, and would make up for all of them at once by the next that it
                // hears: so it is asked again next, and told none without an answer.
                if std::mem::replace(&mut lane.own.is_failing, true) {
                    self.lose(index, 0);
                } else {
                    (self.own.next_asked, self.own.targets) = (index, TARGETS);
                }
                Ok(None)
            }
        }
    }

    /// A unit that was restarted, or never homed: none of its motors knows its place.
    fn is_not_home(&mut self, index: usize, axis: usize) -> Result<(), LinkFault> {
        let (lane, axis) = (number(index), axis_number(axis));
        let was_home = std::mem::take(&mut self.lanes[index].own.is_home);
        let event = if was_home {
            StreamEvent::Restarted { lane, axis }
        } else {
            StreamEvent::Homed { lane, homed: false }
        };
        self.put_out(index, event);
        Ok(())
    }

    /// Tells the motors of all lanes to stop until their units say that they do nothing. Where they are led they have to be where that was: by
    /// one bit a stop has the counter begin anew. Those that do not come to rest are out, those that do not answer are lost.
    pub(super) fn settle_lanes(&mut self) -> Result<(), LinkFault> {
        let (begun, mut tries) = (self.talk.now(), 0);
        let heard = (0..self.lanes.len()).filter(|index| self.lanes[*index].own.was_heard);
        // Each with how often it did not answer.
        let mut left: Vec<(usize, u32)> = heard.map(|index| (index, 0)).collect();
        while !left.is_empty() {
            // All are told before any is asked.
            let absent = self.lanes.iter().filter(|lane| lane.own.is_absent);
            let told = left.iter().map(|(index, _)| &self.lanes[*index]).chain(absent);
            let stops: Vec<_> = told.flat_map(SixpackLane::stops).collect();
            self.talk.send(&stops)?;
            tries += 1;
            let mut still = Vec::new();
            for (index, silent) in left {
                match self.stands(index)? {
                    Stands::All => {}
                    Stands::Silent if silent + 1 >= SILENT => self.lose(index, 0),
                    Stands::Silent => still.push((index, silent + 1)),
                    Stands::Not(a) if tries >= SETTLES && self.has_braked_since(index, begun) => {
                        let (lane, by_mm) = (number(index), self.lanes[index].axes[a].figures.error_mm);
                        self.put_out(index, StreamEvent::OffCourse { lane, axis: axis_number(a), by_mm });
                    }
                    Stands::Not(_) => still.push((index, silent)),
                }
            }
            left = still;
        }
        Ok(())
    }

    /// True if a lane whose motors were told to stop then has to be at rest.
    fn has_braked_since(&self, index: usize, begun: MonoTime) -> bool {
        let told = self.talk.now().since(begun);
        self.lanes[index].axes.iter().all(|axis| told > axis.brakes)
    }

    /// Whether the motors of a lane that were told to stop do nothing. One that is led and stands elsewhere is out.
    fn stands(&mut self, index: usize) -> Result<Stands, LinkFault> {
        let lane = &self.lanes[index];
        let actions = match self.talk.ask(lane.own.unit, SixpackOrder::AskActions { response: ANSWER }) {
            Ok(SixpackReply::ActionsTold(ActionsTold { actions })) => actions,
            Ok(_) | Err(TalkFault::Silent { .. }) => return Ok(Stands::Silent),
            Err(TalkFault::Link(fault)) => return Err(fault),
        };
        let rests = |axis: &Axis| actions.get(usize::from(axis.motor)) == Some(&action::IDLE);
        if let Some(a) = lane.axes.iter().position(|axis| !rests(axis)) {
            return Ok(Stands::Not(a));
        }
        let axes = if lane.is_led() { lane.axes.len() } else { 0 };
        for a in 0..axes {
            let Some(told) = self.place_of(index, a)? else { return Ok(Stands::Silent) };
            let by_mm = self.lanes[index].axes[a].beside(told.position).0;
            if by_mm.abs() > OFF_COURSE_MM {
                let (lane, axis) = (number(index), axis_number(a));
                self.put_out(index, StreamEvent::OffCourse { lane, axis, by_mm });
                break;
            }
        }
        Ok(Stands::All)
    }

    /// Looks for the unit of a lane that is lost or out.
    fn probe(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        self.own.next_asked = (index + 1) % self.lanes.len();
        self.lanes[index].own.not_before = now + PROBES;
        let Some(told) = self.seek(index)? else { return Ok(()) };
        if told.reset != 0 || self.lanes[index].own.is_another(told.serial) {
            return self.is_not_home(index, 0);
        }
        let lane = &mut self.lanes[index];
        let was_lost = lane.stage == Stage::Lost;
        (lane.own.is_failing, lane.own.not_before) = (false, now);
        lane.make_ready(now);
        if was_lost {
            self.tell(StreamEvent::Back { lane: number(index) });
        }
        Ok(())
    }

    /// Who a unit is, if it is there, asked once. At the rate with which it wakes, if that is another, that is asked by turns, but only while nobody plays; one
    /// that answers there is switched to the rate of the link.
    fn seek(&mut self, index: usize) -> Result<Option<UnitTold>, LinkFault> {
        let may_wake = self.talk.other_baud().is_some() && !self.lanes.iter().any(SixpackLane::plays);
        let own = &mut self.lanes[index].own;
        own.probes = own.probes.wrapping_add(1);
        let (unit, is_waking) = (own.unit, own.probes.is_multiple_of(2) && may_wake);
        if !is_waking {
            let told = who_now(&mut self.talk, unit)?;
            self.lanes[index].own.was_heard |= told.is_some();
            return Ok(told);
        }
        at_waking_rate(&mut self.talk, |talk| {
            let told = who_now(talk, unit)?;
            told.map_or(Ok(()), |_| talk.switch(unit, talk.own_baud()))?;
            Ok(told)
        })
    }
}

/// True where a motor does what a play has it do: it stands, or follows targets.
const fn is_ordered(does: u8) -> bool {
    matches!(does, action::IDLE | action::PI)
}

impl SixpackLane {
    /// True if poses move it, or may at once.
    const fn plays(&self) -> bool {
        matches!(self.stage, Stage::Runs | Stage::Ends)
    }
}
