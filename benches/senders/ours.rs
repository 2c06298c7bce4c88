//! kinocue's own sender: engine, lanes, mailboxes, sockets, tick loop and ack loop, on the threads that `kinocue play`
//! has.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::harness::belief::Reading;
use kinocue::harness::drive::Lane;
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::net::{DrainGrid, Ports, Sender};
use kinocue::harness::rt::{
    Accounts, AckLoop, Conductor, FrameSink, Live, MailEnds, Places, PlanLoop, Planning, TickLoop, mailboxes,
};
use kinocue::harness::sys::clock::{Monotonic, thread_cpu_time};
use kinocue::harness::sys::realtime::{RealTime, normal_priority, request};
use kinocue::harness::time::{Clock, MonoTime, TickGrid};
use kinocue::harness::tracker::histogram;
use kinocue::harness::{ride, stage};

use super::outcome::{Outcome, Quantiles, each};

/// From here to tick 0: time to start the threads.
const RUN_UP: Duration = Duration::from_millis(20);

/// What the threads found.
struct Run {
    ticks: u64,
    missed: u64,
    accounts: Accounts,
    send_time: Duration,
    receive_time: Duration,
    granted: RealTime,
}

/// Plays a ride of that many seconds on that clock; `silent` asks for no replies.
pub(crate) fn run(clock: &impl Clock, seconds: u32, to: &[SocketAddrV4], silent: bool) -> Outcome {
    run_into(clock, seconds, to, silent, |sender, _| sender)
}

/// The same through what `sink` makes of the sockets.
pub(crate) fn run_into<S: FrameSink>(
    clock: &impl Clock,
    seconds: u32,
    to: &[SocketAddrV4],
    silent: bool,
    sink: impl FnOnce(Sender, &mut AckLoop) -> S,
) -> Outcome {
    let (staged, watched) = stage(ride(seconds, 0.0, &[]), 1000.0, to, silent);
    let rate = staged.show.rate;
    let any = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
    let (sender, receiver) = Ports::open(any, to).expect("loopback has a free port").split();
    let live = Arc::new(Live::new(to.len()));
    let (mail, ends) = mailboxes(to.len(), rate, Arc::clone(&live));
    let MailEnds { sent, ticks, tasks, answers, .. } = ends;
    let mut acks = AckLoop::new(receiver, watched, u32::from(!silent), sent, ticks);
    acks.tell(Arc::clone(&live));
    let sink = sink(sender, &mut acks);
    let desk = staged.desk();
    let (engine, lanes, planner, timeline) = staged.split();
    let plans = PlanLoop { planning: Box::new(Planning { planner, timeline }), tasks, answers };
    let origin = Monotonic.now() + RUN_UP;
    stand_at_park(&live, to.len(), origin);
    let places = Places::new(&lanes, rate);
    let conductor = Conductor::of_a_play(origin, false);
    let grid = TickGrid::new(origin, rate);
    let drains = if silent { DrainGrid::rare } else { DrainGrid::new }(origin, rate.period());
    let never = AtomicBool::new(false);
    let tick_loop =
        TickLoop { clock, grid, engine, conductor, lanes, places, sink, mail, desk: &desk, leave: &never };
    outcome(to.len(), run_threads(tick_loop, acks, plans, drains))
}

/// Every seat was read at park.
pub(crate) fn stand_at_park(live: &Live, lanes: usize, at: MonoTime) {
    let parked = Reading::at_rest([0.0; MAX_AXES], at);
    (0..lanes).filter_map(|lane| live.evidence(lane)).for_each(|evidence| evidence.on_reading(&parked));
}

/// The calling thread becomes the tick thread, once the others have been started.
fn run_threads<C: Clock, S: FrameSink>(
    mut tick_loop: TickLoop<'_, C, S>,
    acks: AckLoop,
    mut plans: PlanLoop,
    drains: DrainGrid,
) -> Run {
    let (sent_all, done) = (AtomicBool::new(false), AtomicBool::new(false));
    thread::scope(|scope| {
        let sent_all = &sent_all;
        let ack_thread = scope.spawn(move || {
            let _ = normal_priority();
            let accounts = acks.run(&Monotonic, drains, || sent_all.load(Ordering::Acquire));
            (accounts, thread_cpu_time())
        });
        let plan_thread = scope.spawn(|| {
            let _ = normal_priority();
            plans.run(&done)
        });
        tick_loop.mail.wakes(plan_thread.thread().clone());
        let granted = request();
        let before = thread_cpu_time();
        let ended = tick_loop.run();
        let send_time = thread_cpu_time().saturating_sub(before);
        sent_all.store(true, Ordering::Release);
        done.store(true, Ordering::Release);
        plan_thread.thread().unpark();
        let (mut accounts, receive_time) = ack_thread.join().expect("the ack thread does not panic");
        accounts.close(tick_loop.lanes.iter().map(Lane::last_frame), Monotonic.now());
        assert!(plan_thread.join().is_ok_and(|refusals| refusals.is_empty()), "the ride is gentle");
        Run { ticks: ended.ticks, missed: ended.missed, accounts, send_time, receive_time, granted }
    })
}

fn outcome(controllers: usize, run: Run) -> Outcome {
    let tracker = run.accounts.books.tracker();
    let mut ack = histogram();
    let (mut sent, mut acked) = (0, 0);
    for controller in 0..controllers {
        let counts = tracker.counts(controller);
        assert_eq!(counts.asked, counts.acked + counts.refused() + counts.lost, "the books balance");
        sent += counts.sent;
        acked += counts.acked;
        ack.add(tracker.latency(controller)).expect("all have the same bounds");
    }
    Outcome {
        lateness: Quantiles::of(&run.accounts.lateness),
        ack: Quantiles::of(&ack),
        ticks: run.ticks,
        missed: run.missed,
        sent,
        acked,
        send_us: each(run.send_time, sent),
        receive_us: each(run.receive_time, acked),
        policy: run.granted.policy.to_string(),
        locked: run.granted.memory_locked,
    }
}
