//! The thread behind the taps: takes what comes, and writes it to the flight recorder, to the recording of a show and to that of an
//! incident. What cannot be written is told, and tried again; it never holds up whoever it comes from.

mod halls;
mod incident;

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::mpsc::Receiver;
use std::thread::Builder;
use std::time::Duration;

use self::halls::HallNotes;
use super::AGAIN;
use super::beginning::{begun, small_file};
use super::disk::Disk;
use super::leftovers::{Leftover, clear_up};
use super::link::{RecordAsk, RecordLink, RecordPart, ShowStart};
use super::open::{OpenFile, OpenRecording};
use crate::app::recording::in_io;
use crate::config::{Record, RecordMode};
use crate::record::{
    Entry, EntryMaker, Flight, HallNote, IncidentCause, Incidents, Intake, Message, Note, Opening,
    state_number,
};
use crate::state::State;
use crate::sys::file::want_of_files;
use crate::sys::realtime;
use crate::time::{Clock, MonoTime};

/// How often it looks: once in a sample. Each time it finds what it works with out of the caches, which of a large hall costs more than
/// the rest.
const LOOK: Duration = Duration::from_millis(50);
/// How often files get what they have: so much is lost where the program is killed.
const FLUSH: Duration = Duration::from_millis(500);
/// How often they are put on the disk, what is free is looked at, and files that are too old or too many go.
const SYNC: Duration = Duration::from_secs(5);
/// A recording begins so long before its show, and ends so long after it.
const BEFORE: Duration = Duration::from_secs(10);
const AFTER: Duration = Duration::from_secs(5);
/// Asks that are taken in one look; more wait for the next.
const ASKS: usize = 256;
/// States of the hall that are kept: more than it comes to before it is told of one.
const STATES: usize = 8;

/// What the thread has.
pub(super) struct Worker {
    intake: Intake,
    asks: Receiver<(MonoTime, RecordAsk)>,
    link: RecordLink,
    opening: Opening,
    maker: EntryMaker,
    disk: Disk,
    record: Record,
    safe: Option<String>,
    flight: Option<Flight>,
    /// Samples of the last ten seconds.
    recent: VecDeque<Entry>,
    halls: HallNotes,
    /// The states that ticks told last, each with its first tick.
    states: VecDeque<(MonoTime, State)>,
    show: Option<OpenRecording>,
    incidents: Incidents,
    incident: Option<OpenFile>,
    flush_at: MonoTime,
    sync_at: MonoTime,
    closes: bool,
}

impl Worker {
    pub(super) fn new(
        intake: Intake,
        asks: Receiver<(MonoTime, RecordAsk)>,
        link: RecordLink,
        opening: Opening,
        maker: EntryMaker,
        disk: Disk,
        record: Record,
    ) -> Self {
        link.tell(|status| status.mode = record.mode.word().to_owned());
        // An incident is of what the flight recorder has.
        let keeps_ticks = record.flight_s > 0 || record.mode == RecordMode::Full;
        Self {
            intake: if keeps_ticks { intake.in_full() } else { intake },
            asks,
            link,
            opening,
            maker,
            disk,
            record,
            safe: None,
            flight: None,
            recent: VecDeque::new(),
            halls: HallNotes::default(),
            states: VecDeque::new(),
            show: None,
            incidents: Incidents::default(),
            incident: None,
            flush_at: MonoTime::default(),
            sync_at: MonoTime::default(),
            closes: false,
        }
    }

    /// The same with a text of the configuration for each file.
    pub(super) fn attaching(self, safe: Option<String>) -> Self {
        Self { safe, ..self }
    }

    /// The same with the flight recorder's file, which takes so many octets a second.
    pub(super) fn flying(mut self, path: &Path, len: u64, octets_a_s: u64) -> Self {
        if self.record.flight_s == 0 {
            return self;
        }
        match Flight::create(path, &self.opening.clone().with("of", "incident").to_octets(), len) {
            Ok(flight) => {
                self.flight = Some(flight);
                let reach_s = reach_s(len, octets_a_s).min(self.record.flight_s.into());
                self.link.tell(|status| status.flight_s = reach_s);
            }
            Err(error) => {
                let path = path.display();
                let remedy = "give the service a runtime folder (RuntimeDirectory= in the unit)";
                let trouble = format!("there is no flight recorder: {path}: {error}; {remedy}");
                self.link.trouble(RecordPart::Flight, Some(trouble));
            }
        }
        self
    }

