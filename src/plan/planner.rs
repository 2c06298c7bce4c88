//! The planner: answers requests of the tick thread for a course. It keeps the courses that it issued, so that
//! a request need only name the one to continue from, and when.

use std::collections::VecDeque;

use super::join::{join, joins_without_a_move};
use super::park::park;
use super::seam::Before;
use super::{After, Course, Curve, LaneScene, Leg, Place, Plan, PlanError, Scene};
use crate::motion::{AxisState, Window};
use crate::time::ShowTime;

/// How many courses are remembered at the most: the one that is followed, and those that were asked for since.
const REMEMBERED: usize = 64;

/// What the lanes do as the new course begins; the scene says which of them do not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum From {
    /// They rest.
    Rest,
    /// They are under way on another course.
    Course {
        /// Its serial.
        serial: u32,
        /// The show time that it has reached.
        at: ShowTime,
        /// How fast show time runs on it, as a multiple of the clock.
        pace: f64,
    },
}

/// Where the new course leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum To {
    /// Onto the cue; lanes that are out, to park.
    Cue,
    /// Into the park pose.
    Park,
    /// Nowhere else: every lane does what it did, but those that went out, came in, or were away since. The new course
    /// begins at the show time at which the old one ends.
    Same,
}

/// A request for a course.
#[derive(Debug, PartialEq)]
pub struct Request {
    /// How the lanes are as it begins.
    pub from: From,
    /// Where it leads.
    pub to: To,
    /// The show time at which it begins.
    pub start: ShowTime,
    /// The number it is to have.
    pub serial: u32,
    /// How the lanes are, lane by lane.
    pub scene: Box<Scene>,
}

/// Plans courses for the lanes of one play.
#[derive(Debug)]
pub struct Planner {
    windows: Vec<Window>,
    rate_hz: f64,
    given: VecDeque<Course>,
}

/// One lane as its leg is planned.
struct LaneTask<'a> {
    index: usize,
    /// Its window, at its level.
    window: Window,
    scene: &'a LaneScene,
    /// How its moving slots move as the course begins.
    states: Vec<AxisState>,
    to: To,
}

impl LaneTask<'_> {
    /// True if a leg made for the other serves this one as well: the seats of a hall are mostly alike.
    fn is_like(&self, other: &LaneTask<'_>) -> bool {
        self.window == other.window
            && self.to == other.to
            && self.scene.out == other.scene.out
            && self.states == other.states
            && (self.scene.place == Place::OnCourse) == (other.scene.place == Place::OnCourse)
    }
}

impl Planner {
    /// A planner for lanes with these windows.
    #[must_use]
    pub(crate) fn new(windows: Vec<Window>, rate_hz: f64) -> Self {
        Self { windows, rate_hz, given: VecDeque::new() }
    }

    /// Plans what is asked.
    ///
    /// # Errors
    /// [`PlanError`] where a lane's move cannot be planned; nothing is remembered then.
    pub fn plan(&mut self, request: &Request, curve: &Curve<'_>) -> Result<Course, PlanError> {
        let mut old = self.course_of(request.from)?;
        let mut tasks: Vec<LaneTask<'_>> = Vec::with_capacity(self.windows.len());
        let mut legs: Vec<Leg> = Vec::with_capacity(self.windows.len());
        for index in 0..self.windows.len() {
            let task = self.task(index, request, old.as_mut(), curve)?;
            let twin = tasks.iter().position(|other| task.to != To::Same && task.is_like(other));
            let leg = match (twin, old.as_ref().filter(|_| task.to == To::Same)) {
                (Some(twin), _) => legs[twin].clone(),
                (None, Some(old)) => old.leg(index).clone(),
                (None, None) => {
                    curve.ahead(task.window.lead(), |cue| self.leg(&task, request, cue, old.as_mut()))?
                }
            };
            legs.push(leg);
            tasks.push(task);
        }
        let course = Course::new(request.serial, request.start, legs);
        self.given.push_back(course.clone());
        if self.given.len() > REMEMBERED {
            self.given.remove(1); // never the one that is followed
        }
        Ok(course)
    }

