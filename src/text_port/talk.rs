//! One connection: lines are read as they come, also while an answer is waited for, so that a stop waits for nothing.

use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::line::{Order, order};
use crate::hall::{Code, Handle, Posted, Problem, Status, Who};
use crate::time::ShowTime;

/// Octets of a line at the most, its end included.
const LONGEST: u64 = 256;
/// Lines that may wait for their answers; who sends more ahead is not listened to any further.
const AHEAD: usize = 16;
/// How long a peer may take to read its answer.
const WRITING: Duration = Duration::from_secs(5);

type Answer = Result<Arc<Status>, Problem>;

/// A line that was read, on its way to its answer.
enum Read {
    Posted(Posted),
    Answered(Answer),
}

/// Who speaks on a connection, and with which hall.
pub(super) struct Talk {
    pub(super) hall: Handle,
    pub(super) who: Who,
    /// A connection without a line for so long is closed.
    pub(super) idle: Duration,
}

impl Talk {
    /// Talks until the peer leaves, falls silent, or sends what is no line.
    pub(super) async fn run(&self, stream: TcpStream) {
        let (incoming, outgoing) = stream.into_split();
        let (lines, read) = mpsc::channel(AHEAD);
        let answers = answer(outgoing, read);
        tokio::pin!(answers);
        tokio::select! {
            // Who closes its own side still gets its answers.
            () = self.listen(incoming, lines) => answers.await,
            () = &mut answers => {}
        }
    }

    async fn listen(&self, incoming: OwnedReadHalf, lines: mpsc::Sender<Read>) {
        let mut incoming = BufReader::new(incoming);
        let mut line = Vec::new();
        loop {
            line.clear();
            let mut bounded = (&mut incoming).take(LONGEST);
            match timeout(self.idle, bounded.read_until(b'\n', &mut line)).await {
                Ok(Ok(1..)) => {}
                _ => return, // it left, or fell silent
            }
            let Some(text) = line.strip_suffix(b"\n") else {
                if line.len() as u64 == LONGEST {
                    let _ = lines.try_send(Read::Answered(Err(too_long())));
                }
                return; // what is left of a line is none
            };
            let text = text.strip_suffix(b"\r").unwrap_or(text);
            if lines.try_send(self.take(text)).is_err() {
                return;
            }
        }
    }

    fn take(&self, line: &[u8]) -> Read {
        match order(line) {
            Ok(Order::Status) => Read::Answered(Ok(self.hall.status())),
            // A stop is done with this; its answer is for the journal and the peer.
            Ok(Order::Ask(ask)) => match self.hall.post(self.who.clone(), ask) {
                Ok(posted) => Read::Posted(posted),
                Err(problem) => Read::Answered(Err(problem)),
            },
            Err(problem) => Read::Answered(Err(problem)),
        }
    }
}

/// Writes the answers in the order of the lines.
async fn answer(mut outgoing: OwnedWriteHalf, mut read: mpsc::Receiver<Read>) {
    while let Some(read) = read.recv().await {
        let answer = match read {
            Read::Posted(posted) => posted.answer().await,
            Read::Answered(answer) => answer,
        };
        let written = timeout(WRITING, outgoing.write_all(reply(&answer).as_bytes())).await;
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
    }
}

/// `ok STATE POSITION` or `error CODE TEXT; REMEDY`, with the end of the line.
pub(super) fn reply(answer: &Answer) -> String {
    let text = match answer {
        Ok(status) => {
            let position =
                status.show.as_ref().map(|show| ShowTime::from_secs_f64(show.position_s).to_string());
            format!("ok {} {}", status.state, position.as_deref().unwrap_or("-"))
        }
        Err(problem) => format!("error {} {}; {}", problem.code.word(), problem.detail, problem.remedy),
    };
    text.replace(['\r', '\n'], " ") + "\r\n"
}

fn too_long() -> Problem {
    Problem::new(
        Code::Value,
        format!("the line is longer than {LONGEST} octets"),
        "end each line with LF or CRLF",
    )
}
