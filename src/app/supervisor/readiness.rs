//! Whether a show can be armed: what was proved, and what preflight came to.

use super::hall::HallContext;
use super::preflighted::Preflighted;
use crate::state::Readiness;

/// What is next where preflight failed.
pub(super) const CORRECT: &str = "correct each error that preflight found, or accept it by name in the configuration \
                                  (accept_findings), or disable its seat; then run preflight again";

/// What preflight came to, and what the tick thread was told.
#[derive(Debug, Default)]
pub(super) struct ReadinessCheck {
    pub(super) preflighted: Option<Preflighted>,
    told: Option<Readiness>,
}

impl ReadinessCheck {
    /// True if nothing fails at the controllers of a group.
    pub(super) fn has_passed(&self, group: &str, hall: &HallContext) -> bool {
        let of_group = |lane: usize| hall.config.controllers[lane].group == group;
        self.preflighted.as_ref().is_some_and(|it| it.has_passed(of_group))
    }

    /// True if it found what fails at a seat that takes part.
    pub(super) fn has_failed(&self, hall: &HallContext) -> bool {
        self.preflighted.as_ref().is_some_and(|it| !it.has_passed(|lane| hall.settings.is_on(lane)))
    }

    /// What the tick thread is to be told; `None` if it knows.
    pub(super) fn tell(&mut self, hall: &HallContext) -> Option<Readiness> {
        let readiness = self.of(hall);
        (self.told.replace(readiness) != Some(readiness)).then_some(readiness)
    }

    /// It was not told.
    pub(super) const fn forget(&mut self) {
        self.told = None;
    }

    /// True if the tick thread knows that a show can be armed.
    #[cfg(test)]
    pub(super) fn is_told_ready(&self) -> bool {
        self.told == Some(Readiness::Ready)
    }

    fn of(&self, hall: &HallContext) -> Readiness {
        match (&hall.cued, &self.preflighted) {
            (None, _) => Readiness::NoCue,
            (Some(_), Some(preflighted)) if preflighted.has_passed(|lane| hall.settings.is_on(lane)) => {
                Readiness::Ready
            }
            (Some(_), _) => Readiness::NotPreflighted,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::hall;
    use crate::state::State;

    #[test]
    fn the_tick_thread_is_told_once_of_each_change_and_again_where_it_did_not_hear() {
        let mut hall = hall(State::Parked, "one");
        let mut check = ReadinessCheck::default();
        assert_eq!(check.tell(&hall), Some(Readiness::NotPreflighted));
        assert_eq!(check.tell(&hall), None);
        check.forget();
        assert_eq!(check.tell(&hall), Some(Readiness::NotPreflighted));
        check.preflighted = Some(Preflighted::failing_at(1, 2));
        assert_eq!(check.tell(&hall), None);
        hall.settings.only = Some(["A".to_owned()].into());
        assert_eq!(check.tell(&hall), Some(Readiness::Ready), "the one that failed is out");
        hall.cued = None;
        assert_eq!(check.tell(&hall), Some(Readiness::NoCue));
    }
}
