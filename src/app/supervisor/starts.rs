//! Starts of several halls at one instant, which the fleet asks: of what a person here has armed for that, with that cue, for that group,
//! and once. One that is not asked for again in time (the commit), or whose instant cannot be kept, is called off and leaves the hall armed;
//! none is made up for. Until it begins anybody here, or the desk, can call it off.

use std::time::Duration;

use super::act::{Act, Feature, SupervisorEvent};
use super::begin;
use super::hall::{Counted, HallContext, ShowChange};
use crate::control::{
    ArmedForStatus, ClockStatus, Code, Command, Desired, FleetStatus, Problem, StartOrder, StartPhase,
    StartStatus, Who,
};
use crate::rt::{Command as TickCommand, StartOff};
use crate::state::{State, Transition};
use crate::time::ShowTime;

/// So long before its first frame a start may be asked: everybody has to hear of it, and nobody is to have forgotten it.
const LEAST: Duration = Duration::from_secs(2);
const MOST: Duration = Duration::from_mins(1);
/// So long before its first frame the commit is to be there.
const COMMIT_BY: Duration = Duration::from_millis(300);
/// So long before it the instant is taken over into the machine's clock, once, and given to the tick thread.
const GIVEN: Duration = Duration::from_secs(1);
/// With less than this left it is given no more.
const LEAST_LEFT: Duration = Duration::from_millis(150);
/// The tick thread says by then what came of it.
const TOLD_BY: Duration = Duration::from_secs(2);
/// Starts that may be asked with one arming.
const TICKETS: usize = 32;

/// What the fleet may start here, and what it has asked.
#[derive(Debug, Default)]
pub(super) struct FleetStarts {
    armed_for: Option<ArmedFor>,
    held: Option<Held>,
    /// What came of the last one.
    last: Option<StartStatus>,
}

/// What a person here has armed the hall for.
#[derive(Debug)]
struct ArmedFor {
    group: String,
    cue: String,
    sha256: String,
    /// The starts that were asked since.
    tickets: Vec<String>,
}

/// A start that waits for its instant.
#[derive(Debug)]
struct Held {
    order: StartOrder,
    who: Who,
    phase: HeldPhase,
    /// How far the clock may have been off when the instant was taken over, µs.
    bound_us: Option<f64>,
    /// Why it is being called off at the tick thread, which may have begun it all the same.
    off: Option<String>,
}

#[derive(Debug)]
enum HeldPhase {
    /// It comes only if the desk is heard once more.
    Asked,
    /// The desk was heard.
    Committed,
    /// The tick thread has it, and will say what came of it; with what was counted before.
    Given(Box<Counted>),
}

impl FleetStarts {
    /// What is done to arm the hall for a group.
    ///
    /// # Errors
    /// Where the fleet may start nothing here, or not what is loaded.
    pub(super) fn arm(group: &str, hall: &HallContext) -> Result<Vec<Act>, Problem> {
        let Some(fleet) = &hall.config.fleet else {
            return Err(Problem::new(
                Code::Off,
                "this hall is in no fleet",
                "configure [fleet] and restart, or arm without a group",
            ));
        };
        if !fleet.start {
            let detail = "the fleet may start nothing here: start of [fleet] is not true";
            return Err(Problem::new(Code::Off, detail, "set it and reload, or arm without a group"));
        }
        if hall.cued.as_ref().is_some_and(|cued| cued.film.is_some()) {
            let detail = "a film leads this show, so nothing else can start it at an instant";
            return Err(Problem::new(Code::State, detail, "start the film, or load a cue that follows none"));
        }
        begin::needs_a_seat("arm", false, hall)?;
        hall.is_free()?;
        let armed = Act::ArmedFor(group.to_owned());
        let arm = Act::Tick(TickCommand::Request(Transition::Arm));
        // At the instant the film is at its beginning.
        Ok(vec![arm, Act::Stage(ShowChange::Start(ShowTime::ZERO)), armed])
    }

    /// The hall is armed for it.
    pub(super) fn armed(&mut self, group: String, hall: &HallContext) {
        let of = |(cue, sha256): (&String, &String)| ArmedFor {
            group,
            cue: cue.clone(),
            sha256: sha256.clone(),
            tickets: Vec::new(),
        };
        let is_armed = hall.mirror.state == State::Armed;
        let cued = hall.cued.as_ref().filter(|_| is_armed).map(|cued| (&cued.id, &cued.sha256));
        self.armed_for = cued.map(of);
    }

