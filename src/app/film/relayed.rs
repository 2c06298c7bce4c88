//! What a relay sends, and the end that hears it: a greeting, and records of what was read of a device, and when.

use std::io::{self, Read};
use std::time::Duration;

use crate::film::source::LineKind;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// The most that is read at a time: 10 ms of sound at 48,000 samples a second.
pub(super) const BLOCK: usize = 960;
/// When something was read, nanoseconds of the monotonic clock; and how many bytes that were, which follow.
const HEAD: usize = 10;
/// What was read longer ago tells nothing of now.
const OLDEST: Duration = Duration::from_secs(2);

/// What a relay says first to those that it lets in: which kind of line it has.
pub(super) fn greeting(kind: LineKind) -> String {
    format!("kinocue relay 1 {}\n", kind.name())
}

/// What it says to one more than it can serve, as long as a greeting.
pub(super) const FULL: &[u8] = b"kinocue relay full.\n";

/// What was read at an instant: no more than a block.
pub(super) fn record(bytes: &[u8], at: MonoTime) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).expect("a block is less");
    [&at.as_nanos().to_le_bytes()[..], &length.to_le_bytes(), bytes].concat()
}

/// What a relay sends.
pub(super) struct RelayedRead<R> {
    stream: R,
    bytes: [u8; BLOCK],
    newest: MonoTime,
}

impl<R: Read> RelayedRead<R> {
    /// One that has greeted as a relay of that kind of line.
    ///
    /// # Errors
    /// Those of the system; where it is none, or has no device, in words.
    pub(super) fn begin(mut stream: R, kind: LineKind) -> io::Result<Self> {
        let wanted = greeting(kind);
        let mut greeted = vec![0; wanted.len()];
        let fault = |what: String| io::Error::new(io::ErrorKind::InvalidData, what);
        match stream.read_exact(&mut greeted) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                Err(fault("the relay has no line at present; its log says why".to_owned()))
            }
            Err(error) => Err(error),
            Ok(()) if greeted == FULL => {
                Err(fault("the relay serves as many halls as it can; end one that hears it".to_owned()))
            }
            Ok(()) if greeted != wanted.as_bytes() => {
                Err(fault(format!("it does not relay {}", kind.name())))
            }
            Ok(()) => Ok(Self { stream, bytes: [0; BLOCK], newest: MonoTime::default() }),
        }
    }

    /// What was read next, and when; `None` at its end.
    ///
    /// # Errors
    /// Those of the system; a record that no relay sends, in words.
    pub(super) fn next(&mut self) -> io::Result<Option<(&[u8], MonoTime)>> {
        let mut head = [0; HEAD];
        match self.stream.read_exact(&mut head) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
            read => read?,
        }
        let [a, b, c, d, e, f, g, h, low, high] = head;
        let at = MonoTime::from_nanos(u64::from_le_bytes([a, b, c, d, e, f, g, h]));
        let length = usize::from(u16::from_le_bytes([low, high]));
        let now = Monotonic.now();
        let is_sound = (1..=BLOCK).contains(&length) && (self.newest..=now).contains(&at);
        if !is_sound || now.since(at) > OLDEST {
            let what = "the relay sends a wrong time or length; use the same version of kinocue at both ends";
            return Err(io::Error::new(io::ErrorKind::InvalidData, what));
        }
        self.newest = at;
        self.stream.read_exact(&mut self.bytes[..length])?;
        Ok(Some((&self.bytes[..length], at)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said to a listener, and what the listener makes of it.
    fn said(text: &[u8]) -> io::Result<RelayedRead<&[u8]>> {
        RelayedRead::begin(text, LineKind::Ltc)
    }

    #[test]
    fn what_no_relay_sends_is_refused_in_words() {
        let now = Monotonic.now();
        assert!(said(b"HTTP/1.1 400 Bad Request\r\n").is_err() && said(b"kino").is_err());
        assert!(said(b"kinocue relay 1 mtc\n").is_err(), "another kind of line");
        assert_eq!(FULL.len(), greeting(LineKind::Ltc).len());
        let earlier = now.before(Duration::from_secs(5));
        let wrong = [
            record(b"", now),
            record(&[0; BLOCK + 1], now),
            record(b"x", MonoTime::from_nanos(u64::MAX)),
            record(b"x", earlier),
            [record(b"x", now), record(b"x", now.before(Duration::from_millis(1)))].concat(),
        ];
        for bytes in wrong {
            let text = [greeting(LineKind::Ltc).as_bytes(), &bytes].concat();
            let mut relayed = said(&text).unwrap();
            let fault = std::iter::from_fn(|| relayed.next().map(|one| one.map(|_| ())).transpose())
                .find_map(Result::err);
            assert!(
                fault.is_some_and(|fault| fault.to_string().contains("wrong time or length")),
                "{bytes:?}"
            );
        }
        let cut = [greeting(LineKind::Ltc).as_bytes(), &record(b"xyz", now)[..11]].concat();
        assert!(said(&cut).unwrap().next().is_err());
    }
}
