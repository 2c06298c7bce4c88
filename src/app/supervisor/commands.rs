//! What is done for the commands of surfaces.

use super::act::Act;
use super::begin;
use super::features::Features;
use super::film;
use super::gear;
use super::hall::{GoesOn, HallContext, ShowChange};
use super::hall_settings::HallSettings;
use super::homing::refuse_winding;
use super::job::Job;
use super::player;
use super::recorded;
use super::seat_testing::SeatTesting;
use super::show::no_cue;
use super::starts::FleetStarts;
use crate::control::{Asked, Code, Command, LevelsChange, Problem, Who, overtaken};
use crate::rt::Command as TickCommand;
use crate::settings::{LONGEST_WHY, Out};
use crate::state::{Next, State, Transition};
use crate::time::{ShowTime, TRIM_MS};

impl Features {
    /// What is to be done for an ask.
    ///
    /// # Errors
    /// Where it is not done.
    pub(super) fn acts_for(&mut self, asked: &Asked, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        let who = &asked.desired.who;
        match &asked.desired.ask {
            Command::Load { cue } => {
                free_for("load", hall)?;
                let id = cue.parse().map_err(|error| no_cue(cue, &error))?;
                Ok(vec![Act::Start(Job::Load(id))])
            }
            Command::Playlist { id } => self.onward.load(id.as_deref(), hall),
            Command::Select { entry } => self.onward.select(*entry, hall),
            Command::Test { rows } => SeatTesting::make(rows, hall),
            // An armed hall may go at any moment, and then frames come between.
            Command::Preflight => free_for("preflight", hall).map(|()| vec![Act::Start(Job::Preflight)]),
            Command::Home => refuse_winding(hall, &hall.live.table())
                .and_then(|()| request_when_free(Transition::Home, hall)),
            Command::Arm { seats_empty: true } => home_and_arm(hall),
            Command::Arm { seats_empty: false } => begin::needs_a_seat("arm", false, hall)
                .and_then(|()| request_when_free(Transition::Arm, hall)),
            Command::ArmFor(group) => FleetStarts::arm(group, hall),
            Command::StartAt(order) => self.starts.ask(order, who, hall),
            Command::Commit { ticket } => self.starts.commit(ticket, who, hall),
            Command::Disarm => request(Transition::Disarm),
            Command::Go => begin::check("go", hall).map(|()| vec![go(Transition::Go, who)]),
            Command::GoFrom(film) => go_from(*film, who, hall),
            Command::Pause => request(Transition::Pause),
            Command::Resume => resume(who, hall),
            Command::Park => request(Transition::Park),
            // Whoever pressed it meant what was latched then.
            Command::Clear if asked.is_before(hall.mirror.since) => {
                Err(overtaken("clear", hall.mirror.state))
            }
            Command::Clear => request(Transition::Clear),
            Command::Stop => {
                // The flag is set already where it came by a handle; the machine takes a stop in every state.
                hall.desk.stop();
                Ok(vec![Act::AwaitStop])
            }
            Command::Seek(film) => seek(*film, hall),
            Command::Trim(ms) => trim(*ms, hall),
            Command::Nudge(frames) => trim(hall.settings.trim_ms + film::frames_ms(*frames, hall), hall),
            Command::Source(name) => film::choose(name.as_deref(), hall),
            Command::Levels(change) if who.surface.is_remote() => gear::levels(change, hall),
            Command::Levels(change) => set(hall, |settings| settings.change(change)),
            Command::Preset(name) => preset(name, hall),
            Command::Enable(name) => self.enable(name, hall),
            Command::Disable { name, why } => disable(name, who, why.as_deref(), hall),
            Command::Reload => Ok(vec![Act::Reload]),
            Command::Mark { text } => recorded::mark(text.as_deref(), who, hall),
            Command::Dump => recorded::dump(hall),
        }
    }

    /// Takes the group of a controller in.
    fn enable(&self, name: &str, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        let Some(group) = group_of(name, hall) else {
            return Err(if is_absent(name, hall) {
                Problem::new(
                    Code::State,
                    format!("{name} is disabled in the configuration (enabled = false)"),
                    "remove that line from its [[controller]], and reload",
                )
            } else {
                no_controller(name, hall)
            });
        };
        // Between shows arming sees to that.
        if hall.mirror.state.may_send_motion() && !self.readiness.has_passed(group, hall) {
            let detail =
                format!("cannot enable {name} while {}: its preflight has not passed", hall.mirror.state);
            return Err(Problem::new(Code::State, detail, "park, enable it, and run preflight"));
        }
        if is_pressed(group, hall) {
            let detail = format!("cannot enable {name}: an emergency stop is in effect there");
            return Err(Problem::new(Code::State, detail, "release its button, then enable the seat"));
        }
        set(hall, |settings| {
            settings.enable(group, None);
            Ok(())
        })
    }
}

fn free_for(what: &str, hall: &HallContext) -> Result<(), Problem> {
    hall.may(what).and_then(|()| hall.is_free())
}

fn request(request: Transition) -> Result<Vec<Act>, Problem> {
    Ok(vec![Act::Tick(TickCommand::Request(request))])
}

/// What needs the line, or a show that nobody is about to replace.
fn request_when_free(wanted: Transition, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    hall.is_free().and_then(|()| request(wanted))
}

/// Arms, and homes first where a position is unknown.
fn home_and_arm(hall: &HallContext) -> Result<Vec<Act>, Problem> {
    begin::needs_a_seat("arm", true, hall)?;
    if hall.mirror.next == Next::ArmAndHome {
        refuse_winding(hall, &hall.live.table())?;
    }
    request_when_free(Transition::HomeAndArm, hall)
}