    /// Writes anew what an earlier program left, on a thread of its own that waits while `may` says so.
    pub(super) fn clear_up(&self, leftover: Option<Leftover>, may: impl Fn() -> bool + Send + 'static) {
        let (disk, link) = (self.disk.clone(), self.link.clone());
        let cut_short = disk.cut_short();
        if leftover.is_none() && cut_short.is_empty() {
            return;
        }
        // Where there is no thread for it, it stays for the next start.
        let _ = Builder::new().name("recover".to_owned()).spawn(move || {
            realtime::stand_back();
            clear_up(&disk, &link, leftover, cut_short, &may);
        });
    }

    /// Records until the taps are gone.
    pub(super) fn run(mut self, clock: &impl Clock) {
        loop {
            // Asked before they are emptied: what was pushed before the end is taken.
            let is_over = self.intake.is_over();
            let now = clock.now();
            self.look(now);
            if is_over && self.closes {
                return self.end(now);
            }
            clock.sleep_until(now + LOOK);
        }
    }

    /// Takes what is there, and minds what is due.
    fn look(&mut self, now: MonoTime) {
        self.link.looks(now);
        // Ticks first: of what was told so far the ticks are there.
        let asks: Vec<_> = self.asks.try_iter().take(ASKS).collect();
        self.link.took(asks.len());
        self.take_taps();
        self.take_asks(asks, now);
        self.mind_ends(now);
        if now >= self.flush_at {
            self.flush(now);
            self.flush_at = now + FLUSH;
        }
        if now >= self.sync_at {
            self.tell_more_marks(now);
            self.sync(now);
            self.sync_at = now + SYNC;
        }
    }

    fn take_asks(&mut self, asks: Vec<(MonoTime, RecordAsk)>, now: MonoTime) {
        for (at, ask) in asks {
            match ask {
                RecordAsk::Keep(note) => {
                    let note = self.as_of_ticks(at, note);
                    let is_mark = matches!(note, Note::Mark(_));
                    self.keep(at, note);
                    if is_mark {
                        self.intake.marked();
                        self.link.tell(|status| status.marks += 1);
                        self.on_incident(IncidentCause::Mark, at, now);
                    }
                }
                RecordAsk::Begin(start) => self.begin(start, now),
                RecordAsk::End => {
                    if let Some(show) = &mut self.show {
                        show.until.get_or_insert(at + AFTER);
                    }
                }
                RecordAsk::Report(report) => {
                    if let Some(show) = &mut self.show {
                        show.report = Some(report);
                    }
                }
                RecordAsk::Incident(cause) => self.on_incident(cause, at, now),
                RecordAsk::Close => self.closes = true,
            }
        }
    }

    fn take_taps(&mut self) {
        let mut taken = Vec::new();
        self.intake.take(&mut |at, message| taken.push((at, message)));
        for (at, message) in &taken {
            self.write(*at, message);
        }
        for (cause, at) in self.intake.take_found() {
            self.on_incident(cause, at, at);
        }
        if let Some(written) = self.flight.as_mut().map(Flight::write) {
            let trouble =
                |error| format!("the flight recorder cannot be written: {error}; free space on its disk");
            self.link.trouble(RecordPart::Flight, written.err().map(trouble));
        }
    }

    /// A note on the hall with the state in which the tick before it was: whoever tells hears of each change some milliseconds later, and
    /// told states that were over.
    fn as_of_ticks(&self, at: MonoTime, note: Note) -> Note {
        let state = self.states.iter().rev().find(|(since, _)| *since <= at);
        match (note, state) {
            (Note::Hall(hall), Some((_, state))) => {
                Note::Hall(HallNote { state: state_number(*state), ..hall })
            }
            (note, _) => note,
        }
    }

    fn keep(&mut self, at: MonoTime, note: Note) {
        self.write(at, &Message::Note(note));
    }

