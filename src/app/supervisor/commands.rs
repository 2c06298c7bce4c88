//! Executes the commands of surfaces.

use super::{ANSWER, Supervisor, park_until};
use crate::control::{Asked, Code, Command, Desired, LevelsChange, Problem, Who, overtaken};
use crate::rt::Command as TickCommand;
use crate::settings::{LONGEST_WHY, Out};
use crate::state::{State, Transition};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime, TRIM_MS};

impl Supervisor {
    /// Does it, and answers.
    pub(super) fn on_asked(&mut self, asked: Asked) {
        self.take_news();
        let Desired { ask, who } = asked.desired.clone();
        if let Err(problem) = self.may_ask(&asked.desired) {
            return self.answer(asked, Err(problem));
        }
        let before = self.before();
        self.heed(&ask);
        let result = match ask {
            Command::Load { cue } => return self.load(&cue, asked),
            Command::Playlist { id } => return self.playlist(id.as_deref(), asked),
            Command::Select { entry } => return self.select(entry, asked),
            Command::Test { rows } => return self.test(&rows, asked),
            Command::Preflight => return self.preflight(asked),
            Command::Home => self.request(Transition::Home),
            Command::Arm { seats_empty } => {
                let request = if seats_empty { Transition::HomeAndArm } else { Transition::Arm };
                self.request(request).inspect(|()| self.say_what_lasts())
            }
            Command::Disarm => self.request(Transition::Disarm),
            Command::Go => self.go(&who, |this| this.request(Transition::Go)),
            Command::GoFrom(film) => self.go(&who, |this| this.go_from(film)),
            Command::Pause => self.request(Transition::Pause),
            Command::Resume => self.request(Transition::Resume),
            Command::Park => self.request(Transition::Park),
            // Whoever pressed it meant what was latched then.
            Command::Clear if asked.is_before(self.mirror.since) => {
                Err(overtaken("clear", self.mirror.state))
            }
            Command::Clear => self.request(Transition::Clear),
            Command::Stop => {
                // The flag is set already where it came by a handle; the machine takes a stop in every state.
                self.runtime.desk.stop();
                self.await_stop();
                Ok(())
            }
            Command::Seek(film) => self.seek(film),
            Command::Trim(ms) => self.trim(ms),
            Command::Levels(change) if who.surface.is_gear() => self.levels_of_gear(&change),
            Command::Levels(change) => self.levels(&change),
            Command::Enable(name) => self.enable(&name, None),
            Command::Disable { name, why } => self.disable(&name, &who, why.as_deref()),
            Command::Reload => self.reload(),
            Command::Preset(name) => self.preset(&name),
        };
        if result.is_ok() {
            self.note_doer(&asked.desired, before);
        }
        self.tell_readiness();
        self.answer(asked, result);
    }

    /// Begins the show for `who`, once everybody is buckled who has to be.
    fn go(&mut self, who: &Who, begin: impl FnOnce(&mut Self) -> Result<(), Problem>) -> Result<(), Problem> {
        let counted = self.count_before();
        self.are_buckled()?;
        begin(self)?;
        self.begin_show(&who.to_string(), who.surface, counted);
        Ok(())
    }

    fn request(&mut self, request: Transition) -> Result<(), Problem> {
        if matches!(request, Transition::Arm | Transition::HomeAndArm | Transition::Home) {
            // Both need the line, or a show that nobody is about to replace.
            self.is_free()?;
        }
        self.command(TickCommand::Request(request))
    }

    /// Waits until the stop is seen in the state, a tick or two.
    fn await_stop(&mut self) {
        let until = Monotonic.now() + ANSWER;
        while Monotonic.now() < until {
            self.take_news();
            if matches!(self.mirror.state, State::Stopping | State::Stopped | State::Fault) {
                return;
            }
            park_until(until);
        }
    }

