//! Reads the texts of `/proc` and `/sys`. Nothing here opens a file; a text that is not as expected gives `None`, or
//! leaves out the line in question.

/// The value of a `Name: value` line, as `/proc/self/status` has them.
#[must_use]
pub(crate) fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let value = |line: &'a str| line.strip_prefix(name)?.trim_start().strip_prefix(':');
    text.lines().find_map(value).map(str::trim)
}

/// True if the effective rights of `/proc/self/status` hold the one of that number.
#[must_use]
pub(crate) fn has_right(status: &str, number: u32) -> Option<bool> {
    let held = u64::from_str_radix(field(status, "CapEff")?, 16).ok()?;
    Some(held.checked_shr(number)? & 1 == 1)
}

/// True if `/proc/self/uid_map` is that of the first user namespace; in any other one rights do not reach the scheduler.
#[must_use]
pub(crate) fn is_first_user_namespace(uid_map: &str) -> bool {
    uid_map.split_ascii_whitespace().eq(["0", "0", "4294967295"])
}

/// How many processors a list such as `0-3,8` names.
#[must_use]
pub(crate) fn list_len(list: &str) -> Option<usize> {
    list.trim().split(',').map(range_len).sum()
}

fn range_len(range: &str) -> Option<usize> {
    let (first, last) = range.split_once('-').unwrap_or((range, range));
    let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
    last.checked_sub(first)?.checked_add(1)
}

/// A control group of this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ControlGroup {
    /// Its path below where its hierarchy is mounted.
    pub(crate) path: String,
    /// True if it is of the second version.
    pub(crate) unified: bool,
}

/// The control group that rules processor time, from `/proc/self/cgroup`: the first version's `cpu` hierarchy if there is
/// one, else the second version's.
#[must_use]
pub(crate) fn cpu_group(cgroup: &str) -> Option<ControlGroup> {
    let rows = || cgroup.lines().filter_map(row);
    let first = rows().find(|(controllers, _)| controllers.split(',').any(|name| name == "cpu"));
    let row = first.or_else(|| rows().find(|(controllers, _)| controllers.is_empty()));
    row.map(|(controllers, path)| ControlGroup { path: path.to_owned(), unified: controllers.is_empty() })
}

/// Controllers and path of `number:controllers:path`.
fn row(line: &str) -> Option<(&str, &str)> {
    line.split_once(':')?.1.split_once(':')
}

/// Where the hierarchy of a control group is mounted, from `/proc/self/mounts`.
#[must_use]
pub(crate) fn group_mount<'a>(mounts: &'a str, group: &ControlGroup) -> Option<&'a str> {
    mounts.lines().find_map(|line| {
        let mut words = line.split(' ');
        let (_, at, kind, options) = (words.next()?, words.next()?, words.next()?, words.next()?);
        let fits = match kind {
            "cgroup2" => group.unified,
            "cgroup" => !group.unified && options.split(',').any(|option| option == "cpu"),
            _ => false,
        };
        fits.then_some(at)
    })
}

/// Processors' worth of time that `cpu.max` of the second version gives a group each period; `None` where the text is
/// none, `Some(None)` where there is no limit.
#[must_use]
pub(crate) fn cpu_max(text: &str) -> Option<Option<f64>> {
    let (quota, period) = text.trim().split_once(' ')?;
    if quota == "max" { Some(None) } else { Some(Some(share(quota.parse().ok()?, period.parse().ok()?)?)) }
}

/// The same of `cpu.cfs_quota_us` and `cpu.cfs_period_us` of the first version.
#[must_use]
pub(crate) fn cfs_quota(quota: &str, period: &str) -> Option<Option<f64>> {
    let quota: f64 = quota.trim().parse().ok()?;
    if quota < 0.0 { Some(None) } else { Some(Some(share(quota, period.trim().parse().ok()?)?)) }
}

fn share(quota: f64, period: f64) -> Option<f64> {
    (quota > 0.0 && period > 0.0).then(|| quota / period)
}

