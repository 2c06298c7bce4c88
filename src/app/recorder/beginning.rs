//! What a file of a recording begins with.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use crate::app::recording::in_io;
use crate::record::{Entry, EntryMaker, Opening, Recording};
use crate::sys::file;

/// The largest cue that is attached, octets.
const MOST_ATTACHED: u64 = 64 << 20;

/// A recording with what was before it, and the text of the configuration.
pub(super) fn begun<'a>(
    out: BufWriter<File>,
    opening: &Opening,
    maker: EntryMaker,
    safe: Option<&str>,
    entries: impl Iterator<Item = &'a Entry>,
) -> io::Result<Recording<BufWriter<File>>> {
    let mut file = Recording::open(out, opening, maker).map_err(in_io)?;
    for entry in entries {
        file.put(entry).map_err(in_io)?;
    }
    if let Some(safe) = safe {
        file.attach("configuration.toml", "application/toml", safe.as_bytes()).map_err(in_io)?;
    }
    Ok(file)
}

/// A file of a size that is attached.
pub(super) fn small_file(path: &Path) -> Option<Vec<u8>> {
    file::read(path, MOST_ATTACHED).ok()
}
