//! Ports of surfaces that could not be opened yet. The hall is there without them; each is tried again, ever less often.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::sys::lock::lock;

/// When it is tried again first, and how long from one try to the next at the most.
const FIRST: Duration = Duration::from_secs(1);
const MOST: Duration = Duration::from_secs(30);

/// Which they are, and why they are not open. Clones share it; any thread but tick.
#[derive(Debug, Clone, Default)]
pub(crate) struct AwaitedPorts(Arc<Mutex<BTreeMap<String, String>>>);

impl AwaitedPorts {
    /// Opens one, or notes why it does not open.
    pub(crate) fn try_open<T, E: fmt::Display>(
        &self,
        what: &str,
        open: impl FnOnce() -> Result<T, E>,
    ) -> Option<T> {
        let opened = open();
        let mut awaited = lock(&self.0);
        match &opened {
            Ok(_) => awaited.remove(what),
            Err(why) => awaited.insert(what.to_owned(), why.to_string()),
        };
        opened.ok()
    }

    /// Opens one as soon as that is possible.
    pub(crate) async fn open<T, E: fmt::Display>(
        &self,
        what: &str,
        mut open: impl FnMut() -> Result<T, E>,
    ) -> T {
        let mut pause = FIRST;
        loop {
            tokio::time::sleep(pause).await;
            if let Some(opened) = self.try_open(what, &mut open) {
                return opened;
            }
            pause = longer(pause);
        }
    }

    /// What does not open, and why, with what to do; `None` where all are open.
    pub(crate) fn trouble(&self) -> Option<String> {
        let why = lock(&self.0).values().cloned().collect::<Vec<_>>().join(", ");
        let remedy =
            "end the program that has the port, or name another in the configuration; it is tried again";
        (!why.is_empty()).then(|| format!("{why}; {remedy}"))
    }
}

/// How long to wait after another try that failed.
fn longer(pause: Duration) -> Duration {
    (2 * pause).min(MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_tried_again_until_it_opens_and_is_named_until_then() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let (ports, mut tries) = (AwaitedPorts::default(), 0);
        assert!(ports.try_open("osc", || Err::<(), _>("it is in use")).is_none());
        assert!(ports.trouble().is_some_and(|trouble| trouble.starts_with("it is in use; end the program")));
        let opened = runtime.block_on(ports.open("osc", || {
            tries += 1;
            Ok::<_, String>(7)
        }));
        assert_eq!((opened, tries), (7, 1));
        assert_eq!(ports.trouble(), None);
    }

    #[test]
    fn each_pause_is_longer_than_the_one_before_up_to_half_a_minute() {
        let pauses = std::iter::successors(Some(FIRST), |pause| Some(longer(*pause)));
        let seconds: Vec<u64> = pauses.take(7).map(|pause| pause.as_secs()).collect();
        assert_eq!(seconds, [1, 2, 4, 8, 16, 30, 30]);
    }
}
