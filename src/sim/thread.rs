//! The thread that virtual controllers or drives run on.

use std::thread::{Builder, JoinHandle};
use std::{fmt, io, panic};

/// A thread that is told to end, and waited for, when this is ended or dropped.
pub(crate) struct SimThread<T> {
    handle: Option<JoinHandle<T>>,
    tell: Box<dyn Fn() + Send + Sync>,
}

impl<T: Send + 'static> SimThread<T> {
    /// Runs `run` on it until that returns, which it does soon after `tell` was called.
    ///
    /// # Errors
    /// That of the system where it gives no thread.
    pub(crate) fn spawn(
        run: impl FnOnce() -> T + Send + 'static,
        tell: impl Fn() + Send + Sync + 'static,
    ) -> io::Result<Self> {
        let handle = Builder::new().name("kinocue-sim".to_owned()).spawn(run)?;
        Ok(Self { handle: Some(handle), tell: Box::new(tell) })
    }
}

impl<T> SimThread<T> {
    /// Ends it, and gives what it came to; its panic goes on here.
    pub(crate) fn end(mut self) -> T {
        self.join().expect("only this and a drop take it, and both take self")
    }

    fn join(&mut self) -> Option<T> {
        let handle = self.handle.take()?;
        (self.tell)(); // a thread that has ended needs no telling
        Some(handle.join().unwrap_or_else(|panic| panic::resume_unwind(panic)))
    }
}

impl<T> Drop for SimThread<T> {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = self.join(); // nobody is left to be given it
        }
    }
}

impl<T> fmt::Debug for SimThread<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimThread").finish_non_exhaustive()
    }
}
