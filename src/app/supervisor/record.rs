//! ShowRecords for the journal: commands with their operators, and shows.

mod fallen;

use std::collections::VecDeque;
use std::time::Duration;

use jiff::Zoned;

use self::fallen::ShowEvents;
use super::act::{Act, Feature, ShowBegun, SupervisorEvent};
use super::hall::{Counted, HallContext};
use crate::app::film::{FilmTable, SharedTable, SourceRow};
use crate::app::recorder::RecordAsk;
use crate::control::model::{Ending, FrameCounts, Percentiles};
use crate::control::{Desired, JournalLine, Problem, Surface};
use crate::film::point::FilmState;
use crate::journal::{Action, FilmProof, FoldedAction, Folds, Journal, Outcome, ShowRecord, stamp};
use crate::rt::Row;
use crate::state::{Cause, State};
use crate::time::MonoTime;
use crate::tracker::Histogram;

/// How long the last frames of a show have to meet their fate, and the ack thread to tell it.
const SETTLED_WITHIN: Duration = Duration::from_millis(1_500);
/// Lines that every status carries.
const NEWEST: usize = 20;

/// What is written down, and what was lately.
#[derive(Debug)]
pub(super) struct ShowRecords {
    journal: Journal,
    folds: Folds,
    newest: VecDeque<JournalLine>,
    /// The show that is under way.
    open: Option<Box<OpenShow>>,
}

/// A show that has begun.
#[derive(Debug)]
struct OpenShow {
    record: ShowRecord,
    before: Counted,
    events: ShowEvents,
    /// The film that leads it, if one does, and how often another source had taken over before.
    film: Option<(FilmProof, u64)>,
    /// How it ended; none while it goes on.
    over: Option<ShowOver>,
}

/// The end of a show whose last frames may be on their way.
#[derive(Debug)]
struct ShowOver {
    cause: Cause,
    end: String,
    at: MonoTime,
    ticks: u64,
    missed: u64,
}

impl ShowRecords {
    /// ShowRecords that go to a journal.
    pub(super) fn new(journal: Journal) -> Self {
        Self { journal, folds: Folds::default(), newest: VecDeque::new(), open: None }
    }

    /// The newest lines, newest first.
    pub(super) fn newest(&self) -> Vec<JournalLine> {
        self.newest.iter().cloned().collect()
    }

    /// Why lines cannot be written at present, and what to do.
    pub(super) fn trouble(&self) -> Option<String> {
        self.journal.trouble()
    }

    /// What has become worse or better in writing it.
    pub(super) fn news(&mut self) -> Vec<String> {
        self.journal.news()
    }

    /// The journal, for the next supervisor.
    pub(super) fn into_journal(mut self) -> Journal {
        self.folds.rest().iter().for_each(|one| self.journal.note(&one.action));
        self.journal
    }

