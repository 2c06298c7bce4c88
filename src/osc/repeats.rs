//! The network may deliver a datagram twice, and gear sends it twice to be sure: what moves seats is done once.

use std::mem::discriminant;
use std::time::Duration;

use crate::control::Command;
use crate::time::MonoTime;

/// For how long the same is taken for a repeat.
const WINDOW: Duration = Duration::from_secs(1);

/// What was asked last, of each kind that moves seats.
#[derive(Debug, Default)]
pub(super) struct Repeats(Vec<(Command, MonoTime)>);

impl Repeats {
    /// True if the same go, resume or seek was asked within a second before; if not, it is noted. What brings the seats to
    /// rest is never a repeat, and neither are levels, which faders bring back to where they were.
    pub(super) fn is_repeat(&mut self, ask: &Command, at: MonoTime) -> bool {
        if !matches!(ask, Command::Go | Command::Resume | Command::Seek(_)) {
            return false;
        }
        let before = self.0.iter_mut().find(|(one, _)| discriminant(one) == discriminant(ask));
        match before {
            Some((same, when)) if same == ask && at.since(*when) < WINDOW => return true,
            Some(before) => *before = (ask.clone(), at),
            None => self.0.push((ask.clone(), at)),
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::ShowTime;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn the_same_go_within_a_second_is_a_repeat_and_after_it_is_not() {
        let mut repeats = Repeats::default();
        let asked = [0, 1, 999, 1_000, 1_001].map(|at| repeats.is_repeat(&Command::Go, ms(at)));
        assert_eq!(asked, [false, true, true, false, true]);
    }

    #[test]
    fn another_place_is_no_repeat_and_a_stop_never_is() {
        let mut repeats = Repeats::default();
        let seek = |s| Command::Seek(ShowTime::from_millis(s));
        let asks = [
            seek(1),
            seek(2),
            seek(2),
            Command::Resume,
            Command::Go,
            Command::Stop,
            Command::Stop,
            Command::Pause,
            Command::Pause,
        ];
        let repeated = asks.map(|ask| repeats.is_repeat(&ask, ms(10)));
        assert_eq!(repeated, [false, false, true, false, false, false, false, false, false]);
    }
}
