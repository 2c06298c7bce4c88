//! The watchdog of the service manager: fed only while the tick thread ticks, in whatever state, and the ack
//! thread reads replies. A thread of its own looks,
//! so that no surface that hangs starves it, and none that lives feeds it for a tick thread that hangs.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use sd_notify::{NotifyState, notify};

use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Looks within the time that the service manager waits.
const LOOKS: u32 = 4;
/// How long a hall may take to close or to open, while nothing ticks.
const BETWEEN: Duration = Duration::from_secs(10);

/// What counts the ticks, and the drains of the ack thread.
pub(crate) type Pulse = [u64; 2];

/// True if the watchdog is to be fed, by counters of ticks and of drains; told the time.
#[derive(Debug)]
pub(crate) struct FeedDecision {
    patience: Duration,
    seen: Option<Pulse>,
    /// When each counter moved last, or was there, or went.
    moved: [MonoTime; 2],
}

impl FeedDecision {
    /// One for a service manager that waits `interval` long, and ticks every `period`. No counter may stand still from one
    /// look to the next no longer than a quarter of the interval, or two periods where ticks are rare.
    #[must_use]
    pub(crate) fn new(interval: Duration, period: Duration, beats: Option<Pulse>, now: MonoTime) -> Self {
        Self { patience: (interval / LOOKS).max(2 * period), seen: beats, moved: [now; 2] }
    }

    /// True if all goes on: to be asked four times within the interval. Where there is no counter, because a hall closes
    /// or opens, that is as good for ten seconds.
    #[must_use]
    pub(crate) fn feed(&mut self, beats: Option<Pulse>, now: MonoTime) -> bool {
        for (counter, moved) in self.moved.iter_mut().enumerate() {
            let count = |pulse: Option<Pulse>| pulse.map(|pulse| pulse[counter]);
            if count(beats) != count(self.seen) {
                *moved = now;
            }
        }
        self.seen = beats;
        let patience = if beats.is_some() { self.patience } else { BETWEEN };
        self.moved.iter().all(|moved| now.since(*moved) < patience)
    }
}

/// The thread that feeds the watchdog. It ends when this is dropped.
#[derive(Debug)]
pub(crate) struct WatchdogThread {
    done: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl WatchdogThread {
    /// Feeds the service manager that waits `interval` long ([`watchdog()`](super::watchdog())) while `beats` counts ticks, which come
    /// every `period`, in every state of the hall; it gives none while no hall is open. To be started by a thread of ordinary
    /// priority.
    ///
    /// # Errors
    /// If the system starts no further thread.
    pub(crate) fn start(
        interval: Duration,
        period: Duration,
        beats: impl Fn() -> Option<Pulse> + Send + 'static,
    ) -> io::Result<Self> {
        // A message that does not get through is missed by whom it is for, which is what a watchdog is there for.
        Self::feeding(interval, period, beats, || drop(notify(&[NotifyState::Watchdog])))
    }

    fn feeding(
        interval: Duration,
        period: Duration,
        beats: impl Fn() -> Option<Pulse> + Send + 'static,
        mut feed: impl FnMut() + Send + 'static,
    ) -> io::Result<Self> {
        let done = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&done);
        let thread = thread::Builder::new().name("watchdog".to_owned()).spawn(move || {
            let mut hunger = FeedDecision::new(interval, period, beats(), Monotonic.now());
            while !end.load(Ordering::Acquire) {
                // Not a sleep: who wants it to end unparks it. A look too early does no harm.
                thread::park_timeout(interval / LOOKS);
                if hunger.feed(beats(), Monotonic.now()) {
                    feed();
                }
            }
        })?;
        Ok(Self { done, thread: Some(thread) })
    }
}

impl Drop for WatchdogThread {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It has nothing to tell, and a panic of it is no reason for another.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc;

    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// Both counters stand there.
    #[expect(clippy::unnecessary_wraps, reason = "as they are told")]
    fn both(count: u64) -> Option<Pulse> {
        Some([count; 2])
    }

    #[test]
    fn it_is_not_fed_while_one_of_the_two_stands() {
        let mut hunger = FeedDecision::new(SECOND, Duration::from_millis(10), Some([0, 0]), ms(0));
        assert!(hunger.feed(Some([25, 40]), ms(200)));
        assert!(!hunger.feed(Some([50, 40]), ms(450)), "nobody hears of an emergency stop");
        assert!(hunger.feed(Some([75, 41]), ms(650)));
        assert!(!hunger.feed(Some([75, 90]), ms(900)));
    }

    fn ms(ms: u64) -> MonoTime {
        MonoTime::default() + Duration::from_millis(ms)
    }

    #[test]
    fn it_is_fed_while_the_counter_moves_and_not_once_it_stands() {
        let mut hunger = FeedDecision::new(SECOND, Duration::from_millis(10), both(0), ms(0));
        assert!(hunger.feed(both(25), ms(250)));
        assert!(hunger.feed(both(26), ms(500)), "one tick is enough");
        assert!(!hunger.feed(both(26), ms(750)), "it hangs");
        assert!(!hunger.feed(both(26), ms(1_000)));
        assert!(hunger.feed(both(27), ms(1_250)), "it was late, and goes on");
    }

    #[test]
    fn a_tick_thread_that_never_ticked_gets_nothing() {
        let mut hunger = FeedDecision::new(SECOND, Duration::from_millis(1), both(0), ms(0));
        assert!((1..40).all(|look| !hunger.feed(both(0), ms(250 * look))));
    }

    #[test]
    fn ticks_once_a_second_are_no_hang() {
        let mut hunger = FeedDecision::new(4 * SECOND, SECOND, both(0), ms(0));
        assert!((1..=10).all(|s| hunger.feed(both(s), ms(1_000 * s))));
        assert!(hunger.feed(both(10), ms(11_000)), "the next tick may be due this very moment");
        assert!(!hunger.feed(both(10), ms(12_000)));
    }

    #[test]
    fn a_hall_that_is_opened_anew_has_ten_seconds_and_counts_from_where_it_likes() {
        let mut hunger = FeedDecision::new(SECOND, Duration::from_millis(10), both(7_000), ms(0));
        assert!((1..40).all(|look| hunger.feed(None, ms(250 * look))));
        assert!(hunger.feed(both(0), ms(10_000)));
        assert!(!hunger.feed(both(0), ms(10_250)), "open, it has to tick");
        assert!(hunger.feed(None, ms(10_500)));
        assert!(!hunger.feed(None, ms(20_500)), "it neither opens nor ends");
    }

    #[test]
    fn the_thread_feeds_while_ticks_come_and_ends_when_it_is_dropped() {
        let ticks = Arc::new(AtomicU64::new(0));
        let (fed, feeds) = mpsc::channel();
        let beats = move || both(ticks.fetch_add(1, Ordering::Relaxed));
        let interval = Duration::from_millis(4);
        let feeder = WatchdogThread::feeding(interval, interval, beats, move || {
            let _ = fed.send(());
        })
        .unwrap();
        for _ in 0..3 {
            feeds.recv().unwrap();
        }
        drop(feeder);
        while feeds.try_recv().is_ok() {}
        assert_eq!(feeds.try_recv(), Err(mpsc::TryRecvError::Disconnected), "the thread is gone");
    }
}
