//! Writing to standard output and standard error, where a closed pipe is no fault.

use std::io::{self, Write as _};

use serde::Serialize;

use super::{Exit, Failure};
use crate::plain;

/// Writes what a person reads, or a pipe.
pub(super) fn out(text: &str) -> Result<(), Failure> {
    data(&plain::lines(text))
}

/// Writes data for programs, every byte of it.
pub(super) fn data(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure {
            exit: Exit::Io,
            error: anyhow::Error::new(error).context("cannot write the output"),
        }),
        _ => Ok(()),
    }
}

/// Writes a line, or several, for a person to the standard error output. That may be closed or full, which is no reason
/// to end otherwise, least of all with a show behind us.
pub(super) fn tell(text: &str) {
    let _ = io::stderr().lock().write_all(format!("{}\n", plain::lines(text)).as_bytes());
}

/// Writes one JSON object and ends the line.
pub(super) fn json(report: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(report);
    let text = text.map_err(|error| Failure { exit: Exit::Internal, error: error.into() })?;
    json_text(&text)
}

/// Writes JSON as somebody else wrote it, and ends the line.
pub(super) fn json_text(text: &str) -> Result<(), Failure> {
    data(&format!("{}\n", plain::json(text.trim_end())))
}
