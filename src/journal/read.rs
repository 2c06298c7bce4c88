//! Reads lines back, whatever is in the files.

use std::io::{self, BufRead, BufReader, Read as _};

use super::files::FileId;
use super::record::Line;
use crate::sys::folder::Folder;

/// The longest line that is taken for one, bytes.
pub(super) const MAX_LINE: u64 = 1 << 20;

/// Hands every line of a file to `take`, in its order; says of those that are none where they are.
pub(super) fn each(
    folder: &Folder,
    file: FileId,
    notes: &mut Vec<String>,
    mut take: impl FnMut(Line),
) -> io::Result<()> {
    let name = file.name();
    let Some((file, _)) = folder.file(&name)? else { return Ok(()) };
    each_in(BufReader::new(file), &name, notes, &mut take)
}

/// The same of what stands in a file of that name.
pub(super) fn each_in(
    mut input: impl BufRead,
    name: &str,
    notes: &mut Vec<String>,
    take: &mut impl FnMut(Line),
) -> io::Result<()> {
    let mut line = Vec::new();
    for number in 1_u64.. {
        line.clear();
        if input.by_ref().take(MAX_LINE).read_until(b'\n', &mut line)? == 0 {
            break;
        }
        let text = line.trim_ascii();
        match serde_json::from_slice(text) {
            _ if text.is_empty() => {}
            Ok(line) => take(line),
            Err(_) => {
                let what = if line.ends_with(b"\n") { "is no record" } else { "is cut short" };
                notes.push(format!("{name}:{number}: {what}, skipped"));
            }
        }
    }
    Ok(())
}
