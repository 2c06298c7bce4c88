//! What the thread of a link tells of a lane, as evidence: the drives of a seat say where they are, and whether they are home. Ack
//! thread; pure; allocates nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

use super::{BrakeReason, StreamEvent};
use crate::belief::{ASTRAY, Fall, Reading, Source};
use crate::config::Controller;
use crate::drive::{Evidence, EvidenceList, Lane, Need, Seen, Whereabouts};
use crate::health::{Continuity, Identity, Pushed, Sighting};
use crate::motion::{MAX_AXES, Pose, Pulses, SeatType};
use crate::time::MonoTime;
use crate::wire::PerAxis;
use crate::wire::silvermax::kill_bits;

/// Two places of an axis are the same, strokes: a servo that holds its place wanders by so much.
const STILL: f64 = 0.000_5;
/// So long in one place is rest: the next poll of that axis found it there.
const REST: Duration = Duration::from_millis(15);
/// Readings further apart say nothing of what was between them.
const APART: Duration = Duration::from_millis(1_500);
/// How far from park a seat at rest may stand, strokes.
pub(crate) const AT_PARK: f64 = 0.002;
/// How far beside where its drive holds it an axis may stand that is led from there, as a part of how far it may be beside where it is led.
const LED_BESIDE: f64 = 0.8;

/// What is wanted of a lane by the thread of its link: levels, so that none is lost, and nobody waits.
#[derive(Debug, Default)]
pub(crate) struct LaneWants {
    /// Since when its axes are to have been read, ns.
    located: AtomicU64,
    /// How often somebody wanted to know whether it is home.
    looks: AtomicU32,
}

impl LaneWants {
    /// Since when its axes are to have been read.
    pub(crate) fn located(&self) -> u64 {
        self.located.load(Ordering::Relaxed)
    }

    /// How often somebody wanted to know whether it is home.
    pub(crate) fn looks(&self) -> u32 {
        self.looks.load(Ordering::Relaxed)
    }
}

/// An axis as it was read.
#[derive(Debug, Clone, Copy)]
struct Told {
    place: f64,
    /// Where its drive holds it; none while that is not known.
    held: Option<f64>,
    at: MonoTime,
    /// Where it has been since then, and whether it was elsewhere before.
    stays: (f64, MonoTime),
    moved: bool,
}

/// A seat whose drives are on a link.
#[derive(Debug)]
pub(crate) struct LinkPeer {
    seat: Arc<SeatType>,
    /// The place of its first own axis in a pose.
    first_slot: usize,
    park: Pose,
    /// How far beside where its drive holds it each axis may stand that is led from there, strokes.
    beside: Pose,
    told: [Option<Told>; MAX_AXES],
    /// Its units are known to be home.
    homed: bool,
    /// Until when it executes what went to it.
    sent: MonoTime,
    lead: Duration,
    wants: Arc<LaneWants>,
}

impl LinkPeer {
    /// One of which nothing is known yet.
    pub(crate) fn new(controller: &Controller, lane: &Lane) -> Self {
        let mut beside = [0.0; MAX_AXES];
        // Past its error limit a drive lets go of its motor by itself, where it is told to.
        if let Some(silvermax) = controller.drives().and_then(|drives| drives.drive.silvermax.as_ref()) {
            let most = |stroke: f64| (silvermax.hold_error_mm / stroke).min(LED_BESIDE * ASTRAY);
            beside.iter_mut().zip(controller.seat.own()).for_each(|(cell, axis)| *cell = most(axis.stroke()));
        }
        Self {
            beside,
            seat: Arc::clone(&controller.seat),
            first_slot: controller.first_slot(),
            park: lane.window.park(),
            told: [None; MAX_AXES],
            homed: false,
            sent: MonoTime::default(),
            lead: lane.window.lead(),
            wants: Arc::default(),
        }
    }

    /// What is wanted of it by the thread of its link.
    pub(crate) fn wants(&self) -> Arc<LaneWants> {
        Arc::clone(&self.wants)
    }

