//! The terminal as a keyboard: keys come one by one and unechoed, until it is set back as it was, whatever ends us.

use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::getpgrp;
use rustix::stdio::stdin;
use rustix::termios::{
    LocalModes, OptionalActions, QueueSelector, SpecialCodeIndex, Termios, isatty, tcflush, tcgetattr,
    tcgetpgrp, tcgetwinsize, tcsetattr,
};

/// How wide the terminal is that a stream goes to, characters; `None` if it goes elsewhere.
pub(crate) fn width(of: impl AsFd) -> Option<u16> {
    let size = isatty(&of).then(|| tcgetwinsize(&of).ok()).flatten();
    size.map(|size| size.ws_col).filter(|width| *width > 0)
}

/// How the terminal was set before; once set it stays, so that a signal handler can read it.
static BEFORE: OnceLock<Termios> = OnceLock::new();

/// The terminal on standard input, read key by key; set back as it was when this is dropped, or the program panics.
///
/// Ctrl-C and Ctrl-\ are signals as ever, and output is as it was: a program that is killed leaves at worst a terminal
/// that shows nothing typed. Ctrl-Z is off: it would leave the seats without frames in the middle of a move.
#[derive(Debug)]
pub(crate) struct Keyboard(());

impl Keyboard {
    /// Takes the terminal over, and forgets what was typed so far. None where standard input is none, or where it belongs
    /// to another job, which a program in the background must not touch.
    #[must_use]
    pub(crate) fn take() -> Option<Self> {
        if !isatty(stdin()) || !is_ours() {
            return None;
        }
        let mut modes = tcgetattr(stdin()).ok()?;
        let _ = BEFORE.set(modes.clone()); // set before, it is from the first time
        modes.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        modes.special_codes[SpecialCodeIndex::VMIN] = 1;
        modes.special_codes[SpecialCodeIndex::VTIME] = 0;
        modes.special_codes[SpecialCodeIndex::VSUSP] = 0; // no key
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panicked| {
            restore();
            before(panicked);
        }));
        let keyboard = Self(());
        let _ = tcflush(stdin(), QueueSelector::IFlush);
        tcsetattr(stdin(), OptionalActions::Now, &modes).ok()?;
        Some(keyboard)
    }

    /// Reads what is typed into `keys`, waiting for it no longer than `wait`; returns how many bytes came, 0 if none
    /// did, or where the terminal is at present another job's.
    ///
    /// # Errors
    /// [`ErrorKind::UnexpectedEof`] where the terminal is gone, else that of the system.
    pub(crate) fn read(&self, keys: &mut [u8], wait: Duration) -> io::Result<usize> {
        if !is_ours() {
            std::thread::park_timeout(wait);
            return Ok(0);
        }
        let wait = Timespec::try_from(wait).map_err(|_| ErrorKind::InvalidInput)?;
        let read = match poll(&mut [PollFd::from_borrowed_fd(stdin(), PollFlags::IN)], Some(&wait)) {
            Ok(0) => return Ok(0),
            Ok(_) => rustix::io::read(stdin(), keys),
            Err(error) => Err(error),
        };
        match read {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Err(Errno::IO) => Err(ErrorKind::UnexpectedEof.into()),
            Err(Errno::INTR) => Ok(0),
            read => Ok(read?),
        }
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        // What was typed too late for us is not meant for the shell.
        let _ = tcflush(stdin(), QueueSelector::IFlush);
        restore();
    }
}

/// True if we may set and read the terminal: it is another's where job control gave it to another process group.
fn is_ours() -> bool {
    // One that is not the controlling terminal knows no jobs.
    tcgetpgrp(stdin()).map_or(true, |group| group == getpgrp())
}

/// Sets the terminal back as it was, if it was taken. Async-signal-safe: a load and three system calls.
fn restore() {
    if let Some(before) = BEFORE.get()
        && is_ours()
    {
        let _ = tcsetattr(stdin(), OptionalActions::Now, before); // it may be gone
    }
}

/// Has `signal` set the terminal back where `when` is set; to be called before anything that ends the program at that
/// signal, because what a signal does is done in the order of these calls.
///
/// # Errors
/// If the signal cannot be handled.
#[expect(unsafe_code, reason = "a program that a signal ends at once drops nothing")]
pub(crate) fn restore_on(signal: i32, when: Arc<AtomicBool>) -> io::Result<()> {
    let act = move || {
        if when.load(Ordering::Relaxed) {
            restore();
        }
    };
    // SAFETY: `act` neither allocates nor locks nor panics: it loads two atomics and makes system calls, none of which
    // touches what the interrupted code may be at.
    unsafe { signal_hook::low_level::register(signal, act) }.map(drop)
}
