//! How surfaces reach the hall: a bounded queue of asks, each with the way back for its answer; the newest status; and the
//! stop, which waits for neither.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::Thread;
use std::time::Duration;

use tokio::sync::{oneshot, watch};

use super::posted::{Posted, gone};
use super::{Code, Command, Problem, SharedClock, Status, Who};
use crate::rt::{Calls, Desk};
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Asks that wait at the most; of a flood the rest is refused.
const ASKS: usize = 64;

/// How old an ask that [goes stale](Command::goes_stale) may be when its turn comes.
const FRESH: Duration = Duration::from_secs(2);

/// How far the clock of whoever asks may be ahead of ours. What is dated later would be fresh for longer than [`FRESH`]: it could be held
/// up, and come when nobody expects it any more.
const AHEAD: Duration = Duration::from_millis(250);

/// When something was asked, by our own clock, that is so many milliseconds old by the clock of whoever asked, negative where that is
/// ahead; the most that it may be where it is more.
pub(crate) fn asked_at(age_ms: i128, now: MonoTime) -> Result<MonoTime, Duration> {
    let age = Duration::from_millis(u64::try_from(age_ms.unsigned_abs()).unwrap_or(u64::MAX));
    match age_ms {
        ..=0 if age <= AHEAD => Ok(now), // its clock is ahead
        ..=0 => Err(AHEAD),
        _ if age <= FRESH => Ok(now.before(age)),
        _ => Err(FRESH),
    }
}

/// What a surface wants, and on whose behalf.
#[derive(Debug, Clone, PartialEq)]
pub struct Desired {
    /// What.
    pub ask: Command,
    /// Who.
    pub who: Who,
}

/// An ask on its way to the supervisor of the hall.
#[derive(Debug)]
pub struct Asked {
    /// What, and who.
    pub desired: Desired,
    asked_at: MonoTime,
    /// True once it is taken, or given up: whoever sets it first decides. A stop is never given up.
    settled: Arc<AtomicBool>,
    reply: oneshot::Sender<Result<Arc<Status>, Problem>>,
}

impl Asked {
    fn is_stale(&self, now: MonoTime) -> bool {
        self.desired.ask.goes_stale() && now.since(self.asked_at) > FRESH
    }

    /// True if it was asked before that instant.
    #[must_use]
    pub(crate) fn is_before(&self, at: MonoTime) -> bool {
        self.asked_at < at
    }

    /// Answers it: the state that it led to, or why it was not done.
    pub fn answer(self, answer: Result<Arc<Status>, Problem>) {
        drop(self.reply.send(answer)); // whoever asked may have gone
    }
}

/// The supervisor's end: asks come out, in the order in which they were asked.
#[derive(Debug)]
pub struct Inbox(mpsc::Receiver<Asked>);

impl Inbox {
    /// The next ask, waited for so long; `None` if nobody asked, or all surfaces are gone. What has gone
    /// stale while it waited is answered here and never comes out: nobody expects it any more. Neither does what was given up.
    #[must_use]
    pub fn next(&self, wait: Duration) -> Option<Asked> {
        let until = Monotonic.now() + wait;
        loop {
            let asked = self.0.recv_timeout(until.since(Monotonic.now())).ok()?;
            if asked.settled.swap(true, Ordering::AcqRel) {
                continue;
            }
            if !asked.is_stale(Monotonic.now()) {
                return Some(asked);
            }
            let problem = late(asked.desired.ask.word());
            asked.answer(Err(problem));
        }
    }
}

/// The supervisor of the hall as it was opened last; `None` before it runs.
type Keeper = Arc<RwLock<Option<Thread>>>;

/// Where the supervisor puts the newest status.
#[derive(Debug)]
pub struct StatusSource {
    status: watch::Sender<Arc<Status>>,
    keeper: Keeper,
    clock: SharedClock,
}

impl StatusSource {
    /// From now on that thread, the supervisor's own, is woken by each ask. What was asked before is there to be taken.
    pub(crate) fn wakes(&self, supervisor: Thread) {
        *self.keeper.write().unwrap_or_else(PoisonError::into_inner) = Some(supervisor);
    }

    /// How far the wall clock may be off, as surfaces are told.
    pub(crate) fn clock(&self) -> SharedClock {
        self.clock.clone()
    }

    /// Makes a status known to all who watch.
    pub fn put(&self, status: Arc<Status>) {
        self.status.send_replace(status);
    }
}

/// A surface's end; one each.
#[derive(Debug, Clone)]
pub struct Handle {
    asks: SyncSender<Asked>,
    status: watch::Receiver<Arc<Status>>,
    calls: Calls,
    keeper: Keeper,
    clock: SharedClock,
}

