//! A network that loses and repeats on purpose, the same way for the same seed.

use super::LinkFaults;

/// What becomes of one datagram and its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
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
pub(super) struct Link {
    loss: f64,
    duplicate: f64,
    state: u64,
}

impl Link {
    /// The link of the controller with this index.
    pub(super) fn new(faults: &LinkFaults, seed: u64, index: usize) -> Self {
        // Each controller gets its own stream: a distance of one step in the seed is far apart after one mix.
        let state = mix(seed ^ mix(index as u64));
        Self { loss: faults.loss, duplicate: faults.duplicate, state }
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
    pub(super) fn fate(&mut self) -> Fate {
        let (lost, half, twice) = (self.chance(), self.chance(), self.chance());
        if lost < self.loss {
            if half < 0.5 { Fate::LostOnTheWay } else { Fate::AnswerLost }
        } else if twice < self.duplicate {
            Fate::AnsweredTwice
        } else {
            Fate::Answered
        }
    }

    /// A number from 0 to below 1.
    #[expect(clippy::cast_precision_loss, reason = "53 bits are what an f64 holds")]
    fn chance(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.state) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The mixing step of SplitMix64: every bit of the result hangs on every bit of the input.
const fn mix(mut z: u64) -> u64 {
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fates(loss: f64, duplicate: f64, seed: u64) -> Vec<Fate> {
        let faults = LinkFaults { loss, duplicate, ..LinkFaults::default() };
        let mut link = Link::new(&faults, seed, 0);
        (0..10_000).map(|_| link.fate()).collect()
    }

    fn count(fates: &[Fate], fate: Fate) -> usize {
        fates.iter().filter(|&&f| f == fate).count()
    }

    #[test]
    fn a_faultless_link_answers_all_once_and_a_dead_one_none() {
        assert_eq!(count(&fates(0.0, 0.0, 1), Fate::Answered), 10_000);
        let dead = fates(1.0, 1.0, 1);
        assert_eq!(count(&dead, Fate::LostOnTheWay) + count(&dead, Fate::AnswerLost), 10_000);
    }

    #[test]
    fn faults_come_as_often_as_asked_for() {
        let fates = fates(0.2, 0.1, 7);
        assert!((900..1_100).contains(&count(&fates, Fate::LostOnTheWay)));
        assert!((900..1_100).contains(&count(&fates, Fate::AnswerLost)));
        assert!((700..900).contains(&count(&fates, Fate::AnsweredTwice)));
    }

    #[test]
    fn the_same_seed_gives_the_same_faults_and_another_gives_others() {
        assert_eq!(fates(0.5, 0.5, 3), fates(0.5, 0.5, 3));
        assert_ne!(fates(0.5, 0.5, 3), fates(0.5, 0.5, 4));
    }
}
