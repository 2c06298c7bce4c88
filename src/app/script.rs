//! Before tick 0: reads the position of every seat, so that it joins from there. A seat that does not report all its axes is brought to
//! park by one frame that is slow enough from anywhere in the stroke, and has to be acked if acks are on.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::belief::{KnownPose, Reading, Taken};
use crate::config::Controller;
use crate::drive::Lane;
use crate::net::{Delivery, Sender};
use crate::plan::slow_park_time;
use crate::rt::{AckLoop, Live, Places, Sent};
use crate::state::State;
use crate::time::{Clock, MonoTime};
use crate::wire::MAX_LEN;

/// Rounds of position reads, and how long each waits for the answers. A seat is at rest where three rounds find it.
const READ_TRIES: usize = 5;
const READ_WAIT: Duration = Duration::from_millis(150);
/// How often the slow frame is sent, where its ack does not come.
const PARK_TRIES: usize = 3;
/// How long that ack is waited for.
const ACK_WAIT: Duration = Duration::from_millis(200);
/// How often replies are looked for meanwhile.
const LOOK: Duration = Duration::from_millis(2);
/// What is waited beyond the Time of the slow frame.
const SETTLE: Duration = Duration::from_millis(20);

/// What was done before tick 0.
#[derive(Debug, Clone, Default)]
pub(super) struct Prepared {
    /// Slow frames, by controller.
    pub(super) park_frames: Vec<u64>,
    /// Controllers whose way to park may have been faster than 50 mm/s, because PA0b cuts a longer Time.
    pub(super) hurried: Vec<usize>,
}

impl Prepared {
    /// Nothing done for so many controllers.
    pub(super) fn nothing(controllers: usize) -> Self {
        Self { park_frames: vec![0; controllers], hurried: Vec::new() }
    }
}

/// Everything that preparing needs.
pub(super) struct Preparation<'a, C> {
    pub(super) clock: &'a C,
    pub(super) sender: &'a Sender,
    pub(super) acks: &'a mut AckLoop,
    pub(super) controllers: &'a [Controller],
    pub(super) lanes: &'a mut [Lane],
    pub(super) places: &'a mut Places,
    /// Read throughout: somebody wants the show to stop.
    pub(super) stop: &'a AtomicBool,
    /// Has what the ack thread sees; told of the seats that are brought to park.
    pub(super) live: &'a Arc<Live>,
}

/// Why nothing can begin.
#[derive(Debug, Default)]
pub(super) struct Unready {
    /// Seats that move, though no frame has left from here.
    pub(super) moving: Vec<String>,
    /// Seats of which it cannot be known where they are.
    pub(super) unsure: Vec<String>,
}