    /// Gives a message to whoever keeps it.
    fn write(&mut self, at: MonoTime, message: &Message) {
        let Ok(entry) = self.maker.entry(at, message) else { return };
        if let Message::State(state) = message {
            self.states.push_back((at, *state));
            if self.states.len() > STATES {
                self.states.pop_front();
            }
        }
        if let Some(flight) = &mut self.flight {
            flight.put(&entry);
        }
        if let Some(Err(error)) = self.incident.as_mut().map(|incident| incident.file.put(&entry)) {
            self.fail_incident(&in_io(error), at);
        }
        let is_full = self.maker.is_full(entry.channel);
        if !is_full || self.record.mode == RecordMode::Full {
            let file = self.show.as_mut().and_then(|show| show.file.as_mut());
            if let Some(Err(error)) = file.map(|open| open.file.put(&entry)) {
                self.fail_show(&in_io(error), at);
            }
        }
        if matches!(message, Message::Note(Note::Hall(_))) {
            let reach = BEFORE.max(Duration::from_secs(self.record.flight_s.into()));
            self.halls.put(entry.clone(), reach);
        }
        if !is_full && self.record.mode != RecordMode::Off {
            let oldest = entry.log_time.saturating_sub(u64::try_from(BEFORE.as_nanos()).unwrap_or(u64::MAX));
            while self.recent.front().is_some_and(|one| one.log_time < oldest) {
                self.recent.pop_front();
            }
            self.recent.push_back(entry);
        }
    }

    /// A show begins; one that is still open is closed.
    fn begin(&mut self, start: ShowStart, now: MonoTime) {
        self.close_show(now);
        if self.record.mode == RecordMode::Off {
            return;
        }
        self.show =
            Some(OpenRecording { start, part: 0, file: None, again_at: None, until: None, report: None });
        self.open_part(now);
    }

    /// Opens the next file of the show that is under way.
    fn open_part(&mut self, now: MonoTime) {
        let Some(show) = &mut self.show else { return };
        let opened = self.disk.clear_out_for_more().and_then(|()| {
            let ShowStart { kind, cue, title, sha256, attached } = &show.start;
            let number = show.part + 1;
            let opening = self.opening.clone();
            let is_full = self.record.mode == RecordMode::Full;
            let opening = if is_full { opening } else { opening.sampled() };
            let opening = opening
                .with("of", *kind)
                .with("cue", cue.clone())
                .with("title", title.clone())
                .with("cue_sha256", sha256.clone())
                .with("part", number.to_string());
            let word = if cue.is_empty() { kind } else { cue.as_str() };
            let (disk, out) = self.disk.create(kind, word, number)?;
            let disk = disk.until_begun();
            // The first has what was before the show, and all of them how the hall stands.
            let before = if number == 1 { &self.recent } else { &VecDeque::new() };
            let since = before.front().map_or(u64::MAX, |first| first.log_time);
            let entries = self.halls.before(since).into_iter().chain(before);
            let mut file = begun(out, &opening, self.maker, self.safe.as_deref(), entries)?;
            if let Some(cue) = attached.as_ref().filter(|_| number == 1)
                && let Some(octets) = small_file(cue)
            {
                let name = cue.file_name().unwrap_or_default().to_string_lossy();
                file.attach(&name, "application/octet-stream", &octets).map_err(in_io)?;
            }
            file.flush().map_err(in_io)?;
            Ok((number, OpenFile { file, disk: disk.begun(), counts: self.intake.counts() }))
        });
        match opened {
            Ok((number, open)) => {
                let name = open.disk.name();
                self.link.tell(|status| status.recording = Some(name));
                self.link.trouble(RecordPart::Show, None);
                (show.part, show.file, show.again_at) = (number, Some(open), None);
            }
            Err(error) => self.fail_show(&error, now),
        }
    }

    /// The recording of a show ends early; the show does not.
    fn fail_show(&mut self, error: &io::Error, now: MonoTime) {
        let dir = self.disk.dir().display().to_string();
        if let Some(show) = &mut self.show {
            (show.file, show.again_at) = (None, Some(now + AGAIN));
        }
        self.link.tell(|status| status.recording = None);
        let room = "free space on that disk, or set [record] dir to a folder that the service may write to";
        let remedy = want_of_files(error).unwrap_or(room);
        let trouble = format!(
            "the show is not recorded: {dir}: {error}; {remedy}; the show goes on, and a new file is tried every 30 s"
        );
        self.link.trouble(RecordPart::Show, Some(trouble));
    }

