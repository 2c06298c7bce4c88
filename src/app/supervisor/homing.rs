//! Homing: while the hall is in that state the controllers find their zero by themselves. Their seats stand elsewhere than
//! before then, so the hall is home only once all of them were seen anew.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use super::job::Job;
use super::seat_places::SeatPlaces;
use crate::app::runtime::Finding;
use crate::config::Controller;
use crate::control::{Code, Problem};
use crate::device::home::{AT_ZERO_DEG, UNTURN};
use crate::health::HealthState;
use crate::rt::{Command as TickCommand, Order, Row};
use crate::state::{Event, State, Trouble};
use crate::time::MonoTime;

/// How long controllers that are home have to be seen.
const SEEN_WITHIN: Duration = Duration::from_secs(5);
/// What is told sooner than this after an order may be from before it.
const STALE: Duration = Duration::from_millis(300);

/// How far a homing is, which is over as soon as the hall leaves that state.
#[derive(Debug, Default)]
pub(super) enum Homing {
    /// There is none.
    #[default]
    Idle,
    /// These controllers are told to, and watched; called off, none of them is told any more.
    UnderWay(Vec<usize>, Arc<AtomicBool>),
    /// They are home since then, and have to be seen.
    Settling(MonoTime),
}

impl Homing {
    /// The hall homes no longer: no further seat begins to. What has begun is the controllers' own.
    fn call_off(&mut self) {
        if let Self::UnderWay(_, called_off) = std::mem::take(self) {
            called_off.store(true, Ordering::Release);
        }
    }

    /// Sends somebody to home all that take part. Where that cannot be, the state machine ends the homing when its time is
    /// over.
    fn begin(&mut self, hall: &HallContext) -> Option<Act> {
        hall.is_free().ok()?;
        let (lanes, called_off): (Vec<_>, _) = (hall.lanes_on().collect(), Arc::default());
        *self = Self::UnderWay(lanes.clone(), Arc::clone(&called_off));
        Some(Act::Start(Job::Home(lanes, called_off)))
    }

    /// Ends it where a seat was taken out meanwhile: there may be somebody on it, and what homes moves by itself.
    fn mind_seats(&mut self, hall: &HallContext) -> Vec<Act> {
        let Self::UnderWay(lanes, _) = self else { return Vec::new() };
        let Some(out) = lanes.iter().copied().find(|lane| !hall.settings.is_on(*lane)) else {
            return Vec::new();
        };
        self.call_off();
        let name = &hall.config.controllers[out].name;
        let note = format!("{name}: was taken out while the seats homed, so no seat goes on to home");
        vec![Act::Note(note), tell(Event::Trouble(Trouble::Homing(out)))]
    }

    /// Takes what became of the seats: those that are home are looked at anew.
    pub(super) fn take(&mut self, finding: Finding, hall: &HallContext) -> Vec<Act> {
        let Finding::Homed(results) = finding else { return Vec::new() };
        let (mut acts, mut failed) = (Vec::new(), None);
        let is_over = matches!(self, Self::Idle);
        for (controller, result) in results {
            match result {
                Ok(()) => {
                    let index = u16::try_from(controller).expect("fewer controllers than ports");
                    acts.push(Act::Order(Order::Homed(index)));
                }
                // Of what was called off nobody waits for an end.
                Err(_) if is_over => {}
                Err(error) => {
                    acts.push(Act::Note(format!("{}: {error}", hall.config.controllers[controller].name)));
                    failed.get_or_insert(controller);
                }
            }
        }
        match failed {
            _ if is_over => {}
            Some(controller) => acts.push(tell(Event::Trouble(Trouble::Homing(controller)))),
            None => *self = Self::Settling(hall.now),
        }
        acts
    }

    /// Says that the seats are home once all of them were seen.
    fn settle(&mut self, table: &[Row], hall: &HallContext) -> Option<Act> {
        let Self::Settling(since) = *self else { return None };
        let open = table.iter().enumerate().find(|(lane, row)| {
            hall.settings.is_on(*lane) && (row.at < since + STALE || !row.standing.may_move())
        });
        let event = match open {
            None if !table.is_empty() => Event::Homed,
            Some((controller, _)) if hall.now.since(since) > SEEN_WITHIN => {
                Event::Trouble(Trouble::Homing(controller))
            }
            _ => return None,
        };
        *self = Self::Idle;
        Some(tell(event))
    }
}

impl Feature for Homing {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        match event {
            SupervisorEvent::Entered(to) => {
                self.call_off();
                if *to == State::Homing {
                    out.extend(new_zeros(hall));
                    out.extend(self.begin(hall));
                }
            }
            SupervisorEvent::Leaving => self.call_off(),
            SupervisorEvent::Round(table) => {
                out.extend(self.mind_seats(hall));
                out.extend(self.settle(table, hall));
            }
            _ => {}
        }
    }
}

