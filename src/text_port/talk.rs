//! One connection: lines are read as they come, also while an answer is waited for, so that a stop waits for nothing.

use std::sync::Arc;
use std::time::Duration;

use sha2::{Digest as _, Sha256};
use subtle::ConstantTimeEq as _;
use tokio::io::{AsyncBufRead, AsyncBufReadExt as _, AsyncReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::line::{TextFault, TextOrder, is_stop, order};
use crate::config::GearWord;
use crate::control::{Code, Command, FilmStatus, Handle, Place, Posted, Problem, Status, Who};
use crate::time::ShowTime;

/// Bytes of a line at the most, its end included.
const LONGEST: usize = 256;
/// Lines that may wait for their answers; of who sends more ahead nothing but a stop is heard any more.
const AHEAD: usize = 16;
/// Of what came behind the last line so much is read, bytes, and waited for so long.
const REST: u64 = 64 << 10;
const PARTING: Duration = Duration::from_secs(1);
/// How long a peer may take to read its answer.
const WRITING: Duration = Duration::from_secs(5);

type TextAnswer = Result<Arc<Status>, Problem>;

/// A line that was read, on its way to its answer.
enum Read {
    Posted(Posted),
    Answered(TextAnswer),
    Film(Box<FilmStatus>),
}

/// Who speaks on a connection, with which hall, and what they may ask.
pub(super) struct TextTalk {
    pub(super) hall: Handle,
    pub(super) who: Who,
    pub(super) allow: Vec<GearWord>,
    /// SHA-256 of the token that the first line shows; `None` if none is wanted.
    pub(super) token: Option<[u8; 32]>,
    /// A connection without a line for so long is closed.
    pub(super) idle: Duration,
    /// Its place among the connections.
    pub(super) place: Place,
}

/// How a line ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LineEnd {
    /// As it should: with LF, CR or both.
    Whole,
    /// It did not, in [`LONGEST`] bytes.
    TooLong,
    /// The peer left.
    Cut,
}

/// What comes after a line.
enum Then {
    /// Further lines.
    Listen,
    /// Nothing: it was no order.
    End,
}

impl TextTalk {
    /// Talks until the peer leaves, falls silent, or sends what is no order, or until another needs its place.
    pub(super) async fn run(self, stream: TcpStream) {
        let (mut incoming, outgoing) = stream.into_split();
        let (lines, read) = mpsc::channel(AHEAD);
        let answers = answer(outgoing, read);
        tokio::pin!(answers);
        let talk = async {
            tokio::select! {
                // Who closes its own side still gets its answers.
                () = self.listen(&mut incoming, lines) => answers.await,
                () = &mut answers => {}
            }
            part(&mut incoming).await;
        };
        tokio::select! {
            () = talk => {}
            () = self.place.leave() => {}
        }
    }

    async fn listen(&self, incoming: &mut OwnedReadHalf, lines: mpsc::Sender<Read>) {
        let mut incoming = BufReader::new(incoming);
        // None once lines came faster than their answers: what is left to hear is a stop.
        let mut lines = Some(lines);
        let mut wanted = self.token;
        let mut line = Vec::new();
        loop {
            line.clear();
            let end = timeout(self.idle, self.next_line(&mut incoming, &mut line)).await;
            let end = end.unwrap_or(LineEnd::Cut); // it fell silent
            // What is left of a line is none, unless it is a stop.
            if end != LineEnd::Whole && !is_stop(&line) {
                if let Some(lines) = lines.filter(|_| end == LineEnd::TooLong) {
                    let _ = lines.try_send(Read::Answered(Err(too_long())));
                }
                return;
            }
            let text = line.trim_ascii();
            match &lines {
                _ if text.is_empty() => {} // CR and LF end one line, and some gear sends one before
                None => self.hear_a_stop(text),
                Some(to) => {
                    let first = wanted.is_some();
                    let (read, then) = if first { self.first(text, &mut wanted) } else { self.take(text) };
                    let full = to.try_send(read).is_err();
                    match then {
                        Then::End => return,
                        Then::Listen if full => lines = None,
                        Then::Listen => {}
                    }
                }
            }
            if end != LineEnd::Whole {
                return;
            }
        }
    }

    /// Reads a line, without its end. A stop is done as soon as it can be read, whether or not its line has ended.
    async fn next_line(&self, incoming: &mut (impl AsyncBufRead + Unpin), line: &mut Vec<u8>) -> LineEnd {
        loop {
            let Ok(octets @ [_, ..]) = incoming.fill_buf().await else { return LineEnd::Cut };
            let octets = &octets[..octets.len().min(LONGEST - line.len())];
            let end = octets.iter().position(|octet| b"\r\n".contains(octet));
            line.extend(&octets[..end.unwrap_or(octets.len())]);
            let read = end.map_or(octets.len(), |end| end + 1);
            incoming.consume(read);
            match end {
                Some(_) => return LineEnd::Whole,
                None if line.len() == LONGEST => return LineEnd::TooLong,
                None if is_stop(line) => self.hall.stop(),
                None => {}
            }
        }
    }

