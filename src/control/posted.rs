//! What was asked of the hall and is not answered yet. Until the supervisor takes it, it can be given up.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::oneshot;

use super::problem::NOT_TAKEN;
use super::{Code, Problem, Status};

/// How long an answer may take: a cue of two hours is proved meanwhile.
const PATIENCE: Duration = Duration::from_secs(60);
/// How long an ask may wait until the supervisor takes it: people are answered within a second.
const TAKEN: Duration = Duration::from_millis(800);

/// Something asked that waits for its answer. Dropped, it is done all the same.
#[derive(Debug)]
pub struct Posted {
    answer: oneshot::Receiver<Result<Arc<Status>, Problem>>,
    word: &'static str,
    settled: Option<Arc<AtomicBool>>,
}

impl Posted {
    /// The answer to an ask of that word. `settled` is that of the ask; a stop has none, as it is done already.
    pub(super) const fn new(
        answer: oneshot::Receiver<Result<Arc<Status>, Problem>>,
        word: &'static str,
        settled: Option<Arc<AtomicBool>>,
    ) -> Self {
        Self { answer, word, settled }
    }

    /// The state that it led to. What the supervisor has not taken after 0.8 s is given up, and never done.
    ///
    /// # Errors
    /// [`Problem`] where it was not done.
    pub(crate) async fn answer(mut self) -> Result<Arc<Status>, Problem> {
        let is_given_up = |settled: Arc<AtomicBool>| !settled.swap(true, Ordering::AcqRel);
        match tokio::time::timeout(TAKEN, &mut self.answer).await {
            Ok(answer) => return answer.unwrap_or_else(|_| Err(gone())),
            Err(_) if self.settled.is_some_and(is_given_up) => return Err(not_taken(self.word)),
            Err(_) => {}
        }
        match tokio::time::timeout(PATIENCE, self.answer).await {
            Ok(answer) => answer.unwrap_or_else(|_| Err(gone())),
            Err(_) => Err(Problem::new(
                Code::Timeout,
                format!("no answer within {} s", PATIENCE.as_secs()),
                "check the status before you repeat the command: it may still take effect",
            )),
        }
    }
}

fn not_taken(word: &str) -> Problem {
    let detail =
        format!("the hall was too busy to take {word} within {} s; it is not done", TAKEN.as_secs_f64());
    Problem {
        why: Some(NOT_TAKEN),
        ..Problem::new(Code::Timeout, detail, "try again; a stop waits for nothing")
    }
}

/// That nobody keeps the hall any more.
pub(super) fn gone() -> Problem {
    Problem::new(Code::Timeout, "the hall is shutting down", "wait until the service is back")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Command, Handle, Inbox, Role, Surface, Who, handle};
    use crate::rt::Desk;
    use crate::sys::clock::Monotonic;
    use crate::time::Clock as _;

    const NOW: Duration = Duration::ZERO;

    fn hall() -> (Handle, Inbox, Arc<Desk>) {
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (handle, inbox, _source) = handle(Arc::clone(&desk), Status::starting("Hall 1"));
        (handle, inbox, desk)
    }

    fn post(handle: &Handle, ask: Command) -> Posted {
        let who = Who { role: Role::Operate, surface: Surface::Http, name: "anna".to_owned() };
        handle.post(who, ask).unwrap()
    }

    #[test]
    fn what_the_supervisor_does_not_take_within_a_second_is_refused_and_never_done() {
        let (handle, inbox, desk) = hall();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let posted = post(&handle, Command::Pause);
        let problem = runtime.block_on(posted.answer()).unwrap_err();
        assert_eq!((problem.code, problem.status), (Code::Timeout, 503));
        assert!(problem.detail.contains("take pause within 0.8 s; it is not done"), "{problem}");
        let stop = post(&handle, Command::Stop);
        let waits = runtime.block_on(async { tokio::time::timeout(2 * TAKEN, stop.answer()).await });
        assert!(waits.is_err(), "a stop is not given up: {waits:?}");
        assert!(desk.take_stop());
        assert_eq!(inbox.next(NOW).unwrap().desired.ask, Command::Stop, "the pause does not come out late");
        assert!(inbox.next(NOW).is_none());
    }

    #[test]
    fn what_was_taken_in_time_is_answered_however_long_it_takes() {
        let (handle, inbox, _) = hall();
        let posted = post(&handle, Command::Preflight);
        let taken = inbox.next(NOW).unwrap();
        let worker = std::thread::spawn(move || {
            Monotonic.sleep_until(Monotonic.now() + 2 * TAKEN);
            taken.answer(Ok(Arc::new(Status::starting("Hall 1"))));
        });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        assert!(runtime.block_on(posted.answer()).is_ok());
        worker.join().unwrap();
    }
}
