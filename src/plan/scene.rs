//! State of the lanes when a course is requested: what the planner cannot know from the courses it issued.

use crate::motion::{Pose, Window};

/// Where one lane is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// On the course that the lanes follow.
    OnCourse,
    /// At rest in that pose, fractions of each slot's stroke, whatever the course says.
    Still(Pose),
    /// Nowhere that is known, and no frames go to it: nothing is planned for it.
    Away,
}

/// One lane as a course is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneScene {
    /// Where it is.
    pub place: Place,
    /// How much of the cue's motion about its neutral pose it makes, 0 to 1.
    pub level: f64,
    /// True if it rests in park while the others play.
    pub out: bool,
}

/// All lanes as a course is asked for. It goes to the planner with the request, and comes back with the answer, so that
/// the tick thread neither makes nor frees one.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// In the order of the lanes.
    pub lanes: Vec<LaneScene>,
}

impl Scene {
    /// All lanes at rest in their park poses, at the levels of their windows.
    #[must_use]
    pub(crate) fn parked(windows: &[Window]) -> Self {
        let lane = |window: &Window| LaneScene {
            place: Place::Still(window.park()),
            level: window.level(),
            out: false,
        };
        Self { lanes: windows.iter().map(lane).collect() }
    }
}
