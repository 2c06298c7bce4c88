//! Notifies the service manager: that the hall is ready, its state, and that its ticks go on. Control plane; if no
//! service manager wants notifications (`NOTIFY_SOCKET`), all of it does nothing. By the protocol of `sd_notify(3)`.

use std::borrow::Cow;
use std::io;
use std::time::Duration;

use sd_notify::{NotifyState, notify};

use crate::log::escaped;
use crate::time::MonoTime;

mod watchdog;

pub(crate) use watchdog::WatchdogThread;

/// How often the line in `systemctl status` changes at the most.
const STATUS_EVERY: Duration = Duration::from_secs(1);
/// The longest such line, bytes; systemd takes no more than 4,096 in all.
const STATUS_LEN: usize = 1_024;

/// Tells the service manager how the hall is. Of one thread, which owns it.
#[derive(Debug, Default)]
pub(crate) struct Notifier {
    line: StatusLine,
}

impl Notifier {
    /// The hall is ready: controllers were asked once, and the surfaces are open.
    ///
    /// # Errors
    /// That of the socket; the service manager will take the start for a failed one.
    pub(crate) fn ready(&mut self, text: &str, now: MonoTime) -> io::Result<()> {
        self.line.is(text, now);
        notify(&[NotifyState::Ready, NotifyState::Status(&line(text))])
    }

    /// What the hall does, in a line. Told once a second at the most, and only where it differs from what was told before;
    /// to be called again with every new status, so that what came too early is told then.
    pub(crate) fn status(&mut self, text: &str, now: MonoTime) {
        if self.line.is(text, now) {
            // Whoever looks sees the line before this one; the next second tries again.
            let _ = notify(&[NotifyState::Status(&line(text))]);
        }
    }

    /// The hall parks its seats and ends.
    ///
    /// # Errors
    /// That of the socket.
    pub(crate) fn stopping(&mut self, text: &str, now: MonoTime) -> io::Result<()> {
        self.line.is(text, now);
        notify(&[NotifyState::Stopping, NotifyState::Status(&line(text))])
    }
}

/// How long the service manager waits for a sign of life, if it waits for any (`WATCHDOG_USEC`, meant for this process).
#[must_use]
pub(crate) fn watchdog() -> Option<Duration> {
    sd_notify::watchdog_enabled().filter(|interval| !interval.is_zero())
}

/// When a line is told.
#[derive(Debug, Default)]
struct StatusLine {
    told: Option<(MonoTime, String)>,
}

impl StatusLine {
    /// True if it is to be told now; taken for told then.
    fn is(&mut self, text: &str, now: MonoTime) -> bool {
        let tell = match &self.told {
            Some((at, last)) => last != text && now.since(*at) >= STATUS_EVERY,
            None => true,
        };
        if tell {
            self.told = Some((now, text.to_owned()));
        }
        tell
    }
}

/// The text as one line: a line break in it would begin another message to the service manager.
fn line(text: &str) -> Cow<'_, str> {
    escaped(text, STATUS_LEN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(seconds: f64) -> MonoTime {
        MonoTime::default() + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn a_line_is_told_at_once_then_once_a_second_and_never_twice() {
        let mut line = StatusLine::default();
        assert!(line.is("parked", s(0.0)));
        assert!(!line.is("armed", s(0.9)), "too early");
        assert!(line.is("armed", s(1.0)), "told as soon as it may");
        assert!(!line.is("armed", s(9.0)), "nothing new");
        assert!(line.is("playing", s(9.1)));
    }

    #[test]
    fn a_status_cannot_smuggle_in_another_message() {
        assert_eq!(line("cue a\nWATCHDOG=trigger"), "cue a\\nWATCHDOG=trigger");
        assert!(line(&"x".repeat(9_000)).len() <= STATUS_LEN + '…'.len_utf8());
    }
}
