//! Folds repeated commands into one line: the first is written at once, the others when their time is over, with how many
//! there were and the newest of them. Endless repetition fills no disk, and hides no command of others.

use std::time::Duration;

use super::record::Action;
use crate::time::MonoTime;

/// For how long the same is a repeat in the journal.
const WINDOW: Duration = Duration::from_secs(10);
/// Kinds of asks that are folded at a time; of more the oldest is written out.
const KINDS: usize = 64;
/// Kinds that are told apart of one person; of more it is the word alone that tells them apart.
const KINDS_OF_ONE: usize = 16;

/// What was asked of late.
#[derive(Debug)]
pub(crate) struct Folds {
    window: Duration,
    folds: Vec<Fold>,
}

/// What is to be written, and when it was asked; of repeats the last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FoldedAction {
    /// When.
    pub(crate) at: MonoTime,
    /// What.
    pub(crate) action: Action,
}

/// Asks of one kind.
#[derive(Debug)]
struct Fold {
    kind: FoldKind,
    since: MonoTime,
    /// The repeats so far, as one.
    repeats: Option<FoldedAction>,
}

/// What is a repeat of what: asked by the same person with the same word, done or refused alike, and where it was done, of the
/// same things.
#[derive(Debug, PartialEq, Eq)]
struct FoldKind {
    who: String,
    word: &'static str,
    done: bool,
    of: String,
}

impl FoldKind {
    fn new(action: &Action, word: &'static str) -> Self {
        let of = match (action.is_done(), word) {
            (false, _) => String::new(),
            // Of a fader that moves it is the last value that counts.
            (true, "levels" | "trim" | "seek") => action.what.replace(|c: char| c.is_ascii_digit(), ""),
            (true, _) => action.what.clone(),
        };
        Self { who: action.who.clone(), word, done: action.is_done(), of }
    }
}

impl Default for Folds {
    fn default() -> Self {
        Self::within(WINDOW)
    }
}

impl Folds {
    /// Some for which the same is a repeat for so long.
    pub(crate) const fn within(window: Duration) -> Self {
        Self { window, folds: Vec::new() }
    }

    /// Takes what was asked with that word; gives what is to be written now.
    #[must_use]
    pub(crate) fn take(&mut self, action: Action, word: &'static str, now: MonoTime) -> Vec<FoldedAction> {
        let mut written = self.due(now);
        let folds = &mut self.folds;
        let mut kind = FoldKind::new(&action, word);
        let of_one = folds.iter().filter(|fold| fold.kind.who == kind.who).count();
        if of_one >= KINDS_OF_ONE && folds.iter().all(|fold| fold.kind != kind) {
            kind.of = String::new();
        }
        if let Some(fold) = folds.iter_mut().find(|fold| fold.kind == kind) {
            let times = action.times + fold.repeats.as_ref().map_or(0, |repeats| repeats.action.times);
            fold.repeats = Some(FoldedAction { at: now, action: Action { times, ..action } });
            return written;
        }
        if folds.len() == KINDS {
            written.extend(folds.remove(0).repeats);
        }
        folds.push(Fold { kind, since: now, repeats: None });
        written.push(FoldedAction { at: now, action });
        written
    }

    /// The repeats whose time is over.
    #[must_use]
    pub(crate) fn due(&mut self, now: MonoTime) -> Vec<FoldedAction> {
        let over = |fold: &mut Fold| now.since(fold.since) >= self.window;
        self.folds.extract_if(.., over).filter_map(|fold| fold.repeats).collect()
    }

    /// All that is left.
    #[must_use]
    pub(crate) fn rest(&mut self) -> Vec<FoldedAction> {
        self.folds.drain(..).filter_map(|fold| fold.repeats).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> MonoTime {
        MonoTime::from_nanos(0) + Duration::from_secs(seconds)
    }

    fn action(who: &str, what: &str, result: &str) -> Action {
        let [at, who, what, result, state] = ["", who, what, result, ""].map(str::to_owned);
        Action { at, who, what, result, state, times: 1 }
    }

    #[test]
    fn a_flood_is_two_lines_and_hides_nobody_else() {
        let mut folds = Folds::default();
        let mut written = Vec::new();
        for n in 0..1000 {
            written.extend(folds.take(
                action("eve", &format!("levels row {n}"), "no such row"),
                "levels",
                at(1),
            ));
        }
        written.extend(folds.take(action("eve", "levels motion 60 %", "done"), "levels", at(2)));
        written.extend(folds.take(action("ann", "levels row 7", "no such row"), "levels", at(3)));
        assert!(folds.due(at(10)).is_empty());
        written.extend(folds.due(at(11)));
        let lines: Vec<_> = written
            .iter()
            .map(|FoldedAction { action: one, .. }| (one.who.as_str(), one.what.as_str(), one.times))
            .collect();
        assert_eq!(
            lines,
            [
                ("eve", "levels row 0", 1),
                ("eve", "levels motion 60 %", 1),
                ("ann", "levels row 7", 1),
                ("eve", "levels row 999", 999),
            ]
        );
        let later = folds.take(action("eve", "levels row 1", "no such row"), "levels", at(12));
        assert_eq!(later.len(), 1, "its time is over");
    }

    #[test]
    fn what_was_done_to_each_seat_is_told_and_of_a_fader_the_last() {
        let mut folds = Folds::default();
        let mut written = Vec::new();
        for (word, what) in [
            ("disable", "disable A1"),
            ("disable", "disable A2"),
            ("disable", "disable A3"),
            ("disable", "disable A2"),
        ] {
            written.extend(folds.take(action("ann", what, "done"), word, at(0)));
        }
        for percent in [90, 80, 70] {
            let what = format!("levels motion {percent} %");
            written.extend(folds.take(action("ann", &what, "done"), "levels", at(0)));
        }
        written.extend(folds.rest());
        let lines: Vec<_> = written.iter().map(|one| (one.action.what.as_str(), one.action.times)).collect();
        let each = [("disable A1", 1), ("disable A2", 1), ("disable A3", 1), ("levels motion 90 %", 1)];
        assert_eq!(lines, [&each[..], &[("disable A2", 1), ("levels motion 70 %", 2)]].concat());
        for n in 0..1000 {
            let lines = folds.take(action("eve", &format!("enable A{n}"), "done"), "enable", at(0)).len();
            assert_eq!(lines, usize::from(n <= KINDS_OF_ONE), "{n}");
        }
    }

    #[test]
    fn nothing_is_left_behind() {
        let mut folds = Folds::default();
        for n in 0..2 * KINDS {
            for _ in 0..2 {
                let _ = folds.take(action(&n.to_string(), "stop", "done"), "stop", at(0));
            }
        }
        assert_eq!(folds.rest().len(), KINDS);
        assert!(folds.rest().is_empty());
    }
}