    /// Has the thread of the link find out what is needed; says in how many messages, for whoever waits for an answer.
    pub(crate) fn poll(&self, need: Need, now: MonoTime) -> u32 {
        match need {
            Need::Position => self.wants.located.store(now.as_nanos(), Ordering::Relaxed),
            Need::Identity => drop(self.wants.looks.fetch_add(1, Ordering::Relaxed)),
            // Its thread asks for signs of life by itself.
            Need::KeepAlive { .. } => {}
            Need::Count | Need::Dark => return 0,
        }
        1
    }

    /// A pose went to it: where it stood before says nothing of whether it rests.
    pub(crate) fn on_sent(&mut self, at: MonoTime) {
        self.sent = at + self.lead;
    }

    /// Takes what the thread of its link tells at an instant: puts into `out` of what it is evidence.
    pub(crate) fn hear(&mut self, event: &StreamEvent, now: MonoTime, out: &mut EvidenceList) {
        match *event {
            StreamEvent::Confirmed { .. }
            | StreamEvent::Withdrawn { .. }
            | StreamEvent::Rests { .. }
            | StreamEvent::Moves { .. } => {}
            StreamEvent::Read { axis, position, held, at, .. } => {
                out.extend([Evidence::Answered, Evidence::Alive]);
                if self.homed {
                    out.push(Evidence::Position(self.read(usize::from(axis), (position, held), at)));
                }
            }
            StreamEvent::Homed { homed, .. } => {
                self.homed = homed;
                out.extend([Evidence::Answered, Evidence::Alive, Evidence::Homed(homed)]);
                out.push(Evidence::Seen(self.seen(now)));
            }
            StreamEvent::Restarted { .. } => self.lose_zero(out),
            StreamEvent::Killed { axis, cause, .. } => {
                out.push(Evidence::Killed { axis: usize::from(axis) + 1, cause: kill_bits(cause) });
                self.lose_zero(out);
            }
            StreamEvent::Braked { why: BrakeReason::Stopped, .. } => {}
            StreamEvent::Braked { .. } | StreamEvent::Lost { .. } => out.push(Evidence::Fell(Fall::Gap)),
            StreamEvent::OffCourse { .. } | StreamEvent::Elsewhere { .. } => {
                out.push(Evidence::Fell(Fall::Astray));
            }
            // What is in doubt is found out, or the lane brakes.
            StreamEvent::Doubt { .. } | StreamEvent::Back { .. } => {}
        }
    }

    fn lose_zero(&mut self, out: &mut EvidenceList) {
        (self.homed, self.told) = (false, [None; MAX_AXES]);
        out.push(Evidence::LostZero);
    }

    /// An axis was read there, and its drive holds it there.
    fn read(&mut self, axis: usize, (place, held): (f64, Option<f64>), at: MonoTime) -> Whereabouts {
        if let Some(told) = self.told.get_mut(axis) {
            let before = told.filter(|told| at.since(told.at) <= APART);
            let stays = before.map(|told| told.stays).filter(|(stay, _)| (place - stay).abs() <= STILL);
            let moved = before.is_some_and(|told| told.moved || stays.is_none());
            // Where it stood before all poses were over says nothing of whether it rests.
            let stays = stays.filter(|(_, since)| *since > self.sent).unwrap_or((place, at));
            *told = Some(Told { place, held, at, stays, moved });
        }
        let reading = self.reading();
        let slot = self.first_slot + axis;
        let mut passing =
            Reading { slots: 0, rests: false, by: Source::Passing, ..Reading::at_rest([0.0; MAX_AXES], at) };
        if let Some(cell) = passing.pose.get_mut(slot) {
            (*cell, passing.slots) = (place, 1 << slot);
        }
        Whereabouts {
            reading,
            passing: Some(passing),
            told: self.pulses(),
            outside: None,
            pushed: self.pushed(),
            is_ambiguous: false,
            is_off_park: reading.is_some() && !self.is_at_park(),
        }
    }

    /// The first axis that stands farther beside where its drive holds it than one may that is led from there.
    fn pushed(&self) -> Option<Pushed> {
        let mut axes = self.told.iter().zip(&self.beside).enumerate();
        axes.find_map(|(axis, (told, beside))| {
            let Told { place, held, .. } = (*told)?;
            let held = held.filter(|held| (place - held).abs() > *beside)?;
            let place_of = |part: f64| Pushed::thousandths(self.seat.each[axis].place(part));
            Some(Pushed { axis, at: place_of(place), held: place_of(held) })
        })
    }

