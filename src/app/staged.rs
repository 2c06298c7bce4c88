//! A show that is ready to be played: everything that the tick loop and the planner need, made and proved.

use std::sync::Arc;

use crate::config::drive::SeatDrive;
use crate::config::{Config, Connection};
use crate::drive::{Lane, Manner, lanes};
use crate::engine::{Engine, Headroom, MAX_SPEED_UP, Mix, Show, Slewing};
use crate::film::chase::ChaseRules;
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

const _: () = assert!(PaceLimits::MOST_OFF <= MAX_SPEED_UP, "no film asks for more than seats are given");

/// How a film that is followed so may have the pace changed.
fn slewing(pace: PaceLimits) -> Slewing {
    Slewing { most: pace.most() - 1.0, change_per_s: pace.change_per_s() }
}

/// The headroom of a cue that chases a film, and was proved [`at_any_pace`] of that.
#[must_use]
pub fn chasing(headroom: Headroom, rules: &ChaseRules) -> Headroom {
    headroom.led(slewing(rules.pace))
}

/// The seat with what is left of its limits for a cue, whatever pace a film asks for that is followed so.
pub(crate) fn seat_at_any_pace(seat: &SeatType, pace: PaceLimits, rate: Rate) -> SeatType {
    let slewing = slewing(pace);
    seat.clone().with_each(|axis| {
        let [velocity, acceleration] = axis.most_shaken();
        let most = [axis.max_velocity, axis.max_acceleration, axis.max_jerk];
        let left = slewing.leaves(rate, most);
        [axis.max_velocity, axis.max_acceleration, axis.max_jerk] = left;
        // No pace makes a vibration quicker: what is over both together is what the pace adds to the motion.
        axis.max_shaken_velocity = Some(velocity - (most[0] - left[0]));
        axis.max_shaken_acceleration = Some(acceleration - (most[1] - left[1]));
    })
}

/// The hall with what is left of its seats' limits for a cue, whatever pace a film asks for that is followed so.
pub(crate) fn at_any_pace(config: &Config, pace: PaceLimits, rate: Rate) -> Config {
    let (mut config, slewing) = (config.clone(), slewing(pace));
    for controller in &mut config.controllers {
        controller.seat = Arc::new(seat_at_any_pace(&controller.seat, pace, rate));
        if let Connection::Link(drives) = &mut controller.connection {
            // What a fit misses is in proportion to the jerk of what it follows.
            let max_deviation_mm = drives.drive.max_deviation_mm / (1.0 + slewing.most).powi(3);
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::fmt::Write as _;
    use std::path::Path;

    use super::*;
    use crate::cue::{self, Source};
    use crate::film::point::FilmState;
    use crate::harness::{Event, ORIGIN, Virtual};
    use crate::proof::{Digest, Terms, prove};
    use crate::time::ShowTime;

    /// Where a ride is that goes up and down more than three times a second, so much of the stroke to either side, from rest to rest.
    fn place(amplitude: f64, t: f64) -> f64 {
        let u = (t.min(30.0 - t) / 2.0).clamp(0.0, 1.0);
        0.5 + amplitude * u * u * (3.0 - 2.0 * u) * (TAU * t / 0.3).sin()
    }

    fn ride(amplitude: f64) -> String {
        let mut text = "time_ms,a1\n".to_owned();
        for ms in (0..=30_000).step_by(10) {
            writeln!(text, "{ms},{:.9}", place(amplitude, f64::from(ms) * 1e-3)).unwrap();
        }
        text
    }

    #[test]
    fn a_cue_that_uses_all_that_is_left_for_a_film_is_where_that_is_at_any_of_its_paces() {
        let rate = Rate::from_hz(100.0);
        let paced = at_any_pace(&Virtual::new(ride(0.0)).config(), PaceLimits::default(), rate);
        let passes = |amplitude: f64| {
            let cue = cue::read(Path::new("ride.csv"), ride(amplitude).as_bytes(), &Source::Native);
            let timeline = Timeline::new(cue.unwrap());
            prove(&timeline, Terms::of_hall(&paced, Digest::of(timeline.cue()), rate, 1.0)).passed()
        };
        let (mut keeps, mut breaks) = (0.0, 0.1);
        for _ in 0..10 {
            let middle = f64::midpoint(keeps, breaks);
            if passes(middle) { keeps = middle } else { breaks = middle }
        }
        for speed in [0.9985, 1.0015] {
            let lead = |tick: u64, at_s: f64, ahead_s: f64| {
                let media = ShowTime::from_secs_f64(0.5 + speed * (at_s - 0.5) + ahead_s);
                (tick, Event::Film(media, speed, FilmState::Locked))
            };
            // 30 ms that are slewed, in the middle of it.
            let script = vec![lead(50, 0.5, 0.0), lead(1_000, 10.0, 0.03)];
            let played =
                Virtual { chases: true, at_most: 20_000, script, ..Virtual::new(ride(keeps)) }.play();
            let worst = played.worst();
            assert!(worst.velocity <= 1.01 && worst.acceleration <= 1.01 && worst.jerk <= 1.01, "{worst:?}");
            assert!(worst.jerk > 0.94, "it uses what there is: {worst:?}");
            assert_eq!(played.clamps[0].worst, None);
            let off = played.frames.iter().zip(played.positions_mm(0, 0)).filter_map(|(frame, mm)| {
                let end_s = frame.at.since(ORIGIN).as_secs_f64() + 0.01;
                let ahead_s = if end_s < 10.0 { 0.0 } else { 0.03 };
                let wanted = 150.0 * place(keeps, 0.5 + speed * (end_s - 0.5) + ahead_s);
                let is_slewed = (5.0..9.9).contains(&end_s) || (16.0..26.0).contains(&end_s);
                is_slewed.then_some((mm - wanted).abs())
            });
            let worst_mm = off.fold(0.0, f64::max);
            // At 137 mm/s a millisecond is 0.14 mm.
            assert!(worst_mm < 0.05, "{worst_mm} mm at {speed} of the film's speed");
        }
    }
}