fn go(by: Transition, who: &Who) -> Act {
    Act::Go { by, who: who.to_string(), surface: who.surface }
}

/// Goes on after a pause, or with a show that another machine led when it died: the seats join it where its film is by now.
fn resume(who: &Who, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    if !hall.has_taken_over() {
        begin::needs_a_seat("resume", false, hall)?;
        return request(Transition::Resume);
    }
    hall.is_free()?;
    begin::check("resume", hall)?;
    let go = go(Transition::Resume, who);
    match hall.goes_on() {
        Some(GoesOn::WithFilm) => Ok(vec![go]),
        Some(GoesOn::At(film)) => Ok(begin_at(film, go, hall)),
        None => {
            let detail = "cannot resume: what the other machine played is not loaded as it was there, or its film is over";
            Err(Problem::new(Code::State, detail, "park, then arm and start a show"))
        }
    }
}

/// Has what is loaded begin there, and the film that is shown from here wound to it.
fn start_at(film: ShowTime, hall: &HallContext) -> impl Iterator<Item = Act> {
    [Act::Stage(ShowChange::Start(film))].into_iter().chain(player::seek(film, hall))
}

/// Begins there, for that one show.
fn begin_at(film: ShowTime, go: Act, hall: &HallContext) -> Vec<Act> {
    start_at(film, hall).chain([Act::Otherwise(vec![Act::Stage(ShowChange::Rewind)]), go]).collect()
}

/// Lets what is loaded go from there on, by a join onto the moving cue.
fn go_from(film: ShowTime, who: &Who, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    begin::check("go", hall)?;
    if hall.mirror.state != State::Armed {
        let detail = format!("cannot go from {film} while {}", hall.mirror.state);
        return Err(Problem::new(Code::State, detail, "arm first; while the cue plays or is paused, seek"));
    }
    within_cue(film, hall)?;
    Ok(begin_at(film, go(Transition::Go, who), hall))
}

/// True if the cue that is loaded has that time.
///
/// # Errors
/// Why it has not.
fn within_cue(film: ShowTime, hall: &HallContext) -> Result<(), Problem> {
    let Some(cued) = &hall.cued else {
        return Err(Problem::new(Code::State, "cannot seek: no cue is loaded", "load one"));
    };
    let length = cued.timeline.duration();
    if film < ShowTime::ZERO || film >= length {
        let detail = format!("{film} is outside the cue, which is {length} long");
        return Err(Problem::new(Code::Value, detail, "give a time within it"));
    }
    Ok(())
}

fn seek(film: ShowTime, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    within_cue(film, hall)?;
    if hall.mirror.state == State::Armed {
        return Ok(start_at(film, hall).collect());
    }
    // Where the film is shown from here it is wound, and the seats follow.
    let wound = player::seek(film, hall).filter(|_| hall.is_on_cue());
    Ok(vec![wound.unwrap_or(Act::Tick(TickCommand::Seek(film)))])
}

/// Sets something, and makes the show anew where its first frames hang on that.
fn set(
    hall: &HallContext,
    change: impl FnOnce(&mut HallSettings) -> Result<(), Problem>,
) -> Result<Vec<Act>, Problem> {
    let mut settings = hall.settings.clone();
    change(&mut settings)?;
    Ok(vec![Act::Stage(ShowChange::Settings(Box::new(settings)))])
}

fn trim(ms: i32, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    if ms.abs() > TRIM_MS {
        let detail = format!("a trim of {ms} ms is outside -{TRIM_MS}..={TRIM_MS}");
        return Err(Problem::new(Code::Value, detail, "give a smaller one"));
    }
    set(hall, |settings| {
        settings.trim_ms = ms;
        Ok(())
    })
}

fn preset(name: &str, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    let Some(preset) = hall.config.preset(name) else {
        let known = hall.config.presets.iter().map(|preset| preset.name.as_str());
        return Err(Problem::unknown("preset", name, known, "the status names the presets"));
    };
    set(hall, |settings| settings.change(&LevelsChange::from(preset)))
}

/// Takes the group of a controller out.
fn disable(name: &str, who: &Who, why: Option<&str>, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    let why = why.map_or(Ok(None), Out::reason).map_err(|fault| {
        Problem::new(Code::Value, fault, format!("say it in a line of {LONGEST_WHY} characters at the most"))
    })?;
    let Some(group) = group_of(name, hall) else {
        return if is_absent(name, hall) { Ok(Vec::new()) } else { Err(no_controller(name, hall)) };
    };
    set(hall, |settings| {
        settings.enable(group, Some(Out::now(who, why)));
        Ok(())
    })
}

fn group_of<'h>(name: &str, hall: &'h HallContext) -> Option<&'h str> {
    hall.config.controllers.iter().find(|one| one.name == name).map(|one| one.group.as_str())
}

fn is_absent(name: &str, hall: &HallContext) -> bool {
    hall.config.absent.iter().any(|one| one.controller.name == name)
}

fn no_controller(name: &str, hall: &HallContext) -> Problem {
    Problem::unknown(
        "controller",
        name,
        hall.config.named().map(|one| one.name.as_str()),
        "the status lists them",
    )
}

/// True if an emergency stop is in effect at a controller of a group: with it the whole hall would stop.
fn is_pressed(group: &str, hall: &HallContext) -> bool {
    let controllers = hall.config.controllers.iter().zip(hall.live.table());
    let mut of_group = controllers.filter(|(one, _)| one.group == group);
    of_group.any(|(_, row)| row.state.emergency_stop())
}
