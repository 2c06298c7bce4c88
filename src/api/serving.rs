//! A thread that serves until whoever holds it lets go.

use std::thread::JoinHandle;

use tokio::sync::watch;

/// A thread of a surface: when this is dropped, it is asked to end, and waited for.
#[derive(Debug)]
pub(crate) struct ServingThread {
    closing: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl ServingThread {
    /// That thread, which ends once `closing` says true.
    pub(crate) const fn new(closing: watch::Sender<bool>, thread: JoinHandle<()>) -> Self {
        Self { closing, thread: Some(thread) }
    }
}

impl Drop for ServingThread {
    fn drop(&mut self) {
        self.closing.send_replace(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic in it has been told
        }
    }
}
