//! Machines made up, and what is said of them.

use std::time::Duration;

use super::clocks::{ClockSource, Clocks};
use super::kernel::{Kernel, Preemption, RealTimeThreads, Slack};
use super::lateness::{LatenessRun, MachineLoad};
use super::memory::MemoryFacts;
use super::network::{NeighbourTable, NetworkFacts};
use super::processor::{Around, DmaLatency, IdleState, Processor};
use super::scheduling::{FifoTrial, Group, RealTimeRefusal, Scheduling, Throttle};
use super::*;
use crate::net::SendCost;
use crate::sys::machine::{ClockSync, ProcessLimit};
use crate::sys::realtime::Policy;
use crate::tracker::histogram;

fn one() -> Hall {
    of(1, 1)
}

fn of(controllers: u32, neighbours: u32) -> Hall {
    Hall { controllers, neighbours, rate: Rate::from_hz(100.0) }
}
const NO_LIMIT: ProcessLimit = ProcessLimit { soft: None, hard: None };

fn at_most(limit: u64) -> ProcessLimit {
    ProcessLimit { soft: Some(limit), hard: Some(limit) }
}

/// A bare machine, set up for shows.
fn good() -> Facts {
    Facts {
        scheduling: Scheduling {
            trial: Ok(FifoTrial { given: false, policy: Policy::Fifo, priority: 50, refusal: None }),
            limit: at_most(50),
            right: Ok(false),
            group: Ok(Group { path: "/system.slice".to_owned(), share: None, configured: Some(false) }),
            throttle: Ok(Throttle { runtime_us: 950_000, period_us: 1_000_000 }),
        },
        kernel: Kernel {
            preemption: Ok(Preemption::Full),
            slack: Ok(Slack { default_ns: 50_000, settable: true }),
            others: Ok(RealTimeThreads { of_programs: Vec::new(), of_kernel: 9, whole: true }),
            confinement: Ok(()),
        },
        memory: MemoryFacts { locked: Ok(()), limit: NO_LIMIT, swaps: Ok(Vec::new()) },
        processor: Processor {
            allowed: Ok(8),
            quota: Ok(None),
            governors: Ok(vec!["performance".to_owned(); 8]),
            idle: Ok(vec![state("POLL", 0), state("C1", 2)]),
            dma_latency: Ok(DmaLatency { opened: Ok(()), held_us: Some(2_000_000_000) }),
            around: Around { container: false, machine: Ok(None) },
        },
        clocks: Clocks {
            source: Ok(ClockSource { current: "tsc".to_owned(), available: vec!["tsc".to_owned()] }),
            resolution_ns: 1,
            sync: Ok(ClockSync { synchronised: true, max_error_us: 500 }),
        },
        network: NetworkFacts {
            neighbours: Ok(NeighbourTable { kept: 128, tidied: 512, most: 1_024 }),
            receive_max: Ok(212_992),
            receive_default: Ok(212_992),
            udp_pages: Ok(190_000),
            files: at_most(4_096),
            sending: Ok(SendCost(Duration::from_nanos(3_500))),
        },
    }
}

fn state(name: &str, latency_us: u64) -> IdleState {
    IdleState { name: name.to_owned(), latency_us }
}

fn refuse(facts: &mut Facts, not_permitted: bool) {
    let refusal = RealTimeRefusal { words: "Operation not permitted".to_owned(), not_permitted };
    facts.scheduling.trial =
        Ok(FifoTrial { given: false, policy: Policy::Other, priority: 0, refusal: Some(refusal) });
}

fn not_seen<T>() -> Seen<T> {
    Err("may not be read".to_owned())
}

/// The line of that name for one controller.
fn line(facts: &Facts, id: &str) -> FindingLine {
    line_for(facts, one(), id)
}

fn line_for(facts: &Facts, hall: Hall, id: &str) -> FindingLine {
    judge(facts, hall).into_iter().find(|line| line.id == id).unwrap()
}

fn verdict(facts: &Facts, id: &str) -> Verdict {
    line(facts, id).verdict
}

#[test]
fn a_machine_that_is_set_up_is_ready_and_every_line_says_so() {
    let lines = judge(&good(), one());
    assert!(ready(&lines));
    for line in &lines {
        assert_eq!((line.verdict, &line.fix), (Verdict::Ok, &None), "{line:?}");
        assert!(!line.found.is_empty(), "{line:?}");
    }
    let mut ids: Vec<_> = lines.iter().map(|line| line.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), lines.len());
}

