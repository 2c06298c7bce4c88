//! Signals of the system: to end, and to reload the configuration, for which another hall is opened.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::Supervisor;
use super::lasting::Lasting;
use crate::config;
use crate::control::{Code, Command, Desired, Problem, Role, Surface, Who};
use crate::settings::{LoadedShow, Settings};
use crate::state::State;

/// What goes over from a hall to the one that is opened with another configuration, or comes from before the start.
#[derive(Debug, Default)]
pub struct Carryover {
    /// What was set and loaded; `None` if nobody has set anything.
    pub(super) settings: Option<Settings>,
    pub(super) lasting: Lasting,
    /// What was latched: another configuration clears nothing.
    pub(super) latched: bool,
    /// What a person should know of the hall before.
    pub(super) notes: VecDeque<String>,
    /// What happened between the halls, and was not said yet.
    pub(super) untold: Vec<String>,
}

impl Carryover {
    /// Adds something that a person should know.
    pub fn note(&mut self, note: String) {
        self.untold.push(note);
    }
}

/// What the system asks of the program; set by signals.
#[derive(Debug, Clone, Default)]
pub struct Signals {
    /// Park, and end.
    pub leave: Arc<AtomicBool>,
    /// Read the configuration anew.
    pub reload: Arc<AtomicBool>,
}

impl Signals {
    /// True if the program is to end.
    #[must_use]
    pub fn is_leaving(&self) -> bool {
        self.leave.load(Ordering::Acquire)
    }
}

impl Supervisor {
    /// Takes up what goes over from the hall before. Ahead of the first tick: what was latched stays so.
    pub(super) fn begin(&mut self, show: Option<LoadedShow>, latched: bool) {
        self.set_desk();
        if latched {
            self.runtime.desk.stop();
        }
        if let Some(show) = show {
            self.load_again(show);
        }
    }

    /// What goes over to the next hall.
    pub(super) fn remember(&mut self) -> Carryover {
        let latched = self.mirror.state.is_latched();
        if latched {
            let (state, cause) = (self.mirror.state, self.cause());
            self.note(format!("the hall was in {state} before the configuration was read anew: {cause}"));
        }
        Carryover {
            settings: Some(self.settings()),
            lasting: self.lasting.go_over(),
            latched,
            notes: std::mem::take(&mut self.notes),
            untold: Vec::new(),
        }
    }

    /// Does what the system asks.
    pub(super) fn heed_signals(&mut self) {
        if self.ports.signals.is_leaving() {
            // Whatever moves parks first; the tick thread sees to that.
            self.runtime.leave.store(true, Ordering::Release);
            self.hold_back();
            self.call_off_homing();
        }
        // A job that is under way holds what the next hall needs: its end is waited for.
        if self.is_free().is_ok() && self.ports.signals.reload.swap(false, Ordering::AcqRel) {
            let result = self.reload();
            let who = Who { role: Role::Engineer, surface: Surface::Signal, name: "SIGHUP".to_owned() };
            self.write_down(&Desired { ask: Command::Reload, who }, &result);
            if let Err(problem) = result {
                self.note(problem.to_string());
            }
        }
    }

    /// Reads the configuration anew, and has the hall opened with it. The old one is kept where the new one is bad, and while
    /// anything is armed.
    pub(super) fn reload(&mut self) -> Result<(), Problem> {
        let idle = matches!(
            self.mirror.state,
            State::Boot | State::Recovering | State::Parked | State::Stopped | State::Fault
        );
        if !idle {
            let detail = format!("cannot read the configuration anew while {}", self.mirror.state);
            return Err(Problem::new(Code::State, detail, "park, and disarm first"));
        }
        self.is_free()?;
        let config = config::load(&self.ports.config).map_err(|faults| {
            let detail = format!("{} is bad; the old configuration is kept", self.ports.config.display());
            let faults = faults.to_string().lines().map(str::to_owned).collect();
            Problem::new(Code::Check, detail, "correct it, and reload again").with(faults)
        })?;
        self.reload = Some(Arc::new(config));
        self.runtime.leave.store(true, Ordering::Release);
        Ok(())
    }
}