    fn seek(&mut self, film: ShowTime) -> Result<(), Problem> {
        let Some(cued) = &mut self.cued else {
            return Err(Problem::new(Code::State, "cannot seek: no cue is loaded", "load one"));
        };
        let length = cued.timeline.duration();
        if film < ShowTime::ZERO || film >= length {
            let detail = format!("{film} is outside the cue, which is {length} long");
            return Err(Problem::new(Code::Value, detail, "give a time within it"));
        }
        if matches!(self.mirror.state, State::Armed | State::Parked) {
            let before = std::mem::replace(&mut cued.start, film);
            return self.stage().inspect_err(|_| {
                if let Some(cued) = &mut self.cued {
                    cued.start = before;
                }
            });
        }
        self.command(TickCommand::Seek(film))
    }

    /// Lets what is loaded go from there on, by a join onto the moving cue.
    fn go_from(&mut self, film: ShowTime) -> Result<(), Problem> {
        if self.mirror.state != State::Armed {
            let detail = format!("cannot go from {film} while {}", self.mirror.state);
            return Err(Problem::new(Code::State, detail, "arm first; while it plays or is paused, seek"));
        }
        self.seek(film)?;
        self.request(Transition::Go).inspect_err(|_| self.rewind())
    }

    fn trim(&mut self, ms: i32) -> Result<(), Problem> {
        if ms.abs() > TRIM_MS {
            let detail = format!("a trim of {ms} ms is outside -{TRIM_MS}..={TRIM_MS}");
            return Err(Problem::new(Code::Value, detail, "give a smaller one"));
        }
        self.set(|settings| {
            settings.trim_ms = ms;
            Ok(())
        })
    }

    fn preset(&mut self, name: &str) -> Result<(), Problem> {
        let Some(preset) = self.runtime.config.preset(name) else {
            let detail = format!("there is no preset {name}");
            return Err(Problem::new(Code::Unknown, detail, "the status names the presets"));
        };
        let change = LevelsChange::from(preset);
        self.levels(&change)
    }

    fn levels(&mut self, change: &LevelsChange) -> Result<(), Problem> {
        self.set(|settings| settings.change(change))
    }

    /// True if an emergency stop is in effect at a controller of a group: with it the whole hall would stop.
    fn is_pressed(&self, group: &str) -> bool {
        let controllers = self.runtime.config.controllers.iter().zip(self.runtime.live.table());
        let mut of_group = controllers.filter(|(one, _)| one.group == group);
        of_group.any(|(_, row)| row.state.emergency_stop())
    }

    /// Takes the group of a controller out.
    fn disable(&mut self, name: &str, who: &Who, why: Option<&str>) -> Result<(), Problem> {
        let why = why.map_or(Ok(None), Out::reason).map_err(|fault| {
            Problem::new(
                Code::Value,
                fault,
                format!("say it in a line of {LONGEST_WHY} characters at the most"),
            )
        })?;
        self.enable(name, Some(Out::now(who, why)))
    }

    /// Takes the group of a controller in, or out.
    fn enable(&mut self, name: &str, out: Option<Out>) -> Result<(), Problem> {
        let config = &self.runtime.config;
        let Some(controller) = config.controllers.iter().find(|one| one.name == name) else {
            return match config.absent.iter().find(|one| one.controller.name == name) {
                Some(_) if out.is_some() => Ok(()),
                Some(_) => Err(Problem::new(
                    Code::State,
                    format!("{name} is out for good: the configuration says enabled = false"),
                    "take that line out of its [[controller]], and reload",
                )),
                None => Err(Problem::new(
                    Code::Unknown,
                    format!("there is no controller {name}"),
                    "GET /api/v1/controllers lists them",
                )),
            };
        };
        let on = out.is_none();
        let group = controller.group.clone();
        // Between shows arming sees to that.
        if on && self.mirror.state.may_send_motion() && !self.is_preflighted(&group) {
            let detail =
                format!("cannot enable {name} while {}: its preflight has not passed", self.mirror.state);
            return Err(Problem::new(Code::State, detail, "park, enable it, and run preflight"));
        }
        if on && self.is_pressed(&group) {
            let detail = format!("cannot enable {name}: an emergency stop is in effect there");
            return Err(Problem::new(Code::State, detail, "release its button, then enable the seat"));
        }
        self.set(|settings| {
            settings.enable(&group, out);
            Ok(())
        })
    }
}
