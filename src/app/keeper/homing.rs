//! Homing: while the hall is in that state the controllers find their zero by themselves. Their seats stand elsewhere than
//! before then, so the hall is home only once all of them were seen anew.

use std::time::Duration;

use super::Keeper;
use super::errand::Done;
use crate::app::house::{Finding, Inquiry, inquire};
use crate::rt::{Command, Order};
use crate::state::{Event, State, Trouble};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// How long controllers that are home have to be seen.
const SEEN_WITHIN: Duration = Duration::from_secs(5);
/// What is told sooner than this after an order may be from before it.
const STALE: Duration = Duration::from_millis(300);

/// Controllers that are home and have to be seen.
#[derive(Debug)]
pub(super) struct Settling {
    since: MonoTime,
}

impl Keeper {
    /// Sends somebody to home all that take part. An errand that is under way has the line; the state machine ends the homing
    /// then when its time is over.
    pub(super) fn begin_homing(&mut self) {
        let lanes: Vec<usize> =
            (0..self.reins.config.controllers.len()).filter(|lane| self.board.is_on(*lane)).collect();
        let Some(mut line) = self.line.take() else {
            let _ = self.command(Command::Event(Event::Trouble(Trouble::HomingTime)));
            return;
        };
        let config = self.reins.config.clone();
        self.send("homing", None, move || {
            let finding = inquire(&mut line, &config.controllers, Inquiry::Home(lanes), &mut |_| {});
            Done::Homed(line, finding)
        });
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
                    let _ = self.reins.orders.push(Order::Homed(index));
                }
                Err(error) => {
                    self.note(format!("{}: {error}", self.reins.config.controllers[controller].name));
                    failed.get_or_insert(controller);
                }
            }
        }
        match failed {
            Some(controller) => {
                let _ = self.command(Command::Event(Event::Trouble(Trouble::Homing(controller))));
            }
            None => self.homing = Some(Settling { since: Monotonic.now() }),
        }
    }

    /// Says that the seats are home once all of them were seen.
    pub(super) fn settle_homing(&mut self) {
        let Some(Settling { since }) = self.homing else { return };
        if self.known.state != State::Homing {
            self.homing = None;
            return;
        }
        let now = Monotonic.now();
        let table = self.reins.live.table();
        let open = table.iter().enumerate().find(|(lane, row)| {
            self.board.is_on(*lane) && (row.at < since + STALE || !row.standing.may_move())
        });
        let event = match open {
            None if !table.is_empty() => Event::Homed,
            Some((controller, _)) if now.since(since) > SEEN_WITHIN => {
                Event::Trouble(Trouble::Homing(controller))
            }
            _ => return,
        };
        self.homing = None;
        let _ = self.command(Command::Event(event));
    }
}
