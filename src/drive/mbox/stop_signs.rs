//! What the looks at a controller say of an emergency stop: that one is in effect any of its answers may say, that it is over only
//! whole looks.

use crate::observe::StopSign;

/// So many looks in a row without a sign of an emergency stop say that it is over: one answer may be late or repeated.
const CALM_LOOKS: u8 = 2;

/// What was seen of it so far.
#[derive(Debug, Clone, Default)]
pub(super) struct StopSigns {
    /// Looks in a row without a sign of an emergency stop.
    calm: u8,
    /// Looks in a row that saw it last although its inputs, which had asked for it, do no more; none before they had.
    held: Option<u8>,
    /// There was a sign of it since this look began.
    seen: bool,
    /// What this look says was taken.
    taken: bool,
}

impl StopSigns {
    /// Another look begins.
    pub(super) const fn begin(&mut self) {
        (self.seen, self.taken) = (false, false);
    }

    /// A sign of an emergency stop: what was asked before says nothing of its end.
    pub(super) const fn mind(&mut self) {
        (self.seen, self.calm) = (true, 0);
    }

    /// What a whole look says; said once. `inputs` are the active ones, of which any one of `asking` means a stop, and
    /// so do those of `mask` together; none where they were not told.
    pub(super) fn take(&mut self, inputs: Option<u16>, asking: u16, mask: Option<u16>) -> Option<StopSign> {
        if std::mem::replace(&mut self.taken, true) {
            return None;
        }
        let is_calm = inputs.map_or(asking == 0, |inputs| inputs & asking == 0);
        self.calm = if self.seen || !is_calm { 0 } else { self.calm.saturating_add(1) };
        if self.calm == 0 {
            return Some(self.why(is_calm, inputs.zip(mask)));
        }
        self.held = None;
        Some(if self.calm >= CALM_LOOKS { StopSign::Over } else { StopSign::Unsure })
    }

    /// Whether the inputs ask for the emergency stop that is in effect. That they do not is believed only once they had: else
    /// it may come from elsewhere.
    fn why(&mut self, is_calm: bool, told: Option<(u16, u16)>) -> StopSign {
        let Some((inputs, mask @ 1..)) = told else { return StopSign::Unsure };
        if !is_calm || inputs & mask == mask {
            self.held = Some(0);
            return StopSign::Asked;
        }
        self.held = self.held.map(|looks| looks.saturating_add(1));
        if self.held.is_some_and(|looks| looks >= CALM_LOOKS) { StopSign::Held } else { StopSign::Unsure }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use StopSign::{Asked, Held, Over, Unsure};

    /// One look after the other: whether it had a sign of a stop, and the inputs, of which all of `mask` together ask for one.
    fn looks(signs: &mut StopSigns, asking: u16, looks: &[(bool, u16)]) -> Vec<StopSign> {
        let mut look = |(seen, inputs): &(bool, u16)| {
            signs.begin();
            if *seen {
                signs.mind();
            }
            let said = signs.take(Some(*inputs), asking, Some(1)).expect("it is the first time");
            assert_eq!(signs.take(Some(*inputs), asking, Some(1)), None, "it is said once");
            said
        };
        looks.iter().map(&mut look).collect()
    }

    #[test]
    fn an_emergency_stop_is_over_after_two_whole_looks_that_were_asked_since_its_last_sign() {
        let mut signs = StopSigns::default();
        assert_eq!(looks(&mut signs, 0, &[(true, 0), (false, 0), (false, 0)]), [Unsure, Unsure, Over]);
        signs.mind();
        assert_eq!(looks(&mut signs, 0, &[(false, 0), (false, 0)]), [Unsure, Over]);
        // A sign between two looks: what was asked before it does not count.
        assert_eq!(looks(&mut signs, 0, &[(true, 0), (false, 0)]), [Unsure, Unsure]);
        signs.mind();
        assert_eq!(looks(&mut signs, 0, &[(false, 0), (false, 0)]), [Unsure, Over]);
    }

    #[test]
    fn one_whose_inputs_asked_for_it_and_do_no_more_holds_it_until_a_reset() {
        let mut signs = StopSigns::default();
        let all = |inputs: [u16; 3]| inputs.map(|inputs| (true, inputs));
        assert_eq!(looks(&mut signs, 0, &all([0, 0, 0])), [Unsure; 3], "nobody knows what asks for it");
        assert_eq!(looks(&mut signs, 0, &all([1, 0, 0])), [Asked, Unsure, Held]);
        assert_eq!(looks(&mut signs, 0, &all([1, 0b10, 0b11])), [Asked, Unsure, Asked]);
    }

    #[test]
    fn inputs_that_mean_an_emergency_stop_are_a_sign_of_it_whatever_the_replies_say() {
        let mut signs = StopSigns::default();
        let said = looks(&mut signs, 1, &[0, 0, 1, 0].map(|inputs| (false, inputs)));
        assert_eq!(said, [Unsure, Over, Asked, Unsure]);
        // Inputs that were not told do not say that nothing asks for it.
        signs.begin();
        assert_eq!(signs.take(None, 1, None), Some(Unsure));
    }
}
