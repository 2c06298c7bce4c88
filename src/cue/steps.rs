//! Values that hold until they change: vibration, effects.

use crate::time::ShowTime;

/// A value and the show time from which it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackStep<T> {
    /// From when on.
    pub(crate) at: ShowTime,
    /// What holds from then on.
    pub value: T,
}

/// A track of values, each holding until the next; only changes are kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps<T>(Vec<TrackStep<T>>);

impl<T> Default for Steps<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy + PartialEq + Default> Steps<T> {
    /// Notes the value from `at` on, which is not before the last one noted; at the same time the newer one counts.
    pub(super) fn push(&mut self, at: ShowTime, value: T) {
        if self.0.last().is_some_and(|last| last.at == at) {
            self.0.pop();
        }
        if self.0.last().is_none_or(|last| last.value != value) {
            self.0.push(TrackStep { at, value });
        }
    }

    pub(super) fn shrink(&mut self) {
        self.0.shrink_to_fit();
    }

    /// The same changes with other values.
    #[must_use]
    pub(super) fn with_values(&self, values: &[T]) -> Self {
        let mut steps = Self::default();
        self.0.iter().zip(values).for_each(|(step, value)| steps.push(step.at, *value));
        steps
    }

    /// The changes in order of time.
    #[must_use]
    pub fn as_slice(&self) -> &[TrackStep<T>] {
        &self.0
    }

    /// True if it changes at that very time.
    pub(super) fn changes_at(&self, at: ShowTime) -> bool {
        self.0.binary_search_by_key(&at, |step| step.at).is_ok()
    }

    /// The value that holds at `at`, the type's default before the first. `hint` is where the last answer was found:
    /// asked onwards in time this takes constant time, after a seek the logarithm of the number of changes.
    #[must_use]
    pub(crate) fn at(&self, at: ShowTime, hint: &mut usize) -> T {
        let steps = self.0.as_slice();
        let next = |i: usize| steps.get(i).is_none_or(|step| at < step.at);
        let started = |i: usize| i == 0 || steps.get(i - 1).is_some_and(|step| step.at <= at);
        // `hint` counts the changes that lie at or before `at`.
        if !(started(*hint) && next(*hint)) {
            *hint = if started(*hint + 1) && next(*hint + 1) {
                *hint + 1
            } else {
                steps.partition_point(|step| step.at <= at)
            };
        }
        hint.checked_sub(1).and_then(|i| steps.get(i)).map_or_else(T::default, |step| step.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> Steps<u32> {
        let mut steps = Steps::default();
        for (ms, value) in [(10, 1), (20, 1), (30, 2), (40, 0), (40, 3)] {
            steps.push(ShowTime::from_millis(ms), value);
        }
        steps
    }

    #[test]
    fn only_changes_are_kept_and_the_newest_of_one_time() {
        let kept: Vec<_> =
            steps().as_slice().iter().map(|s| (s.at.as_nanos() / 1_000_000, s.value)).collect();
        assert_eq!(kept, [(10, 1), (30, 2), (40, 3)]);
    }

    #[test]
    fn a_value_holds_until_the_next_from_any_hint() {
        for start in [0, 1, 2, 3, 4, usize::MAX - 1] {
            for (ms, value) in [(0, 0), (9, 0), (10, 1), (29, 1), (30, 2), (40, 3), (4000, 3), (15, 1)] {
                assert_eq!(
                    steps().at(ShowTime::from_millis(ms), &mut { start }),
                    value,
                    "{ms} ms from {start}"
                );
            }
        }
    }

    #[test]
    fn an_empty_track_is_off() {
        assert_eq!(Steps::<u32>::default().at(ShowTime::ZERO, &mut 0), 0);
    }
}