    /// True if a show has begun, and is not over.
    pub(super) fn is_under_way(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.over.is_none())
    }

    /// Puts it before the newest lines; with the line before, where that was the same.
    fn show(&mut self, action: &Action) {
        let Action { at, who, what, result, .. } = action.clone();
        let line = JournalLine { at, who, what, result, times: 1 };
        let same = |before: &&mut JournalLine| {
            (&before.who, &before.what, &before.result) == (&line.who, &line.what, &line.result)
        };
        match self.newest.front_mut().filter(same) {
            Some(before) => *before = JournalLine { times: before.times.saturating_add(1), ..line },
            None => self.newest.push_front(line),
        }
        self.newest.truncate(NEWEST);
    }

    /// Notes something that happens while a show is under way.
    pub(super) fn event(&mut self, event: String) {
        if let Some(open) = self.open.as_mut().filter(|open| open.over.is_none()) {
            open.events.note(event);
        }
    }

    /// Writes down what somebody asked in that state, and what came of it; gives the lines that are due.
    pub(super) fn write_down(
        &mut self,
        desired: &Desired,
        result: &Result<(), Problem>,
        state: State,
        now: MonoTime,
    ) -> Vec<Action> {
        let at = stamp(&Zoned::now());
        let (who, what) = (desired.who.to_string(), desired.ask.to_string());
        let result = match result {
            Ok(()) => "done".to_owned(),
            Err(problem) => format!("{}; {}", problem.detail, problem.remedy),
        };
        let action = Action { at, who, what, result, state: state.to_string(), times: 1 }.shortened();
        self.show(&action);
        let due = self.folds.take(action, desired.ask.word(), now);
        self.noted(due)
    }

    /// Writes down the repeats of what was asked, once their time is over; gives their lines.
    pub(super) fn settle_folds(&mut self, now: MonoTime) -> Vec<Action> {
        let due = self.folds.due(now);
        self.noted(due)
    }

    fn noted(&mut self, due: Vec<FoldedAction>) -> Vec<Action> {
        let due: Vec<Action> = due.into_iter().map(|one| one.action).collect();
        due.iter().for_each(|action| self.journal.note(action));
        due
    }

    /// A show has just begun, and who let it go.
    fn begin(&mut self, begun: &ShowBegun, hall: &HallContext) {
        self.close(hall);
        let Some(cued) = &hall.cued else { return };
        let ShowBegun { who, surface, counted, place } = begun;
        let (now, config) = (Zoned::now(), &hall.config);
        let available = counted
            .table
            .iter()
            .enumerate()
            .filter(|(lane, row)| hall.settings.is_on(*lane) && row.standing.may_move());
        let levels = &hall.settings.levels;
        let off = levels.effects.iter().filter(|(_, on)| !**on);
        let record = ShowRecord {
            start: stamp(&now),
            hall: config.show.name.clone(),
            cue: cued.id.clone(),
            sha256: cued.sha256.clone(),
            title: cued.title.clone(),
            playlist: place.clone(),
            level: levels.motion,
            vibration: levels.vibration,
            trim_ms: hall.settings.trim_ms,
            effects_off: off.map(|(name, _)| name.clone()).collect(),
            seats_total: config.named().count(),
            seats_available: available.count(),
            operator: who.clone(),
            scheduled: *surface == Surface::Schedule,
            out_of_hours: config.log.hours.is_some_and(|hours| !hours.contains(now.time())),
            outcome: None,
        };
        self.journal.begin(&record);
        let before = counted.clone();
        hall.live.take_film_error_most_s(); // that of the show before
        let switches = |table: &SharedTable| (FilmProof::default(), table.read().switches);
        let film = cued.film.and(hall.film.as_ref()).map(switches);
        self.open =
            Some(Box::new(OpenShow { record, before, events: ShowEvents::default(), film, over: None }));
    }

    /// Notes who leads, and how far the seats are from the film, while a show follows it.
    fn follow(&mut self, hall: &HallContext) {
        let Some(open) = self.open.as_mut().filter(|open| open.over.is_none()) else { return };
        let Some((proof, before)) = open.film.as_mut() else { return };
        let Some(table) = hall.film.as_ref().map(SharedTable::read) else { return };
        note_film(proof, &table, *before, hall.live.take_film_error_most_s());
    }

    /// A show is over. It is written down once its last frames have met their fate.
    pub(super) fn end(&mut self, hall: &HallContext) {
        self.follow(hall);
        let Some(open) = self.open.as_mut().filter(|open| open.over.is_none()) else { return };
        open.over = Some(ShowOver {
            cause: hall.ended,
            end: stamp(&Zoned::now()),
            at: hall.now,
            ticks: hall.live.ticks().saturating_sub(open.before.ticks),
            missed: hall.live.missed().saturating_sub(open.before.missed),
        });
    }

    /// Writes down a show that is over, once the ack thread has told the fate of every frame of it.
    fn settle(&mut self, table: &[Row], hall: &HallContext) {
        let Some(over) = self.open.as_ref().and_then(|open| open.over.as_ref()) else { return };
        let told = |row: &Row| row.at > over.at && row.counts.in_flight() == 0;
        if hall.now.since(over.at) > SETTLED_WITHIN || table.iter().all(told) {
            self.close(hall);
        }
    }

    /// Writes down a show that is over, with what was counted so far.
    pub(super) fn close(&mut self, hall: &HallContext) {
        let Some(open) = self.open.take() else { return };
        let OpenShow { mut record, before, events, film, over, .. } = *open;
        let Some(ShowOver { cause, end, ticks, missed, at }) = over else { return };
        let now = hall.live.table();
        let frames =
            |table: &[Row]| table.iter().map(|row| FrameCounts::from(&row.counts)).sum::<FrameCounts>();
        let failed = |table: &[Row]| table.iter().map(|row| row.counts.send_failed).sum::<u64>();
        let after = hall.live.times();
        let (events, seats_out) = events.told(at, hall);
        record.outcome = Some(Outcome {
            end,
            result: ending(cause),
            events,
            seats_out,
            ticks,
            missed_ticks: missed,
            frames: frames(&now).since(frames(&before.table)),
            send_failed: failed(&now).saturating_sub(failed(&before.table)),
            lateness: percentiles(after.lateness, &before.times.lateness),
            ack: percentiles(after.acks, &before.times.acks),
            film: film.map(|(proof, _)| proof),
        });
        self.journal.show(&record);
        if !hall.config.record.names {
            record.operator.clear();
        }
        if let Ok(report) = serde_json::to_vec(&record) {
            hall.recorder.put(RecordAsk::Report(report));
        }
    }
}

