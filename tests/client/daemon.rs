//! A double of the daemon: HTTP over a Unix socket in a temporary folder, one request a connection, answered by a script.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

/// Nothing is waited for longer; where all is well it takes milliseconds.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);

/// A request as it came.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    pub(crate) method: String,
    pub(crate) path: String,
    headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Request {
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }
}

/// What is done with a request.
pub(crate) enum Answer {
    /// A reply, whole.
    Reply(u16, Value),
    /// These events, and then the end.
    Events(Vec<Value>),
    /// These events, and then nothing.
    EventsAndSilence(Vec<Value>),
    /// Nothing, ever.
    Silence,
}

/// The double.
pub(crate) struct Daemon {
    folder: TempDir,
    requests: Receiver<Request>,
}

impl Daemon {
    /// One that answers each request by that script, which is told how many came before it.
    pub(crate) fn start(script: impl Fn(usize, &Request) -> Answer + Send + 'static) -> Self {
        let folder = TempDir::new().expect("a folder");
        let listener = UnixListener::bind(folder.path().join("control.sock")).expect("a socket");
        let (seen, requests) = channel();
        thread::spawn(move || {
            let mut held = Vec::new();
            for (count, stream) in listener.incoming().enumerate() {
                let stream = stream.expect("a connection");
                let Some(request) = read(&stream) else { continue };
                let answer = script(count, &request);
                let _ = seen.send(request); // the test may be over
                write(&stream, &answer);
                if matches!(answer, Answer::Silence | Answer::EventsAndSilence(_)) {
                    held.push(stream);
                }
            }
        });
        Self { folder, requests }
    }

    /// One that answers everything with that status of the hall.
    pub(crate) fn with(status: Value) -> Self {
        Self::start(move |_, _| Answer::Reply(200, status.clone()))
    }

    /// One that refuses everything.
    pub(crate) fn refusing(status: u16, code: &str) -> Self {
        let problem = json!({"status": status, "code": code, "detail": "cannot go while parked", "remedy": "arm first",
            "state": "parked", "cause": "parked by anna", "next": "arm", "position_s": null});
        Self::start(move |_, _| Answer::Reply(status, problem.clone()))
    }

    /// The path of a socket in its folder.
    pub(crate) fn socket(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The next request.
    pub(crate) fn request(&self) -> Request {
        self.requests.recv_timeout(PATIENCE).expect("a request")
    }

    /// Whether nothing more was asked.
    pub(crate) fn is_done(&self) -> bool {
        self.requests.try_recv().is_err()
    }

    /// A command against it.
    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(args).arg("--socket").arg(self.socket("control.sock")).env_remove("KINOCUE_SOCKET");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// A command against it, run to its end.
    pub(crate) fn run(&self, args: &[&str]) -> Run {
        run(&mut self.command(args))
    }
}

/// What a command ended with, and said.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Run {
    let output = command.output().expect("kinocue runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// A command at work, ended with its test.
pub(crate) struct Running(pub(crate) Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill(); // it may have ended
        let _ = self.0.wait();
    }
}

fn read(stream: &UnixStream) -> Option<Request> {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let mut words = line.split(' ').map(str::to_owned);
    let (method, path) = (words.next()?, words.next()?);
    let mut headers = Vec::new();
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).ok()?;
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.push((name.to_ascii_lowercase(), value.to_owned()));
    }
    let length = headers.iter().find(|(name, _)| name == "content-length").map(|(_, value)| value.parse());
    let mut body = vec![0; length.map_or(0, |length| length.expect("a number"))];
    reader.read_exact(&mut body).ok()?;
    Some(Request { method, path, headers, body })
}

fn write(mut stream: &UnixStream, answer: &Answer) {
    let text = match answer {
        Answer::Reply(status, body) => {
            let body = body.to_string();
            let length = body.len();
            format!("HTTP/1.1 {status} As It Is\r\nContent-Length: {length}\r\n\r\n{body}")
        }
        Answer::Events(events) | Answer::EventsAndSilence(events) => {
            let head =
                "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n: hello\n\n";
            let events = events.iter().map(|event| format!("event: status\ndata: {event}\n\n"));
            head.to_owned() + &events.collect::<String>()
        }
        Answer::Silence => return,
    };
    let _ = stream.write_all(text.as_bytes()); // it may have left
}
