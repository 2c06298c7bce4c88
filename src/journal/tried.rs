//! What any octets come to where they stand in a file of the journal. For tests and fuzzing.

use jiff::civil::Date;
use serde_json::Value;

use super::chain::{Chain, JournalKeys};
use super::files::FileKind;
use super::read::LinePlace;
use super::record::Line;
use super::report::{Days, MOST_NOTES, ReportBounds};
use super::{JournalPart, read, tail};

const NAME: &str = "kinocue-2026-11-20-000.jsonl";
const IN_MEMORY: &str = "octets in memory can be read";

/// Nothing of it grows over its bounds, and lines that are passed on are each told once.
pub(crate) fn try_file(octets: &[u8]) {
    let mut days = Days::new(Date::MIN, Date::MAX, ReportBounds { shows: 3, actions: 3 });
    let (mut notes, mut lines) = (Vec::new(), 0);
    let mut chain = Chain::new(FileKind::Shows, JournalKeys::default(), None);
    let mut take = |json: &Value, line: Option<Line>, place: &LinePlace| {
        let counts = chain.take(json, line.as_ref(), place);
        if let Some(line) = line.filter(|_| counts) {
            lines += 1;
            days.take(line);
        }
    };
    read::each_in(octets, (NAME, Date::constant(2026, 11, 20)), &mut notes, &mut take).expect(IN_MEMORY);
    chain.close();
    assert!(lines + notes.len() <= octets.len());
    days.note(notes);
    let report = days.report(true);
    assert!(report.shows.len() <= 3 && report.actions.len() <= 3 && report.notes.len() <= MOST_NOTES + 3);
    serde_json::to_vec(&report).expect("a report is text and numbers");
    let mut at_once = Vec::new();
    tail::told_in(octets, NAME, (0, None), usize::MAX, &mut at_once).expect(IN_MEMORY);
    let mut in_parts: Vec<JournalPart> = Vec::new();
    loop {
        // As an engine gives it back.
        let last =
            in_parts.last().map(|part| serde_json::to_vec(part).expect("a record is text and numbers"));
        let last = last.map(|text| serde_json::from_slice::<JournalPart>(&text).expect("it was one"));
        let before = in_parts.len();
        let (line, last) =
            (last.as_ref().map_or(0, |last| last.line), last.as_ref().map(tail::LastTold::from));
        assert!(
            tail::told_in(octets, NAME, (line, last.as_ref()), before + 100, &mut in_parts).expect(IN_MEMORY)
        );
        if in_parts.len() == before {
            break;
        }
    }
    assert_eq!(in_parts, at_once);
}
