//! What the recorder is told of the hall: how it stands, what happens, what is asked; and which shows are recorded.

use std::time::Duration;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use super::standing::standing_words;
use crate::app::recorder::{RecordAsk, ShowStart};
use crate::control::{Code, Desired, Problem, Who};
use crate::film::point::FilmState;
use crate::health::HealthState;
use crate::journal::{Action, FoldedAction, Folds};
use crate::record::{
    ActionNote, EventNote, HallNote, IncidentCause, MarkNote, Note, TimecodeNote, TooOften, state_number,
};
use crate::rt::Row;
use crate::settings::{LONGEST_WHY, Out};
use crate::state::{Cause, State};
use crate::time::MonoTime;

/// How the hall stands is told so often, even if nothing changes.
const ANYWAY: Duration = Duration::from_secs(10);

const MARKS: [&str; 2] = [
    "this moment was marked within the last second, and that mark stands for both",
    "too many moments are marked: 60, and one a minute, are kept; the recording counts the rest",
];
const DUMPS: [&str; 2] = [
    "this was asked within the last second",
    "this was asked too often: 60 times, and once a minute, it is done",
];

/// What was told so far.
#[derive(Debug, Default)]
pub(super) struct HallTeller {
    standings: Vec<HealthState>,
    hall: Option<(HallNote, MonoTime)>,
    /// A show, or a homing, is recorded.
    is_recording: bool,
}

impl HallTeller {
    fn tell_hall(&mut self, hall: &HallContext) {
        let note = hall_note(hall);
        let is_old = |told: &(HallNote, MonoTime)| hall.now.since(told.1) >= ANYWAY || told.0 != note;
        if self.hall.as_ref().is_none_or(is_old) {
            self.hall = Some((note.clone(), hall.now));
            hall.recorder.keep(Note::Hall(note));
        }
    }

    fn tell_standings(&mut self, table: &[Row], hall: &HallContext) {
        for (lane, row) in table.iter().enumerate() {
            let before = self.standings.get(lane).copied();
            if before == Some(row.standing) {
                continue;
            }
            let seat = hall.config.controllers.get(lane).map(|one| one.name.clone()).unwrap_or_default();
            let text = format!("{}: {}", row.standing, standing_words(hall, lane, row.why).0);
            hall.recorder.keep(Note::Event(EventNote { kind: "standing", seat, text }));
        }
        self.standings = table.iter().map(|row| row.standing).collect();
    }

    fn enter(&mut self, to: State, hall: &HallContext) {
        self.tell_hall(hall);
        if matches!(hall.mirror.cause, Cause::EmergencyStop(_)) && (to.is_latched() || to == State::Stopping)
        {
            hall.recorder.put(RecordAsk::Incident(IncidentCause::EmergencyStop));
        }
        match to {
            State::Homing => self.begin(ShowStart { kind: "homing", ..ShowStart::default() }, hall),
            State::Boot
            | State::Recovering
            | State::Parked
            | State::Armed
            | State::Stopped
            | State::Fault
                if std::mem::take(&mut self.is_recording) =>
            {
                hall.recorder.put(RecordAsk::End);
            }
            _ => {}
        }
    }

    fn begin(&mut self, start: ShowStart, hall: &HallContext) {
        self.is_recording = true;
        hall.recorder.put(RecordAsk::Begin(start));
    }
}

impl Feature for HallTeller {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, _out: &mut Vec<Act>) {
        match event {
            SupervisorEvent::Entered(to) => self.enter(*to, hall),
            SupervisorEvent::Begun(_) => {
                let Some(cued) = &hall.cued else { return };
                let wants_cue = hall.config.record.attach_cue && hall.aside.is_none();
                let start = ShowStart {
                    kind: if hall.aside.is_some() { "test" } else { "show" },
                    cue: cued.id.clone(),
                    title: cued.title.clone().unwrap_or_default(),
                    sha256: cued.sha256.clone(),
                    attached: wants_cue.then(|| cued.timeline.cue().path().to_owned()),
                };
                self.begin(start, hall);
            }
            SupervisorEvent::Round(table) => {
                self.tell_standings(table, hall);
                self.tell_hall(hall);
                tell_film(hall);
            }
            _ => {}
        }
    }
}

