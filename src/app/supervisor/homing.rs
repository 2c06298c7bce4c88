//! Homing: while the hall is in that state the controllers find their zero by themselves. Their seats stand elsewhere than
//! before then, so the hall is home only once all of them were seen anew.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use super::job::Job;
use crate::app::runtime::Finding;
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
    /// The controllers are told to, and watched; called off, none of them is told any more.
    UnderWay(Arc<AtomicBool>),
    /// They are home since then, and have to be seen.
    Settling(MonoTime),
}

impl Homing {
    /// The hall homes no longer: no further seat begins to. What has begun is the controllers' own.
    fn call_off(&mut self) {
        if let Self::UnderWay(called_off) = std::mem::take(self) {
            called_off.store(true, Ordering::Release);
        }
    }

    /// Sends somebody to home all that take part. Where that cannot be, the state machine ends the homing when its time is
    /// over.
    fn begin(&mut self, hall: &HallContext) -> Option<Act> {
        hall.is_free().ok()?;
        let called_off = Arc::default();
        *self = Self::UnderWay(Arc::clone(&called_off));
        Some(Act::Start(Job::Home(hall.lanes_on().collect(), called_off)))
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
            SupervisorEvent::Round(table) => out.extend(self.settle(table, hall)),
            _ => {}
        }
    }
}

/// What a person has to know of axes that search no zero (PA03): nobody puts them where they ought to be.
fn new_zeros(hall: &HallContext) -> impl Iterator<Item = Act> {
    hall.lanes_on().filter_map(|lane| {
        let controller = &hall.config.controllers[lane];
        let (name, axis) = (&controller.name, controller.seat.rotary_axis()? + 1);
        Some(Act::Note(format!(
            "{name}: axis {axis} has no search for its zero: its position now becomes 0; if that is wrong, stop, turn it, and home \
             again"
        )))
    })
}

const fn tell(event: Event) -> Act {
    Act::Tick(TickCommand::Event(event))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row, told};
    use crate::motion::AxisUnit;

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
