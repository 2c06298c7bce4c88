//! The supervisor of a hall: executes the commands of surfaces, prepares shows for the tick thread, runs slow work as jobs, and
//! publishes the status ten times a second. A thread of the control plane; slow work is done elsewhere
//! (`job`), so that a pause or a park never waits behind a preflight.

mod belts;
mod commands;
mod gear;
mod hall_settings;
mod homing;
mod job;
mod lasting;
mod list;
mod ready;
mod record;
mod reload;
mod seat_test;
mod service_log;
mod shared_link;
mod show;
mod state_mirror;
mod status;
mod strangers;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod warnings;

pub use reload::{Carryover, Signals};
pub use service_log::ServiceLog;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use super::runtime::{RuntimeEnd, RuntimeHandle};
use crate::config::Config;
use crate::control::model::Ending;
use crate::control::{Asked, Inbox, Problem, Status, StatusSource};
use crate::journal::Journal;
use crate::library::Library;
use crate::rt::{Command as TickCommand, News, Ticket};
use crate::settings::SettingsFile;
use crate::state::{Cause, State};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};
use hall_settings::HallSettings;
use job::Job;
use ready::Preflighted;
use record::Records;
use shared_link::SharedLink;
use show::ProvedShow;
use state_mirror::StateMirror;
use status::Rates;
use strangers::Strangers;

/// From one status to the next: nothing is looked for more rarely than that.
const TELL: Duration = Duration::from_millis(100);
/// Notes that are kept.
const NOTES: usize = 5;
/// How long the tick thread has to answer a command; a tick takes a second at most.
const ANSWER: Duration = Duration::from_secs(2);

/// What a supervisor has whatever the configuration is.
#[derive(Debug)]
pub struct SupervisorPorts {
    /// What surfaces ask.
    pub inbox: Inbox,
    /// Where the status goes.
    pub source: StatusSource,
    /// The file of the configuration.
    pub config: PathBuf,
    /// When the program started.
    pub began: MonoTime,
    /// What the system asks of the program.
    pub signals: Signals,
    /// Whom to tell what happens.
    pub service_log: ServiceLog,
    /// What was set in the hall before, or before the program started.
    pub carryover: Carryover,
    /// Where what is set is kept.
    pub settings_file: SettingsFile,
}

/// What is left once the hall has closed.
#[derive(Debug)]
pub struct SupervisorEnd {
    /// For the next supervisor.
    pub ports: SupervisorPorts,
    /// What the hall came to.
    pub closed: Box<RuntimeEnd>,
    /// The configuration to open the next hall with; `None` if the program ends.
    pub reload: Option<Arc<Config>>,
    /// How its last show ended; stopped where there was none.
    pub ended: Ending,
    /// The journal, still open.
    pub journal: Journal,
}

/// The supervisor of one hall.
#[derive(Debug)]
pub struct Supervisor {
    ports: SupervisorPorts,
    began: MonoTime,
    runtime: RuntimeHandle,
    mirror: StateMirror,
    settings: HallSettings,
    cued: Option<ProvedShow>,
    preflighted: Option<Preflighted>,
    job: Option<Job>,
    homing: Option<homing::Homing>,
    /// What the tick thread was told of readiness.
    readiness: Option<crate::state::Readiness>,
    rates: Rates,
    strangers: Strangers,
    told: MonoTime,
    line: SharedLink,
    library: Library,
    /// What went wrong lately and no state says, newest last.
    notes: VecDeque<String>,
    list: Option<list::List>,
    onward: list::Onward,
    seat_test: Option<seat_test::SeatTest>,
    record: Records,
    reload: Option<Arc<Config>>,
    /// Since when the hall is paused by gear, and by no person; where that is not the pause of now, it is an old one.
    gear_paused: Option<MonoTime>,
    lasting: lasting::Lasting,
    /// A show has ended, and why.
    show_over: bool,
    ended: Cause,
}

impl Supervisor {
    /// The supervisor of a hall that has just opened.
    #[must_use]
    pub fn new(
        mut ports: SupervisorPorts,
        runtime: RuntimeHandle,
        line: crate::rt::Line,
        library: Library,
        journal: Journal,
    ) -> Self {
        let now = Monotonic.now();
        let carryover = std::mem::take(&mut ports.carryover);
        let settings = carryover.settings(&runtime.config);
        ports.source.lead(Arc::clone(&runtime.desk));
        let mut supervisor = Self {
            ports,
            began: now,
            mirror: StateMirror::new(now),
            settings,
            runtime,
            cued: None,
            preflighted: None,
            job: None,
            homing: None,
            readiness: None,
            rates: Rates::default(),
            strangers: Strangers::default(),
            told: now,
            line: SharedLink::of(line),
            library,
            notes: carryover.notes,
            list: None,
            onward: list::Onward::default(),
            seat_test: None,
            record: Records::new(journal),
            reload: None,
            gear_paused: None,
            lasting: carryover.lasting,
            show_over: false,
            ended: Cause::Started,
        };
        carryover.untold.into_iter().for_each(|note| supervisor.note(note));
        supervisor.examine_library();
        let show = carryover.settings.and_then(|settings| settings.show);
        supervisor.begin(show, carryover.latched);
        supervisor
    }

