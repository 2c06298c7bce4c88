//! Where the daemon is, and the one way in which all commands ask it.

use std::path::PathBuf;
use std::pin::pin;
use std::time::Duration;

use anyhow::anyhow;
use http_body_util::Full;
use hyper::Method;
use hyper::body::Bytes;
use serde_json::Value;
use tokio::time::timeout;

use super::http::{self, HttpReply};
use super::reply;
use crate::cli::{Exit, Failure, OrExit as _, places, print};
use crate::control::Status;

/// The environment variable that names the socket. Not clap's to read, for which it would count as an argument.
const SOCKET_VARIABLE: &str = "KINOCUE_SOCKET";
/// Where the service has its socket.
const SOCKET: &str = "/run/kinocue/control.sock";
/// How long an answer may take: the daemon itself gives up after a minute.
const PATIENCE: Duration = Duration::from_secs(65);
/// The same where it has only to look something up.
const LOOKED_UP: Duration = Duration::from_secs(5);
/// After so long a person hears that an answer takes its time.
const SILENT: Duration = Duration::from_secs(4);

// Where the daemon is, and how its replies are shown. No documentation: clap would show it as the help of `arm` and others.
#[derive(Debug, Clone, clap::Args)]
pub(in crate::cli) struct ServerArgs {
    /// The control socket of the daemon [default: $KINOCUE_SOCKET, /run/kinocue/control.sock, or that of a service of yours].
    #[arg(long, value_name = "PATH")]
    pub(super) socket: Option<PathBuf>,
    /// Print the reply as JSON, unchanged.
    #[arg(long)]
    pub(in crate::cli) json: bool,
}

impl ServerArgs {
    /// Where the daemon listens.
    ///
    /// # Errors
    /// Where two do, and nobody says which is meant: one may be a rehearsal, and the other move seats.
    pub(super) fn socket(&self) -> Result<PathBuf, Failure> {
        if self.named().is_none()
            && let [system, own] = &places::control_sockets()[..]
        {
            let [system, own] = [system, own].map(|path| path.display());
            let error =
                anyhow!("two services run here; say which is meant with --socket {system} or --socket {own}");
            return Err(error).or_exit(Exit::Usage);
        }
        Ok(self.first_socket())
    }

    /// The same for whoever cannot wait for an answer: of two that of the package.
    pub(super) fn first_socket(&self) -> PathBuf {
        let running = || places::control_sockets().into_iter().next();
        self.named().or_else(running).unwrap_or_else(|| PathBuf::from(SOCKET))
    }

    fn named(&self) -> Option<PathBuf> {
        let named = || std::env::var_os(SOCKET_VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
        self.socket.clone().or_else(named)
    }

    /// Looks something up.
    pub(super) fn get(&self, path: &str) -> Result<HttpReply, Failure> {
        let request = http::request(Method::GET, path, None, Full::<Bytes>::default())?;
        http::block_on(http::exchange(&self.socket()?, request, LOOKED_UP))
    }

    /// The status of the hall.
    pub(super) fn status(&self) -> Result<Status, Failure> {
        reply::status(&self.get("/api/v1/status")?)
    }

    /// Has something done by POST, and gives the state that it led to.
    pub(super) fn post(&self, path: &str, body: &Value) -> Result<Status, Failure> {
        self.post_within(path, body, PATIENCE)
    }

    /// The same, for whoever cannot wait.
    pub(super) fn post_within(
        &self,
        path: &str,
        body: &Value,
        patience: Duration,
    ) -> Result<Status, Failure> {
        http::block_on(self.change(Method::POST, path, body, patience))
    }

    /// The same for whoever has a runtime already.
    pub(super) async fn post_now(&self, path: &str, body: &Value) -> Result<Status, Failure> {
        self.change(Method::POST, path, body, PATIENCE).await
    }

    /// Has something done by PUT, and gives the state that it led to.
    pub(super) fn put(&self, path: &str, body: &Value) -> Result<Status, Failure> {
        http::block_on(self.change(Method::PUT, path, body, PATIENCE))
    }

    /// Has something done by POST that is all there is to the command.
    pub(super) fn act(&self, path: &str, body: &Value) -> Result<Exit, Failure> {
        Ok(self.tell(&self.post(path, body)?))
    }

    /// Says in a line what a change led to, and ends well.
    pub(super) fn tell(&self, status: &Status) -> Exit {
        print::tell(&format!("kinocue: {}", status.line()));
        Exit::Done
    }

    async fn change(
        &self,
        method: Method,
        path: &str,
        body: &Value,
        patience: Duration,
    ) -> Result<Status, Failure> {
        let body = Full::new(Bytes::from(body.to_string()));
        let request = http::request(method, path, Some("application/json"), body)?;
        let socket = self.socket()?;
        let reply = awaited(http::exchange(&socket, request, patience), patience).await?;
        self.show(&reply)?;
        reply::status(&reply)
    }

    /// Prints a reply where its JSON is wanted.
    pub(super) fn show(&self, reply: &HttpReply) -> Result<(), Failure> {
        if self.json { print::json_text(&reply.text) } else { Ok(()) }
    }
}

/// What a person waits for, who is told once that it takes its time.
async fn awaited<T>(asked: impl Future<Output = T>, patience: Duration) -> T {
    let mut asked = pin!(asked);
    if let Ok(done) = timeout(SILENT, asked.as_mut()).await {
        return done;
    }
    let seconds = patience.as_secs();
    print::tell(&format!(
        "kinocue: no answer from the daemon yet; waiting for it for up to {seconds} s in all (`kinocue stop` does not)"
    ));
    asked.await
}

/// A name as a part of a path: whatever is no plain letter or digit is written as bytes.
pub(super) fn in_path(name: &str) -> String {
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.~".contains(byte);
    let written = |byte: u8| if plain(&byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    name.bytes().map(written).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_part_of_a_path() {
        assert_eq!(in_path("F4"), "F4");
        assert_eq!(in_path("row A/1?"), "row%20A%2F1%3F");
        assert_eq!(in_path("é"), "%C3%A9");
    }
}
