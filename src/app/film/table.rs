//! All sources of a show, in their ranking: observations in, where the film is by the best of them out, and what a person is to see.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde::{Serialize, Serializer};

use super::SourceRules;
use super::told::{Notes, SourceNotes, noted};
use crate::film::chooser::{Chooser, SourceView};
use crate::film::observation::Observation;
use crate::film::point::{FilmPoint, FilmState, PublishedPoint};
use crate::film::source::FilmArgs;
use crate::film::timecode::FrameRate;
use crate::film::tracker::{SourceGrade, SourceTracker};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime, ShowTime};

/// How often where the film is is published, whatever is heard, and the table with it.
const PUBLISH_EVERY: Duration = Duration::from_millis(50);

/// What is known of the film by all sources.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct FilmTable {
    /// In their ranking.
    pub(crate) sources: Vec<SourceRow>,
    /// The place of the one that leads.
    pub(crate) leads: Option<usize>,
    /// How often another took over.
    pub(crate) switches: u64,
    /// A source that ranks higher is ahead by so many seconds, and a person has to decide.
    pub(crate) disagrees: Option<Disagreement>,
    /// The place of the one that a person chose.
    pub(crate) chosen: Option<usize>,
    /// No source can tell any more, nor will: each was a recording, or a command that has ended.
    #[serde(skip)]
    pub(crate) over: bool,
}

/// Two sources that say different things.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Disagreement {
    pub(crate) source: usize,
    pub(crate) ahead_s: f64,
}

/// One source, as a person is to see it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SourceRow {
    pub(crate) source: String,
    #[serde(serialize_with = "word")]
    pub(crate) state: FilmState,
    /// What that means.
    pub(crate) words: &'static str,
    /// Where the film is by its own time, seconds, if that is known.
    pub(crate) media_s: Option<f64>,
    /// The label of the frame that it is at, if the source has labels.
    pub(crate) timecode: Option<String>,
    /// How much faster than the clock it runs, millionths.
    pub(crate) rate_ppm: Option<f64>,
    /// Deviation of where it is, milliseconds.
    pub(crate) sigma_ms: Option<f64>,
    /// Whether it may lead seats.
    pub(crate) may_lead: bool,
    pub(crate) used: u64,
    pub(crate) rejected: u64,
    pub(crate) jumps: u64,
    pub(crate) dropouts: u64,
    /// For how long the estimate has run on while nothing was heard, in all, seconds.
    pub(crate) freewheel_s: f64,
    #[serde(flatten)]
    pub(crate) notes: SourceNotes,
}

fn word<S: Serializer>(state: &FilmState, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(state.word())
}

/// The newest table, for whoever looks.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedTable {
    newest: Arc<Mutex<FilmTable>>,
    /// The place of the source that a person chose, and 1; 0 while the ranking decides.
    chosen: Arc<AtomicUsize>,
}

impl SharedTable {
    pub(crate) fn read(&self) -> FilmTable {
        let table = self.newest.lock().unwrap_or_else(PoisonError::into_inner).clone();
        FilmTable { chosen: self.chosen(), ..table }
    }

    /// A person chooses the source of that name, or leaves it to the ranking; false where there is none.
    pub(crate) fn choose(&self, name: Option<&str>) -> bool {
        let is_it = |row: &SourceRow| Some(row.source.as_str()) == name;
        let place = self.read().sources.iter().position(is_it);
        if place.is_some() || name.is_none() {
            self.chosen.store(place.map_or(0, |place| place + 1), Ordering::Relaxed);
        }
        place.is_some() || name.is_none()
    }

    fn chosen(&self) -> Option<usize> {
        self.chosen.load(Ordering::Relaxed).checked_sub(1)
    }

    /// One that says so.
    #[cfg(test)]
    pub(crate) fn of(table: FilmTable) -> Self {
        let shared = Self::default();
        shared.put(table);
        shared
    }

    fn put(&self, table: FilmTable) {
        *self.newest.lock().unwrap_or_else(PoisonError::into_inner) = table;
    }
}

