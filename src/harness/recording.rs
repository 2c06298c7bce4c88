//! A recorder without a hall: both taps, and what is behind them.

use std::fs::File;
use std::io::{BufWriter, Result};
use std::path::Path;

use crate::record::{
    self, About, AckRecord, AckTap, Chunk, Entry, EntryMaker, Flight, Handed, Intake, Opening, RecordedSeat,
    Recording, SentFrame, Tap, Taps, Wanted,
};
use crate::time::{MonoTime, Rate};
use crate::tracker::{Fate, Reply};
use crate::wire::{FrameNo, ReplyCode};

/// What takes from the taps into a flight recorder.
#[derive(Debug)]
pub struct RecorderRig {
    intake: Intake,
    flight: Flight,
    maker: EntryMaker,
    opening: Opening,
}

impl RecorderRig {
    /// One of these seats, with a file of that size.
    pub fn new(seats: Vec<RecordedSeat>, rate: Rate, path: &Path, room: u64) -> (Tap, AckTap, Self) {
        let clocks = (MonoTime::default(), 0);
        let about = About::of_hall("bench", rate, clocks);
        let (opening, maker) = (Opening::new(&about, &seats), EntryMaker::new(seats.len(), clocks));
        let flight = Flight::create(path, &opening.to_octets(), room).expect("there is room");
        let (Taps { ticks, acks }, intake) = Intake::new(seats, rate, 20);
        (ticks, acks, Self { intake: intake.in_full(), flight, maker, opening })
    }

    /// Takes all that is there; gives how many octets of messages that made.
    pub fn take(&mut self) -> u64 {
        let Self { intake, flight, maker, .. } = self;
        let mut octets = 0;
        intake.take(&mut |at, message| {
            let entry: Entry = maker.entry(at, &message).expect("figures");
            octets += entry.data.len() as u64;
            flight.put(&entry);
        });
        flight.write().expect("there is room");
        octets
    }

    /// Writes what it holds to a file; gives how many messages that were.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn incident(&self, path: &Path) -> Result<usize> {
        let entries = self.flight.read()?;
        let out = BufWriter::new(File::create(path)?);
        let mut file = Recording::open(out, &self.opening, self.maker).map_err(std::io::Error::other)?;
        for some in entries.chunks(100) {
            some.iter().try_for_each(|entry| file.put(entry)).map_err(std::io::Error::other)?;
            file.flush().map_err(std::io::Error::other)?;
        }
        let out = file.finish(&[], None).map_err(std::io::Error::other)?;
        out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()?;
        Ok(entries.len())
    }

    /// Ticks and records that found no room.
    pub const fn dropped(&self) -> (u64, u64) {
        let counts = self.intake.counts();
        (counts.dropped, counts.dropped_records)
    }
}

/// The frames of a recording of whole ticks: lane, octets and whether the kernel took it, in the order in which they left.
#[must_use]
pub fn datagrams(file: &[u8]) -> Vec<(usize, Vec<u8>, bool)> {
    let mut all = Vec::new();
    let mut take = |_: &record::Contents, _, told: record::Told<'_>| {
        let record::Told::Chunks(octets) = told else { return };
        let mut rest = octets.as_slice();
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            rest = behind;
            let frame =
                |frame: SentFrame<'_>| (frame.lane, frame.datagram.to_vec(), frame.handed != Handed::Refused);
            all.extend(chunk.frames().map(frame));
        }
    };
    record::read(file, Wanted::ALL, &mut take).expect("a recording");
    all
}

/// The ack thread takes a reply to a frame of a controller, and says what it was.
pub fn reply(tap: &mut AckTap, controller: usize, frame: FrameNo, at: MonoTime) {
    let reply = Reply { controller, frame, code: ReplyCode::Running, error: 0, inputs: 0, at };
    tap.take(&AckRecord::Reply(reply));
    tap.take(&AckRecord::Fate(controller, frame, Fate::Answered(reply.code), 150_000));
}

/// A drain is over.
pub fn drained(tap: &mut AckTap, at: MonoTime) {
    tap.drained(at);
}
