//! Before tick 0: reads where every seat stands, and brings those that are not at park, or do not tell, there by one
//! slow frame.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::config::Controller;
use crate::fanout::Lane;
use crate::motion::{MAX_AXES, Pulses};
use crate::net::{Delivery, Sender};
use crate::plan::homing_time;
use crate::rt::{AckLoop, Live, Phase, Sent};
use crate::time::{Clock, MonoTime};
use crate::wire::{Code, MAX_LEN, PerAxis, RegisterReply, position_reads, positions};

/// Tries of a position read, and how long each waits.
const READ_TRIES: usize = 3;
const READ_WAIT: Duration = Duration::from_millis(200);
/// How often replies are looked for meanwhile.
const LOOK: Duration = Duration::from_millis(2);
/// What is waited beyond the Time of the slow frame.
const SETTLE: Duration = Duration::from_millis(20);

/// What was done before tick 0.
#[derive(Debug, Clone, Default)]
pub(super) struct Prepared {
    /// Slow frames, by controller.
    pub(super) homing: Vec<u64>,
    /// Controllers whose way to park may have been faster than 50 mm/s, because PA0b cuts a longer Time.
    pub(super) hurried: Vec<usize>,
}

impl Prepared {
    /// Nothing done for so many controllers.
    pub(super) fn nothing(controllers: usize) -> Self {
        Self { homing: vec![0; controllers], hurried: Vec::new() }
    }
}

/// Everything that preparing needs.
pub(super) struct Preparation<'a, C> {
    pub(super) clock: &'a C,
    pub(super) sender: &'a Sender,
    pub(super) acks: &'a mut AckLoop,
    pub(super) controllers: &'a [Controller],
    pub(super) lanes: &'a mut [Lane],
    /// Read throughout: somebody wants the show to stop.
    pub(super) stop: &'a AtomicBool,
    /// Told of the seats that are brought to park.
    pub(super) live: &'a Live,
}

/// The positions that a controller has told so far, its own axes from the first on.
type Told = [Option<Pulses>; MAX_AXES];