    /// Takes a start that is asked; it comes only once it is committed.
    ///
    /// # Errors
    /// Why it will not come.
    pub(super) fn ask(
        &mut self,
        order: &StartOrder,
        who: &Who,
        hall: &HallContext,
    ) -> Result<Vec<Act>, Problem> {
        self.may_start(order, hall)?;
        let left_ns = left_ns(order, hall);
        if !(nanos(LEAST)..=nanos(MOST)).contains(&left_ns) {
            let (least, most) = (LEAST.as_secs(), MOST.as_secs());
            let ahead_s = ShowTime::from_nanos(left_ns).as_secs_f64();
            let detail = format!("{} is {ahead_s:.1} s from now, not {least} to {most} s", order.at());
            let remedy =
                "give another instant; if this happens every time, the clocks of desk and hall differ";
            return Err(Problem::new(Code::Late, detail, remedy));
        }
        if let Some(held) = &self.held {
            let detail = format!("the start {} waits already", held.order.ticket);
            return Err(Problem::new(Code::Busy, detail, "wait until it is over"));
        }
        let tickets =
            self.armed_for.as_mut().map(|armed| &mut armed.tickets).ok_or_else(|| nobody_armed(order))?;
        if tickets.contains(&order.ticket) {
            let detail = format!("the start {} came before", order.ticket);
            return Err(Problem::new(Code::Late, detail, "ask a new one"));
        }
        if tickets.len() >= TICKETS {
            let detail = format!("{TICKETS} starts were asked since the hall was armed");
            return Err(Problem::new(Code::Busy, detail, "arm the hall once more, by a person there"));
        }
        tickets.push(order.ticket.clone());
        let (order, who) = (order.clone(), who.clone());
        self.held = Some(Held { order, who, phase: HeldPhase::Asked, bound_us: None, off: None });
        Ok(Vec::new())
    }

    /// That start is to come.
    ///
    /// # Errors
    /// Where none of that ticket waits, or it is too late.
    pub(super) fn commit(
        &mut self,
        ticket: &str,
        who: &Who,
        hall: &HallContext,
    ) -> Result<Vec<Act>, Problem> {
        let held = self
            .held
            .as_mut()
            .filter(|held| held.order.ticket == ticket && held.who.name == who.name && held.off.is_none());
        let Some(held) = held else {
            let last = self.last.as_ref().filter(|last| last.ticket == ticket);
            let last = last.map_or_else(String::new, |last| format!(": {} {}", last.phase, last.why));
            let detail = format!("the start {ticket} does not wait here{last}");
            return Err(Problem::new(Code::State, detail, "ask a new one"));
        };
        if matches!(held.phase, HeldPhase::Asked) {
            let left_ns = left_ns(&held.order, hall);
            if left_ns < nanos(COMMIT_BY) {
                let least = COMMIT_BY.as_millis();
                let detail = format!("{} ms are left, and at least {least} are needed", left_ns / 1_000_000);
                return Err(Problem::new(Code::Late, detail, "ask a new start"));
            }
            held.phase = HeldPhase::Committed;
        }
        Ok(Vec::new())
    }

    /// True if what is loaded may start so.
    fn may_start(&self, order: &StartOrder, hall: &HallContext) -> Result<ClockStatus, Problem> {
        let group = &order.group;
        let armed = self.armed_for.as_ref().ok_or_else(|| nobody_armed(order))?;
        if armed.group != *group {
            let detail = format!("the hall is armed for {}, not for {group}", armed.group);
            return Err(Problem::new(Code::State, detail, "start that group, or arm the hall for the other"));
        }
        let loaded = hall.cued.as_ref().map(|cued| cued.sha256.as_str());
        if armed.sha256 != order.sha256 || loaded != Some(&armed.sha256) {
            let detail =
                format!("the hall is armed with {}, and that is not the cue that is meant", armed.cue);
            return Err(Problem::new(
                Code::State,
                detail,
                "ask `ready` once more, or load the other cue and arm",
            ));
        }
        if hall.mirror.state != State::Armed || hall.is_closing() {
            let detail = format!("the hall is {}, not armed", hall.mirror.state);
            return Err(Problem::new(Code::State, detail, "arm it, by a person there"));
        }
        begin::check("start", hall)?;
        clock(hall)
    }

