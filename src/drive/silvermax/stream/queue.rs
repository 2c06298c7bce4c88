//! What goes into the timed queues of units, and what is in doubt of them.

use std::time::Duration;

use super::axis::{Axis, Doubt, Kind, QUEUE};
use super::clock::after;
use super::polls::Question;
use super::{SilverMax, number};
use crate::drive::link::{BrakeReason, LinkPort, LinkTalk as _, Stage, Stream, StreamEvent, axis_number};
use crate::drive::silvermax::talk::{Answer, TalkFault};
use crate::drive::{Segment, TICK_NS};
use crate::wire::silvermax::{NakReason, Request, register};

/// Nearer to a knot it is not known which segment runs.
const UNCLEAR: Duration = Duration::from_millis(3);
/// How long a queue that is full, against what was reckoned, is left alone.
const FULL: Duration = Duration::from_millis(5);

impl<P: LinkPort> Stream<SilverMax, P> {
    /// Sends the next segment of an axis.
    pub(super) fn send_segment(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        let origin = self.lanes[l].own.origin;
        let Some(mut made) = self.lanes[l].axes[a].outbox.front().copied() else { return Ok(()) };
        if made.kind == Kind::Start {
            let received = self.talk.now() + self.talk.octets(START);
            let axis = &mut self.lanes[l].axes[a];
            made.segment = axis.rest_until(origin, received);
            axis.outbox[0] = made;
        }
        let axis = &mut self.lanes[l].axes[a];
        axis.account().sent += 1;
        let answer = self.talk.exchange(axis.terms.unit, request(made.segment));
        self.heard(l, a, request(made.segment), &answer);
        match answer {
            Err(fault) => {
                if !matches!(fault, TalkFault::Link(_)) {
                    self.lanes[l].axes[a].account().in_doubt += 1;
                    self.tell(StreamEvent::Doubt { lane: number(l), axis: axis_number(a) });
                }
                Err(fault)
            }
            Ok(answer) => {
                self.answered(l, a, answer);
                Ok(())
            }
        }
    }

    /// What the unit said of the first segment of the outbox.
    fn answered(&mut self, l: usize, a: usize, answer: Answer) {
        let (sent, now) = (self.talk.moment().sent, self.talk.now());
        let axis = &mut self.lanes[l].axes[a];
        match answer {
            Answer::Nak(NakReason::QueueFull) => {
                axis.account().again += 1;
                axis.not_before = now + FULL;
            }
            Answer::Nak(reason) => {
                axis.account().refused += 1;
                axis.account().reason = Some(reason);
                axis.polls.hurry(Question::Canary, now);
                self.brake(l, BrakeReason::Refused(reason));
            }
            Answer::Ack | Answer::Data(_) => {
                if let Some(made) = axis.outbox.pop_front() {
                    // A unit acts when it has the request; what follows is its reply delay.
                    axis.take(made, sent);
                }
                self.confirm(l);
            }
        }
    }

    fn confirm(&mut self, l: usize) {
        for event in self.lanes[l].confirm(number(l)).into_iter().flatten() {
            self.tell(event);
        }
    }

    /// Finds out what a unit has taken that did not say so.
    pub(super) fn settle(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        match self.lanes[l].axes[a].doubt {
            Some(Doubt::Unanswered(request)) => self.wait_for(l, a, request),
            Some(Doubt::Queue { is_own, fillers }) => self.count(l, a, is_own, fillers),
            None => Ok(()),
        }
    }

    /// Waits for an answer that may still come.
    fn wait_for(&mut self, l: usize, a: usize, request: Request) -> Result<(), TalkFault> {
        let unit = self.lanes[l].axes[a].terms.unit;
        let late = self.talk.fence(unit, request);
        self.heard(l, a, request, &late);
        let late = late?;
        let runs = matches!(self.lanes[l].stage, Stage::Runs | Stage::Ends);
        if !(runs && matches!(request, Request::ImmediateSegment { .. })) {
            return Ok(());
        }
        let kind = self.lanes[l].axes[a].outbox.front().map(|made| made.kind);
        match (late, kind) {
            (Some(answer), _) => self.answered(l, a, answer),
            (None, Some(Kind::Start)) => self.look_if_started(l, a)?,
            // A segment that is sent twice is a segment of travel too much.
            _ => self.lanes[l].axes[a].doubt = Some(Doubt::Queue { is_own: true, fillers: 0 }),
        }
        Ok(())
    }

