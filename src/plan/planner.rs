//! The planner: asked for a course by the tick thread, answers with one. It keeps the courses that it gave out, so that
//! a request need only say from which one, and when, to go on.

use std::collections::VecDeque;

use super::join::{join, joins_without_a_move};
use super::park::park;
use super::seam::Before;
use super::{After, AxisState, Course, Curve, Plan, PlanError};
use crate::motion::Window;
use crate::time::ShowTime;

/// How many courses are remembered at the most: the one that is followed, and those that were asked for since.
const REMEMBERED: usize = 64;

/// How the lanes are as the new course begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum From {
    /// In their park pose, at rest: the beginning of a play.
    Park,
    /// Under way on another course.
    Course {
        /// Its serial.
        serial: u32,
        /// The show time that it has reached.
        at: ShowTime,
        /// How fast show time runs on it, as a multiple of the clock.
        pace: f64,
    },
    /// Where another course was at that show time, but at rest: frames stopped coming there.
    Stalled {
        /// Its serial.
        serial: u32,
        /// The show time that it had reached.
        at: ShowTime,
    },
}

/// Where the new course leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum To {
    /// Onto the cue.
    Cue,
    /// Into the park pose.
    Park,
}

/// A request for a course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// How the lanes are as it begins.
    pub from: From,
    /// Where it leads.
    pub to: To,
    /// The show time at which it begins.
    pub start: ShowTime,
    /// The number it is to have.
    pub serial: u32,
}

/// Plans courses for the lanes of one play.
#[derive(Debug)]
pub struct Planner {
    windows: Vec<Window>,
    rate_hz: f64,
    given: VecDeque<Course>,
}

impl Planner {
    /// A planner for lanes with these windows.
    #[must_use]
    pub fn new(windows: Vec<Window>, rate_hz: f64) -> Self {
        Self { windows, rate_hz, given: VecDeque::new() }
    }

    /// Plans what is asked.
    ///
    /// # Errors
    /// [`PlanError`] where a lane's move cannot be planned; nothing is remembered then.
    pub fn plan(&mut self, request: Request, curve: &Curve<'_>) -> Result<Course, PlanError> {
        let mut old = self.course_of(request.from)?;
        let mut moves: Vec<Option<Plan>> = Vec::with_capacity(self.windows.len());
        let mut states: Vec<Vec<AxisState>> = Vec::with_capacity(self.windows.len());
        for (lane, window) in self.windows.iter().enumerate() {
            states.push(states_of(old.as_mut(), request.from, lane, window, curve));
            // The seats of a hall are mostly alike: what was planned for one serves all like it.
            let twin =
                (0..lane).find(|&other| self.windows[other] == *window && states[other] == states[lane]);
            let planned = match twin {
                Some(twin) => moves[twin].clone(),
                None => self.lane_move(lane, &states[lane], request, curve, old.as_mut())?,
            };
            moves.push(planned);
        }
        let then = if request.to == To::Cue { After::Cue } else { After::Rest };
        let course = Course::new(request.serial, request.start, then, moves);
        self.given.push_back(course.clone());
        if self.given.len() > REMEMBERED {
            self.given.remove(1); // never the one that is followed
        }
        Ok(course)
    }

    fn lane_move(
        &self,
        lane: usize,
        from: &[AxisState],
        request: Request,
        curve: &Curve<'_>,
        old: Option<&mut Course>,
    ) -> Result<Option<Plan>, PlanError> {
        let (window, start, rate_hz) = (&self.windows[lane], request.start, self.rate_hz);
        let parked =
            window.moving().zip(from).all(|((_, slot), from)| *from == AxisState::at_rest(slot.park));
        let mut along = old.zip(under_way(request.from)).map(|(course, (until, pace))| {
            move |at: ShowTime| {
                // Show time may jump with the change of course; what was before goes on backwards from there.
                let since = ShowTime::from_nanos(at.as_nanos() - start.as_nanos()).as_secs_f64();
                let at =
                    ShowTime::from_nanos(until.as_nanos() + ShowTime::from_secs_f64(since * pace).as_nanos());
                course.pose(lane, at, window, &(curve.pose)(at))
            }
        });
        let pace = under_way(request.from).map_or(1.0, |(_, pace)| pace);
        let before = along.as_mut().map(|along| along as Before<'_, '_>);
        match request.to {
            _ if from.is_empty() => Ok(None),
            To::Park if parked => Ok(None),
            To::Park => park(window, from, start, rate_hz, pace, before).map(Some),
            To::Cue if parked && joins_without_a_move(window, curve, start, rate_hz) => Ok(None),
            To::Cue => join(window, from, curve, start, rate_hz, before).map(Some),
        }
    }

