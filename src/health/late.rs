//! What was sent to a controller and is not in its count yet. The network may hold datagrams back for seconds and deliver them then:
//! those are ours, and nobody else's.

use std::time::Duration;

use crate::time::MonoTime;

/// What is missing for longer, up to twice as long, is lost.
const HELD_FOR: Duration = Duration::from_secs(15);

/// Datagrams that may still arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Overdue {
    young: u64,
    old: u64,
    /// Since when what is missing counts as young.
    turned: MonoTime,
}

impl Overdue {
    /// How many may arrive from `now` on.
    pub(super) fn most(self, now: MonoTime) -> u64 {
        let Self { young, old, .. } = self.aged(now);
        young + old
    }

    /// The same after another count, at `now`: so many were sent since the one before, and it has grown by so many.
    pub(super) fn after(self, sent: u64, grown: u64, now: MonoTime) -> Self {
        let Self { young, old, turned } = self.aged(now);
        let came = grown.saturating_sub(sent);
        let of_old = came.min(old);
        let young = (young + sent.saturating_sub(grown)).saturating_sub(came - of_old);
        Self { young, old: old - of_old, turned }
    }

    fn aged(self, now: MonoTime) -> Self {
        let age = now.since(self.turned);
        if age < HELD_FOR {
            return self;
        }
        Self { young: 0, old: if age < 2 * HELD_FOR { self.young } else { 0 }, turned: now }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_may_come_for_a_while_and_is_lost_after_it() {
        let s = |seconds: u64| MonoTime::from_nanos(seconds * 1_000_000_000);
        let late = Overdue::default().after(100, 40, s(100));
        assert_eq!([101, 114, 116, 129, 130].map(|at| late.most(s(at))), [60, 60, 60, 60, 0]);
        let come = late.after(10, 60, s(102));
        assert_eq!((come.most(s(103)), come.after(10, 90, s(103)).most(s(104))), (10, 0));
        // What is missed again and again is no more than what the last half a minute has.
        let thin = (0..1_000).fold(Overdue::default(), |late, at| late.after(100, 99, s(at)));
        assert!((15..=30).contains(&thin.most(s(1_000))), "{thin:?}");
    }
}
