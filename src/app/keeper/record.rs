//! What is written down: what was asked by whom, and what was played.

use std::collections::VecDeque;

use jiff::Zoned;

use super::Keeper;
use crate::hall::{Desired, JournalLine, Problem, Surface};
use crate::journal::{Action, Ending, Journal, Outcome, Percentiles, ShowRecord, stamp};
use crate::rt::{Row, Times};
use crate::state::Cause;
use crate::tracker::{Counts, Histogram};

/// Lines that every status carries.
const NEWEST: usize = 20;

/// What is written down, and what was lately.
#[derive(Debug)]
pub(super) struct Records {
    journal: Journal,
    newest: VecDeque<JournalLine>,
    /// The show that is under way.
    open: Option<Box<Open>>,
}

/// A show that has begun, with what was counted before.
#[derive(Debug)]
struct Open {
    record: ShowRecord,
    events: Vec<String>,
    ticks: u64,
    missed: u64,
    table: Vec<Row>,
    times: Times,
}

impl Records {
    /// Records that go to a journal.
    pub(super) const fn new(journal: Journal) -> Self {
        Self { journal, newest: VecDeque::new(), open: None }
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

    /// The journal, for the next keeper.
    pub(super) fn into_journal(self) -> Journal {
        self.journal
    }

    /// Notes something that happens while a show is under way.
    pub(super) fn event(&mut self, event: String) {
        if let Some(open) = &mut self.open {
            open.events.push(event);
        }
    }
}

impl Keeper {
    /// Writes down what somebody asked, and what came of it.
    pub(super) fn write_down(&mut self, desired: &Desired, result: &Result<(), Problem>) {
        let at = stamp(&Zoned::now());
        let (who, what) = (desired.who.to_string(), desired.ask.to_string());
        let result = match result {
            Ok(()) => "done".to_owned(),
            Err(problem) => format!("{}; {}", problem.detail, problem.remedy),
        };
        let state = self.known.state.to_string();
        self.say_ask(&who, &what, &result, desired.ask.word());
        let line =
            JournalLine { at: at.clone(), who: who.clone(), what: what.clone(), result: result.clone() };
        self.record.newest.push_front(line);
        self.record.newest.truncate(NEWEST);
        self.record.journal.note(&Action { at, who, what, result, state });
    }

    /// A show has just begun, and who let it go. What was counted is as the ack thread told it last, before it began.
    pub(super) fn begin_record(&mut self, who: &str, surface: Surface) {
        let Some(cued) = &self.cued else { return };
        let (now, config) = (Zoned::now(), &self.reins.config);
        let table = self.reins.live.table();
        let available =
            table.iter().enumerate().filter(|(lane, row)| self.board.is_on(*lane) && row.standing.may_move());
        let levels = &self.board.levels;
        let off = levels.effects.iter().filter(|(_, on)| !**on);
        let record = ShowRecord {
            start: stamp(&now),
            hall: config.show.name.clone(),
            cue: cued.id.clone(),
            sha256: cued.sha256.clone(),
            title: cued.title.clone(),
            playlist: self.place(),
            level: levels.motion,
            vibration: levels.vibration,
            trim_ms: self.board.trim_ms,
            effects_off: off.map(|(name, _)| name.clone()).collect(),
            seats_total: config.controllers.len(),
            seats_available: available.count(),
            operator: who.to_owned(),
            scheduled: surface == Surface::Schedule,
            out_of_hours: config.log.hours.is_some_and(|hours| !hours.contains(now.time())),
            outcome: None,
        };
        self.record.journal.begin(&record);
        let live = &self.reins.live;
        self.record.open = Some(Box::new(Open {
            record,
            events: Vec::new(),
            ticks: live.ticks(),
            missed: live.missed(),
            times: live.times(),
            table,
        }));
    }

    /// A show is over; the counts of its last second are still on their way, so a frame under way counts as
    /// what it was when the show began.
    pub(super) fn end_record(&mut self, ended: Cause) {
        let Some(open) = self.record.open.take() else { return };
        let Open { mut record, events, ticks, missed, table, times } = *open;
        let live = &self.reins.live;
        let now = live.table();
        let sum = |of: fn(&Counts) -> u64| -> u64 {
            let after: u64 = now.iter().map(|row| of(&row.counts)).sum();
            let before: u64 = table.iter().map(|row| of(&row.counts)).sum();
            after.saturating_sub(before)
        };
        let after = live.times();
        record.outcome = Some(Outcome {
            end: stamp(&Zoned::now()),
            result: ending(ended),
            events,
            ticks: live.ticks().saturating_sub(ticks),
            missed_ticks: live.missed().saturating_sub(missed),
            sent: sum(|counts| counts.sent),
            asked: sum(|counts| counts.asked),
            acked: sum(|counts| counts.acked),
            refused: sum(Counts::refused),
            lost: sum(|counts| counts.lost),
            send_failed: sum(|counts| counts.send_failed),
            lateness: percentiles(after.lateness, &times.lateness),
            ack: percentiles(after.acks, &times.acks),
        });
        self.record.journal.show(&record);
    }
}

/// How a show ended for that cause.
pub(super) const fn ending(cause: Cause) -> Ending {
    match cause {
        Cause::CueEnded => Ending::Completed,
        Cause::Trouble(_) | Cause::EmergencyStop(_) => Ending::Fault,
        _ => Ending::Stopped,
    }
}

/// Percentiles of what came since.
fn percentiles(mut now: Histogram, before: &Histogram) -> Percentiles {
    // What cannot be taken away was never in it.
    let _ = now.subtract(before);
    #[expect(clippy::cast_precision_loss, reason = "a few seconds in nanoseconds")]
    let us = |ns: u64| (!now.is_empty()).then_some((ns as f64 / 100.0).round() / 10.0);
    Percentiles {
        p50_us: us(now.value_at_quantile(0.5)),
        p99_us: us(now.value_at_quantile(0.99)),
        max_us: us(now.max()),
    }
}
