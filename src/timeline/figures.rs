//! Statistics of a cue's effects and rows, for people to judge it by. Control thread.

use std::time::Duration;

use super::Timeline;
use crate::channel::{self, Sample};
use crate::cue::{Effects, Steps, TrackStep};
use crate::time::ShowTime;

/// The most that something reaches, and where.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Figure {
    /// In mm, mm/s, mm/s² or mm/s³.
    pub value: f64,
    /// Show time of the worst.
    pub(crate) at: ShowTime,
    /// The line of the row at or before it; the number of its message where the file has no lines.
    pub(crate) line: u64,
}

/// How much an effect or an output is used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EffectUse {
    /// The effect's name; `Y01` to `Y12` for a bit of a raw output word.
    pub(crate) name: String,
    /// From when until when it is on, each time, in order.
    pub(crate) spans: Vec<(ShowTime, ShowTime)>,
}

impl EffectUse {
    /// How long it is on in all.
    #[must_use]
    pub(crate) fn on(&self) -> Duration {
        self.spans
            .iter()
            .map(|(from, until)| Duration::from_nanos(until.as_nanos().abs_diff(from.as_nanos())))
            .sum()
    }
}

/// How much an output of the table is used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LevelUse {
    /// How often, and how long, under the name of its column.
    pub(crate) usage: EffectUse,
    /// Its highest level.
    pub(crate) most: f64,
}

impl Timeline {
    /// How much each output of the table is used; nothing of one that is always off.
    #[must_use]
    pub(crate) fn level_uses(&self) -> Vec<LevelUse> {
        let used = channel::switches().filter_map(|(track, part, name)| {
            let (_, most) = self.greatest_level(track, part)?;
            let is_on = |sample: Sample| u32::from(sample.0[part] > 0.0);
            let usage = usage(name.to_owned(), self.cue().tracks().of(track), self.duration(), is_on);
            Some(LevelUse { usage, most })
        });
        used.collect()
    }

    /// How much each effect that the cue names, or each bit of its raw output words, is used.
    #[must_use]
    pub(crate) fn effect_uses(&self) -> Vec<EffectUse> {
        let end = self.duration();
        match self.cue().effects() {
            Effects::Named { names, steps } => names
                .iter()
                .enumerate()
                .map(|(bit, name)| usage(name.clone(), steps, end, |on| on >> bit & 1))
                .collect(),
            Effects::Words(steps) => (0..12)
                .map(|bit| usage(format!("Y{:02}", bit + 1), steps, end, |word| u32::from(word) >> bit & 1))
                .filter(|usage| !usage.spans.is_empty())
                .collect(),
        }
    }

    /// The median time between rows.
    #[must_use]
    pub(crate) fn row_interval(&self) -> Duration {
        let times = self.cue().times();
        let mut spans: Vec<u64> =
            times.windows(2).map(|pair| pair[1].as_nanos().abs_diff(pair[0].as_nanos())).collect();
        let middle = spans.len() / 2;
        if spans.is_empty() {
            return Duration::ZERO;
        }
        Duration::from_nanos(*spans.select_nth_unstable(middle).1)
    }
}

fn usage<T: Copy + PartialEq + Default>(
    name: String,
    steps: &Steps<T>,
    end: ShowTime,
    is_on: impl Fn(T) -> u32,
) -> EffectUse {
    let mut spans = Vec::new();
    let mut since: Option<ShowTime> = None;
    let last = TrackStep { at: end, value: T::default() };
    for step in steps.as_slice().iter().chain([&last]) {
        match (since, is_on(step.value) == 1) {
            (None, true) => since = Some(step.at),
            (Some(_), false) => spans.extend(since.take().map(|from| (from, step.at))),
            _ => {}
        }
    }
    EffectUse { name, spans }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cue::{self, Source};

    fn timeline(text: &str) -> Timeline {
        Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    #[test]
    fn an_effect_is_counted_each_time_it_goes_on() {
        let cue = timeline("time_s,a1,fx_air,fx_wind\n0,0,1,0\n1,0,0,0\n2,0,1,0\n3,0,1,0\n5,0,1,0\n");
        let uses = cue.effect_uses();
        let at = ShowTime::from_secs_f64;
        assert_eq!(uses[0].spans, [(at(0.0), at(1.0)), (at(2.0), at(5.0))]);
        assert_eq!((uses[0].on(), uses[1].on()), (Duration::from_secs(4), Duration::ZERO));
    }

    #[test]
    fn an_output_is_counted_while_its_level_is_above_0() {
        let uses = timeline("time_s,a1,dac1,dac2\n0,0,0,0\n1,0,0.5,0\n2,0,0.75,0\n4,0,0,0\n").level_uses();
        let [LevelUse { usage, most }] = &uses[..] else { panic!("dac2 is always off: {uses:?}") };
        assert_eq!(
            (usage.name.as_str(), usage.spans.len(), usage.on().as_secs(), *most),
            ("dac1", 1, 3, 0.75)
        );
    }

    #[test]
    fn bits_of_a_raw_word_are_outputs() {
        let uses = timeline("time_s,a1,io\n0,0,0x001\n1,0,0x801\n2,0,0\n").effect_uses();
        let names: Vec<_> = uses.iter().map(|usage| (usage.name.as_str(), usage.on().as_secs())).collect();
        assert_eq!(names, [("Y01", 2), ("Y12", 1)]);
    }

    #[test]
    fn the_row_interval_is_the_usual_one() {
        let cue = timeline("time_ms,a1\n0,0\n20,0\n40,0\n60,0\n1060,0\n");
        assert_eq!(cue.row_interval(), Duration::from_millis(20));
    }
}
