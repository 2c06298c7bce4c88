//! The processors: how many, whose, and how deep they sleep.

use super::{FindingLine, Seen, some_of};

/// What is known of the processors.
#[derive(Debug, Clone)]
pub(crate) struct Processor {
    /// Those that this process may run on.
    pub(crate) allowed: Seen<usize>,
    /// Processors' worth of time that the control group gives each period; `None` where there is no limit.
    pub(crate) quota: Seen<Option<f64>>,
    /// The frequency governor of each.
    pub(crate) governors: Seen<Vec<String>>,
    /// Idle states that are in use, of all processors.
    pub(crate) idle: Seen<Vec<IdleState>>,
    /// The device that holds off deep idle states.
    pub(crate) dma_latency: Seen<DmaLatency>,
    /// What is around us.
    pub(crate) around: Around,
}

/// What is between this program and the bare machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Around {
    /// True if a container is.
    pub(crate) container: bool,
    /// Which virtual machine is; `None` where there is none.
    pub(crate) machine: Seen<Option<String>>,
}

/// Makers of virtual machines, as firmware tables name them.
const MAKERS: [&str; 5] = ["QEMU", "VMware", "innotek", "Xen", "Parallels"];

/// Which virtual machine this is, from `/proc/cpuinfo` and from the names that `/sys/hypervisor/type` and the firmware's
/// tables have, empty where they have none. An x86 processor tells by a flag; of others only the names can.
///
/// # Errors
/// Why that cannot be told, in words.
pub(crate) fn machine(cpuinfo: &str, hypervisor: &str, maker: &str) -> Seen<Option<String>> {
    let (hypervisor, maker) = (hypervisor.trim(), maker.trim());
    let flags = cpuinfo.lines().find(|line| line.starts_with("flags"));
    let marked = flags.map(|line| line.split_ascii_whitespace().any(|flag| flag == "hypervisor"));
    let named = !hypervisor.is_empty() || MAKERS.iter().any(|known| maker.starts_with(known));
    match marked {
        Some(marked) if !marked && hypervisor.is_empty() => return Ok(None),
        None if !named => return Err("this processor does not report it".to_owned()),
        _ => {}
    }
    let name = [hypervisor, maker].into_iter().find(|name| !name.is_empty());
    Ok(Some(
        name.map_or_else(|| "a virtual machine".to_owned(), |name| format!("a virtual machine ({name})")),
    ))
}

/// A way for a processor to sleep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct IdleState {
    /// The driver's name of it.
    pub(crate) name: String,
    /// How long waking from it takes, µs.
    pub(crate) latency_us: u64,
}

/// `/dev/cpu_dma_latency`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DmaLatency {
    /// True if it could be opened for writing; else why not.
    pub(crate) opened: Result<(), String>,
    /// The longest wake-up, µs, that all who hold it open agreed on; `None` where it cannot be read.
    pub(crate) held_us: Option<i32>,
}

/// An idle state that takes longer to wake from, µs, shows in the lateness at 1 kHz: a twentieth of the tick.
const DEEP_US: u64 = 50;

impl Processor {
    /// One line for each; `granted` where a play would be real-time.
    #[must_use]
    pub(crate) fn judge(&self, granted: bool) -> Vec<FindingLine> {
        vec![
            self.number(),
            self.time_quota(granted),
            self.governor(),
            self.idle_states(),
            self.latency_device(),
            self.virtual_machine(),
        ]
    }

    fn number(&self) -> FindingLine {
        const ID: &str = "processors";
        match &self.allowed {
            Err(why) => FindingLine::unknown(ID, why, "nproc"),
            Ok(1) => FindingLine::warn(
                ID,
                "1: replies are read, and moves planned, only while no tick is sent",
                "give kinocue a second processor (AllowedCPUs= and CPUAffinity= in the unit, --cpuset-cpus of a container)",
            ),
            Ok(n) => FindingLine::ok(ID, n.to_string()),
        }
    }

    fn time_quota(&self, granted: bool) -> FindingLine {
        const ID: &str = "processor_quota";
        const FIX: &str = "no CPUQuota= in the unit and its slice; no --cpus or CPU limit on the container";
        match &self.quota {
            Err(why) => FindingLine::unknown(ID, why, "cat /sys/fs/cgroup/cpu.max"),
            Ok(None) => FindingLine::ok(ID, "none"),
            Ok(Some(cpus)) if granted || *cpus >= 1.0 => FindingLine::warn(
                ID,
                format!("{cpus:.2} processors: beyond it ordinary threads stop for the rest of a period"),
                FIX,
            ),
            Ok(Some(cpus)) => FindingLine::bad(
                ID,
                format!("{cpus:.2} processors: beyond it every thread stops for the rest of a period"),
                FIX,
            ),
        }
    }

