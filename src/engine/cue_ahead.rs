//! What the cue says in a tick to lanes that are led ahead of the film: each gets now what its controller executes later.

use std::time::Duration;

use super::Beat;
use crate::motion::{MAX_AXES, Pose, Window};
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};
use crate::wire::Timing;

/// The cue as all lanes with the same lead have it.
#[derive(Debug)]
pub(super) struct CueAhead {
    lead: Duration,
    hint: Hint,
    /// Its pose where the frame of this tick leads.
    pub(super) pose: Pose,
    /// What the frames of this tick have in common.
    pub(super) beat: Beat,
}

impl CueAhead {
    /// One for each lead that there is among those lanes, the shortest first.
    pub(super) fn each(windows: &[Window]) -> Box<[Self]> {
        let mut leads: Vec<Duration> = windows.iter().map(Window::lead).collect();
        leads.sort_unstable();
        leads.dedup();
        // A hint of its own for each: of one for all the place would have to be looked for at every turn.
        leads.into_iter().map(Self::new).collect()
    }

    fn new(lead: Duration) -> Self {
        let beat = Beat::still(Timing::Relative, 1);
        Self { lead, hint: Hint::default(), pose: [0.0; MAX_AXES], beat }
    }

    /// That of lanes with that lead.
    pub(super) fn of(all: &[Self], lead: Duration) -> &Self {
        all.iter().find(|cue| cue.lead == lead).expect("there is one for each lane")
    }

    /// Takes up the pose that is reached when show time is `at`.
    pub(super) fn reach(&mut self, timeline: &Timeline, at: ShowTime) {
        self.pose = timeline.sample(at + self.lead, &mut self.hint);
    }

    /// Takes up what frames carry beside positions that leave when show time is `at`; where no lane follows the cue, nothing.
    pub(super) fn fill(&mut self, still: &Beat, timeline: &Timeline, at: Option<ShowTime>) {
        self.beat = *still;
        if let Some(at) = at.map(|at| at + self.lead) {
            self.beat.samples = timeline.samples(at, &mut self.hint);
            self.beat.effects = timeline.effects(at, &mut self.hint);
        }
    }
}
