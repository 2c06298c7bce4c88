//! Does the acts of procedures.

use super::act::{Act, ShowBegun, SupervisorEvent};
use super::hall::{ShowChange, Undo};
use super::job::Job;
use super::procedures::Awaited;
use super::reload::{not_taken, reload};
use super::state_mirror::{ANSWER, busy};
use super::{Supervisor, begin, player};
use crate::control::{Problem, Surface};
use crate::record::{LogNote, Note};
use crate::rt::Command as TickCommand;
use crate::state::{Event, Transition};
use crate::time::ShowTime;

impl Supervisor {
    /// Does what is to be done, up to what has to be waited for.
    pub(super) fn go_on(&mut self) {
        let (is_stopping, now) = (self.hall.mirror.is_stopping(), self.hall.now);
        if let Some((undo, problem)) = self.procedures.on_time(is_stopping, now) {
            self.undo(undo, problem);
        }
        loop {
            while let Some(act) = self.procedures.next_act() {
                if let Err(problem) = self.perform(act) {
                    self.procedures.first().fail(problem);
                }
            }
            let Some(done) = self.procedures.take_done() else { return };
            match (done.asked, done.failed) {
                (Some(asked), None) => {
                    self.happens(&SupervisorEvent::Done(&asked.desired));
                    self.answer(asked, Ok(()));
                }
                (Some(asked), Some(problem)) => self.answer(asked, Err(problem)),
                (None, Some(problem)) => {
                    let name = done.name.map(|name| format!("{name}: ")).unwrap_or_default();
                    self.note(format!("{name}{problem}"));
                }
                (None, None) => {}
            }
        }
    }

    /// Does one.
    ///
    /// # Errors
    /// Where it fails, and with it all that was to follow.
    pub(super) fn perform(&mut self, act: Act) -> Result<(), Problem> {
        match act {
            Act::Tick(command) => self.give(command, Undo::Nothing),
            Act::Stage(change) => self.stage(change),
            Act::Unload => self.hall.cued = None,
            Act::TellReadiness => {
                if let Some(readiness) = self.features.readiness.tell(&self.hall) {
                    self.give(TickCommand::Event(Event::Readiness(readiness)), Undo::Readiness);
                }
            }
            Act::AwaitStop if self.hall.mirror.is_stopping() => {}
            Act::AwaitStop => self.procedures.first().wait(Awaited::Stop(self.hall.now + ANSWER)),
            Act::Otherwise(acts) => self.procedures.first().otherwise = acts,
            Act::Name(name) => self.procedures.first().name = Some(name),
            Act::Fail(problem) => return Err(problem),
            Act::CheckBelts => return begin::check("go", &self.hall),
            Act::Go { by, who, surface } => self.let_go(by, who, surface)?,
            Act::ArmedFor(group) => self.features.starts.armed(group, &self.hall),
            Act::DropStart => {
                let acts = self.features.starts.drop_given();
                self.procedures.first().go_on_with(acts);
            }
            Act::RewindStart if self.hall.mirror.state.may_send_motion() => {}
            Act::RewindStart => self.stage(ShowChange::Start(ShowTime::ZERO)),
            Act::Begin(begun) => {
                self.hall.forget_place();
                self.notes.begin_show();
                self.happens(&SupervisorEvent::Begun(&begun));
            }
            Act::Start(job) => self.start(job)?,
            Act::EndJob => self.hall.job = None,
            Act::Take(result) => {
                let acts = self.features.take(result, &self.hall)?;
                self.procedures.first().go_on_with(acts);
            }
            Act::EndShow => {
                let acts = self.features.end_show(&mut self.hall);
                self.procedures.first().go_on_with(acts);
            }
            Act::EndTest(how) => {
                self.features.seats.end(how);
                self.hall.end_test();
            }
            Act::Player(ask) => self.hall.player.iter().for_each(|player| player.ask(ask.clone())),
            // Where it finds no room the controller is not looked at, and stays out.
            Act::Order(order) => drop(self.runtime.orders.push(order)),
            Act::Reload => {
                let config = reload(&self.hall, &self.ports.config)?;
                for table in not_taken(&self.hall.config, &config) {
                    self.note(format!("{table} has changed; restart the service, a reload does not take it"));
                }
                // Whoever asks is answered once the next hall is there.
                if !self.procedures.is_empty() {
                    self.reloading = self.procedures.first().asked.take().map(|asked| (asked, Ok(())));
                }
                self.reload = Some(config);
                self.hall.close();
            }
            Act::Note(note) => self.note(note),
            Act::Passing(note) => self.note_for(note, true),
            Act::Log(line) => self.ports.service_log.put(line),
            Act::Record(event) => self.features.records.event(event),
        }
        Ok(())
    }

