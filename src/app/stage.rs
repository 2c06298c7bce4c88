//! The threads of one play: tick, ack and planner, from the first tick to the last reply.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Builder};
use std::time::Duration;

use super::play::Control;
use super::run::Run;
use crate::engine::Engine;
use crate::fanout::Lane;
use crate::net::{DrainGrid, Sender};
use crate::rt::{AckLoop, Conductor, Mail, PlanLoop, Spinning, TickLoop};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{Clock, Rate, TickGrid};

/// From the end of preparing to tick 0: time to start the other threads.
const RUN_UP: Duration = Duration::from_millis(20);

/// What the threads of a play share out among themselves.
pub(super) struct Stage {
    /// Whether no replies are to come.
    pub(super) silent: bool,
    pub(super) rate: Rate,
    /// How long before a deadline the tick thread stops sleeping and spins.
    pub(super) spin: Duration,
    pub(super) engine: Engine,
    pub(super) lanes: Vec<Lane>,
    pub(super) sender: Sender,
    pub(super) mail: Mail,
}

impl Stage {
    /// The calling thread becomes the tick thread. Everything it touches has been made by now, so that memory can be
    /// locked; the threads started after it are ordinary ones.
    ///
    /// # Errors
    /// That of the system where it starts no further thread; no tick has been sent then.
    pub(super) fn run(
        self,
        acks: AckLoop,
        mut plans: PlanLoop,
        attended: bool,
        control: &Control,
    ) -> io::Result<Run> {
        let Self { silent, rate, spin, engine, lanes, sender, mut mail } = self;
        let (sent_all, done) = (AtomicBool::new(false), AtomicBool::new(false));
        let granted = realtime::request();
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let period = rate.period();
            let drains =
                if silent { DrainGrid::rare(origin, period) } else { DrainGrid::new(origin, period) };
            let sent_all = &sent_all;
            let ack_thread = Builder::new().name("acks".to_owned()).spawn_scoped(scope, move || {
                let _ = realtime::normal_priority();
                acks.run(&Monotonic, drains, || sent_all.load(Ordering::Acquire))
            })?;
            let planner = Builder::new().name("planner".to_owned()).spawn_scoped(scope, || {
                let _ = realtime::normal_priority();
                plans.run(&done)
            });
            let plan_thread = planner.inspect_err(|_| sent_all.store(true, Ordering::Release))?;
            mail.wakes(plan_thread.thread().clone());
            let grid = TickGrid::new(origin, rate);
            let clock = Spinning::new(&Monotonic, spin, period);
            let conductor = Conductor::of_a_play(origin, attended);
            let (desk, leave) = (&*control.desk, &*control.leave);
            let mut ticks =
                TickLoop { clock: &clock, grid, engine, conductor, lanes, sink: sender, mail, desk, leave };
            let ended = ticks.run();
            let clamps = (0..ticks.lanes.len()).map(|lane| *ticks.engine.clamps(lane)).collect();
            sent_all.store(true, Ordering::Release);
            done.store(true, Ordering::Release);
            plan_thread.thread().unpark();
            let refusals = plan_thread.join().expect("the planner does not panic");
            let mut accounts = ack_thread.join().expect("the ack thread does not panic");
            let closed_at = Monotonic.now();
            accounts.close(ticks.lanes.iter().map(Lane::last_frame), closed_at);
            Ok(Run { ended, clamps, accounts, granted, spun: clock.spun(), refusals, origin, closed_at })
        })
    }
}