/// A source that is tracked.
struct TrackedSource {
    name: String,
    tracker: SourceTracker,
    grade: SourceGrade,
    notes: Notes,
}

impl TrackedSource {
    fn view(&mut self, now: MonoTime, allows_coarse: bool) -> SourceView {
        self.tracker.poll(now);
        let may_lead = self.grade.may_lead(&self.tracker, allows_coarse, now);
        SourceView { point: self.tracker.point(now), may_lead }
    }

    fn row(&self, view: &SourceView, now: MonoTime) -> SourceRow {
        let FilmPoint { media, rate, .. } = view.point;
        let (state, counts) = (self.tracker.state(), self.tracker.counts());
        let is_known = !matches!(state, FilmState::Absent);
        let notes = noted(&self.notes).clone();
        let code = notes.start.filter(|_| is_known).map(|start| start.at_media(media));
        let runs = matches!(state, FilmState::Locked | FilmState::Freewheeling);
        SourceRow {
            source: self.name.clone(),
            state,
            words: state.of_a_source(),
            media_s: is_known.then(|| media.as_secs_f64()),
            timecode: code.map(|code| code.to_string()),
            rate_ppm: runs.then_some((rate - 1.0) * 1e6),
            sigma_ms: self.tracker.sigma_s(now).filter(|_| runs).map(|sigma| sigma * 1e3),
            may_lead: view.may_lead,
            used: counts.used,
            rejected: counts.rejected,
            jumps: counts.jumps,
            dropouts: counts.dropouts,
            freewheel_s: counts.freewheel.as_secs_f64(),
            notes,
        }
    }
}

/// All sources of a show.
pub(super) struct Ranking {
    sources: Vec<TrackedSource>,
    allows_coarse: bool,
    chooser: Chooser,
    views: Vec<SourceView>,
    pub(super) point: Arc<PublishedPoint>,
    pub(super) table: SharedTable,
    over: bool,
    next: MonoTime,
}

impl Ranking {
    /// Those sources, of which nothing was heard yet, with the notes of each.
    pub(super) fn new(args: &[FilmArgs], notes: &[Notes], rules: SourceRules) -> Self {
        let (now, SourceRules { allows_coarse, band, freewheel }) = (Monotonic.now(), rules);
        let of = |(args, notes): (&FilmArgs, &Notes)| TrackedSource {
            name: args.source.to_string(),
            tracker: SourceTracker::new(args.source.kind(), band, now).freewheeling(freewheel),
            grade: SourceGrade::default(),
            notes: Arc::clone(notes),
        };
        let mut ranking = Self {
            sources: args.iter().zip(notes).map(of).collect(),
            allows_coarse,
            chooser: Chooser::default(),
            views: Vec::with_capacity(args.len()),
            point: Arc::default(),
            table: SharedTable::default(),
            over: false,
            next: now,
        };
        ranking.publish(now);
        ranking
    }

    /// Makes of observations where the film is, until nobody can tell any more: then the newest point grows stale.
    pub(super) fn run(mut self, heard: &Receiver<(usize, Observation)>) {
        loop {
            match heard.recv_timeout(PUBLISH_EVERY) {
                Ok((place, told)) => self.sources[place].tracker.hear(&told),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    (self.over, self.next) = (true, Monotonic.now());
                    return self.publish(self.next);
                }
            }
            self.publish(Monotonic.now());
        }
    }

    fn publish(&mut self, now: MonoTime) {
        self.views.clear();
        let allows_coarse = self.allows_coarse;
        self.views.extend(self.sources.iter_mut().map(|source| source.view(now, allows_coarse)));
        let chosen = self.chooser.choose(&self.views, self.table.chosen(), now);
        self.point.publish(&chosen.point);
        // What is heard a hundred times a second is not read that often.
        if now < self.next {
            return;
        }
        self.next = now + PUBLISH_EVERY;
        let disagrees =
            chosen.disagrees.map(|(source, ahead)| Disagreement { source, ahead_s: ahead.as_secs_f64() });
        let rows = self.sources.iter().zip(&self.views).map(|(source, view)| source.row(view, now)).collect();
        let switches = self.chooser.switches();
        let (leads, over) = (chosen.source, self.over);
        self.table.put(FilmTable { sources: rows, leads, switches, disagrees, over, chosen: None });
    }
}

