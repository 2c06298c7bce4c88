//! Events of the hall as log lines: to the journal with fields, or as text to the standard
//! error output. At most one line a second for each cause. Any thread but the tick thread may speak; none of them waits, and
//! a thread of its own writes.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

mod journal;
mod limit;

pub(crate) use crate::plain::escaped;
use journal::Journal;
use limit::RateLimiter;

/// Lines that wait to be written at the most.
const QUEUE: usize = 256;
/// How long the end of the program waits for the last lines.
const FLUSH: Duration = Duration::from_secs(1);
/// The longest line of text, bytes.
const TEXT_LEN: usize = 4_096;

/// How grave a line is; the numbers are those of syslog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Priority {
    /// The show suffers.
    Error = 3,
    /// Worth a look.
    Warning = 4,
    /// Somebody did something, or the state changed.
    Notice = 5,
    /// Good to know.
    Info = 6,
}

impl Priority {
    const fn word(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Notice => "notice",
            Self::Info => "info",
        }
    }
}

/// One line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Line {
    /// How grave it is.
    pub(crate) priority: Priority,
    /// Why it is said: a stable word. Lines of one cause hold each other back.
    pub(crate) cause: Cow<'static, str>,
    /// What a person reads; control characters are escaped on the way out.
    pub(crate) message: String,
    /// What programs read: names in lower case, as `controller`, and their values.
    pub(crate) fields: Vec<(&'static str, String)>,
}

impl Line {
    /// One without fields.
    #[must_use]
    pub(crate) fn new(
        priority: Priority,
        cause: impl Into<Cow<'static, str>>,
        message: impl Into<String>,
    ) -> Self {
        Self { priority, cause: cause.into(), message: message.into(), fields: Vec::new() }
    }

    /// The same with a field more.
    #[must_use]
    pub(crate) fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.fields.push((name, value.into()));
        self
    }

    /// As it stands on a terminal: `warning: A1 is silent (controller-lost, controller A1)`.
    fn text(&self) -> String {
        let Self { priority, cause, message, fields } = self;
        let fields: String = fields.iter().map(|(name, value)| format!(", {name} {value}")).collect();
        let line = format!("{}: {message} ({cause}{fields})", priority.word());
        escaped(&line, TEXT_LEN).into_owned()
    }
}

/// Where to say something; one each for whoever speaks.
#[derive(Debug, Clone)]
pub struct Log(Arc<LogShared>);

#[derive(Debug, Default)]
struct LogShared {
    state: Mutex<LogState>,
    /// Wakes the writer, and whoever waits for its end.
    wake: Condvar,
    dropped: AtomicU64,
}

#[derive(Debug, Default)]
struct LogState {
    limiter: RateLimiter,
    queue: VecDeque<Line>,
    closing: bool,
    written: bool,
}

impl Log {
    /// Starts the thread that writes: to the journal, where the standard error output goes there, else through `tell`, which
    /// may block. To be started by a thread of ordinary priority.
    ///
    /// # Errors
    /// If the system starts no further thread.
    pub fn start(mut tell: impl FnMut(&str) + Send + 'static) -> io::Result<Self> {
        match Journal::open() {
            Some(journal) => Self::writing(move |line| journal.send(line).is_ok()),
            None => Self::writing(move |line| {
                tell(&line.text());
                true
            }),
        }
    }

    fn writing(write: impl FnMut(&Line) -> bool + Send + 'static) -> io::Result<Self> {
        let shared = Arc::new(LogShared::default());
        let writer = Arc::clone(&shared);
        thread::Builder::new().name("log".to_owned()).spawn(move || writer.write(write))?;
        Ok(Self(shared))
    }

    /// Says it, or holds it back, or drops it where too much waits already. Waits for nobody who writes.
    pub(crate) fn say(&self, line: Line) {
        let now = Monotonic.now();
        let mut state = self.0.lock();
        if let Some(line) = state.limiter.offer(line, now) {
            self.0.put(&mut state, line);
        }
        drop(state);
        // Also for what is held back: the writer has to know when that is due.
        self.0.wake.notify_all();
    }

