//! The thread of one pad: it reads presses, does what they ask, and lights the lamps.

use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use super::PadTable;
use super::judge::{Press, PressJudge};
use super::line::{PadLine, wait};
use crate::config::{ButtonPad, PadLamp, PadWord};
use crate::control::{Command, Handle, Role, Severity, Status, Surface, Who};
use crate::log::{Line, Log, Priority};
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// How often lamps are looked after, and how long one that blinks is lit.
const LAMPS: Duration = Duration::from_millis(250);
/// How long a pad that is not there is not looked for again.
const AGAIN: Duration = Duration::from_secs(1);

/// What the thread holds.
pub(super) struct PadReader {
    pad: ButtonPad,
    handle: Handle,
    log: Log,
    table: PadTable,
    place: usize,
    closing: UnixStream,
    who: Who,
}

impl PadReader {
    /// A pad with its place in the table, read until the other end of `closing` is gone.
    pub(super) fn new(
        pad: ButtonPad,
        handle: Handle,
        log: Log,
        (table, place): (PadTable, usize),
        closing: UnixStream,
    ) -> Self {
        let who = Who { role: Role::Operate, surface: Surface::Buttons, name: pad.name.clone() };
        Self { pad, handle, log, table, place, closing, who }
    }

    /// Reads the pad, and looks for it again where it is gone, until it is to end.
    pub(super) fn run(self) {
        loop {
            let trouble = match PadLine::open(&self.pad.device) {
                Ok(line) => {
                    self.table.change(self.place, |row| (row.works, row.trouble) = (true, None));
                    self.say(Priority::Notice, "its buttons are heard");
                    match self.serve(line) {
                        Ok(()) => return,
                        Err(error) => error,
                    }
                }
                Err(error) => error,
            };
            let trouble = format!("{}: {trouble}", self.pad.device);
            self.table.change(self.place, |row| (row.works, row.trouble) = (false, Some(trouble)));
            if wait([Some(self.closing.as_fd())], AGAIN) == [true] {
                return;
            }
        }
    }

    /// Serves an open pad until it is to end.
    fn serve(&self, mut line: PadLine) -> io::Result<()> {
        let mut judge = PressJudge::new(&self.pad, Monotonic.now());
        let mut lit = vec![None; self.pad.lamps.len()];
        loop {
            let [closes, _] = wait([Some(self.closing.as_fd()), Some(line.as_fd())], LAMPS);
            if closes {
                // It may be gone, and then its lamps are dark.
                let _ = self.pad.lamps.iter().try_for_each(|(code, _)| line.light(*code, false));
                return Ok(());
            }
            for event in line.read(Monotonic.now())? {
                if let Some(press) = judge.take(event, Monotonic.now(), || is_armed(&self.handle.status())) {
                    self.take(press);
                }
            }
            let (now, status) = (Monotonic.now(), self.handle.status());
            let asks = judge.waits_for_go(now, is_armed(&status));
            for ((code, shows), lit) in self.pad.lamps.iter().zip(&mut lit) {
                let is_lit = is_lit(*shows, &status, asks.then_some(now));
                if lit.replace(is_lit) != Some(is_lit) {
                    line.light(*code, is_lit)?;
                }
            }
        }
    }

    /// Does what a press asks; what becomes of that the supervisor writes down.
    fn take(&self, press: Press) {
        let word = match press {
            Press::Stop => {
                self.handle.stop(); // before all else
                self.handle.note_stop(self.who.clone());
                PadWord::Stop
            }
            Press::Ask(word, at) => {
                let command = match word {
                    PadWord::Go => Command::Go,
                    PadWord::Pause => Command::Pause,
                    PadWord::Park => Command::Park,
                    PadWord::Mark => Command::Mark { text: None },
                    PadWord::Stop => Command::Stop,
                };
                if let Err(problem) = self.handle.post_asked(self.who.clone(), command, at) {
                    self.say(Priority::Warning, &format!("{word} was pressed and not taken: {problem}"));
                }
                word
            }
            Press::AsksAgain => {
                return self.say(Priority::Notice, "go was pressed, and waits for its second press");
            }
            Press::NotArmed => {
                let status = self.handle.status();
                let state = &status.state;
                return self.say(
                    Priority::Notice,
                    &format!("go was pressed, and does nothing while {state}; arm first"),
                );
            }
        };
        self.table.change(self.place, |row| {
            row.presses += 1;
            row.last = Some(word.to_string());
        });
    }

    fn say(&self, priority: Priority, text: &str) {
        self.log.say(Line::new(priority, "buttons", format!("{}: {text}", self.pad.name)));
    }
}

fn is_armed(status: &Status) -> bool {
    status.state == State::Armed
}

/// True if a lamp is lit; `asks` is the time while GO waits for its second press.
fn is_lit(shows: PadLamp, status: &Status, asks: Option<MonoTime>) -> bool {
    let is_error = || status.warnings.iter().any(|warning| warning.severity == Severity::Error);
    match (shows, asks) {
        (PadLamp::Armed, Some(now)) => (now.as_nanos() / crate::time::nanos(LAMPS)).is_multiple_of(2),
        (PadLamp::Armed, None) => is_armed(status),
        (PadLamp::Playing, _) => status.moving,
        (PadLamp::Fault, _) => {
            [State::Stopped, State::Fault].into_iter().any(|state| status.state == state) || is_error()
        }
    }
}
