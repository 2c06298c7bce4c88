//! MIDI timecode from a raw device, a FIFO or a relay: bytes as they come, and when they were read, into what they say of the film.

use std::io;
use std::os::unix::fs::FileTypeExt as _;
use std::path::Path;

use super::line::{ByteLine, LineTaker};
use super::{FilmError, WordSink, start};
use crate::film::mtc::MtcReader;
use crate::film::source::{FilmArgs, LineKind, MtcInput};
use crate::time::MonoTime;

/// Begins to read a line of MIDI as timecode.
pub(super) fn start_reading(input: &MtcInput, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let (args, sink) = (args.clone(), told.clone());
    let open = move || MtcTaker { told: sink.clone(), reader: MtcReader::new(args.rate, args.start) };
    start_line(input, ByteLine::new(told, open))
}

/// Begins to read a line of MIDI; a device that is pulled out may come back, a FIFO have another writer.
pub(super) fn start_line(input: &MtcInput, line: ByteLine) -> Result<(), FilmError> {
    match input.clone() {
        MtcInput::Relay(socket) => {
            start("mtc", move || while line.told.again(line.read_relayed(&socket, LineKind::Mtc)) {})?;
        }
        MtcInput::Device(path) => {
            check(&path).map_err(|source| FilmError::Open { what: path.display().to_string(), source })?;
            start("mtc", move || while line.told.again(line.read_at(&path)) {})?;
        }
    }
    Ok(())
}

fn check(path: &Path) -> io::Result<()> {
    let kind = path.metadata()?.file_type();
    if kind.is_fifo() || kind.is_char_device() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "it is neither a raw MIDI device nor a FIFO"))
}

/// Hears timecode in the bytes of a line.
struct MtcTaker {
    told: WordSink,
    reader: MtcReader,
}

impl LineTaker for MtcTaker {
    fn take(&mut self, bytes: &[u8], at: MonoTime) -> io::Result<()> {
        for byte in bytes {
            self.reader.hear(*byte, at, &mut |what| {
                self.told.tell(what);
            });
        }
        self.told.note(|notes| notes.label(self.reader.labels()));
        Ok(())
    }
}
