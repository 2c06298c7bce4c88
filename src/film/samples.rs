//! When each sample was captured, by when blocks were read. A read can only be late, now more, now less: the quickest of each half
//! second say when samples were there, and a line below them how fast the card's clock runs.

use crate::time::MonoTime;

/// The quickest read of so long counts, seconds, and so many of them are kept: 10 s.
const BUCKET_S: f64 = 0.5;
const BUCKETS: usize = 20;
/// Half seconds before a slope is believed: a shorter line leans with whatever load there was.
const SLOPED: usize = 6;
/// A sound card's clock is off by no more; what says otherwise is load.
const DRIFT: f64 = 5e-4;
/// Where even the quickest reads of two half seconds are later than this, seconds, and as late as each other, samples were lost. A
/// reader that was held up comes back to the line.
const LOST_S: f64 = 0.005;
const ALIKE_S: f64 = 0.001;
/// So many reads in a row, over so long, seconds, that are late and as late as each other say the same at once: one who catches up
/// is less late each time. It is sooner than a tracker believes in a jump.
const ROW: u32 = 4;
const ROW_S: f64 = 0.1;
/// Of samples whose reads are so much later than the line, seconds, nobody knows yet whether that is so, or some were lost.
const UNSURE_S: f64 = 0.05;

/// The quickest read of half a second.
#[derive(Debug, Clone, Copy)]
struct Quickest {
    /// When it was, and by how much it was after its samples, seconds.
    at_s: f64,
    late_s: f64,
}

/// Reads in a row that are late by about the same.
#[derive(Debug, Clone, Copy)]
struct LateRow {
    since_s: f64,
    reads: u32,
    least_s: f64,
    most_s: f64,
}

/// The clock of the samples of one line.
#[derive(Debug, Clone)]
pub(super) struct SampleClock {
    samples_per_s: f64,
    /// The first read: all times count from there.
    first: Option<MonoTime>,
    quickest: [Quickest; BUCKETS],
    /// Half seconds so far; the newest is not over.
    count: usize,
    begun_s: f64,
    row: Option<LateRow>,
    /// Whether samples of now have no time.
    is_unsure: bool,
    /// How late reads are at the first instant, and how much later in each second.
    late_s: f64,
    drift: f64,
}

impl SampleClock {
    pub(super) fn new(samples_per_s: u32) -> Self {
        let none = Quickest { at_s: 0.0, late_s: f64::INFINITY };
        Self {
            samples_per_s: f64::from(samples_per_s),
            first: None,
            quickest: [none; BUCKETS],
            count: 0,
            begun_s: 0.0,
            row: None,
            is_unsure: false,
            late_s: 0.0,
            drift: 0.0,
        }
    }

    /// Notes that so many samples were there at an instant.
    pub(super) fn note(&mut self, count: f64, at: MonoTime) {
        let first = *self.first.get_or_insert(at);
        let at_s = at.since(first).as_secs_f64();
        let read = Quickest { at_s, late_s: at_s - count / self.samples_per_s };
        self.mind_row(&read);
        if self.count == 0 || at_s - self.begun_s >= BUCKET_S {
            self.mind_loss();
            (self.count, self.begun_s) = (self.count + 1, at_s);
            self.quickest[(self.count - 1) % BUCKETS] = read;
        }
        let newest = &mut self.quickest[(self.count - 1) % BUCKETS];
        if read.late_s <= newest.late_s {
            *newest = read;
        }
        self.draw();
    }

    /// How far a read is above the line, seconds.
    fn over(&self, one: &Quickest) -> f64 {
        one.late_s - self.late_s - self.drift * one.at_s
    }

    fn kept(&self) -> &[Quickest] {
        &self.quickest[..self.count.min(BUCKETS)]
    }

    /// The line with the slope of the quickest reads that none of them is below.
    fn draw(&mut self) {
        // What was held up says nothing of the slope.
        let sound = || self.kept().iter().filter(|one| self.over(one) <= LOST_S);
        #[expect(clippy::cast_precision_loss, reason = "20 at the most")]
        let n = sound().count().max(1) as f64;
        let mean = |of: fn(&Quickest) -> f64| sound().map(of).sum::<f64>() / n;
        let (at_s, late_s) = (mean(|one| one.at_s), mean(|one| one.late_s));
        let (above, below) = sound().fold((0.0, 0.0), |(above, below), one| {
            let apart = one.at_s - at_s;
            (above + apart * (one.late_s - late_s), below + apart * apart)
        });
        let is_long = sound().count() >= SLOPED;
        let drift = if is_long { (above / below).clamp(-DRIFT, DRIFT) } else { 0.0 };
        // On the quickest of all: a read is never before its samples, so none may lie below the line.
        let least = self.kept().iter().map(|one| one.late_s - drift * one.at_s).fold(f64::INFINITY, f64::min);
        (self.drift, self.late_s) = (drift, least);
    }