    /// Closes what is over.
    fn mind_ends(&mut self, now: MonoTime) {
        if self.incidents.take_over(now) {
            self.close_incident(now);
        }
        let Some(show) = &self.show else { return };
        if show.until.is_some_and(|until| now >= until) {
            self.close_show(now);
        } else if show.again_at.is_some_and(|again| now >= again) {
            self.open_part(now);
        } else if show
            .file
            .as_ref()
            .is_some_and(|open| open.disk.len() >> 20 >= u64::from(self.record.part_mib))
        {
            self.cut();
            // The next is open before the last is closed.
            let before = self.show.as_mut().and_then(|show| show.file.take());
            self.open_part(now);
            if let Some(Err(error)) = before.map(|open| self.close_file(open, None)) {
                let trouble = format!("a part of a recording is incomplete: {error}; look at that disk");
                self.link.trouble(RecordPart::Show, Some(trouble));
            }
        }
    }

    /// Gives what is not over to the files, of which one ends: it has all that was counted for it.
    fn cut(&mut self) {
        let mut rest = Vec::new();
        self.intake.close(&mut |at, message| rest.push((at, message)));
        for (at, message) in &rest {
            self.write(*at, message);
        }
    }

    fn close_show(&mut self, now: MonoTime) {
        if self.show.is_some() {
            self.tell_more_marks(now);
            self.cut();
        }
        let Some(OpenRecording { file, report, .. }) = self.show.take() else { return };
        // What a show's file has is in no other: the counts of the next would not be its own.
        self.recent.clear();
        self.link.tell(|status| status.recording = None);
        match file.map(|open| self.close_file(open, report.as_deref())) {
            Some(Err(error)) => self.fail_show(&error, now),
            // What was wrong with it is over, as the log and its files say.
            _ => self.link.trouble(RecordPart::Show, None),
        }
    }

    fn close_file(&self, open: OpenFile, report: Option<&[u8]>) -> io::Result<()> {
        let OpenFile { file, disk, counts } = open;
        let end = self.intake.end_since(&counts);
        let out = file.finish(&end, report).map_err(in_io)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?;
        let len = disk.len();
        let name = disk.name();
        disk.close()?;
        self.link.tell(|status| {
            status.bytes += len;
            status.last = Some(name);
        });
        Ok(())
    }

    fn flush(&mut self, now: MonoTime) {
        if let Some(Err(error)) = self.incident.as_mut().map(|open| open.file.flush()) {
            self.fail_incident(&in_io(error), now);
        }
        let file = self.show.as_mut().and_then(|show| show.file.as_mut());
        let flushed = file.map(|open| open.file.flush().map_err(in_io).and_then(|()| open.disk.is_there()));
        if let Some(Err(error)) = flushed {
            self.fail_show(&error, now);
        }
        let counts = self.intake.counts();
        self.link.tell(|status| {
            (status.dropped_ticks, status.dropped_records) = (counts.dropped, counts.dropped_records);
        });
    }

    fn sync(&mut self, now: MonoTime) {
        if let Ok(free) = self.disk.free() {
            self.link.tell(|status| status.free_bytes = free);
            if let Ok(room) = self.disk.room(free) {
                self.link.has_room(room);
                self.link.trouble(RecordPart::Room, (room == 0).then(|| self.disk.unreached()));
            }
        }
        let file = self.show.as_ref().and_then(|show| show.file.as_ref());
        let Some(open) = file else { return };
        let kept = open.disk.sync().and_then(|()| self.disk.clear_out_for_more());
        if let Err(error) = kept {
            self.fail_show(&error, now);
        }
    }

    fn end(mut self, now: MonoTime) {
        self.close_show(now);
        self.close_incident(now);
        self.link.tell(|status| (status.recording, status.flight_s) = (None, 0.0));
        self.link.ends();
    }
}

/// How far back a file of that length reaches where a second takes so many octets.
#[expect(clippy::cast_precision_loss, reason = "far fewer octets than a double counts")]
fn reach_s(len: u64, octets_a_s: u64) -> f64 {
    len as f64 / octets_a_s as f64
}

#[cfg(test)]
mod tests;
