//! What the journal says of shows beyond what somebody has been told already: it is the queue of those who pass it on.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::files::{self, FileKind};
use super::read::MAX_LINE;
use super::report::JournalError;
use crate::sys::folder::Folder;

/// Files of which it is remembered how much was told: a clock that is set back has the journal go on in an older one.
pub(crate) const TOLD_FILES: usize = 4;

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

/// The first `most` lines that are not among those that were `told`: so many of each file, by its name. Where these are
/// [`TOLD_FILES`], what is older than all of them was told; where they are fewer, a clock that ran ahead has been set back. A line that
/// has no end yet is left for the next time, and one that is no record is passed over.
///
/// # Errors
/// [`JournalError`] where the folder or a file of it cannot be read. No records are no error.
pub(crate) fn tail(
    dir: &Path,
    told: &BTreeMap<String, u64>,
    most: usize,
) -> Result<Vec<JournalPart>, JournalError> {
    let gather = || -> io::Result<Vec<JournalPart>> {
        let folder = Folder::open(dir)?;
        let names = files::all(&folder)?.into_iter().filter(|file| file.kind == FileKind::Shows);
        let oldest = told.first_key_value().filter(|_| told.len() >= TOLD_FILES).map(|(name, _)| name);
        let mut parts = Vec::new();
        for name in names.map(files::FileId::name) {
            let is_told = oldest.is_some_and(|oldest| name < *oldest);
            if !is_told && parts.len() < most {
                of_file(&folder, &name, told.get(&name).copied().unwrap_or(0), most, &mut parts)?;
            }
        }
        Ok(parts)
    };
    gather().map_err(|source| JournalError { path: dir.to_owned(), source })
}

/// Adds the lines of a file behind the first `told`, until there are `most`.
fn of_file(
    folder: &Folder,
    name: &str,
    told: u64,
    most: usize,
    parts: &mut Vec<JournalPart>,
) -> io::Result<()> {
    let Some((file, _)) = folder.file(name)? else { return Ok(()) };
    told_in(BufReader::new(file), name, told, most, parts)
}

/// The same of what stands in a file of that name.
pub(super) fn told_in(
    mut input: impl BufRead,
    name: &str,
    told: u64,
    most: usize,
    parts: &mut Vec<JournalPart>,
) -> io::Result<()> {
    let mut text = Vec::new();
    let mut line = 0;
    while parts.len() < most {
        text.clear();
        input.by_ref().take(MAX_LINE).read_until(b'\n', &mut text)?;
        if !text.ends_with(b"\n") && text.len() as u64 != MAX_LINE {
            break;
        }
        line += 1;
        if line > told
            && let Ok(record) = serde_json::from_slice(text.trim_ascii())
        {
            parts.push(JournalPart { file: name.to_owned(), line, record });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn told(of: &[(&str, u64)]) -> BTreeMap<String, u64> {
        of.iter().map(|&(file, lines)| (file.to_owned(), lines)).collect()
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
        let of = |told: &BTreeMap<String, u64>, most| -> Vec<_> {
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
}
