//! `kinocue watch`: the hall live. A panel on a terminal, a line for each change in a pipe, a line for each event with
//! `--json`. It outlives the daemon, and says at once when that is gone.

use std::io::{self, ErrorKind, IsTerminal as _, Write as _};
use std::time::Duration;

use tokio::time::sleep;

use super::events::{Events, QUIET};
use super::http::block_on;
use super::panel::WatchPanel;
use super::server::ServerArgs;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::control::{ControllerStatus, Status, Warning};
use crate::plain;

/// How often a daemon that is gone is looked for.
const AGAIN: Duration = Duration::from_millis(500);

/// Shows the hall live, until Ctrl-C.
///
/// State, position, levels, controllers, warnings.
///
/// On a terminal it shows a panel; into a pipe it writes one line for each change. If the daemon goes away it says so at
/// once, and resumes when the daemon is back.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue watch
  kinocue watch >> changes.txt
  kinocue watch --json | jq .state")]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut shown = match (args.server.json, io::stdout().is_terminal()) {
        (true, _) => WatchShown::Json,
        (false, true) => WatchShown::Panel(WatchPanel::new()),
        (false, false) => WatchShown::Lines(None),
    };
    block_on(follow(&args.server, &mut shown))
}

async fn follow(server: &ServerArgs, shown: &mut WatchShown) -> Result<Exit, Failure> {
    // A daemon that is not there at all is a fault; one that goes is waited for.
    let socket = server.socket()?;
    let mut events = Events::open(&socket).await?;
    loop {
        let why = match listen(&mut events, shown).await? {
            Some(why) => why,
            None => return Ok(Exit::Done),
        };
        shown.gone(&format!("the daemon at {} is gone: {why}; waiting for it", socket.display()));
        events = loop {
            sleep(AGAIN).await;
            match Events::open(&socket).await {
                Ok(events) => break events,
                Err(failure) if failure.exit == Exit::NotAllowed => return Err(failure),
                Err(_) => {}
            }
        };
        shown.back();
    }
}

/// Shows what comes until it ends, and why it ended; nothing where nobody reads any more.
async fn listen(events: &mut Events, shown: &mut WatchShown) -> Result<Option<&'static str>, Failure> {
    let mut is_old = false;
    loop {
        match events.next().await {
            Ok(Some(data)) => {
                if std::mem::take(&mut is_old) {
                    shown.back();
                }
                if !shown.show(&data)? {
                    return Ok(None);
                }
            }
            Ok(None) if is_old => {}
            Ok(None) => {
                is_old = true;
                let seconds = QUIET.as_secs();
                shown.gone(&format!("no update from the daemon for {seconds} s: what is shown is old"));
            }
            Err(why) => return Ok(Some(why)),
        }
    }
}

/// The way it is shown.
enum WatchShown {
    Json,
    Panel(WatchPanel),
    /// With the status before.
    Lines(Option<Box<Status>>),
}

impl WatchShown {
    /// Shows an event; false where nobody reads any more.
    fn show(&mut self, data: &str) -> Result<bool, Failure> {
        if matches!(self, Self::Json) {
            return line(&plain::json(data));
        }
        // What is no status is for others.
        let Ok(status) = serde_json::from_str::<Status>(data) else { return Ok(true) };
        if status == Status::default() {
            return Ok(true);
        }
        match self {
            Self::Panel(panel) => panel.show(&status),
            Self::Lines(before) => {
                let changes = changes(before.as_deref(), &status);
                *before = Some(Box::new(status));
                for change in changes {
                    if !line(&change)? {
                        return Ok(false);
                    }
                }
            }
            Self::Json => {}
        }
        Ok(true)
    }

    fn gone(&mut self, why: &str) {
        match self {
            Self::Panel(panel) => panel.gone(why),
            Self::Json | Self::Lines(_) => print::tell(&format!("kinocue: {why}")),
        }
    }

    fn back(&mut self) {
        if !matches!(self, Self::Panel(_)) {
            print::tell("kinocue: the daemon is back");
        }
    }
}

/// Writes a line; false where nobody reads any more, which ends the watch.
fn line(text: &str) -> Result<bool, Failure> {
    let text = plain::lines(&text.replace('\n', " ")).into_owned() + "\n";
    match io::stdout().lock().write_all(text.as_bytes()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(error).or_exit(Exit::Io),
    }
}

/// What has changed, a line each; all there is where nothing was known before.
fn changes(before: Option<&Status>, now: &Status) -> Vec<String> {
    let mut lines = Vec::new();
    let was = before.cloned().unwrap_or_default();
    if (&was.state, &was.cause, &was.next) != (&now.state, &now.cause, &now.next) {
        lines.push(now.line());
    }
    let cue = |status: &Status| status.show.as_ref().map(|show| show.cue.clone());
    if cue(&was) != cue(now) {
        lines.push(cue(now).map_or_else(|| "nothing is loaded".to_owned(), |cue| format!("loaded: {cue}")));
    }
    if (&was.levels, was.trim_ms) != (&now.levels, now.trim_ms) {
        lines.push(format!("levels: {}", now.mix()));
    }
    for controller in &now.controllers {
        let known = was.controllers.iter().find(|one| one.name == controller.name);
        let ControllerStatus { name, enabled, health, why, .. } = controller;
        if known.map(|one| (one.enabled, &one.health)) != Some((*enabled, health)) {
            let why = if why.is_empty() { String::new() } else { format!(": {why}") };
            lines.push(format!("{name} {}{why}", controller.stands()));
        }
    }
    let same = |a: &Warning, b: &Warning| (&a.id, &a.controller) == (&b.id, &b.controller);
    for warning in &now.warnings {
        if !was.warnings.iter().any(|one| same(one, warning)) {
            lines.push(warning.line());
        }
    }
    for warning in &was.warnings {
        if !now.warnings.iter().any(|one| same(one, warning)) {
            let about = warning.controller.as_ref().map_or_else(String::new, |name| format!(" {name}"));
            lines.push(format!("over: {}{about}", warning.id));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(json: &str) -> Status {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn a_position_that_goes_on_is_no_change() {
        let at = |s: f64| {
            status(&format!(
                r#"{{"state":"playing","cause":"go","show":{{"cue":"c","length_s":9.0,"position_s":{s}}},"ticks":{s}}}"#,
                s = s
            ))
        };
        let (a, b) = (at(1.0), at(2.0));
        assert_eq!(changes(Some(&a), &b), [""; 0]);
    }

    #[test]
    fn what_changed_is_said_once() {
        let before = status(
            r#"{"state":"playing","cause":"go","controllers":[{"name":"A1","enabled":true,"health":"ok"}],
                "warnings":[{"id":"not-real-time","severity":"warning","text":"t"}]}"#,
        );
        let now = status(
            r#"{"state":"paused","cause":"pause by anna","next":"resume","levels":{"motion":0.5,"vibration":1.0},
                "controllers":[{"name":"A1","enabled":true,"health":"lost","why":"no ack"}],
                "warnings":[{"id":"controller-lost","severity":"error","controller":"A1","text":"lost","remedy":"look"}]}"#,
        );
        assert_eq!(
            changes(Some(&before), &now),
            [
                "paused: pause by anna; next: resume",
                "levels: motion 50 %, vibration 100 %, trim +0 ms",
                "A1 lost: no ack",
                "error controller-lost: A1: lost; look",
                "over: not-real-time",
            ]
        );
        assert_eq!(changes(Some(&now), &now), [""; 0]);
    }
}
