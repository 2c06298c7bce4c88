//! The kernel: how readily it lets go of a processor, how punctually it wakes, whom else it serves first, and whether it can confine what
//! takes cues apart.

use super::text::{boot_option, bracketed, option_set};
use super::{FindingLine, Seen, count, some_of};
use crate::sys::realtime::PRIORITY;

/// What is known of the kernel.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    /// When it lets a woken thread go before what it is doing itself.
    pub(crate) preemption: Seen<Preemption>,
    /// How much later than asked it may wake an ordinary thread.
    pub(crate) slack: Seen<Slack>,
    /// Threads with a real-time priority of at least [`PRIORITY`], ours left out.
    pub(crate) others: Seen<RealTimeThreads>,
    /// True if a thread could be left nothing but what it has open.
    pub(crate) confinement: Seen<()>,
}

/// The kernel's preemption model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Preemption {
    /// `PREEMPT_RT`: almost anywhere, also in interrupt handlers.
    RealTime,
    /// `full`: wherever it holds no lock.
    Full,
    /// `lazy`: as full for real-time threads.
    Lazy,
    /// `voluntary`: at places where it asks itself.
    Voluntary,
    /// `none`: at the end of a system call.
    None,
}

impl Preemption {
    /// The model that the kernel calls by this name, at boot and in its configuration.
    #[must_use]
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "rt" => Self::RealTime,
            "full" => Self::Full,
            "lazy" => Self::Lazy,
            "voluntary" => Self::Voluntary,
            "none" => Self::None,
            _ => return None,
        })
    }

    const fn name(self) -> &'static str {
        match self {
            Self::RealTime => "rt",
            Self::Full => "full",
            Self::Lazy => "lazy",
            Self::Voluntary => "voluntary",
            Self::None => "none",
        }
    }
}

/// What tells of the preemption model; empty texts where a file could not be read.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PreemptionSigns<'a> {
    /// `/proc/version`.
    pub(crate) version: &'a str,
    /// `/sys/kernel/debug/sched/preempt`, for root alone.
    pub(crate) in_force: &'a str,
    /// `/proc/cmdline`.
    pub(crate) cmdline: &'a str,
    /// The kernel's configuration.
    pub(crate) config: &'a str,
}

impl PreemptionSigns<'_> {
    /// The model in force, as far as it can be told.
    ///
    /// # Errors
    /// Why it cannot, in words.
    pub(crate) fn model(&self) -> Seen<Preemption> {
        let says = |word: &str| self.version.split_ascii_whitespace().any(|said| said == word);
        if says("PREEMPT_RT") {
            return Ok(Preemption::RealTime);
        }
        let dynamic = says("PREEMPT_DYNAMIC");
        let booted = boot_option(self.cmdline, "preempt").filter(|_| dynamic);
        if let Some(model) = bracketed(self.in_force).or(booted).and_then(Preemption::named) {
            return Ok(model);
        }
        if says("PREEMPT") {
            return Ok(Preemption::Full);
        }
        let built = [
            ("CONFIG_PREEMPT", Preemption::Full),
            ("CONFIG_PREEMPT_LAZY", Preemption::Lazy),
            ("CONFIG_PREEMPT_VOLUNTARY", Preemption::Voluntary),
            ("CONFIG_PREEMPT_NONE", Preemption::None),
        ];
        let set = built.into_iter().find(|(option, _)| option_set(self.config, option) == Some(true));
        set.map(|(_, model)| model).ok_or_else(|| match dynamic {
            true => "chosen at boot; /sys/kernel/debug/sched/preempt, which shows it, could not be read"
                .to_owned(),
            false => "neither the kernel's version nor its configuration shows it".to_owned(),
        })
    }
}

/// Timer slack of an ordinary thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slack {
    /// What it begins with, ns.
    pub(crate) default_ns: u64,
    /// True if 1 ns was accepted.
    pub(crate) settable: bool,
}

/// Real-time threads of high priority.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct RealTimeThreads {
    /// Of programs, as `name (priority)`.
    pub(crate) of_programs: Vec<String>,
    /// How many of the kernel's own.
    pub(crate) of_kernel: usize,
    /// True if any thread of the kernel's was seen; if not, other programs are hidden as well.
    pub(crate) whole: bool,
}

impl Kernel {
    /// One line for each; `granted` where a play would be real-time.
    #[must_use]
    pub(crate) fn judge(&self, granted: bool) -> Vec<FindingLine> {
        vec![self.model(), self.timer_slack(granted), self.other_threads(), self.confinement()]
    }

