//! Real-time scheduling: whether it is granted, and each thing that can stand in its way.

use super::{FindingLine, Seen};
use crate::sys::machine::ProcessLimit;
use crate::sys::realtime::{PRIORITY, Policy};

/// What is known of real-time scheduling.
#[derive(Debug, Clone)]
pub(crate) struct Scheduling {
    /// What came of trying it.
    pub(crate) trial: Seen<FifoTrial>,
    /// The highest priority that needs no right (`RLIMIT_RTPRIO`).
    pub(crate) limit: ProcessLimit,
    /// True if this process has the right to any priority (`CAP_SYS_NICE` in the first user namespace).
    pub(crate) right: Seen<bool>,
    /// The control group that rules processor time.
    pub(crate) group: Seen<Group>,
    /// How much of each period all real-time threads together may use.
    pub(crate) throttle: Seen<Throttle>,
}

/// What came of asking the kernel for `SCHED_FIFO`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FifoTrial {
    /// True if whoever started the program gave it.
    pub(crate) given: bool,
    /// The policy in force afterwards.
    pub(crate) policy: Policy,
    /// Its priority.
    pub(crate) priority: u8,
    /// Why it was refused.
    pub(crate) refusal: Option<RealTimeRefusal>,
}

/// Why the kernel refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RealTimeRefusal {
    /// In the kernel's words.
    pub(crate) words: String,
    /// True if it was `EPERM`: for lack of a right, or by a control group.
    pub(crate) not_permitted: bool,
}

/// A control group, as far as real-time scheduling goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Group {
    /// Its path within its hierarchy.
    pub(crate) path: String,
    /// The file that gives it its real-time share, and the share in µs; only the first version has one, and only in a
    /// kernel with `CONFIG_RT_GROUP_SCHED`.
    pub(crate) share: Option<(String, i64)>,
    /// True if the kernel shares out real-time by groups; `None` where its configuration could not be read.
    pub(crate) configured: Option<bool>,
}

/// The kernel's guard against a real-time thread that never sleeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Throttle {
    /// `sched_rt_runtime_us`; below zero there is no guard.
    pub(crate) runtime_us: i64,
    /// `sched_rt_period_us`.
    pub(crate) period_us: i64,
}

/// A play with a spin keeps below this part of a processor.
const MOST_PERCENT: i64 = 90;

impl Scheduling {
    /// True if a play would be real-time.
    #[must_use]
    pub(crate) fn granted(&self) -> bool {
        self.trial.as_ref().is_ok_and(|trial| trial.policy != Policy::Other)
    }

    /// True if nothing but a control group, or a filter of the container, can have refused.
    fn entitled(&self) -> bool {
        self.right == Ok(true) || self.limit.soft.is_none_or(|most| most >= u64::from(PRIORITY))
    }

    /// One line for each.
    #[must_use]
    pub(crate) fn judge(&self) -> Vec<FindingLine> {
        vec![self.policy(), self.priority_limit(), self.control_group(), self.guard()]
    }

    fn policy(&self) -> FindingLine {
        const ID: &str = "realtime_policy";
        let trial = match &self.trial {
            Ok(trial) => trial,
            Err(why) => return FindingLine::unknown(ID, why, format!("chrt -f {PRIORITY} true")),
        };
        let in_force = format!("{} at priority {}", trial.policy, trial.priority);
        match &trial.refusal {
            _ if trial.policy != Policy::Other && trial.given => {
                FindingLine::ok(ID, format!("{in_force}, inherited at the start of the program"))
            }
            _ if trial.policy != Policy::Other => FindingLine::ok(ID, format!("{in_force} was granted")),
            Some(refusal) => FindingLine::bad(ID, format!("refused: {}", refusal.words), self.remedy()),
            None => FindingLine::bad(ID, "granted, but not in force", self.remedy()),
        }
    }

    fn remedy(&self) -> String {
        if self.entitled() {
            return "see realtime_group".to_owned();
        }
        format!(
            "in the unit: CPUSchedulingPolicy=fifo, CPUSchedulingPriority={PRIORITY}, CPUSchedulingResetOnFork=yes; for a \
             person: see priority_limit; in a container: --cap-add SYS_NICE"
        )
    }

