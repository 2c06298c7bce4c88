//! How a level changes while a seat follows the cue: gently, and by what the cue leaves of the limits.

// Both chosen: from all to nothing in some 4 s, and no jolt at either end of it.
/// The quickest change of a level, per second.
pub(super) const RATE: f64 = 0.25;
/// How quickly the change itself grows and ends, per second squared: 0.25 s to full speed.
pub(super) const GATHER: f64 = 1.0;
// By a share of next to nothing a change that nears its goal would take for ever to slow down there.
/// The least share with which a change ends.
const LEAST: f64 = 0.05;
/// Levels nearer than this are the same.
const SAME: f64 = 1e-6;

/// A level on its way to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fader {
    level: f64,
    /// Per second.
    rate: f64,
    /// How quickly it comes to stand, per second squared, while it is told to.
    ends_by: Option<f64>,
}

impl Fader {
    pub(super) const fn at(level: f64) -> Self {
        Self { level, rate: 0.0, ends_by: None }
    }

    /// Where it is, 0 to 1.
    pub(super) const fn level(self) -> f64 {
        self.level
    }

    /// Whether it stands.
    pub(super) fn is_still(self) -> bool {
        self.rate == 0.0
    }

    /// Whether it stands at `target`.
    pub(super) fn is_at(self, target: f64) -> bool {
        self.is_still() && (self.level - target).abs() < SAME
    }

    /// Comes to stand, in a quarter of a second at the most, and before `target` if it was on its way there.
    pub(super) fn settle(&mut self, dt: f64, target: f64) {
        // A slow change was slow because the cue left no more: it ends as slowly, unless it was ending already.
        let ends_by = *self.ends_by.get_or_insert(GATHER * self.rate.abs() / RATE);
        let gather = ends_by.max(self.needed(dt, target)) * dt;
        let rate = self.rate - self.rate.clamp(-gather, gather);
        self.level = (self.level + rate * dt).clamp(0.0, 1.0);
        self.rate = rate;
        if rate.abs() < SAME {
            *self = Self::at(self.level);
        }
    }

    /// Moves on for `dt` seconds towards `target`, no quicker than that share of the rates, 0 to 1. One that goes the
    /// other way, or too quickly, slows down first.
    pub(super) fn advance(&mut self, dt: f64, target: f64, share: f64) {
        let (most, needed) = (RATE * share, self.needed(dt, target));
        let gentle = (GATHER * share.max(LEAST)).max(needed);
        // A share that shrinks must neither stop it abruptly nor leave it running: it slows as evenly as if it came to stand, and is
        // as slow as it has to be a quarter of a second later, when the cue leaves no more (`headroom`).
        let gather = if self.rate.abs() > most {
            (*self.ends_by.get_or_insert(GATHER * self.rate.abs() / RATE)).max(needed)
        } else {
            self.ends_by = None;
            gentle
        };
        let change = gather * dt;
        let gap = target - self.level;
        let towards = gap.signum() * self.rate;
        // A share of 0 lets nothing begin, while what is under way is still led to an end: the least share is for ends alone.
        let grown = towards.max(0.0) + GATHER * share * dt;
        let wanted = closing_rate(gap.abs(), gentle, dt).min(most).min(grown);
        self.rate = gap.signum() * wanted.clamp(towards - change, towards + change);
        self.level = (self.level + self.rate * dt).clamp(0.0, 1.0);
        if (target - self.level).abs() < SAME && self.rate.abs() < SAME {
            *self = Self::at(target);
        }
    }

    /// How quickly it has to slow down at the least, per second squared, so that it passes neither its goal nor all or nothing: what
    /// was begun by a greater share is ended as it was begun, also where the cue leaves less by then.
    fn needed(self, dt: f64, target: f64) -> f64 {
        let (gap, rate) = (target - self.level, self.rate.abs());
        // One that has passed its goal by less than a tick ends there; for another the goal has moved away behind it.
        let room = if self.rate * gap > 0.0 || gap.abs() < GATHER * dt * dt {
            gap.abs()
        } else if self.rate > 0.0 {
            1.0 - self.level
        } else {
            self.level
        };
        // From k g dt, slower by g dt each tick, it goes g dt² k(k-1)/2: solved for g.
        (rate * rate / (2.0 * room + rate * dt).max(f64::MIN_POSITIVE)).min(GATHER)
    }
}

