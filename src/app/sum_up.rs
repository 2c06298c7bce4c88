//! Sums up a play: the report, and notes for the person.

use super::report::{ControllerReport, EventReport, PlayReport, RealTimeReport, StateReport};
use super::run::Run;
use super::script::Prepared;
use crate::config::Controller;
use crate::control::model::Ending;
use crate::control::{FORMAT, Percentiles};
use crate::engine;
use crate::health::Groups;
use crate::limiter::Clamp;
use crate::motion::AxisGeometry;
use crate::time::Rate;

/// What happened to controllers and to groups, in the order of time.
fn events(controllers: &[Controller], run: &Run) -> Vec<EventReport> {
    let groups = Groups::of(controllers);
    let of_controllers = run.accounts.observer.events().map(|event| EventReport {
        controller: controllers[event.controller].name.clone(),
        at_s: run.seconds_from_origin(event.at),
        what: event.what.to_string(),
    });
    let of_groups = run.accounts.changes.iter().map(|change| EventReport {
        controller: match change.why.controller() {
            Some(controller) => controllers[controller].name.clone(),
            None => groups.name(change.group).to_owned(),
        },
        at_s: run.seconds_from_origin(change.at),
        what: change.to_string(),
    });
    let mut events: Vec<EventReport> = of_controllers.chain(of_groups).collect();
    events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    events
}

impl From<engine::Ending> for Ending {
    fn from(ending: engine::Ending) -> Self {
        match ending {
            engine::Ending::Completed => Self::Completed,
            engine::Ending::Stopped => Self::Stopped,
            engine::Ending::Fault => Self::Fault,
        }
    }
}

/// What came of a play.
#[derive(Debug)]
pub struct Played {
    /// Its report.
    pub report: PlayReport,
    /// What the system refused, in words.
    pub(crate) refusals: Vec<String>,
    /// What else a person should know, in words.
    pub(crate) notes: Vec<String>,
    /// Controllers that acked nothing, or were lost at the end; `None` if no replies were asked for.
    pub(crate) silent: Vec<String>,
    /// Controllers whose seats were to park at the end, and tell that they are elsewhere.
    pub(crate) off_park: Vec<String>,
    /// Controllers whose seats were to park at the end, and were left where nobody knows.
    pub(crate) lost_sight_of: Vec<String>,
}

impl Played {
    /// Notes who was left out, as it answered nothing. Nothing was played where in the end nobody was there.
    pub(super) fn miss(&mut self, silent: &[String]) {
        let missing = silent.iter().filter(|name| !self.silent.contains(name)).cloned().collect::<Vec<_>>();
        self.silent.extend(missing);
        if self.silent.len() == self.report.controllers.len() && self.report.result == Ending::Completed {
            self.report.result = Ending::Lost;
        }
    }
}

/// What is summed up.
pub(super) struct SumUp {
    /// What was played, as people know it.
    pub(super) cue: String,
    pub(super) rate: Rate,
    /// How it ended.
    pub(super) ending: Ending,
    /// True if no frame asked for a reply.
    pub(super) silent: bool,
}

/// Sums up what was played to these controllers, whose accounts are closed.
pub(super) fn sum_up(about: SumUp, controllers: &[Controller], prepared: &Prepared, run: &Run) -> Played {
    let SumUp { cue, rate, ending, silent } = about;
    let report = PlayReport {
        format: FORMAT,
        cue,
        result: ending,
        ticks: run.ended.ticks,
        missed_ticks: run.ended.missed,
        rate_hz: rate.hz(),
        lateness_us: Percentiles::of(&run.accounts.lateness),
        realtime: RealTimeReport::of(&run.granted, run.spun),
        strangers: run.accounts.strangers,
        controllers: (0..controllers.len())
            .map(|index| entry(index, &controllers[index], prepared, run))
            .collect(),
        links: Vec::new(),
        broadcasts: Vec::new(),
        events: events(controllers, run),
        recording_trouble: None,
    };
    let tracker = run.accounts.books.tracker();
    let gone = |index: &usize| run.accounts.gone.contains(index) || tracker.lost_at_end(*index);
    let lost = (0..controllers.len()).filter(|index| !silent && gone(index));
    Played {
        report,
        refusals: run.granted.refusals.clone(),
        notes: notes(controllers, prepared, run),
        silent: lost.map(|index| controllers[index].name.clone()).collect(),
        off_park: Vec::new(),
        lost_sight_of: run.lost_sight_of.iter().map(|index| controllers[*index].name.clone()).collect(),
    }
}

fn entry(index: usize, controller: &Controller, prepared: &Prepared, run: &Run) -> ControllerReport {
    let tracker = run.accounts.books.tracker();
    let counts = tracker.counts(index);
    ControllerReport {
        name: controller.name.clone(),
        address: controller.address(),
        frames: (&counts).into(),
        park_frames: prepared.park_frames[index],
        duplicate: counts.duplicate,
        stale: counts.stale,
        stray: counts.stray,
        send_failed: counts.send_failed,
        port_closed: counts.port_closed,
        clamps: run.clamps[index].clamps,
        withheld: run.tallies[index].withheld,
        gaps: run.tallies[index].gaps,
        late: run.tallies[index].late,
        hurried: run.tallies[index].hurried,
        ack_us: Percentiles::of(tracker.latency(index)),
        state: StateReport::of(controller, &run.accounts.observer.states()[index], run.closed_at),
    }
}

fn notes(controllers: &[Controller], prepared: &Prepared, run: &Run) -> Vec<String> {
    let mut notes: Vec<String> = run.refusals.iter().map(ToString::to_string).collect();
    notes.extend(prepared.hurried.iter().map(|&index| {
        let Controller { name, seat, .. } = &controllers[index];
        let seconds = |axis: &AxisGeometry| axis.stroke() / axis.unit.park_velocity();
        let slowest = seat.own().iter().max_by(|a, b| seconds(a).total_cmp(&seconds(b)));
        let (stroke, unit, usual) = slowest.map_or((0.0, "", 0.0), |axis| {
            (axis.stroke(), axis.unit.name(), axis.unit.park_velocity())
        });
        format!(
            "{name}: its move to park over a stroke of {stroke} {unit} took 3 s at most (PA0b), so it may have been \
             faster than {usual} {unit}/s"
        )
    }));
    notes.extend(controllers.iter().zip(&run.clamps).filter_map(|(one, clamps)| {
        let Clamp { axis, limit, times, .. } = clamps.worst?;
        let axis = axis + 1;
        let count = clamps.clamps;
        Some(format!(
            "{}: the limiter held its motion back {count} times, at worst from {times:.2} times its limit of {limit} \
             on axis {axis}; check the cue; if it passes, please report this",
            one.name
        ))
    }));
    notes.extend(controllers.iter().zip(&run.tallies).filter(|(_, tally)| tally.withheld > 0).map(|(one, tally)| {
        format!(
            "{}: {} frames were withheld: from some positions at which its seat might have been they were too fast",
            one.name, tally.withheld
        )
    }));
    let withdrawn = |index: usize| run.accounts.books.tracker().counts(index).withdrawn;
    let stopped = controllers.iter().enumerate().map(|(index, one)| (one, withdrawn(index)));
    notes.extend(stopped.filter(|(_, count)| *count > 0).map(|(one, count)| {
        format!("{}: {count} frames were not executed, as its drives were told to stop", one.name)
    }));
    if run.ended.unposted > 0 {
        notes
            .push(format!("{} records did not fit and were inferred from frame numbers", run.ended.unposted));
    }
    notes
}
