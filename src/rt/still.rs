//! A seat that was cut off and vibrates on, and to which the engine sends nothing: one slow frame holds it where it does so, and ends it.
//! Tick thread; allocates nothing.

use super::{FrameSink, Outgoing, TickLoop};
use crate::belief::Fall;
use crate::engine::LaneOrder;
use crate::motion::Pose;
use crate::state::State;
use crate::time::{Clock, MonoTime};
use crate::wire::MAX_LEN;

/// How long the frame takes at the least, and the most, ms: from wherever the seat swings it is slow.
const SLOW_MS: u32 = 100;
const SLOWEST: u32 = 10;

impl<C: Clock, S: FrameSink> TickLoop<'_, C, S> {
    /// A controller takes part again.
    pub(super) fn find(&mut self, lane: usize, now: MonoTime) {
        let Self { conductor, engine, places, mail, .. } = self;
        let flows = conductor.machine().may_send_motion() && !engine.sends_nothing();
        if let Some(pose) = places.find(lane, engine, mail, now, flows) {
            self.still(lane, &pose);
        }
    }

    /// The one frame that leaves in a state that sends none. It leads nowhere: the seat was read for half a second to swing about that pose
    /// and to do nothing else, it is slow from wherever that is, and the seat is looked at anew before there may be another.
    #[cold]
    fn still(&mut self, index: usize, pose: &Pose) {
        let Self { conductor, engine, lanes, places, mail, sink, clock, .. } = self;
        let (state, at) = (conductor.machine().state(), clock.now());
        let belief = places.belief(index);
        let longest_ms = lanes[index].longest_ms;
        let mut slow = (1..=SLOWEST).map(|times| times * SLOW_MS).take_while(|ms| *ms <= longest_ms);
        let slow = slow.find(|ms| belief.allows(pose, *ms, at));
        if let Some(time_ms) = slow.filter(|_| state != State::Homing) {
            let mut buf = [0; MAX_LEN];
            let (stamped, datagram) = lanes[index].encode_still(pose, time_ms, &mut buf);
            let sent = Outgoing { index, stamped, pose, lasts_ms: time_ms, at_most_ms: time_ms, at };
            sent.hand_over(datagram, places, mail, sink);
            engine.break_off();
        }
        engine.order(index, LaneOrder::FallOut(Fall::Stale));
    }
}
