//! Reads every fact from this machine. Nothing is changed; a file that cannot be read becomes the reason why a fact was not
//! seen.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use super::clocks::{ClockSource, Clocks};
use super::kernel::{Kernel, PreemptionSigns, RealTimeThreads, Slack};
use super::memory::MemoryFacts;
use super::network::{NeighbourTable, NetworkFacts};
use super::processor::{Around, DmaLatency, IdleState, Processor, machine};
use super::scheduling::{FifoTrial, Group, RealTimeRefusal, Scheduling, Throttle};
use super::{Facts, Seen, text};
use crate::net::SendCost;
use crate::sys::clock::Monotonic;
use crate::sys::confined::try_confinement;
use crate::sys::file::of_kernel;
use crate::sys::machine as sys;
use crate::sys::realtime::PRIORITY;

/// `CAP_SYS_NICE`.
const SYS_NICE: u32 = 23;
const CPUS: &str = "/sys/devices/system/cpu";

/// Everything that can be seen of this machine.
#[must_use]
pub(crate) fn facts() -> Facts {
    let trial = sys::try_realtime().map_err(|error| format!("no thread to try it on: {error}"));
    let limits = sys::limits();
    let config = kernel_config();
    Facts {
        kernel: Kernel {
            preemption: preemption(&config),
            slack: trial.as_ref().map_err(Clone::clone).and_then(slack),
            others: realtime_threads(),
            confinement: try_confinement()
                .map_err(|error| format!("the kernel takes no filter of system calls ({error})")),
        },
        scheduling: Scheduling {
            trial: trial.map(tried),
            limit: limits.priority,
            right: may_set_priority(),
            group: group(&config),
            throttle: throttle(),
        },
        memory: MemoryFacts {
            locked: sys::try_memory_lock().map_err(|error| error.to_string()),
            limit: limits.locked,
            swaps: read("/proc/swaps").map(|text| text::swaps(&text)),
        },
        processor: processor(),
        clocks: clocks(),
        network: network(limits.files),
    }
}

/// A text, or why it could not be read.
fn read(path: impl AsRef<Path>) -> Seen<String> {
    let path = path.as_ref();
    of_kernel(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => format!("{} does not exist", path.display()),
        ErrorKind::PermissionDenied => format!("{} may not be read", path.display()),
        _ => format!("{}: {error}", path.display()),
    })
}

/// A text, or nothing.
fn text_of(path: impl AsRef<Path>) -> String {
    of_kernel(path.as_ref()).unwrap_or_default()
}

fn number<N: std::str::FromStr>(path: &str) -> Seen<N> {
    read(path)?.trim().parse().map_err(|_| format!("{path} does not hold a number"))
}

fn strange(path: &str) -> String {
    format!("{path} is not as expected")
}

/// Whole names in a folder that begin so; `None` if there is no such folder.
fn entries(folder: impl AsRef<Path>, begins: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let fits = |rest: &str| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit());
    let named = entries.filter(|entry| {
        entry.file_name().to_str().and_then(|name| name.strip_prefix(begins)).is_some_and(fits)
    });
    named.map(|entry| entry.path()).collect()
}

/// The kernel's configuration, where a distribution leaves it as plain text; empty if it does not.
fn kernel_config() -> String {
    let release = text_of("/proc/sys/kernel/osrelease");
    let release = release.trim();
    let places = [format!("/boot/config-{release}"), format!("/lib/modules/{release}/config")];
    places.iter().map(text_of).find(|text| !text.is_empty()).unwrap_or_default()
}

fn tried(trial: sys::Trial) -> FifoTrial {
    let (policy, priority) = trial.in_force;
    let refusal = trial.refusal.map(|error| RealTimeRefusal {
        words: error.to_string(),
        not_permitted: error.raw_os_error() == Some(rustix::io::Errno::PERM.raw_os_error()),
    });
    FifoTrial { given: trial.given, policy, priority, refusal }
}

