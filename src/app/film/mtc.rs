//! MIDI timecode from a raw device or a FIFO: bytes as they come, each read stamped with the instant at which it was.

use std::fs::File;
use std::io::{self, Read as _};
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

use super::{FilmError, LeftRead, WordSink, start};
use crate::film::mtc::MtcReader;
use crate::film::source::FilmArgs;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Begins to read a line of MIDI; a device that is pulled out may come back, a FIFO have another writer.
pub(super) fn start_reading(path: &Path, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let failed = |source| FilmError::Open { what: path.display().to_string(), source };
    let kind = path.metadata().map_err(failed)?.file_type();
    if !kind.is_fifo() && !kind.is_char_device() {
        let why = "it is neither a raw MIDI device nor a FIFO";
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, why)));
    }
    let line = MidiLine { path: path.to_path_buf(), args: args.clone(), told };
    start("mtc", move || {
        while line.told.again(LeftRead::open(&line.path, &line.told).and_then(|bytes| line.read(bytes))) {}
    })?;
    Ok(())
}

struct MidiLine {
    path: PathBuf,
    args: FilmArgs,
    told: WordSink,
}

impl MidiLine {
    /// One line, from its begin to its end, or until nobody listens.
    fn read(&self, mut line: LeftRead<File>) -> io::Result<()> {
        let mut reader = MtcReader::new(self.args.rate, self.args.start);
        let mut bytes = [0; 256];
        self.told.note(|notes| notes.trouble = None);
        loop {
            let count = line.read(&mut bytes)?;
            if count == 0 {
                return Ok(());
            }
            let (at, mut is_heard) = (Monotonic.now(), true);
            for byte in &bytes[..count] {
                reader.hear(*byte, at, &mut |what| is_heard &= self.told.tell(what));
            }
            self.told.note(|notes| {
                notes.label(reader.labels());
            });
            if !is_heard {
                return Ok(());
            }
        }
    }
}