    /// Minds whether reads are late as after a loss; where they are, what was before is forgotten.
    fn mind_row(&mut self, read: &Quickest) {
        let over_s = self.over(read);
        self.is_unsure = self.count > 0 && over_s > UNSURE_S;
        if self.count == 0 || over_s <= LOST_S {
            self.row = None;
            return;
        }
        let Quickest { at_s, late_s } = *read;
        let alone = LateRow { since_s: at_s, reads: 0, least_s: late_s, most_s: late_s };
        let row = self.row.unwrap_or(alone);
        let (least_s, most_s) = (row.least_s.min(late_s), row.most_s.max(late_s));
        let row = if most_s - least_s > ALIKE_S { alone } else { LateRow { least_s, most_s, ..row } };
        let row = LateRow { reads: row.reads + 1, ..row };
        let is_lost = row.reads >= ROW && at_s - row.since_s >= ROW_S;
        self.row = Some(row).filter(|_| !is_lost);
        if is_lost {
            (self.count, self.is_unsure) = (0, false);
        }
    }

    /// Samples that were lost make all later reads later: what was before is forgotten.
    fn mind_loss(&mut self) {
        if self.count < 2 {
            return;
        }
        let newest = [1, 2].map(|back| self.quickest[(self.count - back) % BUCKETS]);
        let alike = (newest[0].late_s - newest[1].late_s).abs() <= ALIKE_S;
        if alike && newest.iter().all(|one| self.over(one) > LOST_S) {
            self.quickest[..2].copy_from_slice(&newest);
            self.count = 2;
        }
    }

    /// When a sample was captured; none before the first read, nor where samples may have been lost.
    pub(super) fn time_of(&self, sample: f64) -> Option<MonoTime> {
        if self.is_unsure {
            return None;
        }
        // late(t) = late + drift t, and t = sample / rate + late(t).
        let at_s = (sample / self.samples_per_s + self.late_s) / (1.0 - self.drift);
        let from = self.first?;
        let span = std::time::Duration::try_from_secs_f64(at_s.abs()).ok()?;
        Some(if at_s < 0.0 { from.before(span) } else { from + span })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const ORIGIN: MonoTime = MonoTime::from_nanos(5_000_000_000);

    /// The greatest error from `from_s` on, ms, of a card that is off by `drift`, whose blocks are read as late as `late_ms` says.
    fn worst_ms(drift: f64, from_s: f64, late_ms: impl Fn(u32) -> f64) -> f64 {
        let mut clock = SampleClock::new(48_000);
        let mut worst = 0.0_f64;
        for block in 1..=3_000_u32 {
            let count = f64::from(block) * 480.0;
            let captured_s = count / (48_000.0 * (1.0 + drift));
            let read = ORIGIN + Duration::from_secs_f64(captured_s + late_ms(block) * 1e-3);
            clock.note(count, read);
            let Some(told) = clock.time_of(count) else { continue };
            let true_at = ORIGIN + Duration::from_secs_f64(captured_s);
            let off = told.since(true_at).as_secs_f64() - true_at.since(told).as_secs_f64();
            if captured_s > from_s {
                worst = worst.max(off.abs() * 1e3);
            }
        }
        worst
    }

    #[test]
    fn reads_that_are_late_now_and_then_and_a_card_that_drifts_leave_a_clock_that_is_right() {
        // The dice of a poor man, which are the same each time.
        let dice = |block: u32| f64::from(block.wrapping_mul(2_654_435_761) >> 16 & 0xff) / 255.0;
        let busy = |block: u32| if dice(block) < 0.3 { 0.0 } else { 12.0 * dice(block.wrapping_add(7)) };
        for drift in [0.0, 2e-5, -1e-4, 3e-4] {
            let worst = worst_ms(drift, 5.0, busy);
            assert!(worst < 0.25, "{drift}: {worst} ms");
        }
        assert!(worst_ms(0.0, 1.0, busy) < 0.2, "from the first second on");
    }

    #[test]
    fn samples_that_are_lost_cost_a_tenth_of_a_second_in_which_nothing_is_told_and_no_wrong_time() {
        for lost_ms in [100.0, 300.0, 1_000.0] {
            let (mut clock, mut untold) = (SampleClock::new(48_000), 0);
            for block in 1..=1_000_u32 {
                let count = f64::from(block) * 480.0;
                let captured_s = count / 48_000.0 + if block > 500 { lost_ms * 1e-3 } else { 0.0 };
                clock.note(
                    count,
                    ORIGIN + Duration::from_secs_f64(captured_s + 0.0003 * f64::from(block % 3)),
                );
                let Some(told) = clock.time_of(count) else {
                    untold += 1;
                    continue;
                };
                let true_at = ORIGIN + Duration::from_secs_f64(captured_s);
                let off = told.since(true_at) + true_at.since(told);
                assert!(off < Duration::from_millis(1), "{lost_ms} ms lost, block {block}: {off:?}");
            }
            assert!((5..=15).contains(&untold), "{lost_ms} ms lost: {untold} blocks of 10 ms");
        }
    }

    #[test]
    fn a_second_in_which_nobody_reads_changes_nothing_and_samples_that_are_lost_are_noticed() {
        let held_up =
            |block: u32| if (500..600).contains(&block) { f64::from(600 - block) * 10.0 } else { 0.1 };
        assert!(worst_ms(0.0, 0.0, held_up) < 0.2);
        let lost = |block: u32| if block < 1_000 { 0.0 } else { 40.0 };
        // Blocks from there on are 40 ms later than their count says: that is when they were captured.
        let off = worst_ms(0.0, 12.0, lost);
        assert!((off - 40.0).abs() < 0.2, "{off} ms");
    }
}
