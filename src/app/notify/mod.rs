//! Alarms to people who are elsewhere: what is raised or over in the warnings of the hall goes into a message of its web hook, and into a
//! mail. A thread for each way, which waits for networks and programs; the supervisor only puts alarms into its queue, and where that
//! is full they are counted.

mod mail;
mod outbox;
mod webhook;

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;

use jiff::Zoned;

use crate::config;
use crate::control::{NotifyStatus, Severity, Warning};
use crate::journal::stamp;
use crate::log::{Line, Log, Priority};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::Clock as _;
use outbox::{Alarm, AlarmMessage, AlarmTurn, Outbox};

/// The warning that says that nobody is told, which is told to nobody.
pub(crate) const WARNING: &str = "notify";
/// Alarms that wait for a thread at the most.
const QUEUE: usize = 256;

/// How the ways to tell are: their threads write, the supervisor reads.
#[derive(Debug, Clone, Default)]
pub(crate) struct NotifyTable(Arc<Mutex<Vec<NotifyStatus>>>);

impl NotifyTable {
    fn with<T>(&self, does: impl FnOnce(&mut Vec<NotifyStatus>) -> T) -> T {
        does(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// How each is.
    #[must_use]
    pub(crate) fn status(&self) -> Vec<NotifyStatus> {
        self.with(|ways| ways.clone())
    }
}

/// One way to tell.
#[derive(Debug)]
struct AlarmQueue {
    queue: SyncSender<Alarm>,
    /// Alarms that found no room.
    omitted: Arc<AtomicU64>,
}

/// Tells what is raised, and what is over.
#[derive(Debug, Default)]
pub(crate) struct AlarmTeller {
    least: Severity,
    ways: Vec<AlarmQueue>,
    table: NotifyTable,
    /// What was raised and is not over.
    raised: BTreeMap<(String, Option<String>), Warning>,
}

impl AlarmTeller {
    /// One that tells as a configuration says; nobody, where it says nothing.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(crate) fn start(config: &config::Config, log: &Log) -> io::Result<Self> {
        let Some(notify) = config.notify.clone() else { return Ok(Self::default()) };
        let least = if notify.has_warnings { Severity::Warning } else { Severity::Error };
        let mut notifier = Self { least, ..Self::default() };
        let outbox = || Outbox::new(&config.show.name, format!("{:x}", wall_now_ns()), notify.every);
        if let Some(hook) = notify.webhook {
            notifier.add("webhook", outbox(), log, move |message| webhook::post(&hook, message))?;
        }
        if let Some(to) = notify.mail {
            notifier.add("mail", outbox(), log, move |message| mail::send(&to, message))?;
        }
        Ok(notifier)
    }

    fn add(
        &mut self,
        name: &str,
        outbox: Outbox,
        log: &Log,
        send: impl FnMut(&AlarmMessage) -> Result<(), String> + Send + 'static,
    ) -> io::Result<()> {
        let (queue, alarms) = sync_channel(QUEUE);
        let omitted = Arc::<AtomicU64>::default();
        let place = self.table.with(|ways| {
            ways.push(NotifyStatus { way: name.to_owned(), ..NotifyStatus::default() });
            ways.len() - 1
        });
        let thread = AlarmThread {
            place,
            table: self.table.clone(),
            log: log.clone(),
            omitted: Arc::clone(&omitted),
            outbox,
            alarms,
        };
        Builder::new().name("notify".to_owned()).spawn(move || thread.run(send))?;
        self.ways.push(AlarmQueue { queue, omitted });
        Ok(())
    }

    /// How the ways to tell are, if there are any.
    #[must_use]
    pub(crate) fn table(&self) -> Option<NotifyTable> {
        (!self.ways.is_empty()).then(|| self.table.clone())
    }

    /// Takes the warnings of now, and tells what is new of them. Waits for nobody.
    pub(crate) fn take<'w>(&mut self, warnings: impl Iterator<Item = &'w Warning>) {
        if self.ways.is_empty() {
            return;
        }
        let counts = |warning: &&Warning| warning.severity >= self.least && warning.id != WARNING;
        let now: BTreeMap<_, _> = warnings
            .filter(counts)
            .map(|warning| ((warning.id.clone(), warning.controller.clone()), warning.clone()))
            .collect();
        let before = std::mem::replace(&mut self.raised, now);
        let raised = self.raised.iter().filter(|(key, _)| !before.contains_key(*key));
        let over = before.iter().filter(|(key, _)| !self.raised.contains_key(*key));
        let turns = raised.map(|(_, warning)| (AlarmTurn::Raised, warning));
        for (turn, warning) in turns.chain(over.map(|(_, warning)| (AlarmTurn::Cleared, warning))) {
            self.ways.iter().for_each(|way| way.put(alarm(turn, warning)));
        }
    }
}