    /// What is due, as often as anything happens.
    pub(super) fn due(&mut self, hall: &HallContext) -> Vec<Act> {
        let Some(held) = &self.held else { return Vec::new() };
        let left_ns = left_ns(&held.order, hall);
        if held.is_given() {
            let is_over = left_ns < -nanos(TOLD_BY);
            return if is_over { self.end("nobody said what came of it") } else { Vec::new() };
        }
        let order = held.order.clone();
        let clock = match self.may_start(&order, hall) {
            Ok(clock) => clock,
            Err(problem) => return self.end(&problem.detail),
        };
        let Some(held) = &mut self.held else { return Vec::new() };
        match held.phase {
            HeldPhase::Asked if left_ns < nanos(COMMIT_BY) => self.end("desk not heard"),
            HeldPhase::Committed if left_ns < nanos(LEAST_LEFT) => {
                self.end(&format!("the service was held up until {} ms before it", left_ns / 1_000_000))
            }
            HeldPhase::Committed if left_ns <= nanos(GIVEN) => {
                (held.phase, held.bound_us) =
                    (HeldPhase::Given(Box::new(hall.count())), Some(clock.bound_us));
                given(&order, hall)
            }
            _ => Vec::new(),
        }
    }

    /// The tick thread has begun it.
    pub(super) fn begun(&mut self, hall: &HallContext) -> (String, Counted) {
        let held = self.held.take();
        self.last = held.as_ref().map(|held| held.status(StartPhase::Started, String::new()));
        match held {
            Some(Held { who, phase: HeldPhase::Given(counted), .. }) => (who.to_string(), *counted),
            _ => ("the fleet".to_owned(), hall.count()),
        }
    }

    /// The tick thread has not begun it, and will not.
    pub(super) fn called_off(&mut self, why: StartOff, hall: &HallContext) -> Vec<Act> {
        let Some(held) = &self.held else { return Vec::new() };
        let why = match (why, &held.off) {
            (_, Some(why)) => why.clone(),
            (StartOff::Asked, None) => "it was called off here".to_owned(),
            (StartOff::NotArmed, None) => hall.cause(),
            (StartOff::Late, None) => "this machine was held up at that very instant".to_owned(),
        };
        self.end(&why)
    }

    /// It could not be given to the tick thread.
    pub(super) fn drop_given(&mut self) -> Vec<Act> {
        self.end("it could not be made ready")
    }

    /// Calls it off, where one waits: at once, or as soon as the tick thread says that it has not begun it.
    fn call_off(&mut self, why: String) -> Vec<Act> {
        match &mut self.held {
            Some(held) if held.is_given() => {
                held.off.get_or_insert(why);
                vec![Act::Tick(TickCommand::CallOff)]
            }
            Some(_) => self.end(&why),
            None => Vec::new(),
        }
    }

    /// It is over without a start; what is loaded begins at its beginning again.
    fn end(&mut self, why: &str) -> Vec<Act> {
        let Some(held) = self.held.take() else { return Vec::new() };
        let StartOrder { group, .. } = &held.order;
        let note = format!("the start of {group} at {} was called off: {why}", held.order.at());
        let was_given = held.is_given();
        self.last = Some(held.status(StartPhase::CalledOff, why.to_owned()));
        let rewind = was_given.then_some(Act::RewindStart);
        [Act::Passing(note)].into_iter().chain(rewind).collect()
    }

    /// As surfaces show it; none in a hall of no fleet.
    pub(super) fn status(&self, hall: &HallContext) -> Option<FleetStatus> {
        let fleet = hall.config.fleet.as_ref()?;
        let armed_for = self.armed_for.as_ref().map(|armed| ArmedForStatus {
            group: armed.group.clone(),
            cue: armed.cue.clone(),
            sha256: armed.sha256.clone(),
            lapses_s: hall.mirror.lapses(hall.now).unwrap_or(0.0),
        });
        Some(FleetStatus {
            clock: hall.clock.status(&hall.wall, fleet.start_bound),
            armed_for,
            start: self.held.as_ref().map(Held::now).or_else(|| self.last.clone()),
        })
    }
}

impl Held {
    /// True if the tick thread has it.
    fn is_given(&self) -> bool {
        matches!(self.phase, HeldPhase::Given(_))
    }

    fn now(&self) -> StartStatus {
        let phase =
            if matches!(self.phase, HeldPhase::Asked) { StartPhase::Asked } else { StartPhase::Committed };
        self.status(phase, String::new())
    }

    fn status(&self, phase: StartPhase, why: String) -> StartStatus {
        let Self { order, who, bound_us, .. } = self;
        StartStatus {
            ticket: order.ticket.clone(),
            group: order.group.clone(),
            who: who.to_string(),
            at: order.at(),
            phase,
            why,
            bound_us: *bound_us,
        }
    }
}

