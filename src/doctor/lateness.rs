//! The measured run: how late a bare tick loop woke up, and whether that will do.

use super::{FindingLine, Verdict};
use crate::sys::realtime::Policy;
use crate::tracker::Histogram;

/// Ticks per second of the run: the fastest that kinocue plays.
pub(crate) const RATE_HZ: f64 = 1_000.0;
/// From one tick of the run to the next, ns.
pub(crate) const PERIOD_NS: u64 = 1_000_000;

/// What else the machine did during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MachineLoad {
    /// Nothing of ours.
    Idle,
    /// One thread of ordinary priority on each processor that never sleeps.
    Loaded,
}

impl MachineLoad {
    /// As it is written in reports.
    #[must_use]
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Loaded => "loaded",
        }
    }

    const fn id(self) -> &'static str {
        match self {
            Self::Idle => "lateness_idle",
            Self::Loaded => "lateness_loaded",
        }
    }
}

/// What came of a run.
#[derive(Debug, Clone)]
pub(crate) struct LatenessRun {
    /// What else went on.
    pub(crate) load: MachineLoad,
    /// How the loop was scheduled.
    pub(crate) policy: Policy,
    /// Wake-ups.
    pub(crate) ticks: u64,
    /// Ticks slept through.
    pub(crate) missed: u64,
    /// From the deadline slept for to the wake-up, ns, of each wake-up; a stall shows whole.
    pub(crate) lateness: Histogram,
}

/// The 99th percentile above which a run is worth a warning, per cent of the tick.
pub(crate) const WARN_PERCENT: u64 = 10;
/// The 99th percentile above which a machine is not ready, per cent of the tick.
pub(crate) const BAD_PERCENT: u64 = 50;
/// Ticks slept through of 1,000 above which a machine is not ready.
pub(crate) const BAD_MISSED_PER_MILLE: u64 = 1;

impl LatenessRun {
    /// The line of this run.
    #[must_use]
    pub(crate) fn judge(&self) -> FindingLine {
        let id = self.load.id();
        if self.lateness.is_empty() {
            return FindingLine::unknown(id, "no tick was measured", "kinocue doctor --seconds 10");
        }
        let p99 = self.lateness.value_at_quantile(0.99);
        let found = format!(
            "p99 {}, longest {}, {} of {} ticks missed, scheduled as {}",
            us(p99),
            us(self.lateness.max()),
            self.missed,
            self.ticks + self.missed,
            self.policy
        );
        match self.verdict(p99) {
            Verdict::Bad => FindingLine::bad(id, found, self.fix()),
            Verdict::Warn => FindingLine::warn(id, found, self.fix()),
            _ => FindingLine::ok(id, found),
        }
    }

    fn verdict(&self, p99_ns: u64) -> Verdict {
        let due = self.ticks + self.missed;
        if p99_ns * 100 > PERIOD_NS * BAD_PERCENT || self.missed * 1_000 > due * BAD_MISSED_PER_MILLE {
            Verdict::Bad
        } else if p99_ns * 100 > PERIOD_NS * WARN_PERCENT || self.missed > 0 {
            Verdict::Warn
        } else {
            Verdict::Ok
        }
    }

    fn fix(&self) -> &'static str {
        match (self.policy, self.load) {
            (Policy::Other, _) => "see realtime_policy: under load nothing else helps",
            (_, MachineLoad::Idle) => {
                "see idle_states, governor and virtual_machine: an idle processor is slow to wake; then \
                 other_realtime_threads"
            }
            (_, MachineLoad::Loaded) => "see other_realtime_threads, preemption and virtual_machine",
        }
    }
}

/// A time in the unit that suits it.
#[must_use]
pub(crate) fn us(ns: u64) -> String {
    let tenths = |ns: u64, unit: u64| format!("{}.{}", ns / unit, ns % unit * 10 / unit);
    match ns {
        0..1_000_000 => format!("{} µs", tenths(ns, 1_000)),
        1_000_000..1_000_000_000 => format!("{} ms", tenths(ns, 1_000_000)),
        _ => format!("{} s", tenths(ns, 1_000_000_000)),
    }
}
