//! Runs slow work on a thread of its own, one job at a time; the command is answered when the job is done.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use super::Supervisor;
use super::lasting::Again;
use super::list::List;
use super::ready::Preflighted;
use super::seat_test::SeatTest;
use super::show::ProvedShow;
use crate::app::runtime::Finding;
use crate::control::{Asked, Code, Problem};

/// What came of a job.
#[derive(Debug)]
pub(super) enum JobResult {
    /// A cue is read and proved, or why not.
    Loaded(Result<Box<ProvedShow>, Problem>),
    /// A playlist is checked, and the cue of its first entry proved, or why not.
    Listed(Result<(Box<List>, Box<ProvedShow>), Problem>),
    /// The cue of an entry is proved, or why not.
    Entry(usize, Result<Box<ProvedShow>, Problem>),
    /// What was loaded before was read and proved again.
    Again(Again),
    /// A test of the seats is made, or why not.
    Swept(Result<(Box<SeatTest>, Box<ProvedShow>), Problem>),
    /// The controllers were asked for all that preflight judges.
    Preflighted(Box<Preflighted>),
    /// Controllers were homed.
    Homed(Finding),
}

/// A job under way.
#[derive(Debug)]
pub(super) struct Job {
    word: &'static str,
    done: Receiver<JobResult>,
    asked: Option<Asked>,
}

impl Supervisor {
    /// True if something long may begin; else why not. In a hall that closes nothing may: it would hold the port that the next
    /// one opens.
    pub(super) fn is_free(&self) -> Result<(), Problem> {
        if self.runtime.leave.load(Ordering::Acquire) {
            return Err(Problem::new(Code::Busy, "the hall is being closed", "ask again in a second"));
        }
        match &self.job {
            None => Ok(()),
            Some(job) => Err(Problem::new(
                Code::Busy,
                format!("{} is under way", job.word),
                "ask again when it is done",
            )),
        }
    }

    /// Sends somebody to do it; `asked` is answered once it is done.
    pub(super) fn send(
        &mut self,
        word: &'static str,
        asked: Option<Asked>,
        work: impl FnOnce() -> JobResult + Send + 'static,
    ) {
        let (tell, done) = channel();
        let supervisor = std::thread::current();
        let thread = std::thread::Builder::new().name(word.to_owned());
        let spawned = thread.spawn(move || {
            let _ = crate::sys::realtime::normal_priority();
            drop(tell.send(work())); // a supervisor that is gone wants no answer
            supervisor.unpark();
        });
        match (spawned, asked) {
            (Ok(_), asked) => self.job = Some(Job { word, done, asked }),
            (Err(cause), Some(asked)) => self.answer(asked, Err(no_thread(&cause))),
            (Err(cause), None) => self.note(no_thread(&cause).to_string()),
        }
    }

    /// Takes what a job has come to.
    pub(super) fn end_errand(&mut self) {
        let Some(job) = &self.job else { return };
        let done = match job.done.try_recv() {
            Ok(done) => Some(done),
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => None,
        };
        let asked = self.job.take().and_then(|job| job.asked);
        let result = match done {
            Some(JobResult::Loaded(cued)) => cued.and_then(|cued| self.take_up(*cued)),
            Some(JobResult::Listed(listed)) => {
                listed.and_then(|(list, cued)| self.take_up_list(*list, *cued))
            }
            Some(JobResult::Entry(entry, cued)) => cued.and_then(|cued| self.take_up_entry(entry, *cued)),
            Some(JobResult::Again(again)) => self.take_up_again(again),
            Some(JobResult::Swept(swept)) => {
                swept.and_then(|(seat_test, cued)| self.take_up_seat_test(*seat_test, *cued))
            }
            Some(JobResult::Preflighted(preflighted)) => {
                self.preflighted = Some(*preflighted);
                Ok(())
            }
            Some(JobResult::Homed(finding)) => {
                self.on_homed(finding);
                Ok(())
            }
            None => Err(Problem::new(Code::Check, "it ended before it was done", "look at the journal")),
        };
        self.tell_readiness();
        match (asked, result) {
            (Some(asked), result) => self.answer(asked, result),
            (None, Err(problem)) => self.note(problem.to_string()),
            (None, Ok(())) => {}
        }
    }
}

fn no_thread(cause: &std::io::Error) -> Problem {
    Problem::new(
        Code::Busy,
        format!("no thread could be started: {cause}"),
        "allow more with TasksMax= in the unit, or `ulimit -u`",
    )
}
