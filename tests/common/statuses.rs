//! The statuses of a hall, as its control socket tells them.

use std::io::{self, BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;

use serde_json::Value;

use crate::process::PATIENCE;

/// Statuses that are waited through; where all is well a few dozen do.
const MOST: usize = 600;

/// The status now, and each that comes.
///
/// # Errors
/// Where nobody listens.
pub(crate) fn statuses(socket: &Path) -> io::Result<impl Iterator<Item = Value> + use<>> {
    let mut stream = UnixStream::connect(socket)?;
    stream.set_read_timeout(Some(PATIENCE)).expect("it is longer than nothing");
    // HTTP/1.0 knows no chunks, so that lines are whole.
    let _ = stream.write_all(b"GET /api/v1/events HTTP/1.0\r\nHost: localhost\r\n\r\n"); // it may be closed again
    let lines = BufReader::new(stream).lines().map_while(Result::ok);
    Ok(lines.filter_map(|line| Some(serde_json::from_str(line.strip_prefix("data: ")?).expect("JSON"))))
}

/// Waits for a status like that; the last that there was, if it does not come.
///
/// # Panics
/// With `dead` where nobody listens.
pub(crate) fn wait(
    socket: &Path,
    dead: impl Fn() -> String,
    mut wanted: impl FnMut(&Value) -> bool,
) -> Result<Value, Option<Value>> {
    let mut last = None;
    // A connection that finds no room, or whose daemon is between two configurations, is made anew.
    let connections = std::iter::repeat_with(|| {
        statuses(socket).unwrap_or_else(|why| panic!("nobody listens: {why}; {}", dead()))
    });
    for status in connections.take(MOST).flatten().take(MOST) {
        if wanted(&status) {
            return Ok(status);
        }
        last = Some(status);
    }
    Err(last)
}