impl<C: Clock> Preparation<'_, C> {
    /// Brings every seat to its park pose, as far as it can be known.
    pub(super) fn run(&mut self, ask: bool) -> Prepared {
        let told = if ask { self.ask() } else { vec![Told::default(); self.lanes.len()] };
        let mut prepared = Prepared::nothing(self.lanes.len());
        if self.stopped() {
            return prepared;
        }
        let mut arrival = None;
        for (lane, told) in told.iter().enumerate() {
            if !self.is_parked(lane, told) {
                let time_ms = self.send_home(lane, &mut prepared);
                self.live.on_homing(time_ms);
                arrival =
                    arrival.max(Some(self.clock.now() + Duration::from_millis(u64::from(time_ms)) + SETTLE));
            }
        }
        if let Some(arrival) = arrival {
            self.live.enter(Phase::Homing);
            self.wait_until(arrival, &mut |_, _| false, &mut || false);
        }
        prepared
    }

    /// Moves nothing: only makes sure that every seat stands at its park pose.
    ///
    /// # Errors
    /// The names of the controllers whose seat does not tell that it does.
    pub(super) fn make_sure(&mut self) -> Result<Prepared, Vec<String>> {
        let told = self.ask();
        let unsure = told.iter().enumerate().filter(|(lane, told)| !self.is_parked(*lane, told));
        let unsure: Vec<_> = unsure.map(|(lane, _)| self.controllers[lane].name.clone()).collect();
        if unsure.is_empty() { Ok(Prepared::nothing(self.lanes.len())) } else { Err(unsure) }
    }

    /// Reads where the seats stand, for the report as well.
    fn ask(&mut self) -> Vec<Told> {
        let told = self.read_positions();
        for (lane, told) in told.iter().enumerate().filter(|(_, told)| told[0].is_some()) {
            let known = told.iter().take_while(|place| place.is_some()).count();
            let positions = PerAxis::from_fn(known, |axis| told[axis].unwrap_or_default());
            self.acks.on_positions(lane, positions, self.clock.now());
        }
        told
    }

    fn read_positions(&mut self) -> Vec<Told> {
        let mut told = vec![Told::default(); self.lanes.len()];
        for _ in 0..READ_TRIES {
            let open: Vec<usize> =
                (0..told.len()).filter(|&lane| !tells_all(&self.controllers[lane], &told[lane])).collect();
            if open.is_empty() || self.stopped() {
                break;
            }
            for lane in open {
                self.send_reads(lane);
            }
            let until = self.clock.now() + READ_WAIT;
            self.wait_for_positions(until, &mut told);
        }
        told
    }

    fn send_reads(&self, lane: usize) {
        let code = self.lanes[lane].code;
        for read in position_reads(self.controllers[lane].seat.axes, code, code) {
            // A read that the kernel does not take is like one that is lost: there are further tries.
            let _ = self.sender.send(lane, read.emit(&mut [0; MAX_LEN]));
        }
    }

    fn wait_for_positions(&mut self, until: MonoTime, told: &mut [Told]) {
        let controllers = self.controllers;
        let told = std::cell::RefCell::new(told);
        let mut take = |lane: usize, octets: &[u8]| {
            let Ok(reply) = RegisterReply::parse(octets) else { return false };
            let Some(first) = first_axis(&reply) else { return false };
            let dialect = controllers[lane].dialect;
            for (axis, pulses) in positions(reply.values(dialect), dialect).iter().enumerate() {
                if let Some(place) = told.borrow_mut()[lane].get_mut(first + axis) {
                    *place = Some(*pulses);
                }
            }
            true
        };
        let mut all = || controllers.iter().zip(told.borrow().iter()).all(|(one, told)| tells_all(one, told));
        self.wait_until(until, &mut take, &mut all);
    }

    /// Whether every own axis told a position within a pulse of park. Axes past the sixth have no position register.
    fn is_parked(&self, lane: usize, told: &Told) -> bool {
        let seat = &self.controllers[lane].seat;
        (0..seat.axes).all(|axis| {
            told[axis].is_some_and(|pulses| pulses.0.abs_diff(seat.pulses(seat.park[axis]).0) <= 1)
        })
    }

    fn send_home(&mut self, lane: usize, prepared: &mut Prepared) -> u32 {
        let stroke_mm = self.controllers[lane].seat.stroke_mm;
        let (time_ms, hurried) = homing_time(stroke_mm);
        let mut buf = [0; MAX_LEN];
        let (stamped, datagram) = self.lanes[lane].encode_homing(time_ms, &mut buf);
        let of = u16::try_from(lane).expect("fewer controllers than ports");
        self.acks.on_sent(Sent::Posted {
            lane: of,
            frame: stamped.frame,
            asked: stamped.asked,
            at: self.clock.now(),
        });
        if let Delivery::Failed(_) = self.sender.send(lane, datagram) {
            self.acks.on_sent(Sent::Failed { lane: of, frame: stamped.frame });
        }
        prepared.homing[lane] += 1;
        if hurried {
            prepared.hurried.push(lane);
        }
        time_ms
    }

    /// Drains replies until an instant, or until there is nothing left to wait for.
    fn wait_until(
        &mut self,
        until: MonoTime,
        take: &mut dyn FnMut(usize, &[u8]) -> bool,
        enough: &mut dyn FnMut() -> bool,
    ) {
        while self.clock.now() < until && !self.stopped() {
            self.clock.sleep_until((self.clock.now() + LOOK).min(until));
            self.acks.drain(take);
            if enough() {
                return;
            }
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// The axis, from 0, of the first position that a reply to one of our reads tells.
fn first_axis(reply: &RegisterReply<'_>) -> Option<usize> {
    let asked = position_reads(MAX_AXES, Code::ALL, Code::ALL);
    let block =
        asked.enumerate().find(|(_, read)| read.channel == reply.channel && read.start == reply.start)?.0;
    Some(3 * block)
}

fn tells_all(controller: &Controller, told: &Told) -> bool {
    told.iter().take(controller.seat.axes.min(6)).all(Option::is_some)
}