/// The greatest rate from which a gap is just closed while slowing down by no more than `gather`, tick by tick.
fn closing_rate(gap: f64, gather: f64, dt: f64) -> f64 {
    let ticks_left = (dt * dt / 4.0 + 2.0 * gap / gather).sqrt() - dt / 2.0;
    // Where less is left than a tick can close, the root makes up to twice of it: it would be passed.
    (gather * ticks_left).min(gap / dt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::asked::Chance;

    /// What the cue leaves, drawn anew each tenth of a second.
    #[test]
    fn however_what_the_cue_leaves_rises_and_falls_a_change_ends_at_its_goal_without_a_jolt() {
        let mut chance = Chance::new(1);
        for (goal, a_second) in
            [0.0_f64, 0.5, 0.8, 1.0].into_iter().flat_map(|goal| [(goal, 100_u32), (goal, 1_000)])
        {
            let (from, dt) = (if goal > 0.5 { 0.0 } else { 1.0 }, 1.0 / f64::from(a_second));
            for _ in 0..16 {
                let (mut fader, mut seen) = (Fader::at(from), 0.0_f64);
                let (mut share, mut settles) = (1.0, false);
                for tick in 0..40 * a_second {
                    let ends = tick >= 30 * a_second;
                    if tick % (a_second / 10) == 0 {
                        let any = chance.between(0.0, 1.0);
                        share = if ends { 1.0 } else { chance.one_of(&[0.0, 0.05, any, any, 1.0]) };
                        settles = !ends && chance.once_in(10);
                    }
                    let before = fader;
                    if settles {
                        fader.settle(dt, goal);
                    } else {
                        fader.advance(dt, goal, share);
                    }
                    // As the seat sees it, also where a level cannot go on.
                    let rate = (fader.level - before.level) / dt;
                    let change = (rate - seen).abs();
                    assert!(change <= 1.2 * GATHER * dt + SAME / dt, "{goal}: {before:?} {fader:?}");
                    let past = (fader.level - goal) * (goal - from).signum();
                    assert!(past <= 2.0 * GATHER * dt * dt + SAME, "{goal}: {fader:?}");
                    seen = rate;
                }
                assert!(fader.is_at(goal), "{goal}: {fader:?}");
            }
        }
    }

    #[test]
    fn a_level_arrives_without_passing_its_rates_or_its_goal() {
        for (from, to, dt) in [(1.0, 0.0, 0.01), (0.0, 1.0, 0.001), (0.6, 0.61, 0.02), (0.5, 0.4999, 0.001)] {
            let mut fader = Fader::at(from);
            let mut ticks = 0;
            while !fader.is_at(to) {
                let before = fader;
                fader.advance(dt, to, 1.0);
                assert!(fader.rate.abs() <= RATE + 1e-9, "{fader:?}");
                let change = (fader.rate - before.rate).abs();
                assert!(change <= GATHER * dt + 1e-6 || fader.is_at(to), "{before:?} {fader:?}");
                assert!((fader.level - from) * (fader.level - to) <= 1e-6, "{fader:?} passes {to}");
                ticks += 1;
                assert!(f64::from(ticks) * dt < 6.0, "{fader:?} never arrives");
            }
            assert_eq!(fader.level(), to);
        }
    }

    #[test]
    fn a_cue_that_leaves_nothing_holds_the_level_where_it_is() {
        let mut fader = Fader::at(1.0);
        (0..1000).for_each(|_| fader.advance(0.01, 0.2, 0.0));
        assert_eq!(fader, Fader::at(1.0));
    }

    #[test]
    fn where_a_cue_leaves_no_more_a_change_stands_a_quarter_of_a_second_later_and_ends_evenly() {
        for (share, left) in [(1.0, 0.0), (1.0, 0.2), (0.3, 0.0), (0.1, 0.0)] {
            let mut fader = Fader::at(1.0);
            (0..50).for_each(|_| fader.advance(0.01, 0.0, share));
            for _ in 0..26 {
                let before = fader.rate;
                fader.advance(0.01, 0.0, left);
                assert!((fader.rate - before).abs() <= 0.01 * GATHER * share + 1e-9, "{share}: {fader:?}");
            }
            assert!(fader.rate.abs() <= RATE * left, "{share} to {left}: {fader:?}");
        }
    }

    #[test]
    fn a_goal_that_moves_away_behind_it_is_turned_to_gently() {
        let mut fader = Fader::at(0.5);
        (0..100).for_each(|_| fader.advance(0.01, 1.0, 1.0));
        let mut last = fader;
        for _ in 0..1000 {
            fader.advance(0.01, 0.0, 1.0);
            assert!((fader.rate - last.rate).abs() <= GATHER * 0.01 + 1e-6, "{last:?} {fader:?}");
            last = fader;
        }
        assert!(fader.is_at(0.0), "{fader:?}");
    }
}
