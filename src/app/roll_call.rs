//! Controllers that answer nothing before a play begins, and whether it begins without them.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::config::Controller;

/// Who answered before a play begins. Where nobody did, nothing is played, whatever is set here.
#[derive(Debug, Default)]
pub(crate) struct RollCall {
    /// All have to answer.
    requires_all: bool,
    /// Somebody is there to be asked.
    asks: AtomicBool,
    agreed: AtomicBool,
    silent: OnceLock<Vec<String>>,
}

impl RollCall {
    /// One of a play that begins only if all answer, where `requires_all` says so.
    pub(crate) fn new(requires_all: bool) -> Self {
        Self { requires_all, ..Self::default() }
    }

    /// Has the play wait for somebody's word where some do not answer.
    pub(crate) fn ask(&self) {
        self.asks.store(true, Ordering::Relaxed);
    }

    /// Somebody wants the play to begin without those that do not answer. Counts only once they are known.
    pub(crate) fn agree(&self) {
        if self.silent.get().is_some() {
            self.agreed.store(true, Ordering::Relaxed);
        }
    }

    /// True while the play waits for that word.
    pub(crate) fn is_open(&self) -> bool {
        let [asks, agreed] = [&self.asks, &self.agreed].map(|flag| flag.load(Ordering::Relaxed));
        self.silent.get().is_some() && asks && !agreed
    }

    /// True if the play needs every controller.
    pub(super) const fn requires_all(&self) -> bool {
        self.requires_all
    }

    /// Those that do not answer, and are left out.
    pub(crate) fn silent(&self) -> &[String] {
        self.silent.get().map_or(&[], Vec::as_slice)
    }

    /// Notes them.
    pub(super) fn note(&self, silent: Vec<String>) {
        let _ = self.silent.set(silent); // once for a play
    }
}

/// The lanes of those controllers, and of others under the same seats: none under a rigid seat moves without the others.
pub(super) fn lanes_with(controllers: &[Controller], is_meant: impl Fn(usize) -> bool) -> Vec<usize> {
    let groups: Vec<_> =
        (0..controllers.len()).filter(|&lane| is_meant(lane)).map(|lane| &controllers[lane].group).collect();
    (0..controllers.len()).filter(|&lane| groups.contains(&&controllers[lane].group)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::from_to_args;

    #[test]
    fn who_shares_a_seat_with_a_controller_that_is_left_out_is_left_out_too() {
        let mut controllers =
            from_to_args(&[1, 2, 3].map(|port| format!("127.0.0.1:{port}")), &[], 1).unwrap().controllers;
        controllers[2].group = controllers[0].group.clone();
        assert_eq!(lanes_with(&controllers, |lane| lane == 0), [0, 2]);
        assert_eq!(lanes_with(&controllers, |lane| lane == 1), [1]);
    }

    #[test]
    fn a_yes_counts_only_once_it_is_known_who_does_not_answer() {
        let roll = RollCall::default();
        roll.ask();
        roll.agree();
        assert!(!roll.is_open());
        roll.note(vec!["A2".to_owned()]);
        assert!(roll.is_open());
        roll.agree();
        assert!(!roll.is_open());
        assert_eq!(roll.silent(), ["A2"]);
    }

    #[test]
    fn without_anybody_to_ask_nothing_is_waited_for() {
        let roll = RollCall::default();
        roll.note(vec!["A2".to_owned()]);
        assert!(!roll.is_open());
    }
}
