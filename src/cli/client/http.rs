//! One request to the daemon over its Unix socket, each on a connection of its own.

use std::future::Future;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use http_body_util::{BodyExt as _, Limited};
use hyper::body::{Body, Incoming};
use hyper::client::conn::http1;
use hyper::header::{ACCEPT, CONTENT_TYPE, HOST};
use hyper::{Method, Request, Response};
use hyper_util::rt::TokioIo;
use tokio::net::UnixStream;
use tokio::time::{sleep, timeout};

use crate::cli::{Exit, Failure, OrExit as _};
use crate::sys::clock::wall_now_ns;

/// How long the socket may take to let us in.
const ENTRY: Duration = Duration::from_secs(2);
/// How soon after it was full it is asked again.
const AGAIN: Duration = Duration::from_millis(5);
/// The longest reply that is read, bytes.
const LONGEST: usize = 64 << 20;

/// A reply, whole.
#[derive(Debug)]
pub(in crate::cli) struct HttpReply {
    pub(in crate::cli) status: u16,
    pub(in crate::cli) text: String,
}

/// Does `work` on a runtime of its own.
pub(super) fn block_on<T>(work: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("no runtime could be started").or_system()?.block_on(work)
}

/// A request to `path` with that body. What changes something carries a key, so that it is done once however often it
/// arrives, and when it was sent, so that it is not done late.
pub(in crate::cli) fn request<B>(
    method: Method,
    path: &str,
    content_type: Option<&'static str>,
    body: B,
) -> Result<Request<B>, Failure> {
    let changes = method != Method::GET;
    let mut request = Request::builder().method(method).uri(path).header(HOST, "localhost");
    request = request.header(ACCEPT, "application/json, application/problem+json, text/event-stream");
    if let Some(content_type) = content_type {
        request = request.header(CONTENT_TYPE, content_type);
    }
    if changes {
        request = request.header("Idempotency-Key", key());
        request = request.header("X-Kinocue-Sent", wall_now_ns() / 1_000_000);
    }
    request.body(body).with_context(|| format!("{path} cannot be requested")).or_exit(Exit::Usage)
}

/// Sends a request and reads its reply, which may take so long.
pub(in crate::cli) async fn exchange<B>(
    socket: &Path,
    request: Request<B>,
    patience: Duration,
) -> Result<HttpReply, Failure>
where
    B: Body + Send + 'static,
    B::Data: Send,
    B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let remedy = if *request.method() == Method::GET {
        "it stands still, or is overloaded; `systemctl status kinocue` and `journalctl -u kinocue` may say why"
    } else {
        "check `kinocue status` before you repeat the command: it may still take effect"
    };
    let whole = async {
        let response = send(socket, request).await?;
        let status = response.status().as_u16();
        let body = Limited::new(response.into_body(), LONGEST).collect().await;
        let body =
            body.map_err(|error| anyhow!(error)).context(cut_off(socket)).or_exit(Exit::Unavailable)?;
        Ok(HttpReply { status, text: String::from_utf8_lossy(&body.to_bytes()).into_owned() })
    };
    timeout(patience, whole).await.unwrap_or_else(|_| {
        let seconds = patience.as_secs();
        let why = anyhow!("the daemon at {} did not answer within {seconds} s; {remedy}", socket.display());
        Err(why).or_exit(Exit::Unavailable)
    })
}

/// Sends a request; the body of the response is yet to come.
pub(super) async fn send<B>(socket: &Path, request: Request<B>) -> Result<Response<Incoming>, Failure>
where
    B: Body + Send + 'static,
    B::Data: Send,
    B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let stream = connect(socket).await.map_err(|error| unreachable_at(socket, error))?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream))
        .await
        .with_context(|| cut_off(socket))
        .or_exit(Exit::Unavailable)?;
    tokio::spawn(connection); // what goes wrong on it, the request is told
    sender.send_request(request).await.with_context(|| cut_off(socket)).or_exit(Exit::Unavailable)
}