#[test]
fn whatever_is_not_ok_says_what_to_do() {
    let mut facts = good();
    refuse(&mut facts, true);
    facts.scheduling.limit = at_most(0);
    facts.memory = MemoryFacts { locked: not_seen(), limit: at_most(65_536), swaps: not_seen() };
    facts.kernel =
        Kernel { preemption: not_seen(), slack: not_seen(), others: not_seen(), confinement: not_seen() };
    facts.clocks = Clocks { source: not_seen(), resolution_ns: 4_000_000, sync: not_seen() };
    facts.network.neighbours = not_seen();
    facts.network.receive_max = not_seen();
    for line in judge(&facts, one()) {
        let told = line.fix.as_ref().is_some_and(|fix| !fix.is_empty());
        assert_eq!(told, line.verdict != Verdict::Ok, "{line:?}");
    }
}

#[test]
fn a_refused_policy_is_never_ready_and_names_the_limit_to_raise() {
    let mut facts = good();
    refuse(&mut facts, true);
    facts.scheduling.limit = at_most(0);
    assert!(!ready(&judge(&facts, one())));
    assert_eq!(verdict(&facts, "realtime_policy"), Verdict::Bad);
    let limit = line(&facts, "priority_limit");
    assert_eq!(limit.verdict, Verdict::Bad);
    assert!(limit.fix.unwrap().contains("LimitRTPRIO=50"));
    facts.scheduling.limit = ProcessLimit { soft: Some(0), hard: Some(99) };
    assert_eq!(line(&facts, "priority_limit").fix.unwrap(), "ulimit -r 50");
    facts.scheduling.right = Ok(true);
    assert_eq!(verdict(&facts, "priority_limit"), Verdict::Ok);
}

#[test]
fn a_policy_that_is_granted_but_not_in_force_is_bad() {
    let mut facts = good();
    facts.scheduling.trial =
        Ok(FifoTrial { given: false, policy: Policy::Other, priority: 0, refusal: None });
    assert_eq!(verdict(&facts, "realtime_policy"), Verdict::Bad);
}

#[test]
fn a_policy_that_systemd_gave_needs_no_limit() {
    let mut facts = good();
    facts.scheduling.trial =
        Ok(FifoTrial { given: true, policy: Policy::RoundRobin, priority: 20, refusal: None });
    facts.scheduling.limit = at_most(0);
    assert!(ready(&judge(&facts, one())));
    assert!(line(&facts, "realtime_policy").found.contains("rr at priority 20, inherited"));
}

#[test]
fn a_group_without_a_real_time_share_is_named_with_its_file() {
    let mut facts = good();
    refuse(&mut facts, true);
    let file = "/sys/fs/cgroup/cpu/hall/cpu.rt_runtime_us".to_owned();
    facts.scheduling.group = Ok(Group { path: "/hall".to_owned(), share: Some((file, 0)), configured: None });
    let group = line(&facts, "realtime_group");
    assert_eq!(group.verdict, Verdict::Bad);
    assert!(group.fix.unwrap().contains("> /sys/fs/cgroup/cpu/hall/cpu.rt_runtime_us"));
    assert_eq!(line(&facts, "realtime_policy").fix.unwrap(), "see realtime_group");
}

#[test]
fn a_refusal_in_spite_of_a_right_is_laid_to_the_group_and_one_without_is_not() {
    let mut facts = good();
    refuse(&mut facts, true);
    facts.scheduling.group = Ok(Group { path: "/hall".to_owned(), share: None, configured: None });
    assert_eq!(verdict(&facts, "realtime_group"), Verdict::Bad);
    facts.scheduling.limit = at_most(0);
    assert_eq!(verdict(&facts, "realtime_group"), Verdict::Unknown);
    facts.scheduling.right = Ok(true);
    assert_eq!(verdict(&facts, "realtime_group"), Verdict::Bad);
    refuse(&mut facts, false);
    assert_eq!(verdict(&facts, "realtime_group"), Verdict::Unknown);
    facts.scheduling.group = not_seen();
    assert_eq!(verdict(&facts, "realtime_group"), Verdict::Unknown);
}

