//! Runs slow work on a thread of its own, one job at a time.

use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use super::job::{Job, JobResult, Tools};
use crate::control::{Asked, Code, Problem};

/// The thread for jobs.
#[derive(Debug)]
pub(super) struct Jobs {
    tools: Tools,
    running: Option<(Receiver<JobResult>, Option<Asked>)>,
}

impl Jobs {
    pub(super) const fn new(tools: Tools) -> Self {
        Self { tools, running: None }
    }

    /// Begins it, for what `asked` gives then; the thread that calls this is woken once it is done.
    ///
    /// # Errors
    /// Where no thread can be had for it.
    pub(super) fn start(&mut self, job: Job, asked: impl FnOnce() -> Option<Asked>) -> Result<(), Problem> {
        let (tell, done) = channel();
        let supervisor = thread::current();
        let tools = self.tools.clone();
        let thread = thread::Builder::new().name(job.word().to_owned());
        let spawned = thread.spawn(move || {
            let _ = crate::sys::realtime::normal_priority();
            drop(tell.send(job.run(&tools))); // a supervisor that is gone wants no answer
            supervisor.unpark();
        });
        spawned.map_err(|cause| no_thread(&cause))?;
        self.running = Some((done, asked()));
        Ok(())
    }

    /// What the job has come to, and for whom; `None` while it runs.
    pub(super) fn take_done(&mut self) -> Option<(Result<JobResult, Problem>, Option<Asked>)> {
        let result = match self.running.as_ref()?.0.try_recv() {
            Ok(result) => Ok(result),
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => {
                Err(Problem::new(Code::Check, "it ended before it was done", "look at the journal"))
            }
        };
        let (_, asked) = self.running.take()?;
        Some((result, asked))
    }
}

fn no_thread(cause: &std::io::Error) -> Problem {
    Problem::new(
        Code::Busy,
        format!("no thread could be started: {cause}"),
        "allow more with TasksMax= in the unit, or `ulimit -u`",
    )
}