/// What a person has to know of axes that search no zero (PA03): nobody puts them where they ought to be.
fn new_zeros(hall: &HallContext) -> impl Iterator<Item = Act> {
    let table = hall.live.table();
    hall.lanes_on().filter_map(move |lane| {
        let controller = &hall.config.controllers[lane];
        let (name, axis) = (&controller.name, controller.seat.rotary_axis()?);
        let read = table.get(lane).and_then(|row| angle(controller, row, axis));
        let read = read.map_or_else(String::new, |at| format!(", read at {at:.1} deg,"));
        Some(Act::Note(format!(
            "{name}: axis {} has no search for its zero: its position now{read} becomes 0; if that is wrong, stop, turn it, switch its \
             controller off and on, and home again",
            axis + 1
        )))
    })
}

/// Where an axis that turns was measured, deg.
fn angle(controller: &Controller, row: &Row, axis: usize) -> Option<f64> {
    let SeatPlaces { positions_mm, measured, .. } = SeatPlaces::of(controller, &row.state);
    positions_mm.filter(|_| measured.is_some())?.get(axis).copied()
}

/// Homing makes the place of an axis that turns its 0: elsewhere than at the 0 that is known it would wind up, home by home.
///
/// # Errors
/// The first that would.
pub(super) fn refuse_winding(hall: &HallContext, table: &[Row]) -> Result<(), Problem> {
    let of = |lane: usize| {
        let (controller, row) = (&hall.config.controllers[lane], table.get(lane)?);
        // One that is out until it was homed has no 0 that is known.
        let is_known = row.homed == Some(true) && row.standing != HealthState::Excluded;
        let axis = controller.seat.rotary_axis().filter(|_| is_known)?;
        let at = angle(controller, row, axis).filter(|at| at.abs() > AT_ZERO_DEG)?;
        Some(format!(
            "cannot home: axis {} of {} is read at {at:.1} deg, which would become its 0",
            axis + 1,
            controller.name
        ))
    };
    hall.lanes_on().find_map(of).map_or(Ok(()), |detail| Err(Problem::new(Code::State, detail, UNTURN)))
}

