//! The threads of one play: tick, ack and planner, from the first tick to the last reply.

use std::io;
use std::thread;
use std::time::Duration;

use super::helpers::{EndFlags, Helpers};
use super::play::{Chased, Control};
use super::run::Run;
use crate::drive::Lane;
use crate::engine::Engine;
use crate::net::{DrainGrid, Sender};
use crate::rt::{AckLoop, Conductor, FilmLead, Mail, Places, PlanLoop, Spinning, TickLoop};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{Clock as _, Rate, TickGrid};

/// From the end of preparing to tick 0: time to start the other threads.
const RUN_UP: Duration = Duration::from_millis(20);

/// What the threads of a play share out among themselves.
pub(super) struct Stage {
    /// True if no replies are to come.
    pub(super) silent: bool,
    pub(super) rate: Rate,
    /// How long before a deadline the tick thread stops sleeping and spins.
    pub(super) spin: Duration,
    pub(super) engine: Engine,
    pub(super) lanes: Vec<Lane>,
    /// What is known of where their seats are.
    pub(super) places: Places,
    pub(super) sender: Sender,
    pub(super) mail: Mail,
    /// The film that it chases.
    pub(super) chased: Option<Chased>,
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
        plans: PlanLoop,
        attended: bool,
        control: &Control,
    ) -> io::Result<Run> {
        let Self { silent, rate, spin, engine, lanes, places, sender, mut mail, chased } = self;
        let engine = if chased.is_some() { engine.waiting() } else { engine };
        let over = EndFlags::default();
        let granted = realtime::request();
        thread::scope(|scope| {
            let origin = Monotonic.now() + RUN_UP;
            let period = rate.period();
            let drains =
                if silent { DrainGrid::rare(origin, period) } else { DrainGrid::new(origin, period) };
            let helpers = Helpers::start(scope, &over, &granted, acks, drains, plans)?;
            mail.wakes(helpers.planner());
            let grid = TickGrid::new(origin, rate);
            let clock = Spinning::new(&Monotonic, spin, period);
            let film = chased.map(|Chased { source, rules }| FilmLead::new(source, rules, origin));
            let conductor = Conductor::of_a_play(origin, attended).chasing(film);
            let (desk, leave) = (&*control.desk, &*control.leave);
            let mut ticks = TickLoop {
                clock: &clock,
                grid,
                engine,
                conductor,
                lanes,
                places,
                sink: sender,
                mail,
                desk,
                leave,
            };
            let ended = ticks.run();
            Ok(helpers.end(&ticks, ended, granted, origin))
        })
    }
}