/// Connects to a socket, however busy whoever serves it is: the kernel refuses at once while too many wait to be let in.
pub(super) async fn connect(socket: &Path) -> io::Result<UnixStream> {
    let let_in = async {
        loop {
            match UnixStream::connect(socket).await {
                Err(error) if error.kind() == ErrorKind::WouldBlock => sleep(AGAIN).await,
                done => return done,
            }
        }
    };
    timeout(ENTRY, let_in).await.unwrap_or_else(|_| Err(ErrorKind::TimedOut.into()))
}

/// Why there is no way in, and what to do.
fn unreachable_at(socket: &Path, error: io::Error) -> Failure {
    let path = socket.display();
    let (exit, why) = match error.kind() {
        ErrorKind::PermissionDenied => {
            let group = "operators have to be in the group kinocue: `sudo usermod -aG kinocue $USER`, then log in again";
            (Exit::NotAllowed, format!("may not open {path}; {group}"))
        }
        ErrorKind::TimedOut => {
            (Exit::TryAgain, format!("the daemon at {path} accepts no connection at the moment; try again"))
        }
        _ => {
            let start = "start it with `sudo systemctl start kinocue` or `kinocue serve --config FILE`, or name its \
                         socket with --socket";
            (Exit::Unavailable, format!("no daemon answers at {path}; {start}"))
        }
    };
    Failure { exit, error: anyhow::Error::new(error).context(why) }
}

fn cut_off(socket: &Path) -> String {
    format!(
        "the daemon at {} hung up; check `kinocue status` before you repeat the command: it may have taken effect",
        socket.display()
    )
}

/// A key like no other: the standard library seeds its hashers at random.
fn key() -> String {
    use std::hash::{BuildHasher as _, RandomState};
    let (a, b) =
        (RandomState::new().hash_one(std::process::id()), RandomState::new().hash_one(wall_now_ns()));
    format!("{a:016x}{b:016x}")
}

#[cfg(test)]
mod tests {
    use rustix::io::Errno;
    use rustix::net::{
        AddressFamily, SocketAddrUnix, SocketFlags, SocketType, accept, bind, listen, socket_with,
    };

    use super::*;

    #[test]
    fn no_two_requests_have_the_same_key_and_what_changes_nothing_has_none() {
        let of = |method| request(method, "/api/v1/show/go", None, ()).unwrap();
        let keys =
            [of(Method::POST), of(Method::POST)].map(|request| request.headers()["idempotency-key"].clone());
        assert_ne!(keys[0], keys[1]);
        assert!(!of(Method::GET).headers().contains_key("idempotency-key"));
    }

    #[test]
    fn whoever_comes_while_too_many_wait_is_let_in_once_there_is_room() {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("full.sock");
        let address = SocketAddrUnix::new(&socket).unwrap();
        let line =
            || socket_with(AddressFamily::UNIX, SocketType::STREAM, SocketFlags::NONBLOCK, None).unwrap();
        let door = line();
        bind(&door, &address).and_then(|()| listen(&door, 0)).unwrap();
        let waiting = line();
        rustix::net::connect(&waiting, &address).unwrap();
        assert_eq!(rustix::net::connect(line(), &address), Err(Errno::AGAIN));
        let entered = block_on(async {
            let entered = tokio::spawn(async move { connect(&socket).await });
            tokio::task::yield_now().await; // it has knocked
            drop(accept(&door).unwrap());
            Ok(entered.await.unwrap())
        });
        assert!(entered.unwrap().is_ok());
    }

    #[test]
    fn what_stands_in_the_way_decides_the_exit_code_and_what_to_do() {
        for (kind, exit, says) in [
            (ErrorKind::NotFound, Exit::Unavailable, "systemctl start kinocue"),
            (ErrorKind::ConnectionRefused, Exit::Unavailable, "kinocue serve"),
            (ErrorKind::PermissionDenied, Exit::NotAllowed, "group kinocue"),
            (ErrorKind::TimedOut, Exit::TryAgain, "try again"),
        ] {
            let failure = unreachable_at(Path::new("/run/k.sock"), kind.into());
            assert_eq!(failure.exit, exit);
            assert!(failure.to_string().contains(says), "{failure}");
        }
    }
}
