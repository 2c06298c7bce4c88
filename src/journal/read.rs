//! Reads lines back, whatever is in the files.

use std::io::{self, BufRead, BufReader, Read as _};

use jiff::civil::Date;
use serde::Deserialize as _;
use serde_json::Value;

use super::files::FileId;
use super::record::Line;
use crate::sys::folder::Folder;

/// The longest line that is taken for one, bytes.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Where a line stands, in words, and in the file of which day; who is told of it elsewhere has no file.
#[derive(Debug, Clone)]
pub(super) struct LinePlace {
    pub(super) words: String,
    pub(super) day: Option<Date>,
}

/// Hands every line of a file to `take`, in its order, with its JSON and where it stands; says of those that are none where they are.
pub(super) fn each(
    folder: &Folder,
    id: FileId,
    notes: &mut Vec<String>,
    mut take: impl FnMut(&Value, Option<Line>, &LinePlace),
) -> io::Result<()> {
    let name = id.name();
    let Some((file, _)) = folder.file(&name)? else { return Ok(()) };
    each_in(BufReader::new(file), (&name, id.day), notes, &mut take)
}

/// The same of what stands in a file of that name.
pub(super) fn each_in(
    mut input: impl BufRead,
    (name, day): (&str, Date),
    notes: &mut Vec<String>,
    take: &mut impl FnMut(&Value, Option<Line>, &LinePlace),
) -> io::Result<()> {
    let mut line = Vec::new();
    for number in 1_u64.. {
        line.clear();
        if input.by_ref().take(MAX_LINE).read_until(b'\n', &mut line)? == 0 {
            break;
        }
        let text = line.trim_ascii();
        if text.is_empty() {
            continue;
        }
        let json = serde_json::from_slice::<Value>(text).ok();
        let record = json.as_ref().and_then(|json| Line::deserialize(json).ok());
        if record.is_none() {
            let what = if line.ends_with(b"\n") { "is no record" } else { "is cut short" };
            notes.push(format!("{name}:{number}: {what}, skipped"));
        }
        // A later version may have written what this one does not know: it has its place in the chain.
        if let Some(json) = &json {
            take(json, record, &LinePlace { words: format!("{name}:{number}"), day: Some(day) });
        }
    }
    Ok(())
}