    fn task<'a>(
        &self,
        index: usize,
        request: &'a Request,
        old: Option<&mut Course>,
        curve: &Curve<'_>,
    ) -> Result<LaneTask<'a>, PlanError> {
        let scene = request.scene.lanes.get(index).ok_or(PlanError::UnknownLane(index))?;
        let window = self.windows[index].at_level(scene.level);
        let keeps =
            old.as_ref().is_some_and(|old| old.leg(index).out == scene.out) && scene.place == Place::OnCourse;
        let to = match request.to {
            To::Same if keeps => To::Same,
            To::Cue | To::Same if scene.out => To::Park,
            To::Cue | To::Same => To::Cue,
            To::Park => To::Park,
        };
        let states = match (scene.place, old, request.from) {
            (Place::OnCourse, Some(course), From::Course { at, pace, .. }) => {
                let states = curve.ahead(window.lead(), |cue| course.states(index, at, &window, cue));
                states.into_iter().map(|state| state.at_pace(pace)).collect()
            }
            (Place::OnCourse, ..) => return Err(PlanError::UnknownPlace(index)),
            (Place::Still(pose), ..) => {
                window.moving().map(|(slot, _)| AxisState::at_rest(pose[slot])).collect()
            }
            (Place::Away, ..) => Vec::new(),
        };
        Ok(LaneTask { index, window, scene, states, to })
    }

    fn leg(
        &self,
        task: &LaneTask<'_>,
        request: &Request,
        curve: &Curve<'_>,
        old: Option<&mut Course>,
    ) -> Result<Leg, PlanError> {
        let then = if task.to == To::Cue { After::Cue } else { After::Rest };
        let plan = self.lane_move(task, request, curve, old)?;
        Ok(Leg { start: request.start, plan, then, out: task.scene.out })
    }

    fn lane_move(
        &self,
        task: &LaneTask<'_>,
        request: &Request,
        curve: &Curve<'_>,
        old: Option<&mut Course>,
    ) -> Result<Option<Plan>, PlanError> {
        let LaneTask { index, window, states: from, .. } = task;
        let (start, rate_hz) = (request.start, self.rate_hz);
        let parked =
            window.moving().zip(from).all(|((_, slot), from)| *from == AxisState::at_rest(slot.park));
        let under_way = under_way(request.from).filter(|_| task.scene.place == Place::OnCourse);
        let mut along = old.zip(under_way).map(|(course, (until, pace))| {
            move |at: ShowTime| {
                // Show time may jump with the change of course; what was before goes on backwards from there.
                let since = ShowTime::from_nanos(at.as_nanos() - start.as_nanos()).as_secs_f64();
                let at =
                    ShowTime::from_nanos(until.as_nanos() + ShowTime::from_secs_f64(since * pace).as_nanos());
                course.pose(*index, at, window, &(curve.pose)(at))
            }
        });
        let pace = under_way.map_or(1.0, |(_, pace)| pace);
        let before = along.as_mut().map(|along| along as Before<'_, '_>);
        match task.to {
            _ if from.is_empty() => Ok(None),
            To::Park if parked => Ok(None),
            To::Park => park(window, from, start, rate_hz, pace, before).map(Some),
            _ if parked && joins_without_a_move(window, curve, start, rate_hz) => Ok(None),
            _ => join(window, from, curve, start, rate_hz, before).map(Some),
        }
    }

    /// The course that the lanes are on; those before it are forgotten. Without it nobody knows where they are, and to take
    /// them for parked would be a leap.
    fn course_of(&mut self, from: From) -> Result<Option<Course>, PlanError> {
        let From::Course { serial, .. } = from else { return Ok(None) };
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
        From::Rest => None,
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

    fn scene(place: Place) -> LaneScene {
        LaneScene { place, level: 1.0, out: false }
    }

    /// Two lanes at most; from rest they are in park.
    fn request(serial: u32, from: From, to: To, start_s: i64) -> Request {
        let place = if from == From::Rest { Place::Still([0.0; MAX_AXES]) } else { Place::OnCourse };
        let scene = Box::new(Scene { lanes: vec![scene(place); 2] });
        Request { from, to, start: ShowTime::from_nanos(start_s * SECOND), serial, scene }
    }

    fn course(serial: u32, at_s: i64) -> From {
        From::Course { serial, at: ShowTime::from_nanos(at_s * SECOND), pace: 1.0 }
    }

    #[test]
    fn a_course_joins_the_cue_and_another_parks_from_it_without_a_step() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(2);
        let mut ride = planner.plan(&request(1, From::Rest, To::Cue, 0), &curve).unwrap();
        let at = ShowTime::from_nanos(5 * SECOND);
        let mut home = planner.plan(&request(2, course(1, 5), To::Park, 5), &curve).unwrap();
        let window = planner.windows[0].clone();
        let before = ride.pose(0, at, &window, &heave(at));
        let after = home.pose(0, at, &window, &heave(at));
        assert!((before[0] - after[0]).abs() < 1e-9, "{before:?} {after:?}");
        assert!(home.pose(1, home.settled(), &window, &heave(at))[0] < 1e-9);
    }

    #[test]
    fn lanes_that_rest_somewhere_join_again_from_there() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(1);
        let mut resting = request(1, From::Rest, To::Cue, 6);
        resting.scene.lanes[0] = scene(Place::Still([0.5; MAX_AXES]));
        let mut again = planner.plan(&resting, &curve).unwrap();
        let window = planner.windows[0].clone();
        let start = again.pose(0, again.start, &window, &heave(again.start));
        let soon =
            again.pose(0, again.start + std::time::Duration::from_millis(1), &window, &heave(again.start));
        assert!((start[0] - 0.5).abs() < 1e-6, "{start:?}");
        assert!((soon[0] - start[0]).abs() < 1e-6, "at rest first");
    }

    #[test]
    fn a_lane_that_goes_out_parks_and_comes_in_again_while_the_other_follows_the_cue_to_the_last_bit() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(60_000) };
        let mut planner = planner(2);
        let mut first = planner.plan(&request(1, From::Rest, To::Cue, 0), &curve).unwrap();
        let mut out = request(2, course(1, 1), To::Same, 1);
        out.scene.lanes[1].out = true;
        let mut out = planner.plan(&out, &curve).unwrap();
        let window = planner.windows[0].clone();
        for ms in (1_000..9_000).step_by(10) {
            let at = ShowTime::from_millis(ms);
            let cue = heave(at);
            assert_eq!(first.pose(0, at, &window, &cue), out.pose(0, at, &window, &cue), "{ms} ms");
        }
        assert!(!out.is_on_cue(1, ShowTime::from_millis(9_000)));
        assert!(out.pose(1, out.settled(), &window, &heave(out.settled()))[0] < 1e-9, "in park");
        let mut back = planner.plan(&request(3, course(2, 20), To::Same, 20), &curve).unwrap();
        assert!(back.is_on_cue(1, back.settled()) && back.is_on_cue(0, back.start));
        let at = ShowTime::from_nanos(20 * SECOND);
        assert!(back.pose(1, at, &window, &heave(at))[0] < 1e-9, "from park");
    }

    #[test]
    fn a_lane_of_which_nothing_is_known_is_no_reason_for_a_leap() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut nowhere = request(1, From::Rest, To::Cue, 0);
        nowhere.scene.lanes[0].place = Place::OnCourse;
        assert_eq!(planner(1).plan(&nowhere, &curve).unwrap_err(), PlanError::UnknownPlace(0));
        assert_eq!(
            planner(3).plan(&request(1, From::Rest, To::Cue, 0), &curve).unwrap_err(),
            PlanError::UnknownLane(2)
        );
    }

    #[test]
    fn the_course_that_is_followed_is_never_forgotten_and_no_other_is_taken_for_it() {
        let curve = Curve { pose: &heave, end: ShowTime::from_millis(20_000) };
        let mut planner = planner(1);
        planner.plan(&request(1, From::Rest, To::Cue, 0), &curve).unwrap();
        for serial in 2..200 {
            let course = planner.plan(&request(serial, course(1, 5), To::Park, 5), &curve).unwrap();
            assert!(course.settled() > course.start, "serial {serial}: it has a way to go");
        }
        let refusal = planner.plan(&request(200, course(777, 0), To::Park, 5), &curve).unwrap_err();
        assert_eq!(refusal, PlanError::UnknownCourse(777));
    }

    #[test]
    fn a_parked_lane_parks_without_a_move() {
        let curve = Curve { pose: &|_| [0.0; MAX_AXES], end: ShowTime::from_millis(1_000) };
        let course = planner(1).plan(&request(1, From::Rest, To::Park, 0), &curve).unwrap();
        assert_eq!(course.settled(), course.start);
    }
}
