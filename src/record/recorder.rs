//! What comes through the rings into a file. A thread of its own, alone at the disk.

use std::io::{Seek, Write};
use std::time::Duration;

use mcap::McapResult;

use super::{Intake, Message, Recording};
use crate::time::{Clock, MonoTime};

/// How often it looks for ticks.
const LOOK: Duration = Duration::from_millis(50);
/// How often what it has is given to the disk: so much is lost where the program is killed.
const FLUSH: Duration = Duration::from_millis(500);

/// Ticks and drains into a file.
pub(crate) struct Recorder<W: Write + Seek> {
    intake: Intake,
    file: Recording<W>,
}

impl<W: Write + Seek> Recorder<W> {
    /// One of what comes in.
    pub(crate) const fn new(intake: Intake, file: Recording<W>) -> Self {
        Self { intake, file }
    }

    /// Records until tick and ack thread are over.
    ///
    /// # Errors
    /// Where writing fails; the rings fill then, and the threads drop what they have, as they do where nobody keeps up.
    pub(crate) fn run(mut self, clock: &impl Clock) -> McapResult<Self> {
        let mut flush_at = clock.now() + FLUSH;
        loop {
            // Asked before they are emptied: what was pushed before the end is taken.
            let is_over = self.intake.is_over();
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

    /// Takes all that is there.
    ///
    /// # Errors
    /// Where writing fails.
    pub(crate) fn take(&mut self) -> McapResult<()> {
        let mut result = Ok(());
        self.intake.take(&mut writer(&mut self.file, &mut result));
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
        self.intake.close(&mut writer(&mut self.file, &mut result));
        result?;
        self.file.finish(&self.intake.end(), report)
    }
}

/// Writes until something fails, and keeps that.
fn writer<'a, W: Write + Seek>(
    file: &'a mut Recording<W>,
    result: &'a mut McapResult<()>,
) -> impl FnMut(MonoTime, Message) + 'a {
    move |at, message| {
        if result.is_ok() {
            *result = file.write(at, &message);
        }
    }
}