impl Feature for FleetStarts {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, out: &mut Vec<Act>) {
        match event {
            SupervisorEvent::Asked(desired) => out.extend(self.on_asked(desired)),
            SupervisorEvent::Entered(State::Armed) => {}
            SupervisorEvent::Entered(_) => {
                self.armed_for = None;
                // Of one that the tick thread has, that says what came of it.
                let waits = self.held.as_ref().is_some_and(|held| !held.is_given());
                out.extend(if waits { self.end(&hall.cause()) } else { Vec::new() });
            }
            SupervisorEvent::Begun(_) => self.armed_for = None,
            SupervisorEvent::Leaving => out.extend(self.call_off("the service ends".to_owned())),
            SupervisorEvent::Round(_) if self.may_begin() => {
                if let Err(problem) = begin::check("start", hall) {
                    out.extend(self.call_off(problem.detail));
                }
            }
            _ => {}
        }
    }
}

impl FleetStarts {
    /// True if the tick thread has one, and was not told to let it be.
    fn may_begin(&self) -> bool {
        self.held.as_ref().is_some_and(|held| held.is_given() && held.off.is_none())
    }

    /// Whoever wants something else of an armed hall wants no start of it.
    fn on_asked(&mut self, Desired { ask, who }: &Desired) -> Vec<Act> {
        if matches!(ask, Command::Arm { .. } | Command::ArmFor(_) | Command::Seek(_)) {
            self.armed_for = None;
        }
        match ask {
            Command::Stop | Command::Pause | Command::Park | Command::Disarm | Command::Go => {}
            Command::GoFrom(_) | Command::Seek(_) | Command::Arm { .. } | Command::ArmFor(_) => {}
            Command::Load { .. } | Command::Playlist { .. } | Command::Select { .. } => {}
            Command::Home | Command::Test { .. } | Command::Reload | Command::Clear => {}
            _ => return Vec::new(),
        }
        self.call_off(format!("{who} asked for {}", ask.word()))
    }
}

fn nobody_armed(order: &StartOrder) -> Problem {
    let group = &order.group;
    let detail = format!("nobody here has armed the hall for {group}");
    Problem::new(Code::State, detail, format!("ask somebody there: kinocue arm --fleet {group}"))
}

/// How far the clock may be off, where that is known and little enough.
fn clock(hall: &HallContext) -> Result<ClockStatus, Problem> {
    let most = hall.config.fleet.as_ref().map(|fleet| fleet.start_bound).unwrap_or_default();
    let Some(clock) = hall.clock.status(&hall.wall, most) else {
        let detail = "nobody has measured lately how far this machine's clock is off";
        let remedy = "set time_server in fleet.toml of its link, and see that the link and that server run";
        return Err(Problem::new(Code::State, detail, remedy));
    };
    if clock.bound_us > clock.start_bound_us {
        let detail = format!(
            "the clock may be {:.2} ms off {}, more than the {} ms of start_bound_ms",
            clock.bound_us / 1e3,
            clock.server,
            clock.start_bound_us / 1e3
        );
        return Err(Problem::new(Code::State, detail, "see to the time service of this machine (chrony)"));
    }
    Ok(clock)
}

/// How long it is until the first frame of a start by the wall clock, ns; below zero it is over. Seats that are led ahead begin sooner.
fn left_ns(order: &StartOrder, hall: &HallContext) -> i64 {
    let lead = hall.cued.as_ref().map(|cued| cued.lead).unwrap_or_default();
    let left = at_ns(order) - i128::from(hall.wall.wall_ns) - i128::from(nanos(lead));
    i64::try_from(left).unwrap_or(if left < 0 { i64::MIN } else { i64::MAX })
}

fn at_ns(order: &StartOrder) -> i128 {
    i128::from(order.at_ms) * 1_000_000
}

fn nanos(span: Duration) -> i64 {
    i64::try_from(span.as_nanos()).unwrap_or(i64::MAX)
}

/// Gives it to the tick thread: the wall clock's instant by the machine's clock from here on, and a show that begins at the first tick from
/// there on, with the film where it is then.
fn given(order: &StartOrder, hall: &HallContext) -> Vec<Act> {
    let film_zero = hall.wall.instant(at_ns(order));
    let begins = film_zero.before(hall.cued.as_ref().map(|cued| cued.lead).unwrap_or_default());
    let (_, first) = hall.grid.first_from(begins);
    vec![
        Act::Name(format!("the start of {}", order.group)),
        Act::Otherwise(vec![Act::Tick(TickCommand::CallOff), Act::DropStart]),
        Act::Stage(ShowChange::Start(ShowTime::ZERO + first.since(begins))),
        Act::Tick(TickCommand::StartAt(film_zero)),
    ]
}

#[cfg(test)]
mod tests;