    /// Keeps the hall until `closed` says what it came to.
    #[must_use]
    pub fn run(mut self, closed: &Receiver<Box<RuntimeEnd>>) -> SupervisorEnd {
        self.ports.source.wakes(thread::current());
        loop {
            let asked = self.ports.inbox.next(Duration::ZERO);
            let rests = asked.is_none();
            if let Some(asked) = asked {
                self.on_asked(asked);
            }
            self.look_after();
            if let Ok(closed) = closed.try_recv() {
                self.end_record(self.ended);
                self.close_record();
                self.keep_settings();
                self.ports.carryover = self.remember();
                let journal = self.record.into_journal();
                let ended = record::ending(self.ended);
                return SupervisorEnd { ports: self.ports, closed, reload: self.reload, ended, journal };
            }
            if rests {
                park_until(self.told + TELL);
            }
        }
    }

    /// Everything that nobody has to ask for.
    fn look_after(&mut self) {
        self.take_news();
        self.heed_signals();
        self.end_show();
        self.settle_record();
        self.follow_sweep();
        self.end_errand();
        self.settle_again();
        self.heed_schedule();
        self.settle_homing();
        self.tell_readiness();
        let now = Monotonic.now();
        if now.since(self.told) >= TELL {
            self.told = now;
            let table = self.runtime.live.table();
            self.rates.note(&table, now);
            self.strangers.note(&table, now);
            self.settle_folds();
            self.say_journal();
            self.keep_settings();
            self.publish();
        }
    }

    /// Hears what the tick thread has to say, and does what a new state needs.
    fn take_news(&mut self) {
        while let Some((ticket, news)) = self.runtime.news.next() {
            self.hear(ticket, news);
        }
    }

    fn hear(&mut self, ticket: Option<Ticket>, news: News) {
        if let News::Unplanned(what) = news {
            self.note(self.name_unplanned(what));
        }
        if let Some((from, to)) = self.mirror.hear(ticket, news) {
            self.on_state(from, to);
        }
    }

    fn on_state(&mut self, from: State, to: State) {
        self.forget_start();
        self.call_off_homing();
        self.note_place(from, to);
        if to == State::Homing {
            self.begin_homing();
        }
        if to == State::Parking || to == State::Stopping {
            self.ended = self.mirror.cause;
        }
        let cause = self.cause();
        self.say_state(to, &cause);
        self.record.event(format!("{to}: {cause}"));
        if from.may_send_motion() && !to.may_send_motion() {
            self.show_over = true;
        }
    }

    /// The engine is done, or rests for good: the next show needs another.
    fn end_show(&mut self) {
        if !std::mem::take(&mut self.show_over) {
            return;
        }
        let how = if self.ended == Cause::CueEnded { "completed" } else { "stopped" };
        let played = self.record.is_under_way();
        self.end_record(self.ended);
        if self.runtime.leave.load(Ordering::Acquire) {
            // There is no next show in this hall, and soon no tick thread to take it.
            return;
        }
        if !played {
            // Seats were brought to park between shows: what is next stays as it is.
            return self.stage_again();
        }
        if self.end_seat_test(how) {
            self.rewind();
        } else {
            self.keep_place();
            self.on_show_over(self.ended);
        }
    }

    /// Notes what no state says, for the log and the warnings.
    fn note(&mut self, note: String) {
        self.say_note(&note);
        self.notes.push_back(note);
        if self.notes.len() > NOTES {
            self.notes.pop_front();
        }
    }

    /// Gives the tick thread a command and waits for its answer, a tick or two.
    fn command(&mut self, command: TickCommand) -> Result<(), Problem> {
        self.take_news(); // so that there is room for the answer
        if self.runtime.commands.push(command).is_err() {
            return Err(state_mirror::busy());
        }
        self.mirror.expect();
        let until = Monotonic.now() + ANSWER;
        loop {
            self.take_news();
            if let Some(answer) = self.mirror.take_answer() {
                return answer;
            }
            if Monotonic.now() >= until {
                return Err(state_mirror::no_answer(ANSWER));
            }
            park_until(until);
        }
    }

    /// Puts the newest status where all can see it.
    fn publish(&mut self) -> Arc<Status> {
        let status = Arc::new(self.status());
        self.speak(&status);
        self.ports.source.put(Arc::clone(&status));
        status
    }

    /// Answers an ask with the state that it led to.
    fn answer(&mut self, asked: Asked, result: Result<(), Problem>) {
        self.write_down(&asked.desired, &result);
        self.keep_settings();
        let status = self.publish();
        asked.answer(result.map(|()| status));
    }
}

/// Sleeps until that instant, or until somebody has something for the supervisor.
fn park_until(instant: MonoTime) {
    thread::park_timeout(instant.since(Monotonic.now()));
}