/// The ends of a hall: for its surfaces, and for its supervisor. `desk` is the tick thread's; the hall's next one is asked by the same
/// flags.
#[must_use]
pub fn handle(desk: Arc<Desk>, first: Status) -> (Handle, Inbox, StatusSource) {
    let (asks, inbox) = mpsc::sync_channel(ASKS);
    let (source, status) = watch::channel(Arc::new(first));
    let (calls, keeper, clock) = (desk.calls().clone(), Keeper::default(), SharedClock::default());
    let source = StatusSource { status: source, keeper: Arc::clone(&keeper), clock: clock.clone() };
    (Handle { asks, status, calls, keeper, clock }, Inbox(inbox), source)
}

impl Handle {
    /// Where it is put how far the wall clock may be off.
    pub(crate) fn clock(&self) -> SharedClock {
        self.clock.clone()
    }

    /// Has the seats come to rest: a flag that the tick thread reads every tick, be it that of the hall which is opened next. Waits for
    /// nothing and cannot fail.
    pub(crate) fn stop(&self) {
        self.calls.stop();
    }

    /// Leaves word of a stop for the journal, without waiting: where there is no room, it is not noted.
    pub(crate) fn note_stop(&self, who: Who) {
        let (reply, _) = oneshot::channel();
        let desired = Desired { ask: Command::Stop, who };
        let note = Asked { desired, asked_at: Monotonic.now(), settled: Arc::default(), reply };
        drop(self.asks.try_send(note));
        self.wake();
    }

    /// Has the supervisor check the queue. One that is just being named checks it by itself, and nobody waits for that.
    fn wake(&self) {
        if let Ok(keeper) = self.keeper.try_read()
            && let Some(supervisor) = &*keeper
        {
            supervisor.unpark();
        }
    }

    /// The newest status.
    #[must_use]
    pub fn status(&self) -> Arc<Status> {
        Arc::clone(&self.status.borrow())
    }

    /// To be woken by each new status.
    #[must_use]
    pub(crate) fn watch(&self) -> watch::Receiver<Arc<Status>> {
        self.status.clone()
    }

    /// Asks, and gives the state that it led to. A stop is set on its flag before it is queued for the journal.
    ///
    /// # Errors
    /// [`Problem`] where it was not done.
    pub(crate) async fn ask(&self, who: Who, ask: Command) -> Result<Arc<Status>, Problem> {
        self.post(who, ask)?.answer().await
    }

    /// The same in two parts, for whoever goes on reading meanwhile: what is posted is queued in the order of the calls.
    ///
    /// # Errors
    /// [`Problem`] where it is not even queued: the role is too low, or too many wait.
    pub fn post(&self, who: Who, ask: Command) -> Result<Posted, Problem> {
        self.post_asked(who, ask, Monotonic.now())
    }

    /// The same for what was asked a while ago.
    ///
    /// # Errors
    /// [`Problem`] where it is not even queued: the role is too low, it is stale already, or too many wait.
    pub(crate) fn post_asked(&self, who: Who, ask: Command, asked_at: MonoTime) -> Result<Posted, Problem> {
        if who.role < ask.least_role() {
            return Err(Problem::role(ask.word(), ask.least_role(), &who));
        }
        if ask == Command::Stop {
            self.stop();
        }
        let (reply, answer) = oneshot::channel();
        let (word, settled) = (ask.word(), Arc::<AtomicBool>::default());
        let posted = Posted::new(answer, word, (ask != Command::Stop).then(|| Arc::clone(&settled)));
        let asked = Asked { desired: Desired { ask, who }, asked_at, settled, reply };
        if asked.is_stale(Monotonic.now()) {
            return Err(late(word));
        }
        let queued = self.asks.try_send(asked);
        self.wake();
        match queued {
            Ok(()) => Ok(posted),
            // It is done with its flag; what would follow is its line in the journal.
            Err(TrySendError::Full(asked)) if asked.desired.ask == Command::Stop => {
                asked.answer(Ok(self.status()));
                Ok(posted)
            }
            Err(TrySendError::Full(_)) => {
                let detail = format!("{ASKS} requests are already waiting");
                Err(Problem::new(Code::Busy, detail, "try again in a second"))
            }
            Err(TrySendError::Disconnected(_)) => Err(gone()),
        }
    }
}

/// What was asked of a hall that is another since.
#[must_use]
pub(crate) fn overtaken(word: &str, state: State) -> Problem {
    let detail = format!("{word} was sent before the hall was {state}");
    Problem::new(Code::Late, detail, "look at the seats, then ask again")
}

