//! The thread that runs a line on a pseudo-terminal, with a link to it that has a name of our choice.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender};
use std::time::Duration;

use super::{Bus, SerialLine};
use crate::plain;
use crate::sim::thread::SimThread;
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::sys::serial::pty::Pty;
use crate::time::{Clock as _, MonoTime};

/// The longest wait for octets, after which orders are looked for.
const ROUND: Duration = Duration::from_millis(5);

/// The rate of a pseudo-terminal that nobody has set; a host that speaks at it is taken to speak at that of the bus.
const UNSET_BAUD: u32 = 38_400;

/// Octets that pass at a time.
const OCTETS: usize = 4_096;

/// Why a line cannot be had.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PtyError {
    /// Something else is there.
    #[error("{}: this already exists; give another path for the link", plain::path(.0))]
    Taken(PathBuf),
    /// The link cannot be made.
    #[error("{}: cannot make the link", plain::path(path))]
    Link {
        /// The link.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is no pseudo-terminal or thread to be had.
    #[error("cannot get a pseudo-terminal")]
    System(#[source] io::Error),
}

/// Something that happens to a line, or to what hangs on it.
pub(crate) type Deed<B> = Box<dyn FnOnce(&mut SerialLine<B>, MonoTime) + Send>;

enum LineOrder<B> {
    Do(Deed<B>, SyncSender<()>),
    Stop,
}

/// A line on a pseudo-terminal, run by a thread of its own until this is stopped or dropped.
pub(crate) struct PtyLoop<B> {
    remote: LineRemote<B>,
    thread: SimThread<SerialLine<B>>,
}

/// Has things happen to a line, from any thread.
pub(crate) struct LineRemote<B>(Sender<LineOrder<B>>);

impl<B> Clone for LineRemote<B> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<B> LineRemote<B> {
    /// Has something happen, and returns once it has; false where the line has ended.
    pub(crate) fn tell(&self, deed: Deed<B>) -> bool {
        let (told, done) = mpsc::sync_channel(1);
        self.0.send(LineOrder::Do(deed, told)).is_ok() && done.recv().is_ok()
    }
}

impl<B: Bus + Send + 'static> PtyLoop<B> {
    /// Makes a pseudo-terminal and a link to it at `path`, and runs the line there; the times of `script` count from now.
    ///
    /// # Errors
    /// A [`PtyError`] where one of them cannot be had.
    pub(crate) fn start(
        line: SerialLine<B>,
        path: &Path,
        script: Vec<(Duration, Deed<B>)>,
    ) -> Result<Self, PtyError> {
        let start = Monotonic.now();
        let mut script: Vec<_> = script.into_iter().map(|(after, deed)| (start + after, deed)).collect();
        script.sort_by_key(|(at, _)| *at);
        let (sender, orders) = mpsc::channel();
        let running = LineRunning { line, plug: Plug::new(path)?, orders, script: script.into() };
        let ending = sender.clone();
        let stop = move || drop(ending.send(LineOrder::Stop));
        let run = move || {
            // Drives answer in their time however busy this machine is.
            let _ = realtime::request_below(realtime::PRIORITY);
            running.run()
        };
        let thread = SimThread::spawn(run, stop).map_err(PtyError::System)?;
        Ok(Self { remote: LineRemote(sender), thread })
    }
}

impl<B> PtyLoop<B> {
    /// What has things happen to the line.
    pub(crate) fn remote(&self) -> LineRemote<B> {
        self.remote.clone()
    }

    /// Ends the thread, which takes the link away; gives the line back.
    pub(crate) fn stop(self) -> SerialLine<B> {
        self.thread.end()
    }
}

/// All that the thread owns.
struct LineRunning<B> {
    line: SerialLine<B>,
    plug: Plug,
    orders: Receiver<LineOrder<B>>,
    script: VecDeque<(MonoTime, Deed<B>)>,
}

impl<B: Bus> LineRunning<B> {
    fn run(mut self) -> SerialLine<B> {
        let mut octets = [0; OCTETS];
        while self.obey(Monotonic.now()) {
            self.plug.set(!self.line.faults.unplugged);
            let due = self.line.next().into_iter().chain(self.script.front().map(|(at, _)| *at)).min();
            let now = Monotonic.now();
            let deadline = due.unwrap_or(now + ROUND).min(now + ROUND);
            let count = self.plug.read(&mut octets, deadline);
            let now = Monotonic.now();
            if count > 0 {
                self.line.set_host_baud(self.plug.baud());
                self.line.send(&octets[..count], now);
            }
            self.line.advance(now);
            let mut answer = std::iter::from_fn(|| self.line.receive(now));
            let count = octets.iter_mut().zip(&mut answer).map(|(place, octet)| *place = octet).count();
            self.plug.write(&octets[..count], now);
        }
        self.line
    }

    /// Does what is due and what was ordered; false once it is time to end.
    fn obey(&mut self, now: MonoTime) -> bool {
        while let Some((_, deed)) = self.script.pop_front_if(|(at, _)| *at <= now) {
            deed(&mut self.line, now);
        }
        while let Ok(order) = self.orders.try_recv() {
            let LineOrder::Do(deed, told) = order else { return false };
            deed(&mut self.line, now);
            let _ = told.send(()); // whoever asked may be gone
        }
        true
    }
}

/// A pseudo-terminal behind a link that stays the same where it is unplugged and comes back as another.
struct Plug {
    path: PathBuf,
    pty: Option<Pty>,
}

impl Plug {
    fn new(path: &Path) -> Result<Self, PtyError> {
        let pty = Pty::open().map_err(PtyError::System)?;
        link(path, &pty)?;
        Ok(Self { path: path.to_owned(), pty: Some(pty) })
    }

    /// Plugs it in or out, if it is not so yet. A line that cannot be had again stays unplugged.
    fn set(&mut self, is_in: bool) {
        if is_in == self.pty.is_some() {
            return;
        }
        self.pty = if is_in { Pty::open().ok() } else { None };
        let _ = match &self.pty {
            Some(pty) => link(&self.path, pty).is_ok(),
            None => fs::remove_file(&self.path).is_ok(),
        };
    }

    fn read(&self, octets: &mut [u8], deadline: MonoTime) -> usize {
        match &self.pty {
            Some(pty) => pty.line().read(octets, deadline).unwrap_or(0),
            None => {
                Monotonic.sleep_until(deadline);
                0
            }
        }
    }

    /// What the host does not read is lost, as at any receiver that is full.
    fn write(&self, octets: &[u8], now: MonoTime) {
        if let Some(pty) = self.pty.as_ref().filter(|_| !octets.is_empty()) {
            let _ = pty.line().write(octets, now);
        }
    }

    fn baud(&self) -> Option<u32> {
        let baud = self.pty.as_ref().and_then(Pty::baud);
        baud.filter(|baud| *baud != UNSET_BAUD)
    }
}

/// Points a link to a pseudo-terminal, in the place of a link to one that is gone.
fn link(path: &Path, pty: &Pty) -> Result<(), PtyError> {
    let refused = |source| PtyError::Link { path: path.to_owned(), source };
    if path.symlink_metadata().is_ok() {
        let target = fs::read_link(path).map_err(|_| PtyError::Taken(path.to_owned()))?;
        if !target.starts_with("/dev/pts") {
            return Err(PtyError::Taken(path.to_owned()));
        }
        fs::remove_file(path).map_err(refused)?;
    }
    symlink(pty.path(), path).map_err(refused)
}

impl Drop for Plug {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path); // it may be gone already
    }
}
