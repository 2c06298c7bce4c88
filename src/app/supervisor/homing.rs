//! Homing: while the hall is in that state the controllers find their zero by themselves. Their seats stand elsewhere than
//! before then, so the hall is home only once all of them were seen anew.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::Supervisor;
use super::job::JobResult;
use crate::app::runtime::{DeviceJob, Finding, run_on_devices};
use crate::rt::{Command as TickCommand, Order};
use crate::state::{Event, Trouble};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// How long controllers that are home have to be seen.
const SEEN_WITHIN: Duration = Duration::from_secs(5);
/// What is told sooner than this after an order may be from before it.
const STALE: Duration = Duration::from_millis(300);

/// How far a homing is, which is over as soon as the hall leaves that state.
#[derive(Debug)]
pub(super) enum Homing {
    /// The controllers are told to, and watched; called off, none of them is told any more.
    UnderWay(Arc<AtomicBool>),
    /// They are home since then, and have to be seen.
    Settling(MonoTime),
}

impl Supervisor {
    /// Sends somebody to home all that take part. Where that cannot be, the state machine ends the homing when its time is
    /// over.
    pub(super) fn begin_homing(&mut self) {
        if self.is_free().is_err() {
            return;
        }
        let lanes: Vec<usize> =
            (0..self.runtime.config.controllers.len()).filter(|lane| self.settings.is_on(*lane)).collect();
        let called_off = Arc::default();
        self.homing = Some(Homing::UnderWay(Arc::clone(&called_off)));
        let (config, line) = (self.runtime.config.clone(), self.line.clone());
        self.send("homing", None, move || {
            let job = DeviceJob::Home { lanes, called_off };
            JobResult::Homed(run_on_devices(&mut line.hold(), &config.controllers, job, &mut |_| {}))
        });
    }

    /// The hall homes no longer: no further seat begins to. What has begun is the controllers' own.
    pub(super) fn call_off_homing(&mut self) {
        if let Some(Homing::UnderWay(called_off)) = self.homing.take() {
            called_off.store(true, Ordering::Release);
        }
    }

    /// Takes what became of the seats: those that are home are looked at anew.
    pub(super) fn on_homed(&mut self, finding: Finding) {
        let Finding::Homed(results) = finding else { return };
        let mut failed = None;
        for (controller, result) in results {
            match result {
                Ok(()) => {
                    let index = u16::try_from(controller).expect("fewer controllers than ports");
                    // Where it finds no room the controller is not looked at, and stays out.
                    let _ = self.runtime.orders.push(Order::Homed(index));
                }
                // Of what was called off nobody waits for an end.
                Err(_) if self.homing.is_none() => {}
                Err(error) => {
                    self.note(format!("{}: {error}", self.runtime.config.controllers[controller].name));
                    failed.get_or_insert(controller);
                }
            }
        }
        if self.homing.is_none() {
            return;
        }
        match failed {
            Some(controller) => {
                let _ = self.command(TickCommand::Event(Event::Trouble(Trouble::Homing(controller))));
            }
            None => self.homing = Some(Homing::Settling(Monotonic.now())),
        }
    }

    /// Says that the seats are home once all of them were seen.
    pub(super) fn settle_homing(&mut self) {
        let Some(Homing::Settling(since)) = self.homing else { return };
        let now = Monotonic.now();
        let table = self.runtime.live.table();
        let open = table.iter().enumerate().find(|(lane, row)| {
            self.settings.is_on(*lane) && (row.at < since + STALE || !row.standing.may_move())
        });
        let event = match open {
            None if !table.is_empty() => Event::Homed,
            Some((controller, _)) if now.since(since) > SEEN_WITHIN => {
                Event::Trouble(Trouble::Homing(controller))
            }
            _ => return,
        };
        self.homing = None;
        let _ = self.command(TickCommand::Event(event));
    }
}