    fn priority_limit(&self) -> FindingLine {
        const ID: &str = "priority_limit";
        let limit = self.limit.soft.map_or_else(|| "none".to_owned(), |most| most.to_string());
        let found = format!("RLIMIT_RTPRIO {limit}");
        let fix = || {
            format!(
                "LimitRTPRIO={PRIORITY} in the unit, or `@kinocue - rtprio {PRIORITY}` in \
                 /etc/security/limits.d/kinocue.conf and log in again"
            )
        };
        if self.limit.soft.is_none_or(|most| most >= u64::from(PRIORITY)) {
            return FindingLine::ok(ID, found);
        }
        match &self.right {
            Ok(true) => FindingLine::ok(ID, found + "; not needed with CAP_SYS_NICE"),
            _ if self.granted() => FindingLine::ok(ID, found + "; not needed, the policy was given"),
            _ if self.limit.hard.is_none_or(|most| most >= u64::from(PRIORITY)) => {
                FindingLine::bad(ID, found + ", which may be raised", format!("ulimit -r {PRIORITY}"))
            }
            Ok(false) => {
                FindingLine::bad(ID, found + ", and no CAP_SYS_NICE that reaches the scheduler", fix())
            }
            Err(why) => FindingLine::bad(ID, format!("{found}; whether there is CAP_SYS_NICE: {why}"), fix()),
        }
    }

    fn control_group(&self) -> FindingLine {
        const ID: &str = "realtime_group";
        const LOOK: &str =
            "cat /proc/self/cgroup; zgrep RT_GROUP_SCHED /proc/config.gz /boot/config-$(uname -r)";
        let group = match &self.group {
            Ok(group) => group,
            Err(why) if self.granted() => {
                return FindingLine::ok(ID, format!("the group does not refuse it ({why})"));
            }
            Err(why) => return FindingLine::unknown(ID, why, LOOK),
        };
        let found = group.words();
        let refused = self.trial.as_ref().ok().and_then(|trial| trial.refusal.as_ref());
        match &group.share {
            _ if self.granted() => FindingLine::ok(ID, found + ", which does not refuse it"),
            Some((file, 0)) => FindingLine::bad(
                ID,
                found,
                format!(
                    "echo 200000 > {file} (first in each group above it), or start kinocue outside the group"
                ),
            ),
            _ if group.configured == Some(false) => FindingLine::ok(ID, found),
            _ if refused.is_some_and(|refusal| refusal.not_permitted) && self.entitled() => FindingLine::bad(
                ID,
                found
                    + "; refused although the limit allows it: blocked by the control group or a seccomp filter",
                "no CPUWeight=, CPUQuota= or Delegate= in the unit and its slice; or boot with rt_group_sched=0; in a \
                 container: --cap-add SYS_NICE and a seccomp profile that allows sched_setscheduler",
            ),
            Some(_) => FindingLine::ok(ID, found),
            None => FindingLine::unknown(
                ID,
                found + "; whether it has a real-time share shows only once the policy is permitted",
                LOOK,
            ),
        }
    }

    fn guard(&self) -> FindingLine {
        const ID: &str = "realtime_throttle";
        const LINE: &str = "sysctl -w kernel.sched_rt_runtime_us=950000 kernel.sched_rt_period_us=1000000";
        let throttle = match &self.throttle {
            Ok(throttle) => *throttle,
            Err(why) => return FindingLine::unknown(ID, why, "sysctl kernel.sched_rt_runtime_us"),
        };
        let found =
            format!("{} µs of each {} µs for real-time threads", throttle.runtime_us, throttle.period_us);
        match throttle.runtime_us {
            ..0 => FindingLine::warn(
                ID,
                "off: a real-time thread that never sleeps keeps its processor forever",
                LINE,
            ),
            0 => FindingLine::bad(ID, found, LINE),
            runtime if runtime.saturating_mul(100) < throttle.period_us.saturating_mul(MOST_PERCENT) => {
                FindingLine::warn(
                    ID,
                    format!("{found}; a play with a spin uses up to {MOST_PERCENT} %"),
                    LINE,
                )
            }
            _ => FindingLine::ok(ID, found),
        }
    }
}

impl Group {
    fn words(&self) -> String {
        let share = match &self.share {
            Some((_, us)) => format!(" with a real-time share of {us} µs"),
            None => String::new(),
        };
        let kernel = match self.configured {
            Some(false) => "; the kernel has no real-time shares of groups",
            Some(true) if self.share.is_none() => "; the kernel has real-time shares of groups",
            _ => "",
        };
        format!("cpu control group {}{share}{kernel}", self.path)
    }
}