/// The names of what is swapped to, from `/proc/swaps`.
#[must_use]
pub(crate) fn swaps(text: &str) -> Vec<String> {
    let names = text.lines().skip(1).filter_map(|line| line.split_ascii_whitespace().next());
    names.map(str::to_owned).collect()
}

/// True if a kernel's configuration has an option set; `None` where it does not speak of it.
#[must_use]
pub(crate) fn option_set(config: &str, name: &str) -> Option<bool> {
    config.lines().find_map(|line| {
        let rest = line.strip_prefix("# ").unwrap_or(line).strip_prefix(name)?;
        match rest {
            "=y" => Some(true),
            " is not set" => Some(false),
            _ => None,
        }
    })
}

/// The value of an option of the kernel's command line; the last of several.
#[must_use]
pub(crate) fn boot_option<'a>(cmdline: &'a str, name: &str) -> Option<&'a str> {
    let value = |word: &'a str| word.strip_prefix(name)?.strip_prefix('=');
    cmdline.split_ascii_whitespace().rev().find_map(value)
}

/// The choice in brackets, as in `none voluntary (full)`.
#[must_use]
pub(crate) fn bracketed(text: &str) -> Option<&str> {
    Some(text.split_once('(')?.1.split_once(')')?.0)
}

/// A thread, from `/proc/PID/task/TID/stat`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ThreadStat {
    /// Its name.
    pub(crate) name: String,
    /// True if it is the kernel's own.
    pub(crate) of_kernel: bool,
    /// Its real-time priority; 0 if it has none.
    pub(crate) priority: u32,
    /// True if its policy is `SCHED_FIFO` or `SCHED_RR`.
    pub(crate) real_time: bool,
}

/// `PF_KTHREAD` among the flags of a thread.
const OF_KERNEL: u64 = 0x0020_0000;