fn slack(trial: &sys::Trial) -> Seen<Slack> {
    let default_ns = trial.slack_ns.ok_or("the kernel does not report it")?;
    Ok(Slack { default_ns, settable: trial.slack_settable })
}

fn may_set_priority() -> Seen<bool> {
    let path = "/proc/self/status";
    let right = text::has_right(&read(path)?, SYS_NICE).ok_or_else(|| strange(path))?;
    Ok(right && text::is_first_user_namespace(&read("/proc/self/uid_map")?))
}

/// The control group that rules processor time, and the folder of its files and of each group above it, its own first.
fn group_folders() -> Seen<(text::ControlGroup, Vec<PathBuf>)> {
    let path = "/proc/self/cgroup";
    let group = text::cpu_group(&read(path)?).ok_or("no control group controls processor time")?;
    let mounts = read("/proc/self/mounts")?;
    let hidden = "the files of the control group are not mounted here";
    let mount = text::group_mount(&mounts, &group).ok_or(hidden)?;
    let own = Path::new(mount).join(group.path.trim_start_matches('/'));
    if !own.is_dir() {
        return Err(hidden.to_owned());
    }
    let folders =
        own.ancestors().take_while(|folder| folder.starts_with(mount)).map(Path::to_path_buf).collect();
    Ok((group, folders))
}

fn group(config: &str) -> Seen<Group> {
    let off = text::boot_option(&text_of("/proc/cmdline"), "rt_group_sched") == Some("0");
    let configured = if off { Some(false) } else { text::option_set(config, "CONFIG_RT_GROUP_SCHED") };
    let (group, folders) = group_folders()?;
    let file = folders[0].join("cpu.rt_runtime_us");
    let share = text_of(&file).trim().parse().ok().map(|us| (file.display().to_string(), us));
    Ok(Group { path: group.path, share, configured })
}

/// The tightest limit of the group and of those above it. A group without the file has none.
fn quota() -> Seen<Option<f64>> {
    let (group, folders) = group_folders()?;
    let mut tightest: Option<f64> = None;
    for folder in folders {
        let name = if group.unified { "cpu.max" } else { "cpu.cfs_quota_us" };
        let limit = text_of(folder.join(name));
        if limit.is_empty() {
            continue;
        }
        let quota = if group.unified {
            text::cpu_max(&limit)
        } else {
            text::cfs_quota(&limit, &read(folder.join("cpu.cfs_period_us"))?)
        };
        if let Some(cpus) = quota.ok_or_else(|| strange(name))? {
            tightest = Some(tightest.map_or(cpus, |least| least.min(cpus)));
        }
    }
    Ok(tightest)
}

fn throttle() -> Seen<Throttle> {
    Ok(Throttle {
        runtime_us: number("/proc/sys/kernel/sched_rt_runtime_us")?,
        period_us: number("/proc/sys/kernel/sched_rt_period_us")?,
    })
}

fn preemption(config: &str) -> Seen<super::kernel::Preemption> {
    let version = text_of("/proc/version");
    let in_force = text_of("/sys/kernel/debug/sched/preempt");
    let cmdline = text_of("/proc/cmdline");
    PreemptionSigns { version: &version, in_force: &in_force, cmdline: &cmdline, config }.model()
}

/// Every thread that can be seen; those that end meanwhile are left out.
fn realtime_threads() -> Seen<RealTimeThreads> {
    fs::read_dir("/proc").map_err(|error| format!("/proc: {error}"))?;
    let own = PathBuf::from(format!("/proc/{}", std::process::id()));
    let mut found = RealTimeThreads::default();
    let tasks = entries("/proc", "").into_iter().filter(|process| *process != own);
    for task in tasks.flat_map(|process| entries(process.join("task"), "")) {
        let Some(thread) = text::thread_stat(&text_of(task.join("stat"))) else { continue };
        found.whole |= thread.of_kernel;
        if !thread.real_time || thread.priority < u32::from(PRIORITY) {
            continue;
        }
        if thread.of_kernel {
            found.of_kernel += 1;
        } else {
            found.of_programs.push(format!("{} ({})", thread.name, thread.priority));
        }
    }
    Ok(found)
}