fn late(word: &str) -> Problem {
    let detail = format!("{word} came more than {} s after it was sent", FRESH.as_secs());
    Problem::new(Code::Late, detail, "look at the seats, then ask again")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Role, Surface};

    fn who(role: Role) -> Who {
        Who { role, surface: Surface::Http, name: "anna".to_owned() }
    }

    fn hall() -> (Handle, Inbox, Arc<Desk>) {
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (handle, inbox, _source) = handle(Arc::clone(&desk), Status::starting("Hall 1"));
        (handle, inbox, desk)
    }

    const NOW: Duration = Duration::ZERO;

    #[test]
    fn what_waited_too_long_never_comes_out_but_a_stop_does() {
        let (handle, inbox, _) = hall();
        let long_ago = Monotonic.now().before(2 * FRESH);
        assert_eq!(
            handle.post_asked(who(Role::Operate), Command::Go, long_ago).unwrap_err().code,
            Code::Late
        );
        let stale = Monotonic.now().before(FRESH - Duration::from_millis(1));
        let posted = handle.post_asked(who(Role::Operate), Command::Go, stale);
        Monotonic.sleep_until(stale + FRESH + Duration::from_micros(1));
        handle.post_asked(who(Role::View), Command::Stop, long_ago).unwrap();
        assert_eq!(inbox.next(NOW).unwrap().desired.ask, Command::Stop);
        drop(posted); // it may have gone stale on its way in
    }

    #[test]
    fn a_stop_is_set_also_where_nothing_more_fits_and_noted_where_it_does() {
        let (handle, inbox, desk) = hall();
        for _ in 0..ASKS {
            handle.post(who(Role::Operate), Command::Pause).unwrap();
        }
        assert_eq!(handle.post(who(Role::Operate), Command::Pause).unwrap_err().code, Code::Busy);
        handle.stop();
        handle.note_stop(who(Role::View));
        assert!(desk.take_stop());
        assert!(handle.post(who(Role::View), Command::Stop).is_ok(), "a stop that is done is not refused");
        assert!(desk.take_stop());
        assert_eq!(inbox.next(NOW).unwrap().desired.ask, Command::Pause);
        handle.note_stop(who(Role::View));
        let last = std::iter::from_fn(|| inbox.next(NOW)).last().unwrap();
        assert_eq!(last.desired.ask, Command::Stop);
    }

    #[test]
    fn a_stop_and_its_note_wait_for_nobody_who_opens_the_hall_anew() {
        let (handle, inbox, source) = {
            let desk = Arc::new(Desk::new(std::iter::empty()));
            handle(desk, Status::starting("Hall 1"))
        };
        let next = Desk::new(std::iter::empty()).called_by(handle.calls.clone());
        let held = source.keeper.write().unwrap(); // as by a reload that stands still
        let (tell, told) = mpsc::channel();
        std::thread::spawn(move || {
            handle.stop();
            handle.note_stop(who(Role::View));
            tell.send(handle.post(who(Role::View), Command::Stop).is_ok()).unwrap();
        });
        assert_eq!(told.recv_timeout(Duration::from_secs(20)), Ok(true));
        assert!(next.take_stop(), "nobody took it, so it is one of the hall that is opened");
        drop(held);
        assert_eq!([(); 2].map(|()| inbox.next(NOW).unwrap().desired.ask), [const { Command::Stop }; 2]);
    }

    #[test]
    fn a_role_that_may_not_ask_reaches_nobody() {
        let (handle, inbox, _) = hall();
        let problem = handle.post(who(Role::View), Command::Go).unwrap_err();
        assert_eq!((problem.code, problem.status), (Code::Role, 403));
        assert!(inbox.next(NOW).is_none());
    }

    #[test]
    fn whoever_takes_what_is_asked_can_sleep_until_somebody_asks() {
        let (handle, inbox, source) = {
            let desk = Arc::new(Desk::new(std::iter::empty()));
            handle(desk, Status::starting("Hall 1"))
        };
        let (tell, told) = mpsc::channel();
        let supervisor = std::thread::spawn(move || {
            source.wakes(std::thread::current());
            tell.send(None).unwrap();
            for _ in 0..2 {
                let asked = std::iter::repeat_with(|| {
                    inbox.next(NOW).or_else(|| {
                        std::thread::park();
                        None
                    })
                });
                let asked = asked.flatten().next().unwrap();
                tell.send(Some(asked.desired.ask)).unwrap();
            }
        });
        let hears = || told.recv_timeout(Duration::from_secs(20)).expect("it is woken");
        assert_eq!(hears(), None);
        handle.post(who(Role::Operate), Command::Pause).unwrap();
        assert_eq!(hears(), Some(Command::Pause));
        handle.note_stop(who(Role::View));
        assert_eq!(hears(), Some(Command::Stop));
        supervisor.join().unwrap();
    }
}