impl<C: Clock> Preparation<'_, C> {
    /// Finds out where every seat stands, and brings those to park that do not tell.
    ///
    /// # Errors
    /// The seats that move already, or cannot be brought to park for certain.
    pub(super) fn run(&mut self, ask: bool) -> Result<Prepared, Unready> {
        if ask {
            self.read_positions();
        }
        let mut prepared = Prepared::nothing(self.lanes.len());
        let moving = self.names(|this, lane| this.reading(lane).is_some_and(|reading| reading.moves));
        if self.stopped() {
            return Ok(prepared);
        }
        if !moving.is_empty() {
            return Err(Unready { moving, ..Unready::default() });
        }
        let untold: Vec<usize> = (0..self.lanes.len()).filter(|&lane| !self.is_known(lane)).collect();
        let unsure = self.park_slowly(&untold, &mut prepared);
        if unsure.is_empty() { Ok(prepared) } else { Err(Unready { unsure, ..Unready::default() }) }
    }

    /// Moves nothing: only makes sure that every seat stands at its park pose.
    ///
    /// # Errors
    /// The names of the controllers whose seat does not tell that it does.
    pub(super) fn make_sure(&mut self) -> Result<Prepared, Vec<String>> {
        self.read_positions();
        let unsure = self.names(|this, lane| !this.is_at_park(lane));
        if unsure.is_empty() { Ok(Prepared::nothing(self.lanes.len())) } else { Err(unsure) }
    }

    fn names(&self, which: impl Fn(&Self, usize) -> bool) -> Vec<String> {
        let lanes = (0..self.lanes.len()).filter(|&lane| which(self, lane));
        lanes.map(|lane| self.controllers[lane].name.clone()).collect()
    }

    fn reading(&self, lane: usize) -> Option<Reading> {
        self.live.evidence(lane)?.reading().map(|(_, reading)| reading)
    }

    /// True if a seat told of all its axes, and was at rest.
    fn is_known(&self, lane: usize) -> bool {
        self.reading(lane).is_some_and(|reading| KnownPose::of(&reading, &self.lanes[lane].window).is_some())
    }

    /// True if a seat tells that it stands at park, to a pulse.
    fn is_at_park(&self, lane: usize) -> bool {
        let window = &self.lanes[lane].window;
        self.reading(lane).is_some_and(|reading| {
            let own = window.slots().iter().enumerate().filter(|(_, slot)| slot.is_own);
            own.into_iter().all(|(index, slot)| {
                let apart = slot.pulses(reading.pose[index]).0.abs_diff(slot.pulses(slot.park).0);
                let held = (reading.pose[index] - slot.park).abs() * slot.stroke_pulses <= 1.5;
                reading.rests && reading.slots >> index & 1 == 1 && apart <= 1 && held
            })
        })
    }

    /// Reads where the seats stand, until each was seen at rest.
    fn read_positions(&mut self) {
        for _ in 0..READ_TRIES {
            let open: Vec<usize> = (0..self.lanes.len())
                .filter(|&lane| !self.reading(lane).is_some_and(|reading| reading.rests))
                .collect();
            if open.is_empty() || self.stopped() {
                break;
            }
            for lane in open {
                self.acks.ask_positions(lane, self.clock.now());
            }
            let until = self.clock.now() + READ_WAIT;
            self.wait_until(until, |_| false);
        }
    }

    /// Sends those seats to park by a frame that is slow enough from anywhere; gives the names of those that cannot be known to
    /// get there.
    fn park_slowly(&mut self, lanes: &[usize], prepared: &mut Prepared) -> Vec<String> {
        let mut open = lanes.to_vec();
        let mut unsure = Vec::new();
        for _ in 0..PARK_TRIES {
            let arrivals: Vec<(usize, Option<MonoTime>)> =
                open.iter().map(|&lane| (lane, self.send_to_park(lane, prepared))).collect();
            let refused = arrivals.iter().filter(|(_, arrival)| arrival.is_none());
            unsure.extend(refused.map(|(lane, _)| self.controllers[*lane].name.clone()));
            let under_way = arrivals.into_iter().filter_map(|(lane, arrival)| Some((lane, arrival?)));
            let (sent, arrivals): (Vec<usize>, Vec<MonoTime>) = under_way.unzip();
            let Some(arrival) = arrivals.into_iter().max() else { break };
            self.live.enter(State::Homing);
            // One that has not acked by then has the whole way to do so.
            let acked = |this: &Self| sent.iter().all(|&lane| this.is_acked(lane));
            self.wait_until((self.clock.now() + ACK_WAIT).min(arrival), acked);
            self.wait_until(arrival, |_| false);
            // One that says nothing at all is left out.
            let is_open = |lane: &usize| !self.is_acked(*lane) && self.acks.has_heard(*lane);
            open = sent.into_iter().filter(is_open).collect();
            if open.is_empty() || self.stopped() {
                return unsure;
            }
        }
        unsure.extend(open.into_iter().map(|lane| self.controllers[lane].name.clone()));
        unsure
    }

    /// True if the last frame to a lane was acked, or asked for no ack.
    fn is_acked(&self, lane: usize) -> bool {
        let last = self.lanes[lane].last_frame();
        let acked = self.live.evidence(lane).and_then(|evidence| evidence.acked());
        self.lanes[lane].ack_every == 0 || acked.is_some_and(|acked| acked.since(last) >= 0)
    }

    /// When it arrives; `None` if no Time that the controller executes is long enough.
    fn send_to_park(&mut self, lane: usize, prepared: &mut Prepared) -> Option<MonoTime> {
        let (time_ms, hurried) = slow_park_time(self.controllers[lane].seat.stroke_mm);
        let time_ms = time_ms.min(self.lanes[lane].longest_ms);
        let (park, at) = (self.lanes[lane].window.park(), self.clock.now());
        if !self.places.belief(lane).allows(&park, time_ms, at) {
            return None;
        }
        let mut buf = [0; MAX_LEN];
        let (stamped, datagram) = self.lanes[lane].encode_slow_park(time_ms, &mut buf);
        let of = u16::try_from(lane).expect("fewer controllers than ports");
        self.acks.on_sent(Sent::Posted { lane: of, frame: stamped.frame, asked: stamped.asked, at });
        if let Delivery::Failed(_) = self.sender.send(lane, datagram) {
            self.acks.on_sent(Sent::Failed { lane: of, frame: stamped.frame });
        } else {
            let (frame, asked) = (stamped.frame, stamped.asked);
            self.places.taken(lane, &Taken { frame, asked, pose: &park, lasts_ms: time_ms, shakes: 0.0, at });
        }
        prepared.park_frames[lane] += 1;
        if hurried {
            prepared.hurried.push(lane);
        }
        self.live.on_homing(time_ms);
        Some(at + Duration::from_millis(u64::from(time_ms)) + SETTLE)
    }

    /// Drains replies until an instant, or until there is nothing left to wait for.
    fn wait_until(&mut self, until: MonoTime, enough: impl Fn(&Self) -> bool) {
        while self.clock.now() < until && !self.stopped() {
            self.clock.sleep_until((self.clock.now() + LOOK).min(until));
            self.acks.drain(&mut |_, _| false);
            if enough(self) {
                return;
            }
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