#[test]
fn the_throttle_may_leave_nothing_little_or_everything() {
    let mut facts = good();
    let mut judged = |runtime_us| {
        facts.scheduling.throttle = Ok(Throttle { runtime_us, period_us: 1_000_000 });
        verdict(&facts, "realtime_throttle")
    };
    assert_eq!(judged(0), Verdict::Bad);
    assert_eq!(judged(500_000), Verdict::Warn);
    assert_eq!(judged(900_000), Verdict::Ok);
    assert_eq!(judged(-1), Verdict::Warn);
}

#[test]
fn memory_that_is_not_locked_is_worse_where_it_can_be_swapped() {
    let mut facts = good();
    facts.memory.locked = Err("Cannot allocate memory".to_owned());
    assert_eq!(verdict(&facts, "memory_lock"), Verdict::Warn);
    facts.memory.swaps = Ok(vec!["/dev/sda2".to_owned()]);
    assert_eq!(verdict(&facts, "memory_lock"), Verdict::Bad);
    assert_eq!(verdict(&facts, "swap"), Verdict::Warn);
    facts.memory.locked = Ok(());
    assert_eq!(verdict(&facts, "swap"), Verdict::Ok);
    facts.memory.limit = at_most(8 << 20);
    assert_eq!(verdict(&facts, "swap"), Verdict::Warn);
    assert_eq!(verdict(&facts, "memory_lock_limit"), Verdict::Warn);
}

#[test]
fn real_time_threads_of_programs_are_named_and_hidden_ones_are_unknown() {
    let mut facts = good();
    let threads = |of_programs, whole| Ok(RealTimeThreads { of_programs, of_kernel: 0, whole });
    facts.kernel.others = threads(vec!["jackd (70)".to_owned()], true);
    let others = line(&facts, "other_realtime_threads");
    assert!(others.verdict == Verdict::Warn && others.found.contains("jackd (70)"), "{others:?}");
    facts.kernel.others = threads(Vec::new(), false);
    assert_eq!(verdict(&facts, "other_realtime_threads"), Verdict::Unknown);
}

#[test]
fn timer_slack_matters_only_without_real_time_and_where_it_cannot_be_set() {
    let mut facts = good();
    facts.kernel.slack = Ok(Slack { default_ns: 50_000, settable: false });
    assert_eq!(verdict(&facts, "timer_slack"), Verdict::Ok);
    refuse(&mut facts, true);
    assert_eq!(verdict(&facts, "timer_slack"), Verdict::Warn);
}

#[test]
fn a_kernel_that_confines_nothing_plays_all_the_same_and_is_worth_a_warning() {
    let mut facts = good();
    assert!(line(&facts, "confinement").found.contains("seccomp"));
    facts.kernel.confinement =
        Err("the kernel takes no filter of system calls (Invalid argument)".to_owned());
    let found = line(&facts, "confinement");
    assert_eq!(found.verdict, Verdict::Warn);
    assert!(found.found.starts_with("the kernel takes no filter") && ready(&judge(&facts, one())));
}

#[test]
fn a_deep_idle_state_counts_unless_somebody_holds_it_off() {
    let mut facts = good();
    facts.processor.idle = Ok(vec![state("C1", 2), state("C6", 133)]);
    let idle = line(&facts, "idle_states");
    assert!(idle.verdict == Verdict::Warn && idle.found.contains("C6"), "{idle:?}");
    facts.processor.dma_latency = Ok(DmaLatency { opened: not_seen(), held_us: Some(2_000_000_000) });
    assert_eq!(verdict(&facts, "cpu_dma_latency"), Verdict::Warn);
    facts.processor.dma_latency = Ok(DmaLatency { opened: not_seen(), held_us: Some(0) });
    assert_eq!(verdict(&facts, "idle_states"), Verdict::Ok);
    assert_eq!(verdict(&facts, "cpu_dma_latency"), Verdict::Ok);
}

#[test]
fn a_quota_is_bad_only_where_it_can_stop_the_ticks() {
    let mut facts = good();
    facts.processor.quota = Ok(Some(0.5));
    assert_eq!(verdict(&facts, "processor_quota"), Verdict::Warn);
    refuse(&mut facts, true);
    assert_eq!(verdict(&facts, "processor_quota"), Verdict::Bad);
    facts.processor.quota = Ok(Some(2.0));
    assert_eq!(verdict(&facts, "processor_quota"), Verdict::Warn);
}

