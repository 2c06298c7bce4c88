//! Pads and keyboards whose keys ask something of the hall: presses in, commands out, and how the hall is on their lamps. A thread for
//! each pad; a stop is set from that thread, by the flag that the tick thread reads, and waits for nobody.
//!
//! ```text
//!  device or relay --> line --> event --> judge --> Handle::stop, or a command of the queue
//!         ^----------- lamps <----------- status
//! ```
//!
//! Nobody sees who presses: so nothing here arms, homes, clears or resumes, and GO is pressed twice, as on the page. What moves seats
//! is done only in a hall that a person has armed (`supervisor::gear`).

mod event;
mod judge;
mod line;
mod reader;
mod relay;

use std::io;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

pub(crate) use event::InputRecords;
pub(crate) use relay::ButtonRelay;

use crate::config::{ButtonPad, Config};
use crate::control::{ButtonsStatus, Handle, Severity, Warning};
use crate::log::Log;
use reader::PadReader;

/// How a pad is, as its thread sees it.
#[derive(Debug, Clone, Default)]
struct PadRow {
    status: ButtonsStatus,
    has_stop: bool,
}

/// How all pads are: their threads write, the supervisor reads.
#[derive(Debug, Clone, Default)]
pub(crate) struct PadTable(Arc<Mutex<Vec<PadRow>>>);

impl PadTable {
    fn of(config: &Config) -> Self {
        let row = |pad: &ButtonPad| {
            let (name, device) = (pad.name.clone(), pad.device.to_string());
            PadRow {
                status: ButtonsStatus { name, device, ..ButtonsStatus::default() },
                has_stop: pad.has_stop(),
            }
        };
        Self(Arc::new(Mutex::new(config.buttons.iter().map(row).collect())))
    }

    fn rows(&self) -> MutexGuard<'_, Vec<PadRow>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, place: usize, change: impl FnOnce(&mut ButtonsStatus)) {
        if let Some(row) = self.rows().get_mut(place) {
            change(&mut row.status);
        }
    }

    /// How each pad is, in the order of the configuration.
    #[must_use]
    pub(crate) fn status(&self) -> Vec<ButtonsStatus> {
        self.rows().iter().map(|row| row.status.clone()).collect()
    }

    /// A warning of each pad that is not heard, under that id; a STOP that nobody hears is an error.
    #[must_use]
    pub(crate) fn warnings(&self, id: &str) -> Vec<Warning> {
        let warning = |row: &PadRow| {
            let trouble = row.status.trouble.as_deref()?;
            let (why, remedy) = trouble.split_once("; ").unwrap_or((trouble, ""));
            let (severity, without) = match row.has_stop {
                true => (Severity::Error, ", its STOP neither"),
                false => (Severity::Warning, ""),
            };
            Some(Warning {
                id: id.to_owned(),
                severity,
                text: format!("the buttons of {} are not heard{without}: {why}", row.status.name),
                remedy: remedy.to_owned(),
                ..Warning::default()
            })
        };
        self.rows().iter().filter_map(warning).collect()
    }
}

/// What any records come to, in pieces.
#[cfg(feature = "harness")]
pub(crate) fn try_records(octets: &[u8]) {
    use crate::config::{PadDevice, PadWord};
    use crate::time::MonoTime;
    let keys = vec![(1, PadWord::Stop), (2, PadWord::Go), (3, PadWord::Park)];
    let device = PadDevice::Relay("/".into());
    let pad = ButtonPad {
        name: String::new(),
        device,
        keys,
        lamps: Vec::new(),
        debounce: std::time::Duration::ZERO,
    };
    let mut judge = judge::PressJudge::new(&pad, MonoTime::default());
    let mut records = InputRecords::default();
    for event in octets.chunks(7).flat_map(|piece| records.take(piece)) {
        std::hint::black_box(judge.take(event, event.at, || true));
    }
}

/// The pads of a hall, read until this is dropped.
#[derive(Debug)]
pub(crate) struct Buttons {
    table: PadTable,
    /// Dropped, they wake the threads, which then end.
    closing: Vec<UnixStream>,
    threads: Vec<JoinHandle<()>>,
}

impl Buttons {
    /// Begins to read all pads. One that is not there is told in the table, and looked for again each second.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(crate) fn read(config: &Config, handle: &Handle, log: &Log) -> io::Result<Self> {
        let mut buttons = Self { table: PadTable::of(config), closing: Vec::new(), threads: Vec::new() };
        for (place, pad) in config.buttons.iter().enumerate() {
            let (wake, closing) = UnixStream::pair()?;
            let reader = PadReader::new(
                pad.clone(),
                handle.clone(),
                log.clone(),
                (buttons.table.clone(), place),
                closing,
            );
            buttons.closing.push(wake);
            buttons.threads.push(Builder::new().name("buttons".to_owned()).spawn(move || reader.run())?);
        }
        Ok(buttons)
    }

    /// How they are, if there are any.
    #[must_use]
    pub(crate) fn table(&self) -> Option<PadTable> {
        (!self.threads.is_empty()).then(|| self.table.clone())
    }
}

impl Drop for Buttons {
    fn drop(&mut self) {
        self.closing.clear();
        self.threads.drain(..).for_each(|thread| {
            let _ = thread.join(); // a panic in it has been told
        });
    }
}
