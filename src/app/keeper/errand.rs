//! What takes long is done on a thread of its own, one thing at a time; whoever asked for it is answered when it is done.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use super::Keeper;
use super::lasting::Again;
use super::list::List;
use super::ready::Preflighted;
use super::show::Cued;
use super::sweep::Sweep;
use crate::app::house::Finding;
use crate::hall::{Asked, Code, Problem};

/// What came of an errand.
#[derive(Debug)]
pub(super) enum Done {
    /// A cue is read and proved, or why not.
    Cued(Result<Box<Cued>, Problem>),
    /// A playlist is checked, and the cue of its first entry proved, or why not.
    Listed(Result<(Box<List>, Box<Cued>), Problem>),
    /// The cue of an entry is proved, or why not.
    Entry(usize, Result<Box<Cued>, Problem>),
    /// What was loaded before was read and proved again.
    Again(Again),
    /// A test of the seats is made, or why not.
    Swept(Result<(Box<Sweep>, Box<Cued>), Problem>),
    /// The controllers were asked for all that preflight judges.
    Preflighted(Box<Preflighted>),
    /// Controllers were homed.
    Homed(Finding),
}

/// An errand under way.
#[derive(Debug)]
pub(super) struct Errand {
    word: &'static str,
    done: Receiver<Done>,
    asked: Option<Asked>,
}

impl Keeper {
    /// Whether something long may begin; else why not. In a hall that closes nothing may: it would hold the port that the next
    /// one opens.
    pub(super) fn is_free(&self) -> Result<(), Problem> {
        if self.reins.leave.load(Ordering::Acquire) {
            return Err(Problem::new(Code::Busy, "the hall is being closed", "ask again in a second"));
        }
        match &self.errand {
            None => Ok(()),
            Some(errand) => Err(Problem::new(
                Code::Busy,
                format!("{} is under way", errand.word),
                "ask again when it is done",
            )),
        }
    }

    /// Sends somebody to do it; `asked` is answered once it is done.
    pub(super) fn send(
        &mut self,
        word: &'static str,
        asked: Option<Asked>,
        work: impl FnOnce() -> Done + Send + 'static,
    ) {
        let (tell, done) = channel();
        let thread = std::thread::Builder::new().name(word.to_owned());
        let spawned = thread.spawn(move || {
            let _ = crate::sys::realtime::normal_priority();
            drop(tell.send(work())); // a keeper that is gone wants no answer
        });
        match (spawned, asked) {
            (Ok(_), asked) => self.errand = Some(Errand { word, done, asked }),
            (Err(cause), Some(asked)) => self.answer(asked, Err(no_thread(&cause))),
            (Err(cause), None) => self.note(no_thread(&cause).to_string()),
        }
    }

    /// Takes what an errand has come to.
    pub(super) fn end_errand(&mut self) {
        let Some(errand) = &self.errand else { return };
        let done = match errand.done.try_recv() {
            Ok(done) => Some(done),
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => None,
        };
        let asked = self.errand.take().and_then(|errand| errand.asked);
        let result = match done {
            Some(Done::Cued(cued)) => cued.and_then(|cued| self.take_up(*cued)),
            Some(Done::Listed(listed)) => listed.and_then(|(list, cued)| self.take_up_list(*list, *cued)),
            Some(Done::Entry(entry, cued)) => cued.and_then(|cued| self.take_up_entry(entry, *cued)),
            Some(Done::Again(again)) => self.take_up_again(again),
            Some(Done::Swept(swept)) => swept.and_then(|(sweep, cued)| self.take_up_sweep(*sweep, *cued)),
            Some(Done::Preflighted(preflighted)) => {
                self.preflighted = Some(*preflighted);
                Ok(())
            }
            Some(Done::Homed(finding)) => {
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