impl AlarmQueue {
    fn put(&self, alarm: Alarm) {
        if self.queue.try_send(alarm).is_err() {
            self.omitted.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn alarm(what: AlarmTurn, warning: &Warning) -> Alarm {
    Alarm {
        what,
        id: warning.id.clone(),
        severity: warning.severity.word(),
        controller: warning.controller.clone(),
        text: warning.text.clone(),
        remedy: warning.remedy.clone(),
        at: stamp(&Zoned::now()),
    }
}

/// The thread of one way.
struct AlarmThread {
    place: usize,
    table: NotifyTable,
    log: Log,
    omitted: Arc<AtomicU64>,
    outbox: Outbox,
    alarms: Receiver<Alarm>,
}

impl AlarmThread {
    /// Tells what comes, until nobody is there any more that something could come from.
    fn run(mut self, mut send: impl FnMut(&AlarmMessage) -> Result<(), String>) {
        loop {
            let next = match self.outbox.waits(Monotonic.now()) {
                Some(wait) => self.alarms.recv_timeout(wait),
                None => self.alarms.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match next {
                Ok(alarm) => self.outbox.add(alarm, Monotonic.now()),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            self.outbox.omit(self.omitted.swap(0, Ordering::Relaxed));
            if let Some(result) = self.outbox.due(Monotonic.now()).map(&mut send) {
                self.note(result);
            }
        }
    }

    fn note(&mut self, result: Result<(), String>) {
        let (now, place) = (Monotonic.now(), self.place);
        let Err(trouble) = result else {
            self.outbox.sent(now);
            return self.table.with(|ways| {
                ways[place].sent += 1;
                ways[place].trouble = None;
            });
        };
        let gives_up = self.outbox.failed(now);
        let way = self.table.with(|ways| {
            ways[place].lost += u64::from(gives_up);
            ways[place].trouble = Some(trouble.clone());
            ways[place].way.clone()
        });
        let then = if gives_up { "it is given up" } else { "it is tried again" };
        let text = format!("a message of alarms by {way} was not sent, {then}: {trouble}");
        self.log.say(Line::new(Priority::Warning, WARNING, text));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    fn warning(id: &str, controller: Option<&str>, severity: Severity) -> Warning {
        Warning {
            id: id.to_owned(),
            severity,
            controller: controller.map(str::to_owned),
            text: "text".to_owned(),
            ..Warning::default()
        }
    }

    /// One whose queue is not read.
    fn notifier() -> (AlarmTeller, Receiver<Alarm>) {
        let (queue, alarms) = sync_channel(2);
        let ways = vec![AlarmQueue { queue, omitted: Arc::default() }];
        (AlarmTeller { least: Severity::Error, ways, ..AlarmTeller::default() }, alarms)
    }

    #[test]
    fn an_alarm_is_told_as_it_is_raised_and_as_it_is_over_and_not_between() {
        let (mut notifier, alarms) = notifier();
        let told = || alarms.try_iter().map(|alarm| (alarm.what, alarm.controller)).collect::<Vec<_>>();
        let lost = warning("controller-lost", Some("A1"), Severity::Error);
        let minor = warning("film", None, Severity::Warning);
        let own = warning(WARNING, None, Severity::Error);
        for _ in 0..3 {
            notifier.take([&lost, &minor, &own].into_iter());
        }
        assert_eq!(told(), [(AlarmTurn::Raised, Some("A1".to_owned()))]);
        notifier.take([&minor].into_iter());
        assert_eq!(told(), [(AlarmTurn::Cleared, Some("A1".to_owned()))]);
    }

    #[test]
    fn nobody_waits_for_a_way_that_is_stuck_and_what_found_no_room_is_counted() {
        let (mut notifier, _alarms) = notifier();
        let all: Vec<_> =
            (0..10).map(|seat| warning("lost", Some(&seat.to_string()), Severity::Error)).collect();
        notifier.take(all.iter());
        assert_eq!(notifier.ways[0].omitted.load(Ordering::Relaxed), 8);
    }

    #[test]
    fn what_fails_is_in_the_status_until_something_is_sent() {
        let log = Log::start(|_| ()).unwrap();
        let mut notifier = AlarmTeller::default();
        let (answer, answers) = mpsc::channel::<Result<(), String>>();
        let (tried, tries) = mpsc::channel();
        let outbox = Outbox::new("Hall 1", "m".to_owned(), Duration::ZERO);
        let send = move |message: &AlarmMessage| {
            let _ = tried.send(message.alarms.len()); // the test may be over
            answers.recv().unwrap_or(Ok(()))
        };
        notifier.add("mail", outbox, &log, send).unwrap();
        notifier.take([&warning("lost", None, Severity::Error)].into_iter());
        assert_eq!(tries.recv_timeout(Duration::from_secs(60)), Ok(1));
        answer.send(Err("no mailer; install one".to_owned())).unwrap();
        // It is tried again after five seconds; what it says then comes after what was noted.
        assert_eq!(tries.recv_timeout(Duration::from_secs(60)), Ok(1));
        let table = notifier.table().unwrap();
        assert_eq!(table.status()[0].trouble.as_deref(), Some("no mailer; install one"));
        answer.send(Ok(())).unwrap();
        notifier.take(std::iter::empty());
        assert_eq!(tries.recv_timeout(Duration::from_secs(60)), Ok(1));
        assert_eq!((table.status()[0].sent, table.status()[0].trouble.clone()), (1, None));
    }
}
