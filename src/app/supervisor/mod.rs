//! The supervisor of a hall: executes the commands of surfaces, prepares shows for the tick thread, runs slow work as jobs, and
//! publishes the status ten times a second. A thread of the control plane that sleeps until its next time is there or somebody
//! has something for it; slow work is done elsewhere (`job`), so that a pause or a park never waits behind a preflight.
//!
//! What it knows is owned by features, which are told what happens and say what is to be done (`act`); the loop here does it.

mod act;
mod away;
mod begin;
mod belts;
mod closing;
mod coded;
mod commands;
mod features;
mod figures;
mod film;
mod fleet;
mod gear;
mod hall;
mod hall_settings;
mod homing;
mod job;
mod lasting;
mod list;
mod margins;
mod notes;
mod perform;
mod player;
mod playlist;
mod preflighted;
mod procedures;
mod reach;
mod readiness;
mod record;
mod recorded;
mod reload;
mod seat_places;
mod seat_test;
mod seat_testing;
mod service_log;
mod shared_link;
mod show;
mod standing;
mod starts;
mod state_mirror;
mod status;
mod strangers;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod warnings;

pub(crate) use reload::{Carryover, SystemSignals};
pub(crate) use service_log::ServiceLog;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::Duration;

use jiff::Zoned;

use super::buttons::PadTable;
use super::film::SharedTable;
use super::pair::PairWatch;
use super::player::PlayerLink;
use super::recorder::RecordLink;
use super::runtime::{RuntimeEnd, RuntimeHandle};
use crate::config::Config;
use crate::control::model::Ending;
use crate::control::{
    Asked, AwaitedPorts, Command, Desired, Inbox, Problem, Role, Status, StatusSource, Surface, Who,
};
use crate::journal::Journal;
use crate::library::Library;
use crate::osc::Counts;
use crate::rt::{News, Ticket};
use crate::settings::{Settings, SettingsFile};
use crate::state::State;
use crate::sys::clock::{Monotonic, wall_at};
use crate::time::{Clock as _, MonoTime};
use act::{Act, SupervisorEvent};
use features::Features;
use hall::HallContext;
use job::{Jobs, Tools};
use list::List;
use notes::NoteBoard;
use procedures::Procedures;
use record::ShowRecords;
use recorded::AsksTold;
use shared_link::SharedLink;
use status::StatusParts;

/// From one status to the next.
const TELL: Duration = Duration::from_millis(100);
/// How long whoever has the configuration read anew waits for controllers that do not answer.
const OPENS: Duration = Duration::from_secs(10);

/// What a supervisor has whatever the configuration is.
#[derive(Debug)]
pub(crate) struct SupervisorPorts {
    /// What surfaces ask.
    pub(crate) inbox: Inbox,
    /// Where the status goes.
    pub(crate) source: StatusSource,
    /// The file of the configuration.
    pub(crate) config: PathBuf,
    /// When the program started.
    pub(crate) began: MonoTime,
    /// What the system asks of the program.
    pub(crate) signals: SystemSignals,
    /// Whom to tell what happens.
    pub(crate) service_log: ServiceLog,
    /// What was set in the hall before, or before the program started.
    pub(crate) carryover: Carryover,
    /// Where what is set is kept.
    pub(crate) settings_file: SettingsFile,
    /// What is heard of the film, if one leads.
    pub(crate) film: Option<SharedTable>,
    /// The way to the player, where the hall has one.
    pub(crate) player: Option<PlayerLink>,
    /// What has come to the port for OSC, where there is one.
    pub(crate) osc: Option<Arc<Counts>>,
    /// How the pads are, where there are any.
    pub(crate) buttons: Option<PadTable>,
    /// The ports that cannot be had yet.
    pub(crate) awaited: AwaitedPorts,
    /// The way to the recorder.
    pub(crate) recorder: RecordLink,
    /// The other show machine, where there is one.
    pub(crate) pair: Option<PairWatch>,
}

/// What is left once the hall has closed.
#[derive(Debug)]
pub(crate) struct SupervisorEnd {
    /// For the next supervisor.
    pub(crate) ports: SupervisorPorts,
    /// What the hall came to.
    pub(crate) closed: Box<RuntimeEnd>,
    /// The configuration to open the next hall with; `None` if the program ends.
    pub(crate) reload: Option<Arc<Config>>,
    /// How its last show ended; stopped where there was none.
    pub(crate) ended: Ending,
    /// The journal, still open.
    pub(crate) journal: Journal,
}

/// The supervisor of one hall.
#[derive(Debug)]
pub(crate) struct Supervisor {
    ports: SupervisorPorts,
    /// When the hall opened.
    opened: MonoTime,
    /// The ways to the tick thread and the ack thread, and back.
    runtime: RuntimeHandle,
    /// The ticket of the next command.
    given: Ticket,
    hall: HallContext,
    features: Features,
    procedures: Procedures,
    jobs: Jobs,
    /// When the status was told last.
    told: MonoTime,
    notes: NoteBoard,
    asks_told: AsksTold,
    reload: Option<Arc<Config>>,
    /// Who asked for another configuration, this one or the next, and what came of it.
    reloading: Option<(Asked, Result<(), Problem>)>,
}

