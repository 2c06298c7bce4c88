//! An engine of one's own, and halls that are linked to it.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use crate::hall::Hall;
use crate::http::To;
use crate::process::{Guarded, PATIENCE, Run};
use crate::programs::is_installed;

/// All words that a hall may allow.
pub(crate) const ALL: &str =
    r#"["pause", "park", "disarm", "load", "levels", "trim", "preflight", "cues", "playlists", "pull"]"#;

/// An engine that runs, with the keys of all who know it.
pub(crate) struct Engine {
    dir: TempDir,
    address: String,
    process: Option<Guarded>,
    /// What was said as its files were made.
    said: String,
}

/// A link that runs.
pub(crate) struct Link {
    process: Guarded,
    said: Receiver<String>,
}

impl Engine {
    /// None where there is no such program, and somebody asked for that.
    pub(crate) fn start(halls: &str) -> Option<Self> {
        Self::start_with(halls, &[])
    }

    /// The same of which `fleet init` was told more.
    pub(crate) fn start_with(halls: &str, more: &[&str]) -> Option<Self> {
        let mut engine = Self::made(halls, "127.0.0.1", more)?;
        engine.restart();
        Some(engine)
    }

    /// The same over TLS, with the certificates that `fleet init` says how to make; as for an engine on another machine, and on this one.
    pub(crate) fn start_over_tls(halls: &str) -> Option<Self> {
        if !is_installed("openssl") {
            return None;
        }
        let mut engine = Self::made(halls, "10.9.9.1", &[])?;
        let fleet = engine.path("fleet");
        let lines: Vec<_> = engine.said.lines().filter(|line| line.starts_with("openssl ")).collect();
        assert_eq!(lines.len(), 2, "{}", engine.said);
        let lines = lines.join(" 2> openssl.log && ").replace("10.9.9.1", "127.0.0.1");
        let made = Command::new("bash").args(["-c", &lines]).current_dir(&fleet).output().unwrap();
        assert!(made.status.success(), "{made:?}");
        let here = |text: String| {
            let folder = format!("{}/", fleet.to_str().unwrap());
            text.replace("0.0.0.0", "127.0.0.1")
                .replace("10.9.9.1", "127.0.0.1")
                .replace("/etc/nats/", &folder)
        };
        for name in ["nats-server.conf", "h1/fleet.toml", "office/desk.toml"] {
            let path = fleet.join(name);
            fs::write(&path, here(fs::read_to_string(&path).unwrap())).unwrap();
        }
        for member in ["h1", "office"] {
            fs::copy(fleet.join("fleet-ca.pem"), fleet.join(member).join("fleet-ca.pem")).unwrap();
        }
        engine.address = here(engine.address);
        engine.restart();
        Some(engine)
    }

