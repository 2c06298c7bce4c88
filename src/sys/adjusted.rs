//! What the kernel says of its own clock of the day: by how much it may be off, as whoever steers it has told it.

use std::io;
use std::mem;
use std::time::Duration;

/// How far off the clock of the day may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WallError {
    /// At the most; it grows while nobody steers the clock, to 16 s.
    pub(crate) most: Duration,
    /// As is estimated.
    pub(crate) likely: Duration,
}

/// Asks the kernel (`adjtimex`, changing nothing).
///
/// # Errors
/// What the kernel answers where it does not say.
#[expect(unsafe_code, reason = "no safe wrapper of adjtimex exists among our dependencies")]
pub(crate) fn wall_error() -> io::Result<WallError> {
    // SAFETY: the structure is plain numbers, for which all zeroes are values; modes 0 reads alone.
    let mut said: libc::timex = unsafe { mem::zeroed() };
    // SAFETY: the kernel writes into the one structure that it is given, which lives longer than the call.
    if unsafe { libc::adjtimex(&raw mut said) } < 0 {
        return Err(io::Error::last_os_error());
    }
    let micros = |value: libc::c_long| Duration::from_micros(u64::try_from(value).unwrap_or(u64::MAX));
    Ok(WallError { most: micros(said.maxerror), likely: micros(said.esterror) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_says_how_far_off_its_clock_may_be() {
        let error = wall_error().expect("anybody may ask");
        assert!(
            error.most <= Duration::from_secs(17) && error.likely <= Duration::from_secs(17),
            "{error:?}"
        );
    }
}