impl Feature for ShowRecords {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, _out: &mut Vec<Act>) {
        match event {
            SupervisorEvent::Entered(to) => self.event(format!("{to}: {}", hall.cause())),
            SupervisorEvent::Begun(begun) => self.begin(begun, hall),
            SupervisorEvent::Round(table) => {
                self.follow(hall);
                if let Some(open) = self.open.as_mut().filter(|open| open.over.is_none()) {
                    open.events.note_seats(table, hall);
                }
                self.settle(table, hall);
            }
            _ => {}
        }
    }
}

/// How a show ended for that cause.
pub(super) const fn ending(cause: Cause) -> Ending {
    match cause {
        cause if cause.completes() => Ending::Completed,
        Cause::Trouble(_) | Cause::EmergencyStop(_) => Ending::Fault,
        _ => Ending::Stopped,
    }
}

/// Adds to what is told of a show's film who leads it now, and the farthest that the seats were from it since the last time. A
/// source counts once seats have followed it.
fn note_film(proof: &mut FilmProof, table: &FilmTable, switches_before: u64, error_s: Option<f64>) {
    let Some(error_s) = error_s else { return };
    let most = proof.greatest_error_ms.unwrap_or_default().max(error_s * 1e3);
    proof.greatest_error_ms = Some(most);
    proof.switches = table.switches.saturating_sub(switches_before);
    // Whom a person has just chosen leads, though nobody may follow it yet.
    let runs = |row: &&SourceRow| matches!(row.state, FilmState::Locked | FilmState::Freewheeling);
    let leads = table.leads.and_then(|place| table.sources.get(place)).filter(runs);
    if let Some(row) = leads.filter(|row| !proof.sources.contains(&row.source)) {
        proof.sources.push(row.source.clone());
    }
}

/// Percentiles of what came since.
fn percentiles(mut now: Histogram, before: &Histogram) -> Percentiles {
    // What cannot be taken away was never in it.
    let _ = now.subtract(before);
    Percentiles::of(&now)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row, told};
    use crate::film::chase::ParkCause;
    use crate::journal::Limits;

    #[test]
    fn a_show_that_is_over_waits_for_the_fate_of_its_last_frames_but_not_for_ever() {
        let folder = tempfile::tempdir().unwrap();
        let limits = Limits { max_size: 1 << 20, max_total: 1 << 20, max_age_days: 1 };
        let mut records = ShowRecords::new(Journal::open(folder.path(), limits, &Zoned::now()));
        let mut hall = hall(State::Armed, "one");
        let ms = Duration::from_millis;
        for (asked, later, settled) in [
            (1, ms(100), false),
            (0, Duration::ZERO, false),
            (0, ms(100), true),
            (1, SETTLED_WITHIN + ms(1), true),
        ] {
            let begun = ShowBegun {
                who: "anna".to_owned(),
                surface: Surface::Http,
                counted: hall.count(),
                place: None,
            };
            told(&mut records, &SupervisorEvent::Begun(&begun), &hall);
            assert!(records.is_under_way());
            records.end(&hall);
            assert!(!records.is_under_way());
            let over = hall.now;
            hall.now = over + later;
            let mut row = row(hall.now);
            row.counts.asked = asked;
            told(&mut records, &SupervisorEvent::Round(&[row]), &hall);
            assert_eq!(records.open.is_none(), settled, "{asked} open, {later:?} after the end");
        }
    }

    #[test]
    fn proof_of_play_has_the_sources_that_were_followed_and_the_farthest_from_the_film() {
        let table = |leads, switches| FilmTable {
            sources: [
                ("ltc", FilmState::Locked),
                ("artnet", FilmState::Freewheeling),
                ("mtc", FilmState::Absent),
            ]
            .map(|(source, state)| SourceRow::named(source, state))
            .into(),
            leads,
            switches,
            ..FilmTable::default()
        };
        let mut proof = FilmProof::default();
        note_film(&mut proof, &table(Some(0), 7), 7, None);
        assert_eq!(proof, FilmProof::default(), "nobody followed it yet");
        for (leads, switches, error_s) in
            [(Some(0), 7, 0.002), (None, 7, 0.001), (Some(1), 8, 0.000_5), (Some(2), 9, 0.001)]
        {
            note_film(&mut proof, &table(leads, switches), 7, Some(error_s));
        }
        let sources = ["ltc", "artnet"].map(str::to_owned).into();
        assert_eq!(proof, FilmProof { sources, switches: 2, greatest_error_ms: Some(2.0) });
    }

    #[test]
    fn a_show_that_ends_with_its_film_is_completed_if_that_led_it_through_its_cue() {
        for over in [Cause::CueEnded, Cause::FilmOver(ParkCause::FilmEnded)] {
            assert_eq!(ending(over), Ending::Completed, "{over}");
        }
        for why in [ParkCause::FilmCutShort, ParkCause::CueLeft, ParkCause::HeldTooLong] {
            assert_eq!(ending(Cause::FilmOver(why)), Ending::Stopped, "{why:?}");
        }
    }
}