    /// The seat as it was told last; none while an axis has not told since the last pose went to it. One that is pushed off a little is
    /// where its drive holds it: a motion begins there, by which it stands as before.
    fn reading(&self) -> Option<Reading> {
        let mut reading = Reading::at_rest([0.0; MAX_AXES], MonoTime::from_nanos(u64::MAX));
        reading.slots = 0;
        for axis in 0..self.seat.axes {
            let told = self.told[axis].filter(|told| told.at > self.sent)?;
            let slot = self.first_slot + axis;
            let held = told.held.filter(|held| (told.place - held).abs() <= self.beside[axis]);
            reading.pose[slot] = held.unwrap_or(told.place);
            reading.slots |= 1 << slot;
            reading.at = reading.at.min(told.at);
            let rests = told.at.since(told.stays.1) >= REST;
            reading.rests &= rests;
            reading.moves |= told.moved && !rests;
        }
        Some(reading)
    }

    /// Whether it was read at park, wherever its drives hold it.
    fn is_at_park(&self) -> bool {
        let own = self.told.iter().zip(&self.park[self.first_slot..]).take(self.seat.axes);
        own.into_iter().all(|(told, park)| told.is_some_and(|told| (told.place - park).abs() <= AT_PARK))
    }

    fn pulses(&self) -> Option<PerAxis<Pulses>> {
        let known = self.told.iter().take_while(|told| told.is_some()).count();
        let place = |axis: usize| self.told[axis].map_or(0.0, |told| told.place);
        (known > 0).then(|| PerAxis::from_fn(known, |axis| self.seat.each[axis].pulses(place(axis))))
    }

    fn seen(&self, now: MonoTime) -> Seen {
        let axes = u16::try_from(self.seat.axes).unwrap_or(u16::MAX);
        let fresh = self.reading().filter(|reading| now.since(reading.at) <= APART);
        let rests = fresh.filter(|reading| reading.rests);
        Seen {
            sighting: Sighting {
                identity: Identity { axes, ..Identity::default() },
                error: 0,
                alarm: 0,
                continuity: Continuity::Mark,
                homed: self.homed,
            },
            // Whoever does not know its zero is led nowhere.
            rests: rests.is_some() || !self.homed,
            sways: false,
            at_park: rests.is_some() && self.is_at_park(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::from_to_args;
    use crate::cue::{Source as CueSource, read};
    use crate::drive::{Manner, lanes};
    use crate::timeline::Timeline;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    /// What is told of the first seat of a hall by an event.
    fn told(peer: &mut LinkPeer, event: &StreamEvent) -> EvidenceList {
        let mut out = EvidenceList::new();
        peer.hear(event, ms(1_000), &mut out);
        out
    }

    #[test]
    fn a_seat_whose_drive_was_restarted_or_let_go_is_nowhere_and_not_home_until_all_its_drives_say_so_again()
    {
        let config = from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
        let cue = read(Path::new("a.csv"), &b"time_ms,a1\n0,0\n1000,0.1\n"[..], &CueSource::Native).unwrap();
        let lanes = lanes(&config, &Timeline::new(cue), Manner { level: 1.0, silent: false });
        let mut peer = LinkPeer::new(&config.controllers[0], &lanes[0]);
        let homed = StreamEvent::Homed { lane: 0, homed: true };
        let read = StreamEvent::Read { lane: 0, axis: 0, position: 0.0, held: None, at: ms(990) };
        let is_placed = |out: &EvidenceList| out.iter().any(|one| matches!(one, Evidence::Position(_)));
        let is_home = |out: &EvidenceList| out.contains(&Evidence::Homed(true));
        for lost in [
            StreamEvent::Restarted { lane: 0, axis: 0 },
            StreamEvent::Killed { lane: 0, axis: 0, cause: 1 << 16 },
        ] {
            assert!(is_home(&told(&mut peer, &homed)));
            assert!(is_placed(&told(&mut peer, &read)));
            assert!(told(&mut peer, &lost).contains(&Evidence::LostZero));
            // Counts of a drive that does not know its zero are no place.
            assert!(!is_placed(&told(&mut peer, &read)), "after {lost:?}");
        }
        assert!(is_home(&told(&mut peer, &homed)) && is_placed(&told(&mut peer, &read)));
    }
}
