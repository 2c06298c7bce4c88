//! A show that is ready to be played: everything that the tick loop and the planner need, made and proved.

use std::sync::Arc;

use crate::config::Config;
use crate::engine::{Engine, Headroom, Mix, Show};
use crate::fanout::{Lane, Manner, lanes};
use crate::motion::Window;
use crate::plan::{Course, Curve, From, PlanError, Planner, Request, Scene, To};
use crate::rt::Desk;
use crate::timeline::{Hint, Timeline};

/// A show with its lanes and its first course; nothing is open yet, and nothing moves.
#[derive(Debug)]
pub struct Staged {
    /// What is played.
    pub show: Show,
    /// The cue's curve.
    pub timeline: Arc<Timeline>,
    /// One lane for each controller, in the configuration's order.
    pub lanes: Vec<Lane>,
    /// Plans the courses to come; it has given out the first.
    pub planner: Planner,
    /// What the lanes do from tick 0 on.
    pub course: Box<Course>,
    /// How much faster than the film the cue may run.
    pub headroom: Headroom,
}

impl Staged {
    /// Makes the lanes, and plans the move from the park pose onto the cue. The cue has to fit the hall.
    ///
    /// # Errors
    /// [`PlanError::NoJoin`] where no move leads onto the cue.
    pub fn new(config: &Config, timeline: Timeline, show: Show, manner: Manner) -> Result<Self, PlanError> {
        let lanes = lanes(config, &timeline, manner);
        let windows: Vec<Window> = lanes.iter().map(|lane| lane.window.clone()).collect();
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let headroom = Headroom::measure(&windows, &curve, show.rate);
        let scene = Box::new(Scene::parked(&windows));
        let request = Request { from: From::Rest, to: To::Cue, start: show.start, serial: 1, scene };
        let mut planner = Planner::new(windows, show.rate.hz());
        let course = Box::new(planner.plan(&request, &curve)?);
        Ok(Self { show, timeline: Arc::new(timeline), lanes, planner, course, headroom })
    }

    /// A desk that is set as the show begins.
    #[must_use]
    pub fn desk(&self) -> Desk {
        let level = |lane: &Lane| lane.window.level();
        Desk::new(self.lanes.iter().map(|lane| Mix {
            motion: level(lane),
            vibration: level(lane),
            ..Mix::FULL
        }))
    }

    /// The engine for the tick loop, the lanes for the fan-out, and the planner for its thread.
    #[must_use]
    pub fn split(self) -> (Engine, Vec<Lane>, Planner, Arc<Timeline>) {
        let windows = self.lanes.iter().map(|lane| lane.window.clone()).collect();
        let engine = Engine::new(self.show, Arc::clone(&self.timeline), self.headroom, windows, self.course);
        (engine, self.lanes, self.planner, self.timeline)
    }
}
