//! A show that is ready to be played: everything that the tick loop and the planner need, made and proved.

use std::sync::Arc;

use crate::config::drive::SeatDrive;
use crate::config::{Config, Connection};
use crate::drive::{Lane, Manner, lanes};
use crate::engine::{Engine, Headroom, Mix, Show};
use crate::film::follower::PaceLimits;
use crate::motion::{SeatType, Window};
use crate::plan::{Course, Curve, From, PlanError, Planner, Request, Scene, To};
use crate::rt::{Desk, Loaded, Planning};
use crate::time::Rate;
use crate::timeline::{Hint, Timeline};

/// A show with its lanes and its first course; nothing is open yet, and nothing moves.
#[derive(Debug)]
pub struct StagedShow {
    /// What is played.
    pub show: Show,
    /// The cue's curve.
    pub timeline: Arc<Timeline>,
    /// One lane for each controller, in the configuration's order.
    pub(crate) lanes: Vec<Lane>,
    /// Plans the courses to come; it has given out the first.
    pub(crate) planner: Planner,
    /// What the lanes do from tick 0 on.
    pub course: Box<Course>,
    /// How much faster than the film the cue may run.
    pub headroom: Headroom,
    /// What operators want of each seat as it begins.
    pub(crate) mixes: Box<[Mix]>,
}

/// How much faster than the film a cue may run on the seats of a hall.
#[must_use]
pub fn headroom(config: &Config, timeline: &Timeline, rate: Rate) -> Headroom {
    let lanes = lanes(config, timeline, Manner { level: 1.0, silent: false });
    let windows: Vec<Window> = lanes.into_iter().map(|lane| lane.window).collect();
    Headroom::measure(&windows, timeline, rate)
}

/// The seat with what is left of its limits at those paces.
pub(crate) fn seat_at_any_pace(seat: &SeatType, pace: PaceLimits) -> SeatType {
    seat.clone().with_each(|axis| {
        [axis.max_velocity, axis.max_acceleration, axis.max_jerk] =
            pace.leave(axis.max_velocity, axis.max_acceleration, axis.max_jerk);
    })
}

/// The hall with what is left of its seats' limits at those paces.
pub(crate) fn at_any_pace(config: &Config, pace: PaceLimits) -> Config {
    let mut config = config.clone();
    for controller in &mut config.controllers {
        controller.seat = Arc::new(seat_at_any_pace(&controller.seat, pace));
        if let Connection::Link(drives) = &mut controller.connection {
            // What a fit misses is in proportion to the jerk of what it follows.
            let max_deviation_mm = drives.drive.max_deviation_mm / pace.most().powi(3);
            drives.drive = Arc::new(SeatDrive { max_deviation_mm, ..SeatDrive::clone(&drives.drive) });
        }
    }
    config
}

impl StagedShow {
    /// Makes the lanes, and plans the move from the park pose onto the cue. The cue has to fit the hall.
    ///
    /// # Errors
    /// [`PlanError::NoJoin`] where no move leads onto the cue.
    pub fn new(config: &Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlanError> {
        let headroom = headroom(config, &timeline, show.rate);
        let level = Mix { motion: manner.level, vibration: manner.level, ..Mix::FULL };
        let mixes = vec![level; config.controllers.len()];
        Self::mixed(config, &Arc::new(timeline), headroom, show, &mixes, manner.silent)
    }

    /// The same for a cue whose headroom is known, with what operators want of each seat: one that is out stays in park.
    ///
    /// # Errors
    /// As [`StagedShow::new`].
    pub fn mixed(
        config: &Config,
        timeline: &Arc<Timeline>,
        headroom: Headroom,
        show: Show,
        mixes: &[Mix],
        silent: bool,
    ) -> Result<Self, PlanError> {
        Self::of_lanes(
            lanes(config, timeline, Manner { level: 1.0, silent }),
            timeline,
            headroom,
            show,
            mixes,
        )
    }

    /// The same for lanes that are made. One that is led ahead has the beginning of the cue before the others, so that show time begins
    /// by the longest lead before the show's start.
    ///
    /// # Errors
    /// As [`StagedShow::new`].
    pub(crate) fn of_lanes(
        mut lanes: Vec<Lane>,
        timeline: &Arc<Timeline>,
        headroom: Headroom,
        show: Show,
        mixes: &[Mix],
    ) -> Result<Self, PlanError> {
        let lead = lanes.iter().map(|lane| lane.window.lead()).max().unwrap_or_default();
        let show = Show { start: show.start - lead, ..show };
        for (lane, mix) in lanes.iter_mut().zip(mixes) {
            lane.window.set_level(mix.motion);
        }
        let windows: Vec<Window> = lanes.iter().map(|lane| lane.window.clone()).collect();
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let mut scene = Box::new(Scene::parked(&windows));
        for (lane, mix) in scene.lanes.iter_mut().zip(mixes) {
            lane.out = !mix.on;
        }
        let request = Request { from: From::Rest, to: To::Cue, start: show.start, serial: 1, scene };
        let mut planner = Planner::new(windows, show.rate.hz());
        let course = Box::new(planner.plan(&request, &curve)?);
        let timeline = Arc::clone(timeline);
        Ok(Self { show, timeline, lanes, planner, course, headroom, mixes: mixes.into() })
    }

    /// A desk that is set as the show begins.
    #[must_use]
    pub fn desk(&self) -> Desk {
        Desk::new(self.mixes.iter().copied())
    }

    /// The engine for the tick loop, the lanes for the fan-out, and the planner for its thread.
    #[must_use]
    pub fn split(self) -> (Engine, Vec<Lane>, Planner, Arc<Timeline>) {
        let windows = self.lanes.iter().map(|lane| lane.window.clone()).collect();
        let engine = Engine::new(self.show, Arc::clone(&self.timeline), self.headroom, windows, self.course)
            .mixed(&self.mixes);
        (engine, self.lanes, self.planner, self.timeline)
    }

    /// The show as a hall takes it up: it waits until it is let go.
    #[must_use]
    pub fn loaded(self) -> Box<Loaded> {
        let (engine, lanes, planner, timeline) = self.split();
        let planning = Some(Box::new(Planning { planner, timeline }));
        Box::new(Loaded { engine: engine.waiting(), lanes, planning, film: None })
    }
}