    /// The course that the lanes are on; those before it are forgotten. Without it nobody knows where they are, and to take
    /// them for parked would be a leap.
    fn course_of(&mut self, from: From) -> Result<Option<Course>, PlanError> {
        let (From::Course { serial, .. } | From::Stalled { serial, .. }) = from else { return Ok(None) };
        let index = self.given.iter().position(|course| course.serial == serial);
        let index = index.ok_or(PlanError::UnknownCourse(serial))?;
        self.given.drain(..index);
        Ok(self.given.front().cloned())
    }
}

/// The show time up to which lanes follow their old course, and their pace on it, where they do not rest.
const fn under_way(from: From) -> Option<(ShowTime, f64)> {
    match from {
        From::Course { at, pace, .. } => Some((at, pace)),
        From::Park | From::Stalled { .. } => None,
    }
}

/// How each moving slot of a lane moves as the new course begins.
fn states_of(
    old: Option<&mut Course>,
    from: From,
    lane: usize,
    window: &Window,
    curve: &Curve<'_>,
) -> Vec<AxisState> {
    match (old, from) {
        (Some(course), From::Course { at, pace, .. }) => {
            let states = course.states(lane, at, window, curve);
            states.into_iter().map(|state| state.at_pace(pace)).collect()
        }
        (Some(course), From::Stalled { at, .. }) => {
            let states = course.states(lane, at, window, curve);
            states.into_iter().map(|state| AxisState::at_rest(state.position)).collect()
        }
        _ => window.moving().map(|(_, slot)| AxisState::at_rest(slot.park)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{MAX_AXES, Pose, SeatType, Slot};

    const SECOND: i64 = 1_000_000_000;

    fn heave(at: ShowTime) -> Pose {
        let mut pose = [0.0; MAX_AXES];
        pose[0] = 0.5 - 0.25 * (at.as_secs_f64() * std::f64::consts::PI).cos();
        pose
    }

    fn planner(lanes: usize) -> Planner {
        let window = Window::new(vec![Slot::new(&SeatType::bench3(1), 0, Some(0), 1.0)]);
        Planner::new(vec![window; lanes], 100.0)
    }

    fn request(serial: u32, from: From, to: To, start_s: i64) -> Request {
        Request { from, to, start: ShowTime::from_nanos(start_s * SECOND), serial }
    }

    #[test]
    fn a_course_joins_the_cue_and_another_parks_from_it_without_a_step() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(2);
        let mut ride = planner.plan(request(1, From::Park, To::Cue, 0), &curve).unwrap();
        let at = ShowTime::from_nanos(5 * SECOND);
        let mut home =
            planner.plan(request(2, From::Course { serial: 1, at, pace: 1.0 }, To::Park, 5), &curve).unwrap();
        let window = planner.windows[0].clone();
        let before = ride.pose(0, at, &window, &heave(at));
        let after = home.pose(0, at, &window, &heave(at));
        assert!((before[0] - after[0]).abs() < 1e-9, "{before:?} {after:?}");
        assert!(home.pose(1, home.settled(), &window, &heave(at))[0] < 1e-9);
    }

    #[test]
    fn lanes_that_stalled_join_again_from_rest() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(1);
        planner.plan(request(1, From::Park, To::Cue, 0), &curve).unwrap();
        let stalled = From::Stalled { serial: 1, at: ShowTime::from_nanos(4 * SECOND + SECOND / 2) };
        let mut again = planner.plan(request(2, stalled, To::Cue, 6), &curve).unwrap();
        let window = planner.windows[0].clone();
        let start = again.pose(0, again.start, &window, &heave(again.start));
        let soon =
            again.pose(0, again.start + std::time::Duration::from_millis(1), &window, &heave(again.start));
        assert!((start[0] - 0.5).abs() < 1e-6, "{start:?}");
        assert!((soon[0] - start[0]).abs() < 1e-6, "at rest first");
    }

    #[test]
    fn the_course_that_is_followed_is_never_forgotten_and_no_other_is_taken_for_it() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(1);
        planner.plan(request(1, From::Park, To::Cue, 0), &curve).unwrap();
        let under_way = From::Course { serial: 1, at: ShowTime::from_nanos(5 * SECOND), pace: 1.0 };
        for serial in 2..200 {
            let course = planner.plan(request(serial, under_way, To::Park, 5), &curve).unwrap();
            assert!(course.settled() > course.start, "serial {serial}: it has a way to go");
        }
        let unknown = From::Course { serial: 777, at: ShowTime::ZERO, pace: 1.0 };
        let refusal = planner.plan(request(200, unknown, To::Park, 5), &curve).unwrap_err();
        assert_eq!(refusal, PlanError::UnknownCourse(777));
    }

    #[test]
    fn a_parked_lane_parks_without_a_move() {
        let curve = Curve { pose: &|_| [0.0; MAX_AXES], end: ShowTime::from_millis(1_000) };
        let course = planner(1).plan(request(1, From::Park, To::Park, 0), &curve).unwrap();
        assert_eq!(course.settled(), course.start);
    }
}