impl Supervisor {
    /// The supervisor of a hall that has just opened. Ahead of the first tick: what was latched stays so.
    #[must_use]
    pub(crate) fn new(
        mut ports: SupervisorPorts,
        runtime: RuntimeHandle,
        line: crate::rt::Line,
        library: Library,
        journal: Journal,
    ) -> Self {
        let now = Monotonic.now();
        let carryover = std::mem::take(&mut ports.carryover);
        let settings = carryover.settings(&runtime.config);
        job::examine(library.clone());
        let mut hall = HallContext::new(&runtime, settings, now);
        (hall.film, hall.player, hall.osc) = (ports.film.clone(), ports.player.clone(), ports.osc.clone());
        (hall.buttons, hall.recorder) = (ports.buttons.clone(), ports.recorder.clone());
        (hall.pair, hall.notify) = (ports.pair.clone(), ports.service_log.notify_table());
        (hall.clock, hall.awaited) = (ports.source.clock(), ports.awaited.clone());
        let tools = Tools {
            config: Arc::clone(&hall.config),
            library,
            line: SharedLink::of(line),
            links: runtime.links.clone(),
            live: Arc::clone(&runtime.live),
            settings: ports.settings_file.folder().to_owned(),
        };
        let mut supervisor = Self {
            ports,
            opened: now,
            runtime,
            given: 0,
            hall,
            features: Features::new(ShowRecords::new(journal), carryover.lasting),
            procedures: Procedures::default(),
            jobs: Jobs::new(tools),
            told: now,
            notes: carryover.notes,
            asks_told: AsksTold::default(),
            reload: None,
            reloading: carryover.reloading,
        };
        carryover.untold.into_iter().for_each(|note| supervisor.note(note));
        carryover.took_over.into_iter().for_each(|it| supervisor.note_for(it.words, true));
        supervisor.hall.set_desk();
        if carryover.latched {
            supervisor.hall.desk.stop();
        }
        let show = carryover.settings.and_then(|settings| settings.show);
        let acts = show.map(|show| supervisor.features.lasting.load_again(show));
        supervisor.procedures.add(acts.into_iter().collect());
        supervisor
    }

    /// Keeps the hall until `closed` says what it came to.
    #[must_use]
    pub(crate) fn run(mut self, closed: &Receiver<Box<RuntimeEnd>>) -> SupervisorEnd {
        self.ports.source.wakes(thread::current());
        loop {
            let rests = self.turn();
            if let Ok(closed) = closed.try_recv() {
                return self.end(closed);
            }
            if rests {
                thread::park_timeout(self.wakes_at().since(Monotonic.now()));
            }
        }
    }

    /// Does all that there is to do now, but for no more than one ask; says whether there is nothing more before somebody has
    /// something or a time is there.
    fn turn(&mut self) -> bool {
        (self.hall.now, self.hall.wall) = (Monotonic.now(), wall_at());
        self.take_news();
        self.heed_signals();
        self.go_on();
        // One ask after the other: what is done for one is done before the next is taken.
        let is_free = self.procedures.is_empty();
        let asked = if is_free { self.ports.inbox.next(Duration::ZERO) } else { None };
        let nobody_asks = is_free && asked.is_none();
        if let Some(asked) = asked {
            self.on_asked(asked);
        }
        if let Some((result, asked)) = self.jobs.take_done() {
            // Not told as over before what it came to is taken up: between the two a status would say that nothing is loaded.
            let take = result.map_or_else(Act::Fail, Act::Take);
            self.procedures.add_for(asked, Ok(vec![Act::EndJob, take]));
        }
        self.on_time();
        self.go_on();
        nobody_asks || self.procedures.waits_until().is_some()
    }

    /// Hears what the tick thread has to say.
    fn take_news(&mut self) {
        while let Some((ticket, news)) = self.runtime.news.take() {
            match (ticket, state_mirror::answer(news)) {
                (Some(ticket), Some(answer)) => {
                    if let Some((undo, problem)) = self.procedures.answered(ticket, answer) {
                        self.undo(undo, problem);
                    }
                }
                _ => self.hear(news),
            }
        }
    }

    fn hear(&mut self, news: News) {
        if let News::Unplanned(what) = news {
            self.note(self.hall.name_unplanned(what));
        }
        let acts = self.features.on_news(news, &self.hall);
        self.add(acts);
        let Some((from, to)) = self.hall.mirror.hear(news) else { return };
        self.hall.note_place(from, to);
        if matches!(to, State::Parking | State::Stopping) {
            self.hall.ended = self.hall.mirror.cause;
        }
        self.ports.service_log.say_state(to, &self.hall.cause());
        if from.may_send_motion() && !to.may_send_motion() {
            self.procedures.add(vec![Act::EndShow]);
        }
        self.happens(&SupervisorEvent::Entered(to));
    }