    /// Does what a line asks.
    fn take(&self, line: &[u8]) -> (Read, Then) {
        let order = match order(line, &self.allow) {
            Ok(order) => order,
            Err(TextFault::Refused(problem)) => return (Read::Answered(Err(problem)), Then::Listen),
            Err(TextFault::NoOrder(problem)) => return (Read::Answered(Err(problem)), Then::End),
        };
        if order == TextOrder::Command(Command::Stop) {
            self.hall.stop(); // before all else
        }
        self.place.show(&self.who.name);
        let read = match order {
            TextOrder::Status => Read::Answered(Ok(self.hall.status())),
            TextOrder::Film => match self.hall.status().film.clone() {
                Some(film) => Read::Film(Box::new(film)),
                None => Read::Answered(Err(Problem::no_film())),
            },
            // A stop is done with this; its answer is for the journal and the peer.
            TextOrder::Command(ask) => match self.hall.post(self.who.clone(), ask) {
                Ok(posted) => Read::Posted(posted),
                Err(problem) => Read::Answered(Err(problem)),
            },
        };
        (read, Then::Listen)
    }

    /// The first lines where a token is wanted: it, or a stop, which waits for none.
    fn first(&self, line: &[u8], wanted: &mut Option<[u8; 32]>) -> (Read, Then) {
        if matches!(order(line, &[]), Ok(TextOrder::Command(Command::Stop))) {
            return self.take(line);
        }
        let token = line.strip_prefix(b"token ").map(|token| Sha256::digest(token.trim_ascii()));
        let same = |known: &[u8; 32]| token.is_some_and(|token| bool::from(known.ct_eq(token.as_slice())));
        if wanted.as_ref().is_some_and(same) {
            *wanted = None;
            self.place.show(&self.who.name);
            return (Read::Answered(Ok(self.hall.status())), Then::Listen);
        }
        let remedy = "send the line: token TOKEN, with the token whose SHA-256 is token_sha256 of [text]";
        let problem = Problem::new(Code::Token, "the first line has no known token", remedy);
        (Read::Answered(Err(problem)), Then::End)
    }

    fn hear_a_stop(&self, line: &[u8]) {
        if matches!(order(line, &[]), Ok(TextOrder::Command(Command::Stop))) {
            self.hall.stop();
            self.hall.note_stop(self.who.clone());
        }
    }
}

/// Reads what is left, for a moment: where it is unread at the end, the system takes back the answer that is on its way.
async fn part(incoming: &mut OwnedReadHalf) {
    let mut rest = incoming.take(REST);
    let _ = timeout(PARTING, tokio::io::copy(&mut rest, &mut tokio::io::sink())).await; // it may have left long ago
}

/// Writes the answers in the order of the lines.
async fn answer(mut outgoing: OwnedWriteHalf, mut read: mpsc::Receiver<Read>) {
    while let Some(read) = read.recv().await {
        let line = match read {
            Read::Posted(posted) => reply(&posted.answer().await),
            Read::Answered(answer) => reply(&answer),
            Read::Film(film) => film_reply(&film),
        };
        let written = timeout(WRITING, outgoing.write_all(line.as_bytes())).await;
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
    }
    let _ = outgoing.shutdown().await; // so that the peer knows that this was all
}

/// `ok STATE POSITION` or `error CODE TEXT; REMEDY`, with the end of the line.
pub(super) fn reply(answer: &TextAnswer) -> String {
    let text = match answer {
        Ok(status) => {
            let position =
                status.show.as_ref().map(|show| ShowTime::from_secs_f64(show.position_s).to_string());
            format!("ok {} {}", status.state, position.as_deref().unwrap_or("-"))
        }
        Err(problem) => format!("error {} {}; {}", problem.code.word(), problem.detail, problem.remedy),
    };
    ended(&text)
}

/// `ok STATE TIMECODE CAUSE` of the film, with the end of the line.
fn film_reply(film: &FilmStatus) -> String {
    ended(&format!("ok {} {} {}", film.state, film.timecode.as_deref().unwrap_or("-"), film.cause))
}

/// A text as one line, with its end.
fn ended(text: &str) -> String {
    text.replace(['\r', '\n'], " ") + "\r\n"
}

fn too_long() -> Problem {
    Problem::new(
        Code::Value,
        format!("the line is longer than {LONGEST} bytes"),
        "end each line with LF or CRLF",
    )
}
