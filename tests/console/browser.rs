//! A browser that does what a person would: Debian's chromium without a screen, driven through chromedriver, which speaks
//! `WebDriver` over HTTP on the loopback.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Ipv4Addr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::programs::is_installed;

/// Nothing is waited for longer; where all is well a second does.
const PATIENCE: Duration = Duration::from_secs(30);
/// The key of an element in replies, as the standard has it.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";
/// The code of the Escape key.
pub(crate) const ESCAPE: &str = "\u{e00c}";

/// One browser at a time is work enough for a small machine.
static ONE: Mutex<()> = Mutex::new(());

/// A browser, and the page of it that is driven; it ends with its test.
pub(crate) struct Browser {
    driver: Rc<Driver>,
    session: String,
    shots: Option<PathBuf>,
}

/// The program that drives browsers.
struct Driver {
    child: Child,
    port: u16,
    _only: MutexGuard<'static, ()>,
}

impl Browser {
    /// A browser; none where it is not installed, and somebody asked for tests without it.
    pub(crate) fn start() -> Option<Self> {
        if !["chromium", "chromedriver"].into_iter().all(is_installed) {
            return None;
        }
        let only = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let mut child = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("it is installed");
        let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
        let port = lines
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| line.split("successfully on port ").nth(1)?.trim_end_matches('.').parse().ok())
            .expect("it says on which port it listens");
        // Whatever else it says is taken, so that it never waits for us.
        std::thread::spawn(move || lines.for_each(drop));
        Some(Self::driven_by(Rc::new(Driver { child, port, _only: only })))
    }

    /// Another browser on the same machine, which shares nothing with this one.
    pub(crate) fn another(&self) -> Self {
        Self::driven_by(Rc::clone(&self.driver))
    }

    fn driven_by(driver: Rc<Driver>) -> Self {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is in target");
        let shots = std::env::var_os("KINOCUE_SHOTS").map(|_| target.join("console-shots"));
        shots.iter().for_each(|folder| std::fs::create_dir_all(folder).expect("a folder for the pictures"));
        let mut browser = Self { driver, session: String::new(), shots };
        let arguments = [
            "--headless=new",
            "--no-sandbox", // root has none
            "--disable-dev-shm-usage",
            "--disable-gpu",
            "--hide-scrollbars",
            "--no-first-run",
            "--no-proxy-server",
        ];
        let wanted = json!({"capabilities": {"alwaysMatch": {
            "goog:loggingPrefs": {"browser": "ALL"},
            "goog:chromeOptions": {"args": arguments},
        }}});
        let session = browser.ask("POST", "/session", &wanted);
        browser.session = format!("/session/{}", session["sessionId"].as_str().expect("a session"));
        let patience = u64::try_from(PATIENCE.as_millis()).expect("short");
        browser.command("/timeouts", &json!({"script": patience, "pageLoad": patience}));
        browser
    }

    /// Opens a window, which leaves the others in view, or a tab, which hides the one before; that one is driven from now on.
    pub(crate) fn begin(&self, kind: &str) {
        let new = self.command("/window/new", &json!({"type": kind}));
        self.turn_to(new["handle"].as_str().expect("a handle"));
    }

    /// The window or tab that is driven.
    pub(crate) fn page(&self) -> String {
        let page = self.ask("GET", &format!("{}/window", self.session), &Value::Null);
        page.as_str().expect("a handle").to_owned()
    }

    /// Drives that window or tab from now on, which comes in view.
    pub(crate) fn turn_to(&self, page: &str) {
        self.command("/window", &json!({"handle": page}));
    }

    /// Opens a page.
    pub(crate) fn open(&self, url: &str) {
        self.command("/url", &json!({"url": url}));
    }

    /// Asks for these languages from the next page on, the best first.
    pub(crate) fn speak(&self, languages: &[&str]) {
        self.begin_with(&format!(
            "Object.defineProperty(navigator, 'languages', {{ value: {} }})",
            json!(languages)
        ));
    }

    /// Has a script run before each page that is opened from now on in this window.
    pub(crate) fn begin_with(&self, source: &str) {
        let command = json!({"cmd": "Page.addScriptToEvaluateOnNewDocument", "params": {"source": source}});
        self.command("/goog/cdp/execute", &command);
    }

    /// Gives the page that size, px.
    pub(crate) fn resize(&self, width: u32, height: u32) {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.command(
            "/goog/cdp/execute",
            &json!({"cmd": "Emulation.setDeviceMetricsOverride", "params": size}),
        );
    }

    /// Has the page think that it is in that time zone.
    pub(crate) fn live_in(&self, zone: &str) {
        let command = json!({"cmd": "Emulation.setTimezoneOverride", "params": {"timezoneId": zone}});
        self.command("/goog/cdp/execute", &command);
    }

    /// What a script returns.
    pub(crate) fn eval(&self, script: &str) -> Value {
        self.command("/execute/sync", &json!({"script": script, "args": []}))
    }

    /// Waits until an expression of the page is true, and gives how long that took.
    ///
    /// # Panics
    /// Where it does not become true; the page's text says why.
    pub(crate) fn wait(&self, expression: &str) -> Duration {
        let most = PATIENCE.as_millis() - 2000;
        let script = format!(
            "const done = arguments[0], begun = performance.now();
             const look = () => {{
               let is = false;
               try {{ is = Boolean({expression}); }} catch {{ is = false; }}
               const took = performance.now() - begun;
               if (is || took > {most}) done([is, took]); else setTimeout(look, 10);
             }};
             look();"
        );
        let found = self.command("/execute/async", &json!({"script": script, "args": []}));
        if found[0] != json!(true) {
            self.shot("failed");
            let text = self.eval("return document.body.innerText");
            panic!("never true: {expression}\n{}", text.as_str().unwrap_or_default());
        }
        Duration::from_secs_f64(found[1].as_f64().expect("a number") / 1000.0)
    }

    /// Waits until an element shows a text that contains this, whatever the case.
    pub(crate) fn reads(&self, id: &str, text: &str) -> Duration {
        let text = json!(text.to_lowercase());
        self.wait(&format!("document.getElementById('{id}').textContent.toLowerCase().includes({text})"))
    }

    /// Presses an element, wherever on the page it is, once it can be pressed.
    pub(crate) fn press(&self, selector: &str) {
        self.wait(&format!("document.querySelector({}).matches(':enabled')", json!(selector)));
        let element = self.find(selector);
        self.command(&format!("/element/{element}/click"), &json!({}));
    }

    /// Puts a finger on an element, and leaves it there.
    pub(crate) fn touch(&self, selector: &str) {
        let element = self.find(selector);
        let there =
            json!({"type": "pointerMove", "duration": 0, "origin": {ELEMENT: element}, "x": 0, "y": 0});
        let finger = json!({"type": "pointer", "id": "finger", "parameters": {"pointerType": "touch"},
            "actions": [there, {"type": "pointerDown", "button": 0}]});
        self.command("/actions", &json!({"actions": [finger]}));
    }

    /// Takes the finger off.
    pub(crate) fn let_go(&self) {
        self.ask("DELETE", &format!("{}/actions", self.session), &Value::Null);
    }

    /// Chooses a file in a field for one.
    pub(crate) fn choose(&self, selector: &str, file: &Path) {
        let element = self.find(selector);
        self.command(&format!("/element/{element}/value"), &json!({"text": file.to_str().expect("text")}));
    }

    /// Types into what has the focus.
    pub(crate) fn type_text(&self, text: &str) {
        let keys: Vec<Value> = text
            .chars()
            .flat_map(|key| {
                [json!({"type": "keyDown", "value": key}), json!({"type": "keyUp", "value": key})]
            })
            .collect();
        self.command("/actions", &json!({"actions": [{"type": "key", "id": "keys", "actions": keys}]}));
    }

    /// Keeps a picture of the page in `target/console-shots`, if `KINOCUE_SHOTS` is set.
    pub(crate) fn shot(&self, name: &str) {
        let Some(folder) = &self.shots else { return };
        let picture = self.ask("GET", &format!("{}/screenshot", self.session), &Value::Null);
        let bytes = STANDARD.decode(picture.as_str().expect("a picture")).expect("base64");
        std::fs::write(folder.join(format!("{name}.png")), bytes).expect("it can be written");
    }

    /// What the browser complains of, replies of the server that are errors left out.
    pub(crate) fn complaints(&self) -> Vec<String> {
        let log = self.command("/se/log", &json!({"type": "browser"}));
        let messages = log.as_array().expect("a list").iter().filter(|line| line["level"] == "SEVERE");
        messages
            .map(|line| line["message"].as_str().expect("text").to_owned())
            .filter(|text| !text.contains("Failed to load resource"))
            .collect()
    }

    fn find(&self, selector: &str) -> String {
        let found = self.command("/element", &json!({"using": "css selector", "value": selector}));
        found[ELEMENT].as_str().expect("an element").to_owned()
    }

    fn command(&self, path: &str, body: &Value) -> Value {
        self.ask("POST", &format!("{}{path}", self.session), body)
    }

    fn ask(&self, method: &str, path: &str, body: &Value) -> Value {
        let (status, reply) = self.exchange(method, path, body).expect("chromedriver replies");
        assert_eq!(status, 200, "{method} {path} {body}: {reply}");
        reply["value"].clone()
    }

    fn exchange(&self, method: &str, path: &str, body: &Value) -> std::io::Result<(u16, Value)> {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.driver.port))?;
        stream.set_read_timeout(Some(2 * PATIENCE))?;
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let length = body.len();
        let head = format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}\r\n\r\n");
        stream.write_all(format!("{head}{body}").as_bytes())?;
        let mut reader = BufReader::new(stream);
        let (mut status, mut length) = (0, 0);
        loop {
            let mut line = String::new();
            reader.read_line(&mut line)?;
            let line = line.trim_end().to_ascii_lowercase();
            if let Some(rest) = line.strip_prefix("http/1.1 ") {
                status = rest.split(' ').next().and_then(|code| code.parse().ok()).unwrap_or(0);
            } else if let Some(rest) = line.strip_prefix("content-length:") {
                length = rest.trim().parse().unwrap_or(0);
            } else if line.is_empty() {
                break;
            }
        }
        let mut bytes = vec![0; length];
        reader.read_exact(&mut bytes)?;
        Ok((status, serde_json::from_slice(&bytes)?))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() {
            let _ = self.exchange("DELETE", &self.session, &Value::Null); // it ends the browser
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.child.kill(); // it may have ended already
        let _ = self.child.wait();
    }
}
