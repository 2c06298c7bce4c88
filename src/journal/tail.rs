//! What the journal says of shows beyond what somebody has been told already: it is the queue of those who pass it on.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::files::{self, FileKind};
use super::read::MAX_LINE;
use super::report::JournalError;
use crate::sys::folder::Folder;

/// Files of which it is remembered how much was told: a clock that is set back has the journal go on in an older one.
pub(crate) const TOLD_FILES: usize = 4;
/// Lines that are told at a time.
pub(crate) const TOLD_AT_ONCE: usize = 100;
/// The longest text that has them, octets.
pub(crate) const LONGEST_TOLD: u64 = (TOLD_AT_ONCE as u64 + 1) * 2 * MAX_LINE;

/// How much of a journal was told.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Told {
    /// Lines of each file, by its name.
    pub(crate) lines: BTreeMap<String, u64>,
    /// The last line that was told.
    pub(crate) last: Option<LastTold>,
}

/// A line that was told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LastTold {
    file: String,
    line: u64,
    /// Of what it says.
    print: u64,
}

/// A line about shows, or about starts of the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct JournalPart {
    /// The name of its file.
    pub(crate) file: String,
    /// Its number there, from 1.
    pub(crate) line: u64,
    /// What it says.
    pub(crate) record: Value,
}

impl From<&JournalPart> for LastTold {
    fn from(part: &JournalPart) -> Self {
        Self { file: part.file.clone(), line: part.line, print: print(&part.record) }
    }
}

fn print(record: &Value) -> u64 {
    let [a, b, c, d, e, f, g, h, ..] = <[u8; 32]>::from(Sha256::digest(record.to_string()));
    u64::from_be_bytes([a, b, c, d, e, f, g, h])
}

/// The first `most` lines that were not `told`. Where there are [`TOLD_FILES`] files, what is older than all of them was told; where they are
/// fewer, a clock that ran ahead has been set back. A line that has no end yet is left for the next time, and one that is no record is passed
/// over. A file that has fewer lines than were told of it, or another one in the place of the last, was lost and begun anew: it is told from
/// its first line.
///
/// # Errors
/// [`JournalError`] where the folder or a file of it cannot be read. No records are no error.
pub(crate) fn tail(dir: &Path, told: &Told, most: usize) -> Result<Vec<JournalPart>, JournalError> {
    let gather = || -> io::Result<Vec<JournalPart>> {
        let folder = Folder::open(dir)?;
        let names = files::all(&folder)?.into_iter().filter(|file| file.kind == FileKind::Shows);
        let is_whole = told.lines.len() >= TOLD_FILES;
        let oldest = told.lines.first_key_value().filter(|_| is_whole).map(|(name, _)| name);
        let mut parts = Vec::new();
        for name in names.map(files::FileId::name) {
            let is_told = oldest.is_some_and(|oldest| name < *oldest);
            if !is_told && parts.len() < most {
                of_file(&folder, &name, told, most, &mut parts)?;
            }
        }
        Ok(parts)
    };
    gather().map_err(|source| JournalError { path: dir.to_owned(), source })
}

/// Adds the lines of a file behind those that were told of it, until there are `most`.
fn of_file(
    folder: &Folder,
    name: &str,
    told: &Told,
    most: usize,
    parts: &mut Vec<JournalPart>,
) -> io::Result<()> {
    let lines = told.lines.get(name).copied().unwrap_or(0);
    let last = told.last.as_ref().filter(|last| last.file == name && last.line == lines);
    for lines in [lines, 0] {
        let Some((file, _)) = folder.file(name)? else { break };
        if told_in(BufReader::new(file), name, (lines, last), most, parts)? {
            break;
        }
    }
    Ok(())
}

