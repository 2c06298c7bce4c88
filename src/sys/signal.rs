//! How the program that started us wants signals treated.

use std::mem::MaybeUninit;
use std::{io, ptr};

/// True if a signal is ignored, as `nohup` leaves SIGHUP: who wanted that does not want it handled either.
///
/// # Errors
/// If there is no such signal.
#[expect(unsafe_code, reason = "no safe wrapper of sigaction exists among our dependencies")]
pub(crate) fn is_ignored(signal: i32) -> io::Result<bool> {
    let mut present = MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: with no new action the call only writes the present one to `present`, which is of its type.
    let result = unsafe { libc::sigaction(signal, ptr::null(), present.as_mut_ptr()) };
    if result != 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the call succeeded, so it wrote all of `present`.
    Ok(unsafe { present.assume_init() }.sa_sigaction == libc::SIG_IGN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_nobody_touched_is_not_ignored_and_sigpipe_is() {
        assert!(!is_ignored(libc::SIGUSR2).unwrap());
        assert!(is_ignored(libc::SIGPIPE).unwrap(), "every Rust program ignores it");
        assert!(is_ignored(9_999).is_err());
    }
}
