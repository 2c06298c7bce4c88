//! Decides if a controller that is back is the one it was, and has not rebooted: its identity, and its count of datagrams.
//!
//! DP34 counts the datagrams that a controller received, round after 65,535. Since it was last read, it must have grown
//! by at least the frames that were acked and at most by all that was sent, and by what was held back before ([`Overdue`]); whether
//! reads count is left open. A
//! controller that rebooted began at 0 and hardly ever meets that; where it counts more than it could since, somebody else
//! sent to it.
//!
//! An MBOX controller has no DP34. That one did not reboot is proved by its answers: it needs a second to start, and then
//! homes, so whoever has answered all the while has not.

use super::late::Overdue;
use crate::time::MonoTime;

/// What was read of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sighting {
    /// What it is; no more than compared.
    pub(crate) identity: Identity,
    /// Its error number; 0 for none.
    pub(crate) error: u16,
    /// What kind of alarm its drives have (DPFE of an MBOX controller); 0 for none.
    pub(crate) alarm: u16,
    /// By what it can be told that it has not restarted.
    pub(crate) continuity: Continuity,
    /// True if DPF0 says that it knows its zero.
    pub(crate) homed: bool,
}

/// By what a controller tells that it has not restarted since it was believed last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// DP34, the datagrams it received.
    Packets(u16),
    /// Nothing but that it answered all the while.
    Answers,
    /// A number of ours that it keeps until it restarts: it says so itself, by not being home.
    Mark,
}

/// What a controller is, as far as registers tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Identity {
    /// DPFF.
    pub(crate) version: u16,
    /// DPFE; 0 for an MBOX controller, whose DPFE is something else.
    pub(crate) minor_version: u16,
    /// PA00.
    pub(crate) work_mode: u16,
    /// PA02.
    pub(crate) axes: u16,
}

/// Datagrams that may have been under way when the counter was read, either way.
const UNDER_WAY: u64 = 64;
/// With more datagrams than these in doubt the counter proves nothing.
const PROVES: u64 = 1 << 15;
/// With more than these in doubt it is time to read the counter again, or sooner where it has counted little.
const REFRESH: u64 = 1 << 13;

/// Datagrams to one controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Traffic {
    /// Handed to the kernel: frames and reads.
    pub(super) sent: u64,
    /// Frames that were acked, so that it has surely received them.
    pub(super) acked: u64,
}

/// What was known when the counter was last read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Baseline {
    identity: Identity,
    continuity: Continuity,
    homed: bool,
    traffic: Traffic,
    /// What it had not counted then of all that was sent before.
    late: Overdue,
}

/// What a sighting says beside the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Same,
    Other,
    NotHome,
    Rebooted,
    Crowded,
    Gap,
    Unproved,
}

impl Continuity {
    const fn packets(self) -> Option<u16> {
        if let Self::Packets(packets) = self { Some(packets) } else { None }
    }
}

impl Sighting {
    /// The datagrams that it counts, if it does.
    pub(super) const fn packets(&self) -> Option<u16> {
        self.continuity.packets()
    }
}

impl Baseline {
    pub(super) const fn homed(&self) -> bool {
        self.homed
    }

    pub(super) fn of(sighting: &Sighting, traffic: Traffic) -> Self {
        let Sighting { identity, continuity, homed, .. } = *sighting;
        Self { identity, continuity, homed, traffic, late: Overdue::default() }
    }

    /// The one that follows it, of a sighting that it believes.
    pub(super) fn renewed(&self, sighting: &Sighting, traffic: Traffic, now: MonoTime) -> Self {
        let grown = |(then, now): (u16, u16)| {
            let acked = traffic.acked - self.traffic.acked;
            let beyond = u64::from(now).wrapping_sub(u64::from(then)).wrapping_sub(acked);
            (acked + beyond.wrapping_add(UNDER_WAY) % (1 << 16)).saturating_sub(UNDER_WAY)
        };
        let sent = traffic.sent - self.traffic.sent;
        let late =
            self.packets().zip(sighting.packets()).map(grown).map(|grown| self.late.after(sent, grown, now));
        Self { late: late.unwrap_or_default(), ..Self::of(sighting, traffic) }
    }

    /// `gap` says whether it has left unanswered, since it was believed last, what it would not have.
    pub(super) fn judge(&self, sighting: &Sighting, traffic: Traffic, gap: bool, now: MonoTime) -> Verdict {
        if sighting.identity != self.identity {
            return Verdict::Other;
        }
        // Some seats are played without ever having been homed by DPF0: only the loss of it tells something.
        if self.homed && !sighting.homed {
            return Verdict::NotHome;
        }
        let late = self.late.most(now);
        let (then, now) = match (self.continuity, sighting.continuity) {
            (Continuity::Packets(then), Continuity::Packets(now)) => (then, now),
            (Continuity::Answers, Continuity::Answers) if gap => return Verdict::Gap,
            (Continuity::Answers, Continuity::Answers) | (Continuity::Mark, Continuity::Mark) => {
                return Verdict::Same;
            }
            _ => return Verdict::Unproved,
        };
        let doubt = self.doubt(traffic) + late + 2 * UNDER_WAY;
        if doubt > PROVES {
            return Verdict::Unproved;
        }
        let acked = traffic.acked - self.traffic.acked;
        let grown = u64::from(now).wrapping_sub(u64::from(then)).wrapping_sub(acked);
        if grown.wrapping_add(UNDER_WAY) % (1 << 16) <= doubt {
            return Verdict::Same;
        }
        let counted_since = traffic.sent - self.traffic.sent + late + UNDER_WAY;
        if u64::from(now) <= counted_since { Verdict::Rebooted } else { Verdict::Crowded }
    }