    fn model(&self) -> FindingLine {
        const ID: &str = "preemption";
        match &self.preemption {
            Err(why) => FindingLine::unknown(
                ID,
                why,
                "as root: cat /sys/kernel/debug/sched/preempt; or: zgrep PREEMPT /proc/config.gz",
            ),
            Ok(model @ (Preemption::RealTime | Preemption::Full | Preemption::Lazy)) => {
                FindingLine::ok(ID, model.name())
            }
            Ok(model) => FindingLine::warn(
                ID,
                format!("{}: a long system call of another program delays a tick", model.name()),
                "boot with preempt=full, or with a PREEMPT_RT kernel (Debian: apt install linux-image-rt-amd64)",
            ),
        }
    }

    fn timer_slack(&self, granted: bool) -> FindingLine {
        const ID: &str = "timer_slack";
        match &self.slack {
            Err(why) => FindingLine::unknown(ID, why, "cat /proc/self/timerslack_ns"),
            Ok(slack) if granted => {
                FindingLine::ok(ID, format!("{} ns, of no effect on real-time threads", slack.default_ns))
            }
            Ok(slack) if slack.settable => {
                FindingLine::ok(ID, format!("{} ns; play sets 1 ns", slack.default_ns))
            }
            Ok(slack) => FindingLine::warn(
                ID,
                format!("{} ns, and setting 1 ns was refused: every wake-up is that late", slack.default_ns),
                "allow prctl(PR_SET_TIMERSLACK) in the container's seccomp profile, or see realtime_policy",
            ),
        }
    }

    fn confinement(&self) -> FindingLine {
        const ID: &str = "confinement";
        match &self.confinement {
            Ok(()) => FindingLine::ok(
                ID,
                "what checks cues and draws recordings can open, send and start nothing (seccomp)",
            ),
            Err(why) => FindingLine::warn(
                ID,
                format!("{why}: a cue that takes its checking over may do what the service's user may"),
                "run a kernel with CONFIG_SECCOMP_FILTER, or allow prctl(PR_SET_SECCOMP) in the container's seccomp profile",
            ),
        }
    }

    fn other_threads(&self) -> FindingLine {
        const ID: &str = "other_realtime_threads";
        const LOOK: &str = "on the host: ps -eLo pid,tid,cls,rtprio,comm | awk '$4 >= 50'";
        let others = match &self.others {
            Ok(others) => others,
            Err(why) => return FindingLine::unknown(ID, why, LOOK),
        };
        let kernels = format!("{} of the kernel's own", count(others.of_kernel, "thread"));
        let programs = &others.of_programs;
        if !programs.is_empty() {
            return FindingLine::warn(
                ID,
                format!("at priority {PRIORITY} or more: {}; and {kernels}", some_of(programs, 5)),
                format!(
                    "end what a show does not need, or lower its priority: chrt -f -p {} TID (TIDs: ps -eLo tid,rtprio,comm)",
                    PRIORITY - 1
                ),
            );
        }
        if others.whole {
            FindingLine::ok(ID, format!("no program at priority {PRIORITY} or more; {kernels}"))
        } else {
            FindingLine::unknown(ID, "none visible here, but other programs are hidden", LOOK)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preemption_model_is_read_where_it_is_told_and_not_guessed_where_it_is_not() {
        let dynamic = PreemptionSigns {
            version: "Linux version 6.12.0 (a@b) #1 SMP PREEMPT_DYNAMIC Debian",
            ..PreemptionSigns::default()
        };
        assert!(dynamic.model().unwrap_err().starts_with("chosen at boot"));
        let booted = PreemptionSigns { cmdline: "quiet preempt=full", ..dynamic };
        assert_eq!(booted.model(), Ok(Preemption::Full));
        let in_force = PreemptionSigns { in_force: "none (voluntary) full\n", ..booted };
        assert_eq!(in_force.model(), Ok(Preemption::Voluntary));
        let config = "CONFIG_PREEMPT_NONE=y\n# CONFIG_PREEMPT is not set\nCONFIG_PREEMPT_DYNAMIC=y\n";
        assert_eq!(PreemptionSigns { config, ..dynamic }.model(), Ok(Preemption::None));
    }

    #[test]
    fn a_kernel_with_one_model_names_it_in_its_version() {
        let model =
            |version, cmdline| PreemptionSigns { version, cmdline, ..PreemptionSigns::default() }.model();
        assert_eq!(model("Linux version 6.12.0-rt #1 SMP PREEMPT_RT", ""), Ok(Preemption::RealTime));
        assert_eq!(model("Linux version 5.4 #1 SMP PREEMPT", "preempt=none"), Ok(Preemption::Full));
        assert!(model("Linux version 5.4 #1 SMP", "preempt=full").is_err());
    }
}