impl FilmTable {
    /// Where the film is by the source that leads, if that is known and heard.
    pub(crate) fn locked_at(&self) -> Option<ShowTime> {
        let row = self.leads.and_then(|place| self.sources.get(place));
        row.filter(|row| row.state == FilmState::Locked && row.may_lead)?.media_s.map(ShowTime::from_secs_f64)
    }

    /// How the film is, if that is to be said, and where in a cue of that length, by which source; nothing where nothing is known.
    pub(crate) fn place(&self, length: ShowTime, says_state: bool) -> Option<String> {
        let row = self.sources.get(self.leads.unwrap_or(0))?;
        let place = row.media_s.map(ShowTime::from_secs_f64).map(|at| match at {
            at if at < ShowTime::ZERO => format!("{} before the cue", ShowTime::ZERO.since(at)),
            at if at > length => format!("{} behind the end of the cue", at.since(length)),
            at => format!("at {at} of the cue"),
        });
        let state = says_state.then(|| row.state.word().to_owned());
        let known: Vec<String> = state.into_iter().chain(place).collect();
        (!known.is_empty()).then(|| format!("{} by {}", known.join(", "), row.source))
    }

    /// Sources that have all ended without a position of a film.
    pub(crate) fn unheard(&self) -> Option<String> {
        let is_unheard = self.over && self.sources.iter().all(|row| row.used == 0);
        let names = || self.sources.iter().map(|row| row.source.as_str()).collect::<Vec<_>>().join(", ");
        is_unheard.then(names)
    }

    /// How long so many frames of the film last, as the source that leads has it, else the first; of 24 a second where none knows.
    pub(crate) fn frames_ms(&self, frames: i32) -> i32 {
        let rate =
            self.sources.get(self.leads.unwrap_or(0)).and_then(|row| row.notes.fps.as_ref()?.parse().ok());
        let ms = f64::from(frames) * 1e3 / rate.unwrap_or(FrameRate::F24).frames_per_second();
        #[expect(clippy::cast_possible_truncation, reason = "a dozen frames are half a second")]
        let ms = ms.round() as i32;
        ms
    }

    /// What a person should know beside where the film is: sentences that stay as they are for as long as they are true.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let name = |place: usize| self.sources.get(place).map_or("", |row| row.source.as_str());
        let apart = self.disagrees.map(|two| {
            let leads = self.leads.map_or("", name);
            format!("{} and {leads} disagree about where the film is; {leads} leads", name(two.source))
        });
        self.sources.iter().flat_map(SourceRow::warnings).chain(apart).collect()
    }
}

impl SourceRow {
    /// A source of which nothing is known but its name and state.
    #[cfg(test)]
    pub(crate) fn named(source: &str, state: FilmState) -> Self {
        Self {
            source: source.to_owned(),
            state,
            words: "",
            media_s: None,
            timecode: None,
            rate_ppm: None,
            sigma_ms: None,
            may_lead: false,
            used: 0,
            rejected: 0,
            jumps: 0,
            dropouts: 0,
            freewheel_s: 0.0,
            notes: SourceNotes::default(),
        }
    }

    fn warnings(&self) -> Vec<String> {
        let Self { source, notes, .. } = self;
        let foreign = notes
            .foreign_from
            .map(|from| format!("{source}: {from} sends as well, and is ignored; find out what it is"));
        let set = (notes.clock_steps > 0).then(|| {
            format!("{source}: the system's clock was set while the film ran; the film goes on as it was")
        });
        let sentences = [&notes.trouble, &notes.refused].into_iter().flatten();
        let sentences = sentences.map(|why| format!("{source}: {why}"));
        let coarse = (self.state == FilmState::Locked && !self.may_lead).then(|| {
            format!("{source}: too coarse for seats to follow; --allow-coarse, or allow_coarse in [sync], permits it")
        });
        sentences.chain(foreign).chain(set).chain(coarse).collect()
    }
}