fn hall_note(hall: &HallContext) -> HallNote {
    let settings = &hall.settings;
    let off = settings.levels.effects.iter().filter(|(_, on)| !**on);
    HallNote {
        state: state_number(hall.mirror.state),
        cause: hall.cause(),
        next: hall.mirror.next.to_string(),
        cue: hall.cued.as_ref().map(|cued| cued.id.clone()).unwrap_or_default(),
        level: settings.levels.motion,
        vibration: settings.levels.vibration,
        trim_ms: settings.trim_ms,
        effects_off: off.map(|(name, _)| name.clone()).collect(),
        seats_out: settings.out.keys().cloned().collect(),
    }
}

/// Where the film is that leads, while seats follow it.
fn tell_film(hall: &HallContext) {
    let (Some(table), Some(error_s)) = (&hall.film, hall.live.film_error_s()) else { return };
    let table = table.read();
    let leads = table.leads.and_then(|place| table.sources.get(place));
    hall.recorder.keep(Note::Timecode(TimecodeNote {
        source: leads.map(|row| row.source.clone()).unwrap_or_default(),
        film_s: hall.live.show().as_secs_f64(),
        error_ms: error_s * 1e3,
        locked: leads.is_some_and(|row| row.state == FilmState::Locked),
    }));
}

/// For how long the same is a repeat in recordings: what was asked is told while the incident that it belongs to is written.
const REPEATS: Duration = Duration::from_secs(1);

/// What the recorder is told of what is asked, each with its own instant: of repeats once a second, so that no flood of them takes the
/// room of what happened.
#[derive(Debug)]
pub(super) struct AsksTold(Folds);

impl Default for AsksTold {
    fn default() -> Self {
        Self(Folds::within(REPEATS))
    }
}

impl AsksTold {
    pub(super) fn take(&mut self, desired: &Desired, result: &Result<(), Problem>, hall: &HallContext) {
        let action = Action {
            at: String::new(),
            who: name_of(&desired.who, hall),
            what: desired.ask.to_string(),
            result: result.as_ref().map_or_else(ToString::to_string, |()| "done".to_owned()),
            state: hall.mirror.state.to_string(),
            times: 1,
        };
        tell_asks(self.0.take(action.shortened(), desired.ask.word(), hall.now), hall);
    }

    /// Tells of the repeats whose time is over.
    pub(super) fn settle(&mut self, hall: &HallContext) {
        tell_asks(self.0.due(hall.now), hall);
    }
}

fn tell_asks(due: Vec<FoldedAction>, hall: &HallContext) {
    for FoldedAction { at, action: Action { who, what, result, state, times, .. } } in due {
        let result = if times > 1 { format!("{result}, {times} times") } else { result };
        hall.recorder.keep_of(at, Note::Action(ActionNote { who, what, result, state }));
    }
}

/// Who it is, as recordings have it.
fn name_of(who: &Who, hall: &HallContext) -> String {
    if hall.config.record.names { who.to_string() } else { who.role.to_string() }
}

/// Marks this moment.
///
/// # Errors
/// Where nothing is recorded, or the words cannot stand there.
pub(super) fn mark(text: Option<&str>, who: &Who, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    records(hall)?;
    let text = text.map_or(Ok(None), Out::reason).map_err(|fault| {
        Problem::new(Code::Value, fault, format!("give one line of at most {LONGEST_WHY} characters"))
    })?;
    let film_s = hall.live.show().as_secs_f64();
    let note = MarkNote { film_s, text: text.unwrap_or_default(), who: name_of(who, hall) };
    hall.recorder.mark(note, hall.now).map_err(|refusal| too_often(refusal, MARKS, "mark"))?;
    Ok(Vec::new())
}

