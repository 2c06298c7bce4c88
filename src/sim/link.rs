//! A network that loses and repeats on purpose, the same way for the same seed.

use super::LinkFaults;
use super::chance::Chance;

/// What becomes of one datagram and its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DatagramFate {
    /// The datagram does not arrive.
    LostOnTheWay,
    /// It arrives; its answer does not.
    AnswerLost,
    /// Its answer comes once.
    Answered,
    /// Its answer comes twice.
    AnsweredTwice,
}

/// Decides the fate of each datagram of one controller.
#[derive(Debug, Clone)]
pub(super) struct FaultyLink {
    loss: f64,
    duplicate: f64,
    chance: Chance,
}

impl FaultyLink {
    /// The link of the controller with this index.
    pub(super) fn new(faults: &LinkFaults, seed: u64, index: usize) -> Self {
        Self { loss: faults.loss, duplicate: faults.duplicate, chance: Chance::new(seed, index) }
    }

    /// Changes the chance of a loss.
    pub(super) const fn set_loss(&mut self, chance: f64) {
        self.loss = chance;
    }

    /// Changes the chance of a repetition.
    pub(super) const fn set_duplicate(&mut self, chance: f64) {
        self.duplicate = chance;
    }

    /// The fate of the next datagram.
    pub(super) fn fate(&mut self) -> DatagramFate {
        let (lost, half, twice) = (self.chance.draw(), self.chance.draw(), self.chance.draw());
        if lost < self.loss {
            if half < 0.5 { DatagramFate::LostOnTheWay } else { DatagramFate::AnswerLost }
        } else if twice < self.duplicate {
            DatagramFate::AnsweredTwice
        } else {
            DatagramFate::Answered
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fates(loss: f64, duplicate: f64, seed: u64) -> Vec<DatagramFate> {
        let faults = LinkFaults { loss, duplicate, ..LinkFaults::default() };
        let mut link = FaultyLink::new(&faults, seed, 0);
        (0..10_000).map(|_| link.fate()).collect()
    }

    fn count(fates: &[DatagramFate], fate: DatagramFate) -> usize {
        fates.iter().filter(|&&f| f == fate).count()
    }

    #[test]
    fn a_faultless_link_answers_all_once_and_a_dead_one_none() {
        assert_eq!(count(&fates(0.0, 0.0, 1), DatagramFate::Answered), 10_000);
        let dead = fates(1.0, 1.0, 1);
        assert_eq!(count(&dead, DatagramFate::LostOnTheWay) + count(&dead, DatagramFate::AnswerLost), 10_000);
    }

    #[test]
    fn faults_come_as_often_as_asked_for() {
        let fates = fates(0.2, 0.1, 7);
        assert!((900..1_100).contains(&count(&fates, DatagramFate::LostOnTheWay)));
        assert!((900..1_100).contains(&count(&fates, DatagramFate::AnswerLost)));
        assert!((700..900).contains(&count(&fates, DatagramFate::AnsweredTwice)));
    }

    #[test]
    fn the_same_seed_gives_the_same_faults_and_another_gives_others() {
        assert_eq!(fates(0.5, 0.5, 3), fates(0.5, 0.5, 3));
        assert_ne!(fates(0.5, 0.5, 3), fates(0.5, 0.5, 4));
    }
}