    /// Starts what takes longer than the supervisor waits, one at a time.
    fn start(&mut self, job: Job) -> Result<(), Problem> {
        self.hall.is_free()?;
        self.hall.job = Some(job.word());
        // Before it reads anything: from now on the fleet changes none of what may be loaded by it.
        self.publish();
        let started = self.jobs.start(job, || self.procedures.first().asked.take());
        started.inspect_err(|_| self.hall.job = None)
    }

    /// Lets the show go. By itself none begins in a hall that closes.
    fn let_go(&mut self, by: Transition, who: String, surface: Surface) -> Result<(), Problem> {
        if surface == Surface::Schedule {
            self.hall.is_free()?;
        }
        let (counted, place) = (self.hall.count(), self.features.onward.place(&self.hall));
        let begun = Box::new(ShowBegun { who, surface, counted, place });
        let go = Act::Tick(TickCommand::Request(by));
        self.procedures.first().go_on_with(vec![go, Act::Begin(begun)]);
        Ok(())
    }

    /// Changes what is loaded or set, and gives the tick thread the show made of it. While the seats move the desk is enough for
    /// what is set.
    fn stage(&mut self, change: ShowChange) {
        let is_live = matches!(change, ShowChange::Settings(_)) && self.hall.mirror.state.may_send_motion();
        let is_cue = matches!(change, ShowChange::Cue(..));
        let undo = self.hall.apply(change);
        self.hall.set_desk();
        if is_cue && let Some(player) = &self.hall.player {
            player.ask(player::load(&self.hall));
        }
        if is_live {
            return;
        }
        match self.hall.show() {
            Ok(Some(show)) => self.give(TickCommand::Load(show), undo),
            Ok(None) => {}
            Err(problem) => self.undo(undo, problem),
        }
    }

    /// Gives the tick thread a command; what follows waits for its answer.
    fn give(&mut self, command: TickCommand, undo: Undo) {
        if self.runtime.commands.push(command).is_err() {
            return self.undo(undo, busy());
        }
        let awaited = Awaited::Answer(self.given, undo, self.hall.now + ANSWER);
        self.procedures.first().wait(awaited);
        self.given = self.given.wrapping_add(1);
    }

    /// Undoes what was not taken up.
    pub(super) fn undo(&mut self, undo: Undo, problem: Problem) {
        match undo {
            Undo::Nothing => {}
            Undo::Change(change) => {
                self.hall.apply(change);
                self.hall.set_desk();
            }
            Undo::Unload => self.hall.cued = None,
            Undo::Drop => {
                self.hall.cued = None;
                return self.note(problem.to_string());
            }
            Undo::Readiness => return self.features.readiness.forget(),
        }
        self.procedures.first().fail(problem);
    }

    /// Notes what no state says, for the log and the warnings.
    pub(super) fn note(&mut self, note: String) {
        self.note_for(note, false);
    }

    /// The same, of what is over once the next show has begun or not.
    pub(super) fn note_for(&mut self, note: String, passes: bool) {
        self.ports.service_log.say_note(&note);
        let line = LogNote { level: 3, message: note.clone(), name: "supervisor".to_owned() };
        self.hall.recorder.keep(Note::Log(line));
        self.notes.add(note, passes);
    }
}