fn processor() -> Processor {
    let status = "/proc/self/status";
    let allowed = read(status).and_then(|text| {
        text::field(&text, "Cpus_allowed_list").and_then(text::list_len).ok_or_else(|| strange(status))
    });
    Processor {
        allowed,
        quota: quota(),
        governors: governors(),
        idle: idle_states(),
        dma_latency: dma_latency(),
        around: around(),
    }
}

fn governors() -> Seen<Vec<String>> {
    let files = entries(CPUS, "cpu").into_iter().map(|cpu| cpu.join("cpufreq/scaling_governor"));
    let names: Vec<String> =
        files.map(text_of).map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect();
    if names.is_empty() { Err("no frequency control is visible".to_owned()) } else { Ok(names) }
}

fn idle_states() -> Seen<Vec<IdleState>> {
    let folders: Vec<PathBuf> =
        entries(CPUS, "cpu").into_iter().flat_map(|cpu| entries(cpu.join("cpuidle"), "state")).collect();
    if folders.is_empty() {
        return Err("no idle states are visible".to_owned());
    }
    let used = folders.iter().filter(|folder| text_of(folder.join("disable")).trim() != "1");
    let state = |folder: &PathBuf| {
        let latency_us = text_of(folder.join("latency")).trim().parse().ok()?;
        Some(IdleState { name: text_of(folder.join("name")).trim().to_owned(), latency_us })
    };
    Ok(used.filter_map(state).collect())
}

/// Opened only: a wish is made by writing.
fn dma_latency() -> Seen<DmaLatency> {
    let path = "/dev/cpu_dma_latency";
    let opened = match OpenOptions::new().write(true).open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Err(format!("{path} is not there")),
        opened => opened.map(drop).map_err(|error| error.to_string()),
    };
    let mut held = [0; 4];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut held));
    Ok(DmaLatency { opened, held_us: read.ok().map(|()| i32::from_ne_bytes(held)) })
}

fn around() -> Around {
    let signs = ["/run/.containerenv", "/.dockerenv", "/run/systemd/container"];
    let maker = text_of("/sys/class/dmi/id/sys_vendor");
    Around {
        container: signs.iter().any(|sign| Path::new(sign).exists()),
        machine: read("/proc/cpuinfo")
            .and_then(|cpuinfo| machine(&cpuinfo, &text_of("/sys/hypervisor/type"), &maker)),
    }
}

fn clocks() -> Clocks {
    let folder = Path::new("/sys/devices/system/clocksource/clocksource0");
    let source = read(folder.join("current_clocksource")).map(|current| ClockSource {
        current: current.trim().to_owned(),
        available: text_of(folder.join("available_clocksource"))
            .split_ascii_whitespace()
            .map(str::to_owned)
            .collect(),
    });
    Clocks {
        source,
        resolution_ns: sys::timer_resolution_ns(),
        sync: sys::clock_sync().map_err(|error| format!("adjtimex: {error}")),
    }
}

fn network(files: sys::ProcessLimit) -> NetworkFacts {
    let threshold = |n| number(&format!("/proc/sys/net/ipv4/neigh/default/gc_thresh{n}"));
    let neighbours =
        || Ok(NeighbourTable { kept: threshold(1)?, tidied: threshold(2)?, most: threshold(3)? });
    let udp = "/proc/sys/net/ipv4/udp_mem";
    let last = |text: String| text.split_ascii_whitespace().last().and_then(|word| word.parse().ok());
    NetworkFacts {
        neighbours: neighbours(),
        receive_max: number("/proc/sys/net/core/rmem_max"),
        receive_default: number("/proc/sys/net/core/rmem_default"),
        udp_pages: read(udp).and_then(|text| last(text).ok_or_else(|| strange(udp))),
        files,
        sending: SendCost::measured(&Monotonic).map_err(|error| format!("loopback: {error}")),
    }
}