    /// Tells all features of it, and has done what they say.
    fn happens(&mut self, event: &SupervisorEvent<'_>) {
        let acts = self.features.on(event, &self.hall);
        self.add(acts);
    }

    fn add(&mut self, acts: Vec<Act>) {
        if !acts.is_empty() {
            self.procedures.add(acts);
        }
    }

    /// Has done what somebody asks.
    fn on_asked(&mut self, asked: Asked) {
        let acts = self.features.may_ask(&asked.desired, &self.hall).and_then(|()| {
            self.happens(&SupervisorEvent::Asked(&asked.desired));
            self.features.acts_for(&asked, &self.hall)
        });
        self.procedures.add_for(Some(asked), acts);
        self.go_on();
    }

    /// Does what the system asks.
    fn heed_signals(&mut self) {
        if self.ports.signals.is_leaving() {
            // Whatever moves parks first; the tick thread sees to that.
            self.hall.close();
            self.happens(&SupervisorEvent::Leaving);
        }
        // A job that is under way holds what the next hall needs: its end is waited for.
        let is_free = self.procedures.is_empty() && self.hall.is_free().is_ok();
        if is_free && self.ports.signals.reload.swap(false, Ordering::AcqRel) {
            let result = self.perform(Act::Reload);
            let who = Who { role: Role::Engineer, surface: Surface::Signal, name: "SIGHUP".to_owned() };
            self.write_down(&Desired { ask: Command::Reload, who }, &result);
            if let Err(problem) = result {
                self.note(problem.to_string());
            }
        }
    }

    /// Does what is done when its time is there.
    fn on_time(&mut self) {
        if self.features.onward.list.is_some() {
            self.happens(&SupervisorEvent::Clock(&Zoned::now()));
        }
        let due = self.features.starts.due(&self.hall);
        self.add(due);
        let now = self.hall.now;
        if now.since(self.told) < TELL {
            return;
        }
        self.told = now;
        let table = self.hall.live.table();
        self.hall.reach.look(&self.hall.config, &table, now);
        let acts = self.features.on(&SupervisorEvent::Round(&table), &self.hall);
        // Also where there are none: at the end of each the tick thread is told of readiness that it was not told.
        self.procedures.add(acts);
        let log = &self.ports.service_log;
        self.features.records.settle_folds(now).iter().for_each(|action| log.say_ask(action));
        log.say_kept("journal", &self.features.records.news());
        log.say_kept("recordings", &self.hall.recorder.take_said());
        self.asks_told.settle(&self.hall);
        log.say_settings(self.ports.settings_file.news());
        self.keep_settings();
        self.publish();
        self.answer_reload();
    }

    /// Answers whoever asked for this configuration, once the hall knows its seats, or has looked for them for long enough.
    fn answer_reload(&mut self) {
        let has_opened = self.hall.mirror.state != State::Boot || self.hall.now.since(self.opened) > OPENS;
        if self.reload.is_none()
            && let Some((asked, result)) = self.reloading.take_if(|_| has_opened)
        {
            self.answer(asked, result);
        }
    }

    /// The next time at which there is something to do.
    fn wakes_at(&self) -> MonoTime {
        let told = self.told + TELL;
        let until = self.procedures.waits_until().map_or(told, |until| until.min(told));
        let starts = self.features.onward.list.as_ref().and_then(|list| list.starts_in(&Zoned::now()));
        starts.map_or(until, |wait| until.min(Monotonic.now() + wait))
    }

    /// Writes down what somebody asked, and what came of it.
    fn write_down(&mut self, desired: &Desired, result: &Result<(), Problem>) {
        let state = self.hall.mirror.state;
        self.asks_told.take(desired, result, &self.hall);
        let due = self.features.records.write_down(desired, result, state, self.hall.now);
        due.iter().for_each(|action| self.ports.service_log.say_ask(action));
    }

    /// All that is to last.
    fn settings(&self) -> Settings {
        let place = self.features.onward.list.as_ref().map(List::place);
        self.features.lasting.settings(&self.hall, place)
    }

    /// Has it kept.
    fn keep_settings(&mut self) {
        let settings = self.settings();
        let text = self.ports.settings_file.put(settings);
        text.into_iter().zip(&self.ports.pair).for_each(|(text, pair)| pair.set(text));
    }

    /// How all of it stands.
    fn status(&self) -> Status {
        let Self { hall, features, .. } = self;
        let (record, began) = (&hall.recorder.status_at(hall.now), self.ports.began);
        let parts = StatusParts { hall, features, record, began };
        let table = hall.live.table();
        let warnings = parts.warnings(&table, &self.notes, self.ports.settings_file.trouble());
        parts.status(&table, warnings)
    }

    /// Puts the newest status where all can see it.
    fn publish(&mut self) -> Arc<Status> {
        self.hall.now = Monotonic.now();
        let status = Arc::new(self.status());
        let ends = self.reload.is_none() && self.ports.signals.is_leaving();
        self.ports.service_log.speak(&status, self.opened, ends, self.hall.now);
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