#[test]
fn a_slow_clock_source_is_changed_for_a_fast_one_where_there_is_one() {
    let mut facts = good();
    let mut judged = |current: &str, available: &[&str]| {
        let available = available.iter().map(|name| (*name).to_owned()).collect();
        facts.clocks.source = Ok(ClockSource { current: current.to_owned(), available });
        line(&facts, "clock_source")
    };
    let hpet = judged("hpet", &["hpet", "tsc"]);
    assert!(hpet.verdict == Verdict::Warn && hpet.fix.unwrap().starts_with("echo tsc >"));
    assert!(judged("hpet", &["hpet"]).fix.unwrap().contains("dmesg"));
    assert_eq!(judged("jiffies", &[]).verdict, Verdict::Bad);
    assert_eq!(judged("new-clock", &[]).verdict, Verdict::Unknown);
}

#[test]
fn a_wall_clock_that_nobody_disciplines_or_that_is_far_off_is_worth_a_warning() {
    let mut facts = good();
    for sync in [
        ClockSync { synchronised: false, max_error_us: 0 },
        ClockSync { synchronised: true, max_error_us: 400_000 },
    ] {
        facts.clocks.sync = Ok(sync);
        assert_eq!(verdict(&facts, "clock_synchronisation"), Verdict::Warn);
    }
    assert!(ready(&judge(&facts, one())));
}

#[test]
fn a_huge_hall_outgrows_the_table_of_neighbours_unless_it_is_elsewhere() {
    let hall = |neighbours| of(1_024, neighbours);
    let facts = good();
    let table = line_for(&facts, hall(1_024), "neighbour_table");
    assert_eq!(table.verdict, Verdict::Bad);
    assert!(table.fix.unwrap().contains("gc_thresh1=2048, gc_thresh2=4096, gc_thresh3=8192"));
    assert_eq!(line_for(&facts, hall(600), "neighbour_table").verdict, Verdict::Warn);
    assert_eq!(line_for(&facts, hall(0), "neighbour_table").verdict, Verdict::Ok);
    let mut facts = good();
    facts.network.neighbours = not_seen();
    assert_eq!(line_for(&facts, hall(1), "neighbour_table").verdict, Verdict::Unknown);
    assert_eq!(line_for(&facts, hall(0), "neighbour_table").verdict, Verdict::Ok);
}

#[test]
fn buffers_and_files_are_held_against_the_hall() {
    let hall = of(5_000, 0);
    let mut facts = good();
    let files = line_for(&facts, hall, "open_files");
    assert!(files.verdict == Verdict::Bad && files.fix.unwrap().contains("LimitNOFILE=8192"));
    facts.network.udp_pages = Ok(1_000);
    assert_eq!(line_for(&facts, hall, "socket_buffers").verdict, Verdict::Warn);
    assert_eq!(verdict(&facts, "socket_buffers"), Verdict::Ok);
    facts.network.receive_max = Ok(2_304);
    assert!(line(&facts, "socket_buffers").fix.unwrap().contains("net.core.rmem_max="));
}

fn measured(policy: Policy, lateness_us: &[(u64, u64)], missed: u64) -> LatenessRun {
    let mut lateness = histogram();
    for &(us, ticks) in lateness_us {
        lateness.record_n(us * 1_000, ticks).unwrap();
    }
    LatenessRun { load: MachineLoad::Loaded, policy, ticks: lateness.len(), missed, lateness }
}

#[test]
fn a_run_is_judged_by_its_99th_percentile_and_by_what_it_missed() {
    let judged = |lateness_us, missed| measured(Policy::Fifo, lateness_us, missed).judge().verdict;
    assert_eq!(judged(&[(20, 9_950), (99, 50)], 0), Verdict::Ok);
    assert_eq!(judged(&[(20, 9_800), (150, 200)], 0), Verdict::Warn);
    assert_eq!(judged(&[(20, 9_800), (600, 200)], 0), Verdict::Bad);
    assert_eq!(judged(&[(20, 9_999), (1_100, 1)], 1), Verdict::Warn);
    assert_eq!(judged(&[(20, 9_999), (40_000, 1)], 39), Verdict::Bad);
    assert_eq!(judged(&[], 0), Verdict::Unknown);
}

#[test]
fn a_run_that_was_not_real_time_is_laid_to_that() {
    let line = measured(Policy::Other, &[(2_000, 1_000)], 1_000).judge();
    assert!(line.found.ends_with("1000 of 2000 ticks missed, scheduled as other"), "{line:?}");
    assert!(line.fix.unwrap().contains("realtime_policy"));
}
