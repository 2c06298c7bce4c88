//! The machine's clocks: what time is read from, how finely it is slept, and whether the wall clock is true.

use super::{FindingLine, Seen};
use crate::sys::machine::ClockSync;

/// What is known of the clocks.
#[derive(Debug, Clone)]
pub(crate) struct Clocks {
    /// What the kernel reads the time from.
    pub(crate) source: Seen<ClockSource>,
    /// The finest step of a sleep, ns.
    pub(crate) resolution_ns: u64,
    /// How well the wall clock is held.
    pub(crate) sync: Seen<ClockSync>,
}

/// The kernel's clock source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ClockSource {
    /// The one in use.
    pub(crate) current: String,
    /// Those that could be.
    pub(crate) available: Vec<String>,
}

/// Read without leaving the program, in some ten nanoseconds.
const FAST: [&str; 6] =
    ["tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "xen", "arch_sys_counter", "riscv_clocksource"];
/// Read from a device, in a microsecond or more, one reader at a time.
const SLOW: [&str; 4] = ["hpet", "acpi_pm", "hyperv_clocksource_msr", "refined-jiffies"];

/// A sleep in steps of a kernel tick cannot keep a grid of 1 ms.
const COARSE_NS: u64 = 10_000;
/// A wall clock further off than this, µs, cannot be lined up with a film by a person's log.
const FAR_US: u64 = 100_000;

impl Clocks {
    /// One line for each.
    #[must_use]
    pub(crate) fn judge(&self) -> Vec<FindingLine> {
        vec![self.clock_source(), self.resolution(), self.wall_clock()]
    }

    fn clock_source(&self) -> FindingLine {
        const ID: &str = "clock_source";
        const FILE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
        let source = match &self.source {
            Ok(source) => source,
            Err(why) => return FindingLine::unknown(ID, why, format!("cat {FILE}")),
        };
        let current = source.current.as_str();
        if FAST.contains(&current) {
            return FindingLine::ok(ID, current);
        }
        if !SLOW.contains(&current) && current != "jiffies" {
            return FindingLine::unknown(
                ID,
                format!("{current}, whose cost is unknown"),
                "see the measured run",
            );
        }
        let fix = match source.available.iter().find(|name| FAST.contains(&name.as_str())) {
            Some(fast) => format!("echo {fast} > {FILE}"),
            None => "dmesg | grep -i -e tsc -e clocksource shows why no fast one is trusted; if the processor's is \
                     sound, boot with tsc=reliable"
                .to_owned(),
        };
        if current == "jiffies" {
            return FindingLine::bad(ID, "jiffies: time goes in steps of milliseconds", fix);
        }
        FindingLine::warn(ID, format!("{current}: each reading takes a microsecond or more"), fix)
    }

    fn resolution(&self) -> FindingLine {
        const ID: &str = "timer_resolution";
        let found = format!("{} ns", self.resolution_ns);
        if self.resolution_ns <= COARSE_NS {
            return FindingLine::ok(ID, found);
        }
        FindingLine::bad(
            ID,
            found,
            "boot without highres=off, with a kernel that has CONFIG_HIGH_RES_TIMERS=y",
        )
    }

    fn wall_clock(&self) -> FindingLine {
        const ID: &str = "clock_synchronisation";
        const FIX: &str = "apt install chrony, or timedatectl set-ntp true; for a container or virtual machine: on the host";
        match &self.sync {
            Err(why) => FindingLine::unknown(ID, why, "chronyc tracking, or timedatectl show-timesync"),
            Ok(sync) if !sync.synchronised => FindingLine::warn(
                ID,
                "the wall clock is not synchronised; ticks do not use it, but logs and other machines will disagree",
                FIX,
            ),
            Ok(sync) if sync.max_error_us > FAR_US => {
                FindingLine::warn(ID, format!("may be wrong by {} ms", sync.max_error_us / 1_000), FIX)
            }
            Ok(sync) => FindingLine::ok(ID, format!("within {} µs", sync.max_error_us)),
        }
    }
}
