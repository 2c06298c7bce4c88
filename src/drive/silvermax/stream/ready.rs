//! What brakes a lane and makes it ready for poses.

use std::time::Duration;

use super::SilverMax;
use super::axis::Axis;
use crate::drive::link::{LinkPort, LinkTalk as _, Stage, Stream};
use crate::drive::silvermax::talk::{Answer, TalkFault};
use crate::wire::silvermax::Request;
use crate::wire::silvermax::register::{QUEUE_SOURCE, TARGET};

/// From one look whether an axis still moves to the next: slower than a count in that time is rest.
const LOOKS: Duration = Duration::from_millis(20);
/// After a refusal it begins again.
const AGAIN: Duration = Duration::from_millis(100);
/// Steps until a unit waits for its first segment.
const STEPS: usize = 5;

impl Axis {
    /// True if its unit waits for a first segment.
    pub(super) const fn is_made_ready(&self) -> bool {
        self.step == STEPS && !self.owes_stop && self.doubt.is_none()
    }

    /// Its next step. The first is where it stands, at rest; the second what happened by now.
    fn next_step(&self) -> Request {
        match self.step {
            0 => Request::ReadRegister { register: TARGET },
            1 => Request::Poll,
            2 => Request::ClearQueue,
            3 => Request::WriteRegister { register: QUEUE_SOURCE, value: 0 },
            _ => Request::StartQueue,
        }
    }
}

impl<P: LinkPort> Stream<SilverMax, P> {
    /// Brakes an axis.
    pub(super) fn stop_axis(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        let axis = &self.lanes[l].axes[a];
        let (unit, doubt) = (axis.terms.unit, axis.doubt);
        let request = Request::Stop { deceleration: axis.terms.brake };
        let answer = self.talk.exchange(unit, request);
        self.heard(l, a, request, &answer);
        let axis = &mut self.lanes[l].axes[a];
        // While something is in doubt its answer may be taken for that of the stop: once more, behind a fence.
        axis.owes_stop = doubt.is_some();
        if doubt.is_some() {
            let late = self.talk.fence(unit, request);
            self.heard(l, a, request, &late);
            late?;
        }
        answer.map(|_| ())
    }

    /// The next step of making an axis ready.
    pub(super) fn make_ready(&mut self, l: usize, a: usize) -> Result<(), TalkFault> {
        let axis = &self.lanes[l].axes[a];
        let (request, step) = (axis.next_step(), axis.step);
        let answer = self.talk.exchange(axis.terms.unit, request);
        self.heard(l, a, request, &answer);
        let answer = answer?;
        let now = self.talk.now();
        let axis = &mut self.lanes[l].axes[a];
        match (step, answer) {
            (0, Answer::Data(words)) => {
                // What it was a while ago it is at rest.
                if words.value().is_none() || axis.stood_at != words.value() {
                    (axis.stood_at, axis.not_before) = (words.value(), now + LOOKS);
                    return Ok(());
                }
                axis.rest_at(words.value().unwrap_or_default());
            }
            (1, Answer::Data(words)) => self.happened(l, a, words.word().unwrap_or_default())?,
            (_, Answer::Nak(reason)) => {
                axis.account().reason = Some(reason);
                (axis.not_before, axis.step, axis.stood_at) = (now + AGAIN, 0, None);
                return Ok(());
            }
            _ => {}
        }
        if self.lanes[l].stage == Stage::Readying {
            self.lanes[l].axes[a].step = step + 1;
        }
        Ok(())
    }
}
