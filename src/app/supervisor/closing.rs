//! The end of a hall: what goes over to the next one, and the answers to all that it does not do any more.

use super::{Supervisor, SupervisorEnd, record, state_mirror};
use crate::app::runtime::RuntimeEnd;
use crate::app::supervisor::reload::Carryover;

impl Supervisor {
    /// What goes over to the next hall, with what the tick thread said as it left.
    pub(super) fn remember(&mut self) -> Carryover {
        self.take_news();
        let latched = self.hall.mirror.state.is_latched();
        if latched {
            let (state, cause) = (self.hall.mirror.state, self.hall.cause());
            self.note(format!("the hall was in {state} before {}: {cause}", self.why_it_closes()));
        }
        Carryover {
            settings: Some(self.settings()),
            lasting: self.features.lasting.go_over(),
            latched,
            notes: std::mem::take(&mut self.notes),
            untold: Vec::new(),
            took_over: None,
            reloading: self.reloading.take(),
        }
    }

    const fn why_it_closes(&self) -> &'static str {
        if self.reload.is_some() { "the configuration was reloaded" } else { "the service ended" }
    }

    /// Answers whoever waits for what this hall does not do any more.
    pub(super) fn refuse_asked(&mut self) {
        for asked in std::mem::take(&mut self.procedures).into_asked() {
            let problem = state_mirror::closed(self.why_it_closes());
            self.answer(asked, Err(problem));
        }
    }

    /// The hall has closed.
    pub(super) fn end(mut self, closed: Box<RuntimeEnd>) -> SupervisorEnd {
        self.refuse_asked();
        self.features.records.end(&self.hall);
        self.features.records.close(&self.hall);
        self.keep_settings();
        self.ports.carryover = self.remember();
        let ended = record::ending(self.hall.ended);
        let journal = self.features.records.into_journal();
        SupervisorEnd { ports: self.ports, closed, reload: self.reload, ended, journal }
    }
}