/// Has what the flight recorder holds written out.
///
/// # Errors
/// Where there is none, or that is asked too often: each makes a file, or makes one longer, and older files go for it.
pub(super) fn dump(hall: &HallContext) -> Result<Vec<Act>, Problem> {
    records(hall)?;
    hall.recorder.dump(hall.now).map_err(|refusal| too_often(refusal, DUMPS, "ask"))?;
    Ok(Vec::new())
}

/// That something is asked for too often: what is said so soon after the last and of one too many, and how to ask again.
fn too_often(refusal: TooOften, [again, too_many]: [&'static str; 2], ask: &str) -> Problem {
    let (detail, wait) = match refusal {
        TooOften::Same => (again, Duration::ZERO),
        TooOften::TooMany(wait) => (too_many, wait),
    };
    Problem::new(Code::Busy, detail, format!("{ask} again in {} s", wait.as_secs() + 1))
}

fn records(hall: &HallContext) -> Result<(), Problem> {
    let status = hall.recorder.status_at(hall.now);
    if status.flight_s > 0.0 || status.recording.is_some() {
        return Ok(());
    }
    let why = status.troubles.into_values().next().unwrap_or_else(|| "nothing is recorded here".to_owned());
    Err(Problem::new(Code::State, why, "set flight_s and mode in [record], and reload"))
}

/// Why the next show would not be recorded to its end: said once it is loaded, while there is time to make room.
pub(super) fn lacks_room(hall: &HallContext) -> Option<String> {
    let length_s = hall.cued.as_ref()?.timeline.duration().as_secs_f64();
    let (needs, room) = hall.recorder.lacks(length_s)?;
    #[expect(clippy::cast_precision_loss, reason = "to a tenth")]
    let [needs, room] = [needs, room].map(|octets| octets as f64 / 1e6);
    Some(format!(
        "a recording of this show takes up to {needs:.1} MB, and there is room for {room:.1} MB; free space on that disk, or set \
         dir, mode or min_free_gib in [record]"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row, told};

    #[test]
    fn a_moment_cannot_be_marked_where_nothing_is_recorded() {
        let hall = hall(State::Playing(crate::state::PlayMode::Following), "one");
        let who = crate::app::supervisor::testing::desired(
            crate::control::Surface::Http,
            crate::control::Command::Pause,
        )
        .who;
        let problem = mark(Some("F4 jerked"), &who, &hall).unwrap_err();
        assert!(problem.remedy.contains("[record]"), "{problem}");
    }

    #[test]
    fn a_thousand_marks_in_a_second_are_one_and_whoever_asks_is_told_so() {
        let mut hall = hall(State::Playing(crate::state::PlayMode::Following), "one");
        let (link, told_asks) = crate::app::recorder::RecordLink::new();
        link.flies();
        hall.recorder = link;
        let marks = crate::control::Command::Mark { text: None };
        let desired = crate::app::supervisor::testing::desired(crate::control::Surface::Http, marks);
        let mut asks = AsksTold::default();
        for number in 0..1_000 {
            let result = mark(None, &desired.who, &hall).map(|_| ());
            if let Err(problem) = &result {
                assert!(
                    number > 0 && problem.status == 429 && problem.remedy == "mark again in 1 s",
                    "{problem}"
                );
            }
            asks.take(&desired, &result, &hall);
        }
        hall.now = hall.now + Duration::from_secs(10);
        asks.settle(&hall);
        let told: Vec<_> = told_asks.try_iter().map(|(_, ask)| ask).collect();
        let is_mark = |ask: &&RecordAsk| matches!(ask, RecordAsk::Keep(Note::Mark(_)));
        assert_eq!((told.iter().filter(is_mark).count(), told.len()), (1, 1 + 3), "{told:?}");
        let RecordAsk::Keep(Note::Action(last)) = &told[3] else { panic!("{told:?}") };
        assert!(last.result.ends_with(", 998 times"), "{last:?}");
        assert_eq!(hall.recorder.status_at(hall.now).more_marks, 999);
    }

    #[test]
    fn a_program_that_has_the_flight_recorder_written_out_again_and_again_takes_no_room_from_other_incidents()
    {
        let mut hall = hall(State::Playing(crate::state::PlayMode::Following), "one");
        let (link, told_asks) = crate::app::recorder::RecordLink::new();
        link.flies();
        hall.recorder = link;
        let mut refused = 0;
        for _ in 0..36_000 {
            hall.now = hall.now + Duration::from_millis(100);
            if let Err(problem) = dump(&hall) {
                assert!(problem.status == 429 && problem.remedy.starts_with("ask again in "), "{problem}");
                refused += 1;
            }
        }
        let begun = told_asks.try_iter().count();
        assert_eq!((begun, refused), (60 + 59, 36_000 - 60 - 59), "a minute of them, and one a minute");
    }

    #[test]
    fn what_is_asked_twice_within_a_moment_is_recorded_as_of_when_it_was_asked() {
        let mut hall = hall(State::Playing(crate::state::PlayMode::Following), "one");
        let (link, told_asks) = crate::app::recorder::RecordLink::new();
        hall.recorder = link;
        let begin = hall.now;
        let mut asks = AsksTold::default();
        let desired = crate::app::supervisor::testing::desired(
            crate::control::Surface::Http,
            crate::control::Command::Pause,
        );
        for ms in [0, 20] {
            hall.now = begin + Duration::from_millis(ms);
            asks.take(&desired, &Ok(()), &hall);
        }
        hall.now = begin + REPEATS;
        asks.settle(&hall);
        let told: Vec<_> = told_asks.try_iter().collect();
        let after: Vec<_> = told.iter().map(|(at, _)| at.since(begin).as_millis()).collect();
        assert_eq!(after, [0, 20], "{told:?}");
    }

    #[test]
    fn a_show_whose_recording_finds_no_room_is_warned_of_once_it_is_loaded() {
        let mut hall = hall(State::Parked, "one");
        let (link, _asks) = crate::app::recorder::RecordLink::new();
        hall.recorder = link.clone();
        link.takes(1_000_000);
        assert_eq!(lacks_room(&hall), None, "the disk was not looked at yet");
        link.has_room(4_000_000);
        assert_eq!(lacks_room(&hall), None, "four seconds take as much");
        link.has_room(3_900_000);
        let warning = lacks_room(&hall).expect("it is too little");
        assert!(warning.contains("4.0 MB") && warning.contains("3.9 MB"), "{warning}");
        hall.cued = None;
        assert_eq!(lacks_room(&hall), None, "nothing is loaded");
    }

    #[test]
    fn what_the_recorder_is_told_does_not_depend_on_how_often_it_is_looked_at() {
        let mut hall = hall(State::Parked, "one");
        let (link, told_asks) = crate::app::recorder::RecordLink::new();
        hall.recorder = link;
        let mut teller = HallTeller::default();
        let rows = [row(hall.now), row(hall.now)];
        for _ in 0..5 {
            told(&mut teller, &SupervisorEvent::Round(&rows), &hall);
        }
        let asks: Vec<_> = told_asks.try_iter().collect();
        assert_eq!(asks.len(), 2 + 1, "two standings and the hall: {asks:?}");
        hall.mirror.state = State::Homing;
        told(&mut teller, &SupervisorEvent::Entered(State::Homing), &hall);
        hall.mirror.state = State::Parked;
        told(&mut teller, &SupervisorEvent::Entered(State::Parked), &hall);
        told(&mut teller, &SupervisorEvent::Entered(State::Armed), &hall);
        let asks: Vec<_> = told_asks.try_iter().map(|(_, ask)| ask).collect();
        let ends = asks.iter().filter(|ask| matches!(ask, RecordAsk::End)).count();
        let begins = asks.iter().filter(|ask| matches!(ask, RecordAsk::Begin(_))).count();
        assert_eq!((begins, ends), (1, 1), "{asks:?}");
    }
}