/// The same of what stands in a file of that name, of which so many lines were told. False, and nothing added, if these were of another one.
pub(super) fn told_in(
    mut input: impl BufRead,
    name: &str,
    (told, last): (u64, Option<&LastTold>),
    most: usize,
    parts: &mut Vec<JournalPart>,
) -> io::Result<bool> {
    let mut text = Vec::new();
    let mut line = 0;
    while parts.len() < most {
        text.clear();
        input.by_ref().take(MAX_LINE).read_until(b'\n', &mut text)?;
        if !text.ends_with(b"\n") && text.len() as u64 != MAX_LINE {
            break;
        }
        line += 1;
        if line < told {
            continue;
        }
        let record: Option<Value> = serde_json::from_slice(text.trim_ascii()).ok();
        if line > told {
            parts.extend(record.map(|record| JournalPart { file: name.to_owned(), line, record }));
        } else if last.is_some_and(|last| record.as_ref().map(print) != Some(last.print)) {
            return Ok(false);
        }
    }
    Ok(line >= told)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn told(of: &[(&str, u64)]) -> Told {
        Told { lines: of.iter().map(|&(file, lines)| (file.to_owned(), lines)).collect(), last: None }
    }

    #[test]
    fn each_whole_line_of_shows_is_told_once_and_in_its_order() {
        const ONE: &str = "kinocue-2026-11-20-000.jsonl";
        const TWO: &str = "kinocue-2026-11-21-000.jsonl";
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(dir.path().join(name), text).unwrap();
        write(ONE, "{\"kind\":\"start\"}\n{\"kind\":\"be\n{\"kind\":\"begin\"}\n");
        write(TWO, "{\"kind\":\"show\"}\n{\"kind\":\"lo");
        write("kinocue-asked-2026-11-21-000.jsonl", "{\"kind\":\"action\"}\n");
        write("notes.txt", "{}\n");
        let of = |told: &Told, most| -> Vec<_> {
            let parts = tail(dir.path(), told, most).unwrap();
            parts.into_iter().map(|part| (part.file, part.line, part.record["kind"].to_string())).collect()
        };
        let all = of(&told(&[]), 10);
        assert_eq!(
            all.iter().map(|(file, line, kind)| (file.as_str(), *line, kind.as_str())).collect::<Vec<_>>(),
            [(ONE, 1, "\"start\""), (ONE, 3, "\"begin\""), (TWO, 1, "\"show\"")]
        );
        assert_eq!(of(&told(&[]), 2), all[..2]);
        assert_eq!(of(&told(&[(ONE, 1)]), 10), all[1..]);
        let later: Vec<_> = (22..25).map(|day| format!("kinocue-2026-11-{day}-000.jsonl")).collect();
        let four: Vec<_> =
            [TWO].into_iter().chain(later.iter().map(String::as_str)).map(|name| (name, 0)).collect();
        assert_eq!(of(&told(&four), 10), all[2..], "what is older was told");
        assert_eq!(
            of(&told(&four[1..]), 10),
            all,
            "a clock ran ahead, and was set back before any of these days"
        );
        assert_eq!(of(&told(&[(ONE, 3), (TWO, 1)]), 10), []);
        write(TWO, "{\"kind\":\"show\"}\n{\"kind\":\"lost\"}\n");
        assert_eq!(of(&told(&[(ONE, 3), (TWO, 1)]), 10), [(TWO.to_owned(), 2, "\"lost\"".to_owned())]);
        // A clock that was set back.
        write(ONE, "{}\n\n{\"kind\":\"begin\"}\n{\"kind\":\"show\"}\n");
        assert_eq!(of(&told(&[(ONE, 3), (TWO, 2)]), 10), [(ONE.to_owned(), 4, "\"show\"".to_owned())]);
        assert!(tail(&dir.path().join("gone"), &told(&[]), 1).is_err());
    }

    #[test]
    fn a_file_that_was_lost_and_begun_anew_is_told_from_its_first_line() {
        const NAME: &str = "kinocue-2026-11-20-000.jsonl";
        let dir = tempfile::tempdir().unwrap();
        let write = |text: &str| fs::write(dir.path().join(NAME), text).unwrap();
        let numbers = |told: &Told| -> Vec<_> {
            tail(dir.path(), told, 10).unwrap().into_iter().map(|part| part.record["n"].clone()).collect()
        };
        write("{\"n\":1}\n{\"n\":2}\n{\"n\":3}\n");
        let last = tail(dir.path(), &told(&[(NAME, 1)]), 1).unwrap().pop();
        assert_eq!(last.as_ref().map(|last| last.line), Some(2));
        let told = Told { last: last.as_ref().map(LastTold::from), ..told(&[(NAME, 2)]) };
        assert_eq!(numbers(&told), [3]);
        write("{\"n\":7}\n");
        assert_eq!(numbers(&told), [7], "it is shorter than what was told");
        write("{\"n\":7}\n{\"n\":8}\n{\"n\":9}\n");
        assert_eq!(numbers(&told), [7, 8, 9], "another line is where the last one was");
        write("{\"n\":1}\n{\"n\":2}\n");
        assert_eq!(numbers(&told), [0; 0]);
    }
}