    /// Its files, for an engine at that host.
    fn made(halls: &str, host: &str, more: &[&str]) -> Option<Self> {
        if !is_installed("nats-server") {
            return None;
        }
        let dir = tempfile::tempdir().unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let address = format!("{host}:{port}");
        let mut engine = Self { dir, address, process: None, said: String::new() };
        let folder = engine.path("fleet");
        let folder = folder.to_str().unwrap();
        let init = [
            "fleet",
            "init",
            "--site",
            "berlin",
            "--halls",
            halls,
            "--engine",
            &engine.address,
            "--folder",
            folder,
        ];
        let run = crate::process::kinocue(&[&init, more].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
        engine.said = run.stdout;
        let conf = engine.path("fleet/nats-server.conf");
        let store = engine.path("jetstream");
        let text = fs::read_to_string(&conf).unwrap();
        let text = text.replace("/var/lib/nats/jetstream", store.to_str().unwrap());
        fs::write(conf, text).unwrap();
        Some(engine)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn url(&self) -> String {
        format!("nats://{}", self.address)
    }

    /// Starts it, again.
    pub(crate) fn restart(&mut self) {
        let mut command = Command::new("nats-server");
        command.arg("-c").arg(self.path("fleet/nats-server.conf"));
        let mut process = Guarded::start_command(&mut command);
        let stderr = process.stderr();
        thread::spawn(move || stderr.lines().map_while(Result::ok).for_each(drop));
        self.process = Some(process);
        let until = Monotonic.now() + PATIENCE;
        while TcpStream::connect(&self.address).is_err() {
            assert!(Monotonic.now() < until, "the engine does not start");
            thread::yield_now();
        }
    }

    /// Kills it.
    pub(crate) fn kill(&mut self) {
        drop(self.process.take());
    }

    /// Has it end in order.
    pub(crate) fn end(&mut self) {
        let process = self.process.take().unwrap();
        process.signal(Signal::TERM);
        process.finish();
    }

    /// A hall that plays, as a member of the fleet.
    pub(crate) fn hall(&self, name: &str, allow: &str) -> Hall {
        self.hall_with(name, allow, |config| config)
    }

    /// The same of another configuration.
    pub(crate) fn hall_with(&self, name: &str, allow: &str, change: impl FnOnce(String) -> String) -> Hall {
        let table = fs::read_to_string(self.path(&format!("fleet/{name}/kinocue-fleet.toml"))).unwrap();
        let table = table.replace("allow = []", &format!("allow = {allow}"));
        let mut hall = Hall::closed(&[], |config| change(config) + &table);
        fs::create_dir_all(hall.path("state")).unwrap();
        fs::copy(self.path(&format!("fleet/{name}/journal.nk")), hall.path("state/journal.nk")).unwrap();
        hall.serve();
        hall.comes_to("parked");
        hall
    }

    /// Has a member, by the folder of its settings, reach the engine at another address.
    pub(crate) fn reached_at(&self, member: &str, address: &str) {
        for name in ["fleet.toml", "desk.toml"] {
            let file = self.path(&format!("fleet/{member}/{name}"));
            if let Ok(text) = fs::read_to_string(&file) {
                let own = format!("engine = [\"nats://{address}\"]");
                let lines = text.lines().map(|line| if line.starts_with("engine") { &own } else { line });
                fs::write(file, lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
            }
        }
    }

    /// Where it listens.
    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// The link of a hall.
    pub(crate) fn link(&self, name: &str, hall: &Hall) -> Link {
        self.link_in(name, hall.folder())
    }

    /// The same where its sockets and its cues are in a folder.
    pub(crate) fn link_in(&self, name: &str, folder: &Path) -> Link {
        let settings = self.path(&format!("fleet/{name}/fleet.toml"));
        let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let (settings, socket, state) = (settings.to_str().unwrap(), path("fleet.sock"), path("link"));
        let mut process =
            Guarded::start(&["fleet", "link", "--config", settings, "--socket", &socket, "--state", &state]);
        let stderr: BufReader<_> = process.stderr();
        let (tell, said) = channel();
        thread::spawn(move || stderr.lines().map_while(Result::ok).for_each(|line| drop(tell.send(line))));
        Link { process, said }
    }

    /// The page of the desk, with these lines of `[api]` beside where it listens.
    pub(crate) fn page(&self, lines: &str) -> Page {
        let settings = self.path("fleet/office/desk.toml");
        let text = fs::read_to_string(&settings).unwrap();
        fs::write(&settings, format!("{text}[api]\nlisten = [\"127.0.0.1:0\"]\n{lines}\n")).unwrap();
        let mut process = Guarded::start(&["fleet", "desk", "--desk", settings.to_str().unwrap()]);
        let stderr: BufReader<_> = process.stderr();
        let mut lines = stderr.lines().map_while(Result::ok);
        let url = lines.find_map(|line| line.split_once(" at http://").map(|(_, url)| url.to_owned()));
        thread::spawn(move || lines.for_each(drop));
        let to = To::Tcp(url.expect("it says where").trim_end_matches('/').parse().unwrap());
        Page { _process: process, to }
    }

    /// A command of the desk.
    pub(crate) fn desk(&self, args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("fleet").args(args).env("KINOCUE_DESK", self.path("fleet/office/desk.toml"));
        command.stdin(Stdio::null()).output().unwrap().into()
    }

    /// What `kinocue fleet have` says of a hall, once that is so.
    pub(crate) fn has(&self, hall: &str, mut wanted: impl FnMut(&Value) -> bool) -> Value {
        let until = Monotonic.now() + PATIENCE;
        loop {
            let run = self.desk(&["have", hall, "--json"]);
            // There is none where the engine did not answer in time.
            let table: Value = serde_json::from_str(&run.stdout).unwrap_or_default();
            if table.get(0).is_some_and(&mut wanted) {
                return table[0].clone();
            }
            assert!(Monotonic.now() < until, "it did not come to that: {run:?}");
        }
    }

    /// What the desk says of all halls, once that is so.
    pub(crate) fn wait(&self, mut wanted: impl FnMut(&Value) -> bool) -> Value {
        let until = Monotonic.now() + PATIENCE;
        loop {
            let run = self.desk(&["status", "--json"]);
            let table: Value = serde_json::from_str(&run.stdout).unwrap_or_default();
            if !table.is_null() && wanted(&table) {
                return table;
            }
            assert!(Monotonic.now() < until, "it did not come to that: {run:?}");
        }
    }

    /// Waits until one of its halls is heard.
    pub(crate) fn hears_one(&self) -> Value {
        self.wait(|table| {
            table.as_array().is_some_and(|halls| halls.iter().any(|hall| hall["silent"] == false))
        })
    }

    /// Waits until every hall of the desk is heard.
    pub(crate) fn hears_all(&self) -> Value {
        self.wait(|table| {
            table.as_array().is_some_and(|halls| halls.iter().all(|hall| hall["silent"] == false))
        })
    }

    /// The records of a hall that the engine has, in its order.
    pub(crate) fn log(&self, hall: &str) -> Vec<Value> {
        let run = self.desk(&["report", "--records", "--json"]);
        assert!(matches!(run.code, Some(0 | 1)), "{run:?}");
        run.report()[format!("berlin.{hall}")].as_array().cloned().unwrap_or_default()
    }
}

/// A page of all halls that is served.
pub(crate) struct Page {
    _process: Guarded,
    to: To,
}

impl Page {
    pub(crate) fn to(&self) -> &To {
        &self.to
    }

    pub(crate) fn url(&self) -> String {
        let To::Tcp(address) = &self.to else { unreachable!("it is served over TCP") };
        format!("http://{address}/")
    }

    /// The halls as the page has them, once that is so.
    pub(crate) fn wait(&self, mut wanted: impl FnMut(&Value) -> bool) -> Value {
        let until = Monotonic.now() + PATIENCE;
        loop {
            let page = self.to.get("/api/v1/fleet/halls").value();
            if wanted(&page) {
                return page;
            }
            assert!(Monotonic.now() < until, "it did not come to that: {page}");
        }
    }
}

impl Link {
    /// Waits until it has said that.
    pub(crate) fn heard(&self, text: &str) -> String {
        loop {
            let line = self.said.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("it never said {text:?}"));
            if line.contains(text) {
                return line;
            }
        }
    }

    /// True if it has said that since it was listened to last.
    pub(crate) fn has_said(&self, text: &str) -> bool {
        self.said.try_iter().any(|line| line.contains(text))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.process.signal(signal);
    }
}
