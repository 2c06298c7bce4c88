//! A client that says exactly what it is told to, and hears what comes.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use kinocue::harness::sys::clock::wall_now_ns;
use serde_json::Value;

/// Longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(20);

/// Where to.
#[derive(Debug, Clone)]
pub enum To {
    Unix(PathBuf),
    Tcp(SocketAddr),
}

/// A connection.
pub trait Connection: Read + Write + Send {}
impl<T: Read + Write + Send> Connection for T {}

impl To {
    pub fn connect(&self) -> Box<dyn Connection> {
        match self {
            Self::Unix(path) => {
                let stream = UnixStream::connect(path).unwrap();
                stream.set_read_timeout(Some(PATIENCE)).unwrap();
                Box::new(stream)
            }
            Self::Tcp(address) => {
                let stream = TcpStream::connect(address).unwrap();
                stream.set_read_timeout(Some(PATIENCE)).unwrap();
                Box::new(stream)
            }
        }
    }

    pub fn get(&self, path: &str) -> Reply {
        Request::new("GET", path).send(self)
    }

    pub fn post(&self, path: &str) -> Reply {
        Request::new("POST", path).send(self)
    }
}

/// One request.
#[derive(Debug, Clone)]
pub struct Request {
    method: String,
    path: String,
    host: Option<String>,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
}

impl Request {
    pub fn new(method: &str, path: &str) -> Self {
        let (method, path) = (method.to_owned(), path.to_owned());
        Self { method, path, host: None, headers: Vec::new(), body: Vec::new() }
    }

    pub fn host(self, host: &str) -> Self {
        Self { host: Some(host.to_owned()), ..self }
    }

    pub fn header(mut self, name: &str, value: impl ToString) -> Self {
        self.headers.push((name.to_owned(), value.to_string()));
        self
    }

    pub fn token(self, token: &str) -> Self {
        self.header("Authorization", format!("Bearer {token}"))
    }

    /// Sent that many milliseconds ago.
    pub fn sent_ago(self, ms: i64) -> Self {
        let now = i64::try_from(wall_now_ns() / 1_000_000).unwrap();
        self.header("X-Kinocue-Sent", now - ms)
    }

    pub fn json(self, body: impl Into<Vec<u8>>) -> Self {
        self.header("Content-Type", "application/json").body(body)
    }

    pub fn body(self, body: impl Into<Vec<u8>>) -> Self {
        Self { body: body.into(), ..self }
    }

    /// Its bytes, before which its connection is told to end with it.
    pub fn bytes(&self, to: &To) -> Vec<u8> {
        let host = match (&self.host, to) {
            (Some(host), _) => host.clone(),
            (None, To::Tcp(address)) => address.to_string(),
            (None, To::Unix(_)) => "localhost".to_owned(),
        };
        let mut text =
            format!("{} {} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n", self.method, self.path);
        for (name, value) in &self.headers {
            text += &format!("{name}: {value}\r\n");
        }
        if !self.body.is_empty() {
            text += &format!("Content-Length: {}\r\n", self.body.len());
        }
        let mut bytes = (text + "\r\n").into_bytes();
        bytes.extend_from_slice(&self.body);
        bytes
    }

    pub fn send(&self, to: &To) -> Reply {
        let mut connection = to.connect();
        // What is refused before it is whole is not read to its end.
        let _ = connection.write_all(&self.bytes(to));
        Reply::read(&mut *connection)
    }
}

/// What came back.
#[derive(Debug)]
pub struct Reply {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Reply {
    /// Reads until the connection ends.
    pub fn read(connection: &mut dyn Connection) -> Self {
        let mut bytes = Vec::new();
        match connection.read_to_end(&mut bytes) {
            Err(error) if error.kind() != io::ErrorKind::ConnectionReset => panic!("no whole reply: {error}"),
            _ => {}
        }
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
        let end = end.unwrap_or_else(|| panic!("no head: {:?}", String::from_utf8_lossy(&bytes)));
        let head = std::str::from_utf8(&bytes[..end]).unwrap();
        let mut lines = head.lines();
        let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
        let headers = lines.map(|line| {
            let (name, value) = line.split_once(": ").unwrap();
            (name.to_ascii_lowercase(), value.to_owned())
        });
        Self { status, headers: headers.collect(), body: bytes[end + 4..].to_vec() }
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn value(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }

    /// The state of the hall, as it says.
    pub fn state(&self) -> String {
        assert_eq!(self.status, 200, "{}", self.text());
        self.value()["state"].as_str().unwrap().to_owned()
    }

    /// The status and the code of a problem, which is checked for all that belongs to one.
    pub fn problem(&self) -> (u16, String) {
        assert_eq!(
            self.header("content-type"),
            Some("application/problem+json"),
            "{} {}",
            self.status,
            self.text()
        );
        let body = self.value();
        let code = body["code"].as_str().unwrap().to_owned();
        assert_eq!(body["type"], format!("urn:kinocue:problem:{code}"));
        assert_eq!(body["status"], self.status);
        for key in ["title", "detail", "remedy"] {
            assert!(body[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {body}");
        }
        (self.status, code)
    }
}

/// A problem, as it is compared.
pub fn problem(status: u16, code: &str) -> (u16, String) {
    (status, code.to_owned())
}
