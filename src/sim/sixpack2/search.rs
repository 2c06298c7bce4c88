//! How a motor searches its zero: off the switch, onto it fast, off it and onto it slowly, and to zero. One that does not find its
//! switch begins again, for ever.

use crate::wire::sixpack2::action;

/// Where a search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SearchStep {
    /// Off the switch on which it began.
    Leave,
    /// Towards the switch.
    Seek,
    /// Off it again.
    BackOff,
    /// Onto it, slowly.
    Creep,
    /// To zero, which may be beside the edge.
    Return,
    /// Into a mechanical stop.
    Mechanical,
}

/// A search under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Search {
    pub(super) step: SearchStep,
    /// Microsteps in this step.
    pub(super) travelled: f64,
    /// How often it began.
    pub(super) tries: u32,
}

impl SearchStep {
    /// As a motor tells it.
    pub(super) const fn action(self) -> u8 {
        match self {
            Self::Leave => action::SEARCH,
            Self::Seek => action::SEARCH + 1,
            Self::BackOff => action::SEARCH + 2,
            Self::Creep => action::SEARCH + 3,
            Self::Return => action::SEARCH + 4,
            Self::Mechanical => action::MECHANICAL,
        }
    }
}

impl Search {
    pub(super) const fn begun_with(step: SearchStep) -> Self {
        Self { step, travelled: 0.0, tries: 1 }
    }

    /// Where it goes on, if not as it is: by the switch, and by whether it has gone farther than it should have to.
    pub(super) const fn next(&self, is_active: bool, is_over: bool) -> Option<SearchStep> {
        match (self.step, is_active) {
            (SearchStep::Mechanical, _) if is_over => Some(SearchStep::Return),
            (SearchStep::Leave, false) => Some(SearchStep::Seek),
            (SearchStep::Seek, true) => Some(SearchStep::BackOff),
            (SearchStep::BackOff, false) => Some(SearchStep::Creep),
            (SearchStep::Creep, true) => Some(SearchStep::Return),
            (SearchStep::Leave | SearchStep::Seek | SearchStep::BackOff | SearchStep::Creep, _)
                if is_over =>
            {
                Some(SearchStep::Seek)
            }
            _ => None,
        }
    }

    /// Goes on with a step. Seeking out of anything but the switch on which it began is to begin again.
    pub(super) fn enter(&mut self, step: SearchStep) {
        if step == SearchStep::Seek && self.step != SearchStep::Leave {
            self.tries += 1;
        }
        (self.step, self.travelled) = (step, 0.0);
    }
}
