//! The threads beside the tick thread, of a play as of a hall: started before the first tick, ended after the last.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, Scope, ScopedJoinHandle, Thread};

use super::run::Run;
use crate::drive::Lane;
use crate::net::DrainGrid;
use crate::plan::PlanError;
use crate::rt::{Accounts, AckLoop, Ended, LinkLoop, Outlets, PlanLoop, Spinning, TickLoop};
use crate::sys::clock::Monotonic;
use crate::sys::realtime::{self, RealTime};
use crate::time::{Clock as _, MonoTime};

/// The tick loop on real time and real sockets.
pub(super) type RealTicks<'a> = TickLoop<'a, Spinning<'a, Monotonic>, Outlets>;

/// The ack thread and the planner's.
#[derive(Debug)]
pub(super) struct Helpers<'scope> {
    over: &'scope AtomicBool,
    acks: ScopedJoinHandle<'scope, Accounts>,
    planner: ScopedJoinHandle<'scope, Vec<PlanError>>,
    /// Those of links, which go on until the ack thread has heard of them that all seats rest.
    links: Vec<ScopedJoinHandle<'scope, ()>>,
    acks_over: Arc<AtomicBool>,
}

impl<'scope> Helpers<'scope> {
    /// Starts them, until it is `over`: the ack thread below the calling one where that `granted` real-time service, the planner as
    /// an ordinary one.
    ///
    /// # Errors
    /// That of the system where it starts no further thread; none is left then.
    pub(super) fn start(
        scope: &'scope Scope<'scope, '_>,
        over: &'scope AtomicBool,
        granted: &RealTime,
        (mut acks, drains): (AckLoop, DrainGrid),
        mut plans: PlanLoop,
        links: Vec<LinkLoop>,
    ) -> io::Result<Self> {
        let priority = granted.priority;
        let acks = Builder::new().name("acks".to_owned()).spawn_scoped(scope, move || {
            if !realtime::request_below(priority) {
                acks.shares_the_machine();
            }
            acks.run(&Monotonic, drains, || over.load(Ordering::Acquire))
        })?;
        let planner = Builder::new().name("planner".to_owned()).spawn_scoped(scope, move || {
            let _ = realtime::normal_priority();
            plans.run(over)
        });
        let planner = planner.inspect_err(|_| over.store(true, Ordering::Release))?;
        let acks_over = Arc::new(AtomicBool::new(false));
        let mut threads = Vec::new();
        for (index, link) in links.into_iter().enumerate() {
            let over_too = Arc::clone(&acks_over);
            let thread = Builder::new().name(format!("link{index}")).spawn_scoped(scope, move || {
                // As the ack thread: below the ticks, before all else.
                let _ = realtime::request_below(priority);
                link.run(&over_too);
            });
            let ends = |_: &io::Error| {
                [over, &acks_over].into_iter().for_each(|end| end.store(true, Ordering::Release))
            };
            threads.push(thread.inspect_err(ends)?);
        }
        Ok(Self { over, acks, planner, links: threads, acks_over })
    }

    /// The planner's thread, to be woken when there is something for it.
    pub(super) fn planner(&self) -> Thread {
        self.planner.thread().clone()
    }

    /// Ends them, the tick loop having ended, and closes the accounts.
    ///
    /// # Panics
    /// If one of them panicked.
    pub(super) fn end(self, ticks: &RealTicks<'_>, ended: Ended, granted: RealTime, origin: MonoTime) -> Run {
        self.over.store(true, Ordering::Release);
        self.planner.thread().unpark();
        let refusals = self.planner.join().expect("the planner does not panic");
        let mut accounts = self.acks.join().expect("the ack thread does not panic");
        self.acks_over.store(true, Ordering::Release);
        self.links.into_iter().for_each(|link| link.join().expect("the thread of a link does not panic"));
        let closed_at = Monotonic.now();
        accounts.close(ticks.lanes.iter().map(Lane::last_frame), closed_at);
        let lanes = 0..ticks.lanes.len();
        let clamps = lanes.clone().map(|lane| *ticks.engine.lane(lane).clamps()).collect();
        let lost_sight_of = lanes.filter(|lane| ticks.engine.lane(*lane).is_lost_sight_of()).collect();
        let (spun, tallies) = (ticks.clock.spun(), ticks.places.tallies().collect());
        Run { ended, accounts, granted, spun, refusals, clamps, tallies, lost_sight_of, origin, closed_at }
    }
}