    fn governor(&self) -> FindingLine {
        const ID: &str = "governor";
        let mut names = match &self.governors {
            Ok(names) => names.clone(),
            Err(why) => return FindingLine::unknown(ID, why, "on the host: cpupower frequency-info"),
        };
        names.sort_unstable();
        names.dedup();
        let found = some_of(&names, 4);
        if names.iter().all(|name| name == "performance") {
            return FindingLine::ok(ID, found);
        }
        FindingLine::warn(
            ID,
            format!("{found}: a tick may begin at a low clock rate"),
            "cpupower frequency-set -g performance (or: echo performance | tee \
             /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor)",
        )
    }

    /// The slowest state in use that is not held off.
    fn deep(&self) -> Option<&IdleState> {
        let held = self.dma_latency.as_ref().ok().and_then(|device| device.held_us);
        let held = held.and_then(|us| u64::try_from(us).ok()).unwrap_or(u64::MAX);
        let states = self.idle.as_ref().ok()?;
        states.iter().filter(|state| state.latency_us <= held).max_by_key(|state| state.latency_us)
    }

    fn idle_states(&self) -> FindingLine {
        const ID: &str = "idle_states";
        match (&self.idle, self.deep()) {
            (Err(why), _) => FindingLine::unknown(ID, why, "on the host: cpupower idle-info"),
            (Ok(_), None) => FindingLine::ok(ID, "none in use"),
            (Ok(_), Some(state)) => {
                let found = format!("the deepest in use, {}, wakes in {} µs", state.name, state.latency_us);
                if state.latency_us <= DEEP_US {
                    return FindingLine::ok(ID, found);
                }
                let fix = format!(
                    "cpupower idle-set -D {DEEP_US}, or hold 0 in /dev/cpu_dma_latency during a show (tuned-adm profile \
                     latency-performance does)"
                );
                FindingLine::warn(ID, found, fix)
            }
        }
    }

    fn latency_device(&self) -> FindingLine {
        const ID: &str = "cpu_dma_latency";
        let device = match &self.dma_latency {
            Ok(device) => device,
            Err(why) => return FindingLine::unknown(ID, why, "on the host: ls -l /dev/cpu_dma_latency"),
        };
        let held = match device.held_us {
            None => "; its value could not be read".to_owned(),
            Some(us) if us >= FREE_US => "; no program holds it".to_owned(),
            Some(us) => format!("; held at {us} µs"),
        };
        let shallow = self.idle.is_ok() && self.deep().is_none_or(|state| state.latency_us <= DEEP_US);
        match &device.opened {
            Ok(()) => FindingLine::ok(ID, "can be opened".to_owned() + &held),
            Err(why) if shallow => FindingLine::ok(
                ID,
                format!("cannot be opened ({why}); not needed, no idle state in use is deep"),
            ),
            Err(why) => FindingLine::warn(
                ID,
                format!("cannot be opened ({why}){held}"),
                "in /etc/udev/rules.d/90-kinocue.rules: KERNEL==\"cpu_dma_latency\", GROUP=\"kinocue\", MODE=\"0660\"",
            ),
        }
    }

    fn virtual_machine(&self) -> FindingLine {
        const ID: &str = "virtual_machine";
        let container = if self.around.container { "; in a container" } else { "" };
        match &self.around.machine {
            Err(why) => FindingLine::unknown(ID, format!("{why}{container}"), "systemd-detect-virt"),
            Ok(None) => FindingLine::ok(ID, format!("no sign of one{container}")),
            Ok(Some(which)) => FindingLine::warn(
                ID,
                format!("{which}{container}: its host can take a processor away unnoticed"),
                "run on a physical machine, or pin each virtual processor to a dedicated processor of the host",
            ),
        }
    }
}

/// What the device tells while nobody holds it (`PM_QOS_CPU_LATENCY_DEFAULT_VALUE`).
const FREE_US: i32 = 2_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_virtual_machine_is_told_by_its_processor_or_its_maker() {
        let x86 = "flags\t\t: fpu vme hypervisor lahf_lm\n";
        let bare = "flags\t\t: fpu vme lahf_lm\n";
        let arm = "Features\t: fp asimd\n";
        let named = |name: &str| Ok(Some(name.to_owned()));
        assert_eq!(machine(x86, "", "QEMU\n"), named("a virtual machine (QEMU)"));
        assert_eq!(machine(x86, "", ""), named("a virtual machine"));
        assert_eq!(machine(x86, "xen\n", "Xen"), named("a virtual machine (xen)"));
        assert_eq!(machine(bare, "", "Amazon EC2"), Ok(None));
        assert_eq!(machine(arm, "", "QEMU"), named("a virtual machine (QEMU)"));
        assert!(machine(arm, "", "Some Board Ltd").is_err());
    }
}
