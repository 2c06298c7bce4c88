//! MIDI timecode from a raw device, a FIFO or a relay: bytes as they come, and when they were read, into what they say of the film.

use std::io;

use super::line::{ByteLine, LineTaker, RELAY};
use super::{FilmError, WantedFile, WordSink, is_line, start};
use crate::film::mtc::MtcReader;
use crate::film::source::{FilmArgs, LineKind, MtcInput};
use crate::time::MonoTime;

const DEVICE: WantedFile = WantedFile {
    is_one: is_line,
    other: "it is neither a raw MIDI device nor a FIFO",
    remedy: "see with `ls /dev/snd/midi*` which devices there are",
};

/// Begins to read a line of MIDI as timecode.
pub(super) fn start_reading(input: &MtcInput, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let (args, sink) = (args.clone(), told.clone());
    let open = move || MtcTaker { told: sink.clone(), reader: MtcReader::new(args.rate, args.start) };
    start_line(input, ByteLine::new(told, open))
}

/// Begins to read a line of MIDI; a device that is pulled out may come back, a FIFO have another writer.
pub(super) fn start_line(input: &MtcInput, line: ByteLine) -> Result<(), FilmError> {
    match input {
        MtcInput::Relay(socket) => {
            let socket = RELAY.check_if_there(socket)?;
            start("mtc", move || while line.told.again(line.read_relayed(&socket, LineKind::Mtc)) {})?;
        }
        MtcInput::Device(path) => {
            let path = DEVICE.check(path)?;
            start("mtc", move || while line.told.again(line.read_at(&path)) {})?;
        }
    }
    Ok(())
}

/// Hears timecode in the bytes of a line.
struct MtcTaker {
    told: WordSink,
    reader: MtcReader,
}

impl LineTaker for MtcTaker {
    fn take(&mut self, bytes: &[u8], at: MonoTime) -> io::Result<()> {
        self.reader.hear(bytes, at, &mut |what| {
            self.told.tell(what);
        });
        self.told.note(|notes| notes.label(self.reader.labels()));
        Ok(())
    }
}