    /// Lines that were dropped so far.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn dropped(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
    }

    /// Writes what waits and what is held back, waiting for it a second at the most. Nothing is written after that.
    pub(crate) fn close(&self) {
        let mut state = self.0.lock();
        state.closing = true;
        self.0.wake.notify_all();
        let waiting = self.0.wake.wait_timeout_while(state, FLUSH, |state| !state.written);
        drop(waiting);
    }
}

impl LogShared {
    fn lock(&self) -> MutexGuard<'_, LogState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, state: &mut LogState, line: Line) {
        if state.queue.len() < QUEUE {
            state.queue.push_back(line);
        } else {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Writes each line as it comes, until it is closed.
    fn write(&self, mut write: impl FnMut(&Line) -> bool) {
        let mut told = 0;
        while let Some(mut line) = self.next() {
            let dropped = self.dropped.load(Ordering::Relaxed);
            if dropped > told {
                line.message.push_str(&format!(" [{} lines were dropped]", dropped - told));
            }
            if write(&line) {
                told = dropped;
            } else {
                self.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
        self.lock().written = true;
        self.wake.notify_all();
    }

    /// The next line to write, waited for; none once it is closed and all is written.
    fn next(&self) -> Option<Line> {
        let mut state = self.lock();
        loop {
            let now = Monotonic.now();
            let lines = if state.closing { state.limiter.rest() } else { state.limiter.due(now) };
            for line in lines {
                self.put(&mut state, line);
            }
            if let Some(line) = state.queue.pop_front() {
                return Some(line);
            }
            if state.closing {
                return None;
            }
            state = match state.limiter.next() {
                None => self.wake.wait(state).unwrap_or_else(PoisonError::into_inner),
                Some(due) => {
                    let waited = self.wake.wait_timeout(state, due.since(now));
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    fn line(cause: &'static str) -> Line {
        Line::new(Priority::Notice, cause, cause)
    }

    #[test]
    fn a_line_of_text_says_how_grave_it_is_and_why() {
        let line = Line::new(Priority::Warning, "controller-lost", "A1 is silent").with("controller", "A1\n");
        assert_eq!(line.text(), "warning: A1 is silent (controller-lost, controller A1\\n)");
    }

    #[test]
    fn what_was_said_is_written_also_what_was_held_back_when_the_log_is_closed() {
        let (written, lines) = mpsc::channel();
        let log = Log::writing(move |line| written.send(line.message.clone()).is_ok()).unwrap();
        let other = log.clone();
        thread::spawn(move || other.say(line("parked"))).join().unwrap();
        log.say(line("armed"));
        log.say(line("armed"));
        log.close();
        assert_eq!(lines.iter().collect::<Vec<_>>(), ["parked", "armed", "armed"]);
        assert_eq!(log.dropped(), 0);
    }

    #[test]
    fn nobody_waits_for_a_writer_that_is_stuck_and_what_was_dropped_is_told() {
        let (go, gate) = mpsc::channel::<()>();
        let (written, lines) = mpsc::channel();
        let log = Log::writing(move |line| {
            let _ = gate.recv();
            written.send(line.message.clone()).is_ok()
        })
        .unwrap();
        log.say(line("first"));
        let mut state = log.0.lock();
        for _ in 0..QUEUE + 10 {
            log.0.put(&mut state, line("more"));
        }
        drop(state);
        assert!((10..=11).contains(&log.dropped()), "by whether the first was taken: {}", log.dropped());
        drop(go);
        log.close();
        let told = lines.iter().filter(|line| line.ends_with("lines were dropped]")).count();
        assert_eq!(told, 1);
    }

    #[test]
    fn a_line_that_the_journal_does_not_take_counts_as_dropped() {
        let log = Log::writing(|_| false).unwrap();
        log.say(line("parked"));
        log.close();
        assert_eq!(log.dropped(), 1);
    }
}
