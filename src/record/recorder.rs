//! The other end of the ring: takes ticks as they come, folds them, and writes. A thread of its own, alone at the disk.

use std::io::{self, Seek, Write};
use std::time::Duration;

use mcap::McapResult;
use rtrb::Consumer;

use super::full::Block;
use super::{Chunk, Margins, RecordedSeat, Recording, SAMPLE_HZ, Sampled};
use crate::time::{Clock, MonoTime, Rate};

/// How often it looks for ticks.
const LOOK: Duration = Duration::from_millis(20);
/// How often what it has is given to the disk: so much is lost where the program is killed.
const FLUSH: Duration = Duration::from_millis(500);

/// Ticks into a file.
pub(crate) struct Recorder<W: Write + Seek> {
    ring: Consumer<u8>,
    held: Vec<u8>,
    seats: Vec<RecordedSeat>,
    fold: Sampled,
    margins: Margins,
    block: Block,
    file: Recording<W>,
    ticks: u64,
    frames: u64,
    dropped: u64,
}

impl<W: Write + Seek> Recorder<W> {
    /// One of the ring's ticks, of these seats at that rate.
    pub(crate) fn new(ring: Consumer<u8>, seats: Vec<RecordedSeat>, rate: Rate, file: Recording<W>) -> Self {
        let (fold, margins) = (Sampled::new(seats.clone(), SAMPLE_HZ), Margins::new(&seats, rate));
        let (held, block) = (Vec::new(), Block::default());
        Self { ring, held, seats, fold, margins, block, file, ticks: 0, frames: 0, dropped: 0 }
    }

    /// Records until the tick thread is over.
    ///
    /// # Errors
    /// Where writing fails; the ring fills then, and the tick thread drops what it has, as it does where nobody keeps up.
    pub(crate) fn run(mut self, clock: &impl Clock) -> McapResult<Self> {
        let mut flush_at = clock.now() + FLUSH;
        loop {
            // Asked before it is emptied: what was pushed before the end is taken.
            let is_over = self.ring.is_abandoned();
            self.take()?;
            if is_over {
                return Ok(self);
            }
            let now = clock.now();
            if now >= flush_at {
                self.flush()?;
                flush_at = now + FLUSH;
            }
            clock.sleep_until(now + LOOK);
        }
    }

    /// Takes all ticks that are there.
    ///
    /// # Errors
    /// Where writing fails.
    pub(crate) fn take(&mut self) -> McapResult<()> {
        let Self { ring, held, seats, fold, margins, block, file, ticks, frames, dropped } = self;
        held.resize(ring.slots(), 0);
        // Chunks are pushed whole, so whole ones are there.
        ring.pop_entire_slice(held).unwrap_or_default();
        let (mut rest, mut result) = (held.as_slice(), Ok(()));
        while let Some((chunk, behind)) = Chunk::parse(rest) {
            let octets = &rest[..rest.len() - behind.len()];
            rest = behind;
            *ticks += 1;
            *dropped += u64::from(chunk.dropped);
            *frames += chunk.frames().count() as u64;
            margins.take(&chunk, seats, &mut |_, _, _| ());
            fold.take(&chunk, &mut writer(file, &mut result));
            let full = if file.is_full() { block.add(&chunk, octets, seats) } else { None };
            if let (Some((at, block)), Ok(())) = (full, &result) {
                result = file.write_block(at, &block);
            }
        }
        result
    }

    /// Has what was taken so far read even of a file that is cut short.
    ///
    /// # Errors
    /// Where writing fails.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        self.file.flush()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Where writing fails.
    pub(crate) fn finish(mut self, report: Option<&[u8]>) -> McapResult<W> {
        let mut result = Ok(());
        self.fold.close(&mut writer(&mut self.file, &mut result));
        result?;
        if let Some((at, block)) = self.block.close(&self.seats) {
            self.file.write_block(at, &block)?;
        }
        let most = serde_json::to_string(&self.margins.most(&self.seats)).map_err(io::Error::from)?;
        let count = |count: u64| count.to_string();
        let end = [
            ("ticks", count(self.ticks)),
            ("frames", count(self.frames)),
            ("dropped", count(self.dropped)),
            ("most", most),
        ];
        self.file.finish(&end, report)
    }
}

/// Writes until something fails, and keeps that.
fn writer<'a, W: Write + Seek>(
    file: &'a mut Recording<W>,
    result: &'a mut McapResult<()>,
) -> impl FnMut(MonoTime, super::Message) + 'a {
    move |at, message| {
        if result.is_ok() {
            *result = file.write(at, &message);
        }
    }
}