    /// True if the counter should be read again while all is well. One that began not long ago is hard to tell from one that
    /// begins anew, so it is read again as soon as it may have counted twice as much.
    pub(super) fn is_stale(&self, traffic: Traffic) -> bool {
        let counted = |packets: u16| u64::from(packets).clamp(UNDER_WAY, REFRESH);
        self.packets().is_some_and(|packets| self.doubt(traffic) > counted(packets))
    }

    /// True if it has a counter.
    pub(super) const fn is_counted(&self) -> bool {
        self.packets().is_some()
    }

    const fn packets(&self) -> Option<u16> {
        self.continuity.packets()
    }

    /// Datagrams that it may have received or not.
    const fn doubt(&self, traffic: Traffic) -> u64 {
        (traffic.sent - self.traffic.sent).saturating_sub(traffic.acked - self.traffic.acked)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NOW: MonoTime = MonoTime::from_nanos(100_000_000_000);

    const fn sighting(packets: u16) -> Sighting {
        let identity = Identity { version: 3, minor_version: 1, work_mode: 2, axes: 3 };
        Sighting { identity, error: 0, alarm: 0, continuity: Continuity::Packets(packets), homed: true }
    }

    fn after(packets: u16, sent: u64, acked: u64, now: u16) -> Verdict {
        let before = Traffic { sent: 1_000, acked: 900 };
        let baseline = Baseline::of(&sighting(packets), before);
        baseline.judge(&sighting(now), Traffic { sent: 1_000 + sent, acked: 900 + acked }, true, NOW)
    }

    #[test]
    fn a_counter_that_began_anew_is_a_reboot() {
        assert_eq!(after(40_000, 500, 470, 12), Verdict::Rebooted);
        assert_eq!(after(40_000, 500, 470, 40_480), Verdict::Same);
    }

    #[test]
    fn a_counter_of_more_than_was_sent_since_any_reboot_tells_of_another_master() {
        assert_eq!(after(40_000, 500, 470, 41_000), Verdict::Crowded);
        assert_eq!(after(40_000, 500, 470, 700), Verdict::Crowded);
        assert_eq!(after(40_000, 500, 470, 500), Verdict::Rebooted, "of all that was sent since");
    }

    #[test]
    fn a_counter_is_read_again_when_it_may_have_doubled_but_not_seldom() {
        let stale = |packets, sent| {
            let traffic = |sent| Traffic { sent, acked: 0 };
            Baseline::of(&sighting(packets), traffic(0)).is_stale(traffic(sent))
        };
        for (packets, doubt) in [(0, 64), (64, 64), (300, 300), (8_192, 8_192), (60_000, 8_192)] {
            assert!(!stale(packets, doubt) && stale(packets, doubt + 1), "{packets}");
        }
    }

    #[test]
    fn a_counter_without_news_of_so_much_that_was_sent_proves_nothing() {
        assert_eq!(after(0, 40_000, 100, 5_000), Verdict::Unproved);
    }

    #[test]
    fn a_controller_that_counts_nothing_is_believed_as_long_as_it_has_answered_all_the_while() {
        let blind = Sighting { continuity: Continuity::Answers, ..sighting(0) };
        let none = Traffic::default();
        let after = |gap| Baseline::of(&blind, none).judge(&blind, none, gap, NOW);
        assert_eq!((after(false), after(true)), (Verdict::Same, Verdict::Gap));
        assert_eq!(Baseline::of(&sighting(0), none).judge(&blind, none, false, NOW), Verdict::Unproved);
    }

    #[test]
    fn a_controller_that_was_never_home_is_no_less_so_now() {
        let away = Sighting { homed: false, ..sighting(7) };
        let judge =
            |before, now| Baseline::of(before, Traffic::default()).judge(now, Traffic::default(), false, NOW);
        assert_eq!(judge(&away, &away), Verdict::Same);
        assert_eq!(judge(&sighting(7), &away), Verdict::NotHome);
    }

    #[test]
    fn another_work_mode_is_another_controller() {
        let mut other = sighting(7);
        other.identity.work_mode = 1;
        assert_eq!(
            Baseline::of(&sighting(7), Traffic::default()).judge(&other, Traffic::default(), false, NOW),
            Verdict::Other
        );
    }

    #[test]
    fn a_drive_that_keeps_its_mark_is_believed_however_long_it_was_silent_and_no_more_once_it_is_not_home() {
        let marked = Sighting { continuity: Continuity::Mark, ..sighting(0) };
        let after = |now: &Sighting| {
            let none = Traffic::default();
            Baseline::of(&marked, none).judge(now, none, true, NOW)
        };
        assert_eq!(after(&marked), Verdict::Same);
        assert_eq!(after(&Sighting { homed: false, ..marked }), Verdict::NotHome);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn a_counter_that_goes_on_is_believed_after_any_number_of_rounds(
            packets: u16, acked in 0..10_000_000_u64, unanswered in 0..30_000_u64, received in 0.0..1.0_f64,
        ) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a share")]
            let received = (received * unanswered as f64) as u64;
            let now = (u64::from(packets) + acked + received) % (1 << 16);
            let verdict = after(packets, acked + unanswered, acked, u16::try_from(now).unwrap());
            prop_assert_eq!(verdict, Verdict::Same);
        }
    }
}
