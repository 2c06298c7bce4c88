//! Incidents: files with what the flight recorder holds and what comes after; and of marks those that are one too many.

use std::io;

use super::super::beginning::begun;
use super::super::link::RecordPart;
use super::super::open::OpenFile;
use super::Worker;
use crate::app::recording::in_io;
use crate::record::{Counts, EventNote, IncidentCause, IncidentStep, Note};
use crate::sys::file::want_of_files;
use crate::time::MonoTime;

impl Worker {
    /// Says how many marks were one too many, since that was said last.
    pub(super) fn tell_more_marks(&mut self, now: MonoTime) {
        let more = self.link.take_more_marks();
        if more > 0 {
            let text = format!("and {more} more marks");
            self.keep(now, Note::Event(EventNote { kind: "marks", seat: String::new(), text }));
        }
    }

    pub(super) fn fail_incident(&mut self, error: &io::Error, now: MonoTime) {
        // Its file, or the folder where there is none yet.
        let file = self.incident.take().map_or_else(|| self.disk.dir().to_owned(), |open| open.disk.path);
        self.incidents.give_up(now);
        let file = file.display();
        let remedy = want_of_files(error).unwrap_or("free space on that disk, or set [record] dir");
        let trouble = format!("an incident is not kept: {file}: {error}; {remedy}");
        self.link.trouble(RecordPart::Incident, Some(trouble));
    }

    /// Something is worth an incident.
    pub(super) fn on_incident(&mut self, cause: IncidentCause, at: MonoTime, now: MonoTime) {
        if self.flight.is_none() {
            return;
        }
        match self.incidents.on(cause, at) {
            IncidentStep::TooMany => {}
            IncidentStep::Join => self.say_incident(cause, now),
            IncidentStep::Begin => match self.begin_incident(cause, at) {
                Ok(()) => self.say_incident(cause, now),
                Err(error) => self.fail_incident(&error, now),
            },
        }
    }

    fn say_incident(&mut self, cause: IncidentCause, now: MonoTime) {
        self.link.count(cause);
        let event = EventNote { kind: "incident", seat: String::new(), text: cause.word().to_owned() };
        self.keep(now, Note::Event(event));
    }

    /// Begins a file with all that the flight recorder holds.
    fn begin_incident(&mut self, cause: IncidentCause, at: MonoTime) -> io::Result<()> {
        let Some(flight) = &mut self.flight else { return Ok(()) };
        flight.write()?;
        self.disk.clear_out_for_more()?;
        let (disk, out) = self.disk.create_incident(cause)?;
        let disk = disk.until_begun();
        let opening = self.opening.clone().with("of", "incident").with("cause", cause.word());
        let opening = opening.with("caused_ns", at.as_nanos().to_string());
        let oldest = self.maker.wall(at).saturating_sub(1_000_000_000 * u64::from(self.record.flight_s));
        let held = flight.read()?;
        let since = held.first().map_or(oldest, |first| first.log_time.max(oldest));
        // How the hall stood then, not how it stands by now.
        let entries =
            self.halls.before(since).into_iter().chain(held.iter().filter(|entry| entry.log_time >= oldest));
        let mut file = begun(out, &opening, self.maker, self.safe.as_deref(), entries)?;
        file.flush().map_err(in_io)?;
        self.incident = Some(OpenFile { file, disk: disk.begun(), counts: Counts::default() });
        self.link.trouble(RecordPart::Incident, None);
        Ok(())
    }

    pub(super) fn close_incident(&mut self, now: MonoTime) {
        if self.incident.is_some() {
            self.tell_more_marks(now);
        }
        self.cut();
        if let Some(Err(error)) = self.incident.take().map(|open| self.close_file(open, None)) {
            self.fail_incident(&error, now);
        }
    }
}