    /// The segment that starts a queue runs at once, if it was taken.
    fn look_if_started(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        let read = Request::ReadRegister { register: register::TICKS_LEFT };
        let answer = self.talk.exchange(self.lanes[l].axes[a].terms.unit, read);
        self.heard(l, a, read, &answer);
        let sent = self.talk.moment().sent;
        let axis = &mut self.lanes[l].axes[a];
        if let Answer::Data(words) = answer?
            && let Some(left) = words.value().filter(|left| *left > 0)
            && let Some(made) = axis.outbox.pop_front()
        {
            let gone = f64::from(made.segment.ticks.cast_signed().wrapping_sub(left));
            axis.take(made, after(sent, -gone * f64::from(TICK_NS) * 1e-9));
        } else {
            axis.account().lost += 1;
        }
        Ok(())
    }

    /// Counts what is in a queue by what still goes in: fillers of two ticks, until it is full.
    fn count(&mut self, l: usize, a: usize, is_own: bool, fillers: u32) -> Result<(), TalkFault> {
        let now = self.talk.now();
        let axis = &mut self.lanes[l].axes[a];
        if axis.to_knot(now) < UNCLEAR {
            axis.not_before = now + UNCLEAR;
            return Ok(());
        }
        let filler = request(axis.filler());
        let answer = self.talk.exchange(axis.terms.unit, filler);
        let sent = self.talk.moment().sent;
        let axis = &mut self.lanes[l].axes[a];
        match answer {
            Err(TalkFault::Link(fault)) => return Err(fault.into()),
            // A queue of nothing but fillers is over before anything else is in it.
            Ok(Answer::Ack) if fillers as usize + 1 < QUEUE => {
                axis.account().fillers += 1;
                axis.doubt = Some(Doubt::Queue { is_own, fillers: fillers + 1 });
            }
            Ok(Answer::Nak(NakReason::QueueFull)) if axis.to_knot(sent) < UNCLEAR => {}
            Ok(Answer::Nak(NakReason::QueueFull)) if sent < axis.ends() => {
                axis.doubt = None;
                let room = QUEUE.saturating_sub(axis.waiting(sent));
                match (room.checked_sub(fillers as usize), is_own) {
                    (Some(1), true) => {
                        self.answered(l, a, Answer::Ack);
                        self.lanes[l].axes[a].put_in(fillers);
                    }
                    (Some(0), _) => {
                        axis.account().lost += u64::from(is_own);
                        axis.put_in(fillers);
                    }
                    _ => self.brake(l, BrakeReason::InDoubt),
                }
            }
            answer => {
                self.heard(l, a, filler, &answer);
                self.brake(l, BrakeReason::InDoubt);
            }
        }
        Ok(())
    }

    /// A unit answered what another was asked: it may have taken a segment that was not for it.
    pub(super) fn doubt_other(&mut self, by: u8) {
        let all =
            self.lanes.iter().enumerate().flat_map(|(l, lane)| {
                lane.axes.iter().enumerate().map(move |(a, axis)| (l, a, axis.terms.unit))
            });
        let Some((l, a, _)) = all.into_iter().find(|(.., unit)| *unit == by) else { return };
        self.tell(StreamEvent::Doubt { lane: number(l), axis: axis_number(a) });
        let (stage, axis) = (self.lanes[l].stage, &mut self.lanes[l].axes[a]);
        match stage {
            Stage::Runs if axis.has_started() => {
                axis.doubt = axis.doubt.or(Some(Doubt::Queue { is_own: false, fillers: 0 }));
            }
            // One that waits for poses would run off with it.
            Stage::Runs | Stage::Ends | Stage::Ready | Stage::Readying => self.brake(l, BrakeReason::InDoubt),
            Stage::Lost | Stage::Out => {}
        }
    }
}

/// Octets of the request of a rest segment, about.
const START: u32 = 24;

fn request(segment: Segment) -> Request {
    let Segment { ticks, position, acceleration, velocity } = segment;
    Request::ImmediateSegment { ticks, position, acceleration, velocity: velocity.unsigned_abs() }
}

impl Axis {
    /// True if more waits to be sent than can ever be on its way.
    pub(super) fn is_crammed(&self) -> bool {
        self.outbox.len() > CRAMMED
    }

    /// True if the last that it has does not end at rest.
    pub(super) fn ends_moving(&self) -> bool {
        self.queued.back().is_some_and(|queued| !queued.segment.is_at_rest())
    }
}

/// Segments that wait to be sent at most: as a lane ends, four slices are made at once.
const CRAMMED: usize = 12;