const fn tell(event: Event) -> Act {
    Act::Tick(TickCommand::Event(event))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row, told};
    use crate::motion::AxisUnit;
    use crate::observe::Heard;
    use crate::wire::PerAxis;

    /// One under way, and the flag that calls it off.
    fn begun(hall: &mut HallContext) -> (Homing, Arc<AtomicBool>) {
        hall.mirror.state = State::Homing;
        let mut homing = Homing::default();
        let mut acts = told(&mut homing, &SupervisorEvent::Entered(State::Homing), hall);
        let Some(Act::Start(Job::Home(lanes, called_off))) = acts.pop() else { panic!("it begins") };
        assert_eq!(lanes, hall.lanes_on().collect::<Vec<_>>());
        (homing, called_off)
    }

    fn event(acts: &[Act]) -> Option<Event> {
        match acts {
            [] => None,
            [Act::Tick(TickCommand::Event(event))] => Some(*event),
            _ => panic!("{acts:?}"),
        }
    }

    #[test]
    fn seats_that_are_home_have_to_be_seen_after_that_before_the_hall_is() {
        let mut hall = hall(State::Parked, "one");
        let (mut homing, _) = begun(&mut hall);
        let since = hall.now;
        let acts = homing.take(Finding::Homed(vec![(0, Ok(())), (1, Ok(()))]), &hall);
        assert!(matches!(&acts[..], [Act::Order(Order::Homed(0)), Act::Order(Order::Homed(1))]), "{acts:?}");
        for (seen, home) in [([STALE, Duration::ZERO], None), ([STALE, STALE], Some(Event::Homed))] {
            let table = seen.map(|later| row(since + later));
            assert_eq!(event(&told(&mut homing, &SupervisorEvent::Round(&table), &hall)), home);
        }
        assert!(matches!(homing, Homing::Idle), "it is told once");
    }

    #[test]
    fn a_seat_that_is_home_and_not_seen_in_time_is_trouble_and_one_that_is_out_is_not_waited_for() {
        let mut hall = hall(State::Parked, "one");
        hall.settings.only = Some(["B".to_owned()].into());
        let (mut homing, _) = begun(&mut hall);
        let since = hall.now;
        homing.take(Finding::Homed(vec![(1, Ok(()))]), &hall);
        let table = [row(since), row(since)];
        hall.now = since + SEEN_WITHIN;
        assert_eq!(event(&told(&mut homing, &SupervisorEvent::Round(&table), &hall)), None);
        hall.now = hall.now + Duration::from_millis(1);
        let trouble = event(&told(&mut homing, &SupervisorEvent::Round(&table), &hall));
        assert_eq!(trouble, Some(Event::Trouble(Trouble::Homing(1))));
    }

    #[test]
    fn a_hall_that_leaves_the_state_calls_homing_off_and_hears_of_no_end_of_it() {
        for leaving in [SupervisorEvent::Entered(State::Stopped), SupervisorEvent::Leaving] {
            let mut hall = hall(State::Parked, "one");
            let (mut homing, called_off) = begun(&mut hall);
            told(&mut homing, &leaving, &hall);
            assert!(called_off.load(Ordering::Acquire));
            let failed = Finding::Homed(vec![(0, Err("no search".to_owned()))]);
            assert!(homing.take(failed, &hall).is_empty());
            assert!(told(&mut homing, &SupervisorEvent::Round(&[row(hall.now)]), &hall).is_empty());
        }
    }

    #[test]
    fn a_seat_that_is_taken_out_while_it_homes_ends_the_homing_and_one_that_was_out_does_not() {
        let mut hall = hall(State::Parked, "one");
        hall.settings.only = Some(["B".to_owned()].into());
        let (mut homing, called_off) = begun(&mut hall);
        let table = [row(hall.now), row(hall.now)];
        assert!(told(&mut homing, &SupervisorEvent::Round(&table), &hall).is_empty());
        hall.settings.only = Some(["A".to_owned()].into());
        let acts = told(&mut homing, &SupervisorEvent::Round(&table), &hall);
        let [Act::Note(note), Act::Tick(TickCommand::Event(Event::Trouble(Trouble::Homing(1))))] = &acts[..]
        else {
            panic!("{acts:?}")
        };
        assert!(note.starts_with("B1: was taken out"), "{note}");
        assert!(called_off.load(Ordering::Acquire));
        assert!(told(&mut homing, &SupervisorEvent::Round(&table), &hall).is_empty(), "it is told once");
    }

    #[test]
    fn a_seat_that_does_not_home_is_named_and_is_trouble() {
        let mut hall = hall(State::Parked, "one");
        let (mut homing, _) = begun(&mut hall);
        let acts = homing.take(Finding::Homed(vec![(1, Err("no search".to_owned()))]), &hall);
        let [Act::Note(note), trouble] = &acts[..] else { panic!("{acts:?}") };
        assert!(note.starts_with("B1: "), "{note}");
        assert!(
            matches!(trouble, Act::Tick(TickCommand::Event(Event::Trouble(Trouble::Homing(1))))),
            "{trouble:?}"
        );
    }

    #[test]
    fn of_an_axis_that_searches_no_zero_it_is_said_that_it_takes_its_place_for_that_before_anything_homes() {
        let mut hall = hall(State::Homing, "one");
        let config = Arc::make_mut(&mut hall.config);
        Arc::make_mut(&mut config.controllers[1].seat).each[0].unit = AxisUnit::Degree;
        let mut homing = Homing::default();
        let acts = told(&mut homing, &SupervisorEvent::Entered(State::Homing), &hall);
        let [Act::Note(note), Act::Start(_)] = &acts[..] else { panic!("{acts:?}") };
        assert!(note.starts_with("B1: axis 1 has no search for its zero: its position now"), "{note}");
    }

    #[test]
    fn a_turntable_that_is_home_elsewhere_than_at_its_0_is_not_homed_there() {
        let mut hall = hall(State::Parked, "one");
        let config = Arc::make_mut(&mut hall.config);
        let seat = Arc::make_mut(&mut config.controllers[1].seat);
        (seat.each[0].unit, seat.each[0].low, seat.each[0].high) = (AxisUnit::Degree, -180.0, 180.0);
        let axis = seat.each[0];
        let read_at = |deg: f64| {
            let pulses = axis.pulses((deg + 180.0) / 360.0);
            let mut row = row(hall.now);
            row.state.measured = Some(Heard { value: PerAxis::new(&[pulses]), at: hall.now });
            row
        };
        for (deg, homed, standing, refused) in [
            (169.5, Some(true), HealthState::Ok, true),
            (-90.0, Some(true), HealthState::Lost, true),
            (0.1, Some(true), HealthState::Ok, false),
            (169.5, Some(false), HealthState::Ok, false),
            (169.5, None, HealthState::Lost, false),
            (169.5, Some(true), HealthState::Excluded, false),
        ] {
            let table = [row(hall.now), Row { homed, standing, ..read_at(deg) }];
            let refusal = refuse_winding(&hall, &table);
            assert_eq!(refusal.is_err(), refused, "{deg} {homed:?} {standing:?}");
            if let Err(problem) = refusal {
                let words = format!("axis 1 of B1 is read at {deg:.1} deg, which would become its 0");
                assert!(
                    problem.detail.contains(&words) && problem.remedy.contains("park first"),
                    "{problem:?}"
                );
            }
        }
    }

    #[test]
    fn nothing_homes_in_a_hall_that_closes_or_whose_line_is_in_use() {
        for (close, job) in [(true, None), (false, Some("preflight"))] {
            let mut hall = hall(State::Homing, "one");
            if close {
                hall.close();
            }
            hall.job = job;
            let mut homing = Homing::default();
            assert!(told(&mut homing, &SupervisorEvent::Entered(State::Homing), &hall).is_empty());
        }
    }
}