/// Reads such a line. The name stands in brackets and may itself hold brackets and spaces.
#[must_use]
pub(crate) fn thread_stat(text: &str) -> Option<ThreadStat> {
    let (name, rest) = (text.split_once('(')?.1).rsplit_once(')')?;
    let fields: Vec<&str> = rest.split_ascii_whitespace().collect();
    let number = |of_manual: usize| fields.get(of_manual - 3)?.parse::<u64>().ok();
    Some(ThreadStat {
        name: name.to_owned(),
        of_kernel: number(9)? & OF_KERNEL != 0,
        priority: u32::try_from(number(40)?).ok()?,
        real_time: matches!(number(41)?, 1 | 2),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rights_are_bits_of_the_effective_ones() {
        let status = "Name:\tkinocue\nCapPrm:\tffffffffffffffff\nCapEff:\t0000000000800000\n";
        assert_eq!((has_right(status, 23), has_right(status, 14)), (Some(true), Some(false)));
        assert_eq!((has_right("Name:\tx\n", 23), has_right("CapEff:\tsome\n", 23)), (None, None));
    }

    #[test]
    fn a_mapped_user_namespace_is_told_from_the_first() {
        assert!(is_first_user_namespace("         0          0 4294967295\n"));
        assert!(!is_first_user_namespace("         0     100000      65536\n"));
        assert!(!is_first_user_namespace(""));
    }

    #[test]
    fn a_list_of_processors_is_counted() {
        for (list, len) in [("0", Some(1)), ("0-3,8\n", Some(5)), ("", None), ("3-0", None), ("0-", None)] {
            assert_eq!(list_len(list), len, "{list:?}");
        }
    }

    #[test]
    fn the_group_that_rules_processor_time_is_found_in_either_version() {
        let group = |path: &str, unified| Some(ControlGroup { path: path.to_owned(), unified });
        let first = "5:cpuset:/\n3:cpu,cpuacct:/system.slice/a:b\n0::/else\n";
        assert_eq!(cpu_group(first), group("/system.slice/a:b", false));
        assert_eq!(cpu_group("0::/user.slice\n"), group("/user.slice", true));
        assert_eq!((cpu_group(""), cpu_group("nonsense\n")), (None, None));
    }

    #[test]
    fn a_hierarchy_is_found_among_the_mounts() {
        let mounts = "proc /proc proc rw 0 0\ncgroup /cg/set cgroup rw,cpuset 0 0\n\
                      cgroup /cg/cpu cgroup rw,relatime,cpu,cpuacct 0 0\ncgroup2 /cg/unified cgroup2 rw 0 0\n";
        let group = |unified| ControlGroup { path: "/".to_owned(), unified };
        assert_eq!(group_mount(mounts, &group(false)), Some("/cg/cpu"));
        assert_eq!(group_mount(mounts, &group(true)), Some("/cg/unified"));
        assert_eq!(group_mount("proc /proc proc rw 0 0\n", &group(true)), None);
    }

    #[test]
    fn a_share_of_processor_time_is_counted_in_processors() {
        assert_eq!(cpu_max("max 100000\n"), Some(None));
        assert_eq!(cpu_max("150000 100000\n"), Some(Some(1.5)));
        assert_eq!(cfs_quota("-1\n", "100000\n"), Some(None));
        assert_eq!(cfs_quota("50000\n", "100000\n"), Some(Some(0.5)));
        assert_eq!((cpu_max("150000"), cpu_max("1 0"), cfs_quota("", "1")), (None, None, None));
    }

    #[test]
    fn swap_is_listed_by_name() {
        let text =
            "Filename\tType\tSize\tUsed\tPriority\n/dev/sda2 partition 100 0 -2\n/swapfile file 1 0 -3\n";
        assert_eq!(swaps(text), ["/dev/sda2", "/swapfile"]);
        assert!(swaps("Filename\tType\n").is_empty());
    }

    #[test]
    fn an_option_of_the_kernel_is_set_unset_or_not_spoken_of() {
        let config = "CONFIG_RT_GROUP_SCHED_X=y\n# CONFIG_PREEMPT is not set\nCONFIG_PREEMPT_RT=y\n";
        assert_eq!(option_set(config, "CONFIG_PREEMPT"), Some(false));
        assert_eq!(option_set(config, "CONFIG_PREEMPT_RT"), Some(true));
        assert_eq!(option_set(config, "CONFIG_RT_GROUP_SCHED"), None);
    }

    #[test]
    fn the_last_option_of_a_command_line_holds() {
        let cmdline = "quiet preempt=none rootpreempt=x preempt=full\n";
        assert_eq!(boot_option(cmdline, "preempt"), Some("full"));
        assert_eq!(boot_option(cmdline, "rt_group_sched"), None);
        assert_eq!(bracketed("none voluntary (full) lazy\n"), Some("full"));
        assert_eq!(bracketed("none"), None);
    }

    #[test]
    fn a_thread_is_read_whatever_its_name() {
        let line = |flags: u64, priority: u32, policy: u32| {
            let zeros = |n| "0 ".repeat(n);
            format!("77 (a) b (c) S 1 1 1 0 -1 {flags} {}{priority} {policy} 0 0", zeros(30))
        };
        let thread = thread_stat(&line(0x0040_0000, 80, 1)).unwrap();
        assert_eq!((thread.name.as_str(), thread.priority), ("a) b (c", 80));
        assert!(thread.real_time && !thread.of_kernel);
        let thread = thread_stat(&line(0x0020_8040, 0, 0)).unwrap();
        assert!(!thread.real_time && thread.of_kernel);
        assert_eq!(thread_stat("77 (cut) S 1"), None);
        assert_eq!(thread_stat(""), None);
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig::with_cases(64))]
        #[test]
        fn no_text_panics(text in "[0-9 ():,\n=a-z/-]{0,80}") {
            let _ = (thread_stat(&text), cpu_group(&text), cpu_max(&text), list_len(&text), swaps(&text));
            let _ = (has_right(&format!("CapEff:{text}"), 23), bracketed(&text), boot_option(&text, "a"));
        }
    }
}
