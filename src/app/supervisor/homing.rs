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
                    out.extend(self.begin(hall));
                }
            }
            SupervisorEvent::Leaving => self.call_off(),
            SupervisorEvent::Round(table) => out.extend(self.settle(table, hall)),
            _ => {}
        }
    }
}

const fn tell(event: Event) -> Act {
    Act::Tick(TickCommand::Event(event))
}
