//! Follows the status of the hall and tells it on: to the service manager as a line and, once, as ready; to the log as news.

use std::sync::Arc;

use tokio::sync::watch;

use super::{StatusLine, ready, status};
use crate::hall::Status;
use crate::log::{Line, Log, Priority, news};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// After how long the hall counts as ready, whatever its controllers say.
const READY_S: f64 = 10.0;

/// Follows until the hall is gone. To be run beside the surfaces, once they are open.
pub async fn follow(mut statuses: watch::Receiver<Arc<Status>>, log: Log) {
    let mut line = StatusLine::default();
    let mut told_ready = false;
    let mut before = Arc::clone(&statuses.borrow_and_update());
    loop {
        let after = Arc::clone(&statuses.borrow_and_update());
        news(&before, &after).into_iter().for_each(|line| log.say(line));
        let text = words(&after);
        if !told_ready && is_ready(&after) {
            told_ready = true;
            if let Err(error) = ready(&text) {
                log.say(Line::new(
                    Priority::Error,
                    "service-manager",
                    format!("cannot tell that it is ready: {error}"),
                ));
            }
        }
        if line.is(&text, Monotonic.now()) {
            // Whoever looks sees the line before this one; the next change tries again.
            let _ = status(&text);
        }
        before = after;
        if statuses.changed().await.is_err() {
            return;
        }
    }
}

/// Whether all controllers were asked once: the hall knows then where it stands, or they had their time.
fn is_ready(status: &Status) -> bool {
    status.state != "boot" || status.uptime_s >= READY_S
}

/// The hall in a line.
fn words(status: &Status) -> String {
    let Status { state, cause, next, .. } = status;
    let enabled = status.controllers.iter().filter(|one| one.enabled);
    let silent: Vec<_> = enabled
        .filter(|one| matches!(one.standing, "lost" | "unknown"))
        .map(|one| one.name.as_str())
        .collect();
    let silent = match silent.as_slice() {
        [] => String::new(),
        [one] => format!("; {one} does not answer"),
        [first, ..] => format!("; {} controllers do not answer, {first} first", silent.len()),
    };
    let show = status.show.as_ref().map(|show| format!(" ({})", show.cue)).unwrap_or_default();
    format!("{state}{show}: {cause}{silent}; next: {next}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::tests::playing;

    #[test]
    fn a_hall_is_ready_once_it_knows_where_it_stands_and_after_ten_seconds_in_any_case() {
        let at = |state, uptime_s| is_ready(&Status { state, uptime_s, ..playing() });
        assert!(!at("boot", 9.9));
        assert!(at("boot", 10.0), "no controller answers");
        assert!(at("recovering", 0.3) && at("parked", 0.3));
    }

    #[test]
    fn the_line_has_state_cause_and_next_action_and_who_is_silent() {
        let mut status = playing();
        assert_eq!(words(&status), "playing (storm): somebody asked; next: nothing");
        status.controllers[1].standing = "lost";
        assert!(words(&status).contains("; B1 does not answer; next"));
        status.controllers[0].standing = "unknown";
        assert!(words(&status).contains("; 2 controllers do not answer, A1 first; next"));
        status.controllers.iter_mut().for_each(|one| one.enabled = false);
        assert!(!words(&status).contains("answer"));
    }

    #[test]
    fn every_change_of_the_hall_reaches_the_log_until_the_hall_is_gone() {
        let (source, statuses) = watch::channel(Arc::new(playing()));
        let (told, lines) = std::sync::mpsc::channel();
        let log = Log::writing(move |line| told.send(line.message.clone()).is_ok()).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let following = log.clone();
        runtime.block_on(async {
            let follower = tokio::spawn(follow(statuses, following));
            tokio::task::yield_now().await;
            source.send_replace(Arc::new(Status { state: "paused", ..playing() }));
            drop(source);
            follower.await.unwrap();
        });
        log.close();
        drop(log);
        let lines: Vec<String> = lines.iter().collect();
        assert_eq!(lines, ["paused: somebody asked; next: nothing"]);
    }
}
