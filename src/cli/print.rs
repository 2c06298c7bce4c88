//! Writing to standard output, where a closed pipe is no fault.

use std::io::{self, Write as _};

use serde::Serialize;

use super::{Exit, Failure};

/// Writes data for a person or a pipe.
pub(super) fn out(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure {
            exit: Exit::Io,
            error: anyhow::Error::new(error).context("cannot write the output"),
        }),
        _ => Ok(()),
    }
}

/// Writes one JSON object and ends the line.
pub(super) fn json(report: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(report);
    let text = text.map_err(|error| Failure { exit: Exit::Internal, error: error.into() })?;
    out(&(text + "\n"))
}
