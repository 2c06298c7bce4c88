//! The daemon's server-sent events: its whole status when it connects, and after every change.

use std::path::Path;
use std::time::Duration;

use anyhow::anyhow;
use http_body_util::{BodyExt as _, Full};
use hyper::Method;
use hyper::body::{Bytes, Incoming};
use tokio::time::timeout;

use super::http::{HttpReply, request, send};
use super::reply;
use crate::cli::{Exit, Failure, OrExit as _};

/// Statuses come ten times a second; without one for so long, what was last heard is old.
pub(super) const QUIET: Duration = Duration::from_secs(2);
/// How long it may take to begin.
const BEGINNING: Duration = Duration::from_secs(5);
/// The longest event, bytes.
const LONGEST: usize = 64 << 20;

/// A stream of events.
pub(super) struct Events {
    body: Incoming,
    lines: EventLines,
}

impl Events {
    /// Begins to listen.
    pub(super) async fn open(socket: &Path) -> Result<Self, Failure> {
        let asked = request(Method::GET, "/api/v1/events", None, Full::<Bytes>::default())?;
        let silent = || anyhow!("the daemon at {} connects, but sends nothing", socket.display());
        let response = timeout(BEGINNING, send(socket, asked))
            .await
            .map_err(|_| silent())
            .or_exit(Exit::Unavailable)??;
        let status = response.status().as_u16();
        if status != 200 {
            let text = response.into_body().collect().await.map(|body| body.to_bytes()).unwrap_or_default();
            let text = String::from_utf8_lossy(&text).into_owned();
            reply::done(&HttpReply { status, text })?;
            return Err(anyhow!("the daemon sends no events (HTTP status {status})")).or_exit(Exit::Internal);
        }
        Ok(Self { body: response.into_body(), lines: EventLines::default() })
    }

    /// The data of the next event; nothing where none came for [`QUIET`]. Why there will be none any more otherwise.
    pub(super) async fn next(&mut self) -> Result<Option<String>, &'static str> {
        timeout(QUIET, self.event()).await.map_or(Ok(None), |event| event.map(Some))
    }

    /// Given up while it waits, it has lost nothing.
    async fn event(&mut self) -> Result<String, &'static str> {
        loop {
            if let Some(data) = self.lines.event() {
                return Ok(data);
            }
            let frame = self.body.frame().await.ok_or("it closed the connection")?;
            if let Ok(piece) = frame.map_err(|_| "the connection broke")?.into_data() {
                self.lines.take(&piece)?;
            }
        }
    }
}

/// What has come of the stream and is no event yet.
#[derive(Debug, Default)]
struct EventLines {
    bytes: Vec<u8>,
    /// How much of that has been looked through.
    seen: usize,
    /// The data of the event that is under way.
    data: Option<String>,
}

impl EventLines {
    fn take(&mut self, piece: &[u8]) -> Result<(), &'static str> {
        self.bytes.drain(..self.seen);
        self.seen = 0;
        self.bytes.extend_from_slice(piece);
        let data = self.data.as_ref().map_or(0, String::len);
        if self.bytes.len() + data > LONGEST { Err("it sends an endless event") } else { Ok(()) }
    }

    /// The data of the next event that is whole. Names of events, ids and comments are of no use to us.
    fn event(&mut self) -> Option<String> {
        while let Some(len) = self.bytes[self.seen..].iter().position(|&byte| byte == b'\n') {
            let line = &self.bytes[self.seen..self.seen + len];
            self.seen += len + 1;
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            if line.is_empty() {
                if let Some(data) = self.data.take() {
                    return Some(data);
                }
            } else if let Some(more) = line.strip_prefix(b"data:") {
                let more = String::from_utf8_lossy(more.strip_prefix(b" ").unwrap_or(more));
                self.data = Some(match self.data.take() {
                    Some(data) => format!("{data}\n{more}"),
                    None => more.into_owned(),
                });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn events(pieces: &[&[u8]]) -> Vec<String> {
        let mut lines = EventLines::default();
        let mut events = Vec::new();
        for piece in pieces {
            lines.take(piece).unwrap();
            events.extend(std::iter::from_fn(|| lines.event()));
        }
        events
    }

    #[test]
    fn events_are_told_apart_wherever_the_stream_is_cut() {
        let stream = b": hello\n\nevent: status\r\ndata: {\"a\":1}\r\n\r\nid: 7\ndata:x\ndata: y\n\n: still here\n\ndata: z\n";
        let wanted = ["{\"a\":1}", "x\ny"];
        assert_eq!(events(&[stream]), wanted);
        for cut in 0..stream.len() {
            assert_eq!(events(&[&stream[..cut], &stream[cut..]]), wanted, "{cut}");
        }
        let single: Vec<&[u8]> = stream.chunks(1).collect();
        assert_eq!(events(&single), wanted);
    }
}
