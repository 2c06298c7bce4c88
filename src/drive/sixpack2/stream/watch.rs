//! What is asked of units while they play, and what the answers mean.

use std::time::Duration;

use super::axis::{OFF_COURSE_MM, READING};
use super::lane::SixpackLane;
use super::{PROBES, Sixpack2, TARGETS, Track, number};
use crate::drive::link::{LinkFault, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent, axis_number};
use crate::drive::sixpack2::ask::{WHO, searches, waking_baud, where_is, who};
use crate::drive::sixpack2::look::OUTSIDE_MM;
use crate::drive::sixpack2::talk::TalkFault;
use crate::time::MonoTime;
use crate::wire::sixpack2::{AbortSearch, PositionTold, SixpackOrder, SixpackReply, UnitTold, action};

/// How often a unit is asked who it is.
const IDENTITY: Duration = Duration::from_secs(10);
/// From one look whether a motor still moves to the next.
const LOOKS: Duration = Duration::from_millis(20);
/// So many looks in a row at a motor that is led nowhere and moves put its lane out: an answer that is damaged looks like two.
const STRAYS: u32 = 3;
/// What is so far outside the stroke is no place of the seat at all, mm.
const LOST_ZERO_MM: f64 = 10.0;

impl<P: LinkPort> Stream<Sixpack2, P> {
    /// True if a question does not make the next slice later than it has to: there is one after each slice that leaves room for it.
    pub(super) fn has_time(&self) -> bool {
        let is_led = self.lanes.iter().any(|lane| lane.is_led());
        let has_room =
            !self.lanes.iter().any(SixpackLane::plays) || self.talk.question_over() <= self.own.next_slice;
        !is_led || self.own.targets >= TARGETS || (self.own.targets > 0 && has_room)
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
                Stage::Out if is_due && lane.own.moves_on => self.stop_for_good(index, now)?,
                Stage::Readying if is_due => self.look_at(index, now)?,
                Stage::Ready | Stage::Runs | Stage::Ends => self.ask(index, now)?,
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
            self.lanes[index].own.known = Some(now);
            if told.reset != 0 {
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
            // By one bit the question is the order to search; nothing else is ended by this. By another it is a target far away, which
            // the next of a motor that is led ends.
            if self.lanes[index].is_led() {
                self.talk.tell(unit, SixpackOrder::AbortSearch(AbortSearch { motor }))?;
            } else {
                self.stop_motor(unit, motor)?;
            }
            return Ok(None);
        };
        let a = axis_number(axis);
        let axis = &mut self.lanes[index].axes[axis];
        let position = axis.scale.fraction(told.position.into());
        axis.figures.position = position;
        let at = self.talk.moment().sent;
        self.tell(StreamEvent::Read { lane: number(index), axis: a, position, at });
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
        let (low, high) = axis.scale.reach(LOST_ZERO_MM);
        let is_lost = !(low..=high).contains(&f64::from(told.position));
        let is_for_good = is_wrong || is_lost || sent.since(axis.strays_since) > axis.heals_in();
        if axis.strayed > 1 && is_for_good {
            if is_lost {
                return self.is_not_home(index, a);
            }
            let (lane, axis) = (number(index), axis_number(a));
            return self.put_out_and_stop(index, StreamEvent::OffCourse { lane, axis, by_mm });
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
        let is_led = lane.is_led();
        let axis = &mut lane.axes[a];
        if !is_ordered(told.action) || axis.stood_at != Some(told.position) {
            let strays = axis.strays(told.position, self.talk.moment().sent) || !is_ordered(told.action);
            lane.own.not_before = now + LOOKS;
            // Nobody has it search or turn, and neither has an end by itself; nor has a way that its targets do not lead.
            if !strays || (is_led && !searches(told.action)) {
                axis.strayed = 0;
                return Ok(());
            }
            axis.strayed += 1;
            let (lane, by_mm) = (number(index), axis.figures.error_mm);
            return if axis.strayed < STRAYS {
                self.stop_motors(index)
            } else {
                self.put_out_and_stop(index, StreamEvent::OffCourse { lane, axis: axis_number(a), by_mm })
            };
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
                lane.own.is_failing = false;
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

    /// Out until a person has looked, and stopped.
    fn put_out_and_stop(&mut self, index: usize, event: StreamEvent) -> Result<(), LinkFault> {
        self.put_out(index, event);
        let lane = &mut self.lanes[index];
        lane.own.moves_on = true;
        lane.axes.iter_mut().for_each(|axis| (axis.rests, axis.stood_at) = (false, None));
        self.stop_motors(index)
    }

    /// Reads the motors of a lane that is out by turns, and stops each again that is not at rest: a stop that is damaged on the way is a
    /// target far away, or a turn without end.
    fn stop_for_good(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        self.own.next_asked = (index + 1) % self.lanes.len();
        let lane = &mut self.lanes[index];
        let (a, unit) = (lane.own.next_axis % lane.axes.len(), lane.own.unit);
        lane.own.next_axis = a + 1;
        let motor = lane.axes[a].motor;
        let answer = self.talk.ask(unit, where_is(motor));
        let lane = &mut self.lanes[index];
        let axis = &mut lane.axes[a];
        let SixpackReply::PositionTold(told) = (match answer {
            Ok(reply) => reply,
            Err(TalkFault::Link(fault)) => return Err(fault),
            Err(TalkFault::Silent { .. }) => {
                // The question may be damaged, and a target far away by that; a unit without power holds nobody up.
                lane.own.not_before = now + LOOKS;
                axis.rests = false;
                return self.stop_motor(unit, motor);
            }
        }) else {
            return Ok(());
        };
        let before = axis.stood_at.replace(told.position);
        axis.rests = is_ordered(told.action) && before == Some(told.position);
        let moves = !is_ordered(told.action) || before.is_some_and(|before| before != told.position);
        lane.own.moves_on = lane.axes.iter().any(|axis| !axis.rests);
        if moves { self.stop_motor(unit, motor) } else { Ok(()) }
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
        self.put_out_and_stop(index, event)
    }

    /// Ends what each motor may search, and stops it by its ramp. Nobody answers, so it is said twice.
    pub(super) fn stop_motors(&mut self, index: usize) -> Result<(), LinkFault> {
        let unit = self.lanes[index].own.unit;
        let motors: Vec<u8> = self.lanes[index].axes.iter().map(|axis| axis.motor).collect();
        [&motors, &motors].into_iter().flatten().try_for_each(|motor| self.stop_motor(unit, *motor))
    }

    /// The same of one, once.
    fn stop_motor(&mut self, unit: u8, motor: u8) -> Result<(), LinkFault> {
        self.talk.tell(unit, SixpackOrder::AbortSearch(AbortSearch { motor }))?;
        self.talk.tell(unit, SixpackOrder::RampedStop { motor })
    }

    /// Looks for the unit of a lane that is lost or out.
    fn probe(&mut self, index: usize, now: MonoTime) -> Result<(), LinkFault> {
        self.lanes[index].own.not_before = now + PROBES;
        let Some(told) = self.seek(self.lanes[index].own.unit)? else { return Ok(()) };
        if told.reset != 0 {
            return self.is_not_home(index, 0);
        }
        let lane = &mut self.lanes[index];
        let was_lost = lane.stage == Stage::Lost;
        (lane.own.is_failing, lane.own.not_before) = (false, now);
        lane.make_ready();
        if was_lost {
            self.tell(StreamEvent::Back { lane: number(index) });
        }
        Ok(())
    }

    /// Who a unit is, if it is there; one that woke is switched to the rate of the link, but only while nobody plays on it.
    fn seek(&mut self, unit: u8) -> Result<Option<UnitTold>, LinkFault> {
        let told = who(&mut self.talk, unit)?;
        if told.is_some() || self.lanes.iter().any(SixpackLane::plays) {
            return Ok(told);
        }
        let baud = self.talk.baud();
        self.talk.set_baud(waking_baud())?;
        let found = who(&mut self.talk, unit).and_then(|told| {
            told.map_or(Ok(()), |_| self.talk.switch(unit, baud))?;
            Ok(told)
        });
        self.talk.set_baud(baud)?;
        found
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
