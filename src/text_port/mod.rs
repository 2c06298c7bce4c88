//! Lines of plain text over TCP: text commands in, commands to the hall out, one line of reply for each.
//! Control plane.
//!
//! ```text
//!  go   pause   resume   stop   park   status          ok playing 00:12.340
//!  seek 12:30   trim +80ms                             error state cannot go while parked: …; arm first
//!  level 60%   level motion 60%   level vibration 60%
//!  effect water off   enable F4   disable F4
//! ```
//!
//! As with OSC, who speaks is known by address alone, so nothing here arms, homes or clears. A listed machine may have a
//! browser, which a page of anybody leads to send what it likes behind a head of HTTP: so the first line that is no order ends
//! its connection, and where the configuration has a token the first line has to show it; a stop needs none. Off unless the
//! configuration has `[text]`.

mod line;
mod talk;
#[cfg(test)]
mod tests;

use std::convert::Infallible;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, TcpListener};
use std::time::Duration;

use tokio::task::JoinSet;

use crate::config::TextPort;
use crate::control::{Handle, Places, Role, Surface, Who};
use crate::sys::listen;
use talk::TextTalk;

/// Connections at the most; of more the one that was silent longest goes, before all one that never asked anything.
const CONNECTIONS: usize = 16;
/// A connection without a line for so long is closed.
const IDLE: Duration = Duration::from_secs(600);
/// How long to wait where the system has no room for a further connection.
const BREATH: Duration = Duration::from_millis(100);

/// Why the port cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{address} cannot be had for text: {cause}")]
#[non_exhaustive]
pub(crate) struct TextError {
    /// Where it was to listen.
    pub(crate) address: SocketAddrV4,
    /// What the system said.
    #[source]
    pub(crate) cause: io::Error,
}

/// The port, open but not yet served.
#[derive(Debug)]
pub(crate) struct Text {
    listener: TcpListener,
    config: TextPort,
    hall: Handle,
    idle: Duration,
}

/// Opens the port that the configuration names; its address may come later.
///
/// # Errors
/// [`TextError`] where the system does not give it.
pub(crate) fn open(config: &TextPort, hall: Handle) -> Result<Text, TextError> {
    let refused = |cause| TextError { address: config.listen, cause };
    let listener = listen::tcp(SocketAddr::V4(config.listen)).map_err(refused)?;
    Ok(Text { listener, config: config.clone(), hall, idle: IDLE })
}

impl Text {
    /// Where it listens.
    ///
    /// # Errors
    /// If the system does not say.
    #[cfg(test)]
    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Serves the port, and its connections, until its future is dropped. To be awaited within a tokio runtime with time
    /// and network.
    ///
    /// # Errors
    /// If the socket cannot be served; it never ends otherwise.
    pub(crate) async fn serve(self) -> io::Result<Infallible> {
        let Self { listener, config, hall, idle } = self;
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let (mut talks, places) = (JoinSet::new(), Places::new(CONNECTIONS));
        loop {
            let Ok((stream, from)) = listener.accept().await else {
                // Too many files are open, or the peer left at once.
                tokio::time::sleep(BREATH).await;
                continue;
            };
            let SocketAddr::V4(from) = from else { continue };
            if !config.sources.contains(from.ip()) {
                continue; // no word to strangers
            }
            while talks.try_join_next().is_some() {} // those that are over
            let (place, _) = places.take(Some((*from.ip()).into()));
            let who = Who { role: Role::Operate, surface: Surface::Text, name: from.ip().to_string() };
            let (allow, token) = (config.allow.clone(), config.token);
            let talk = TextTalk { hall: hall.clone(), who, allow, token, idle, place };
            talks.spawn(async move { talk.run(stream).await });
        }
    }
}

/// What any line asks of a hall that allows whatever can be allowed.
#[cfg(feature = "harness")]
pub(crate) fn try_line(octets: &[u8]) -> Option<crate::control::Command> {
    let all = crate::config::GearWord::ALL.map(|(_, word)| word);
    match line::order(octets, &all) {
        Ok(line::TextOrder::Command(command)) => Some(command),
        _ => None,
    }
}
