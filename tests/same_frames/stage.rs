//! The shows that halls by chance play.

use std::path::Path;
use std::sync::Arc;

use kinocue::cue::{self, Source};
use kinocue::harness::app::StagedShow;
use kinocue::harness::asked::Chance;
use kinocue::harness::config::{Config, from_to_args};
use kinocue::harness::drive::Manner;
use kinocue::harness::engine::{Headroom, Mix, Show};
use kinocue::harness::swell;
use kinocue::harness::time::{Rate, ShowTime};
use kinocue::harness::timeline::Timeline;
use kinocue::wire::Timing;

/// A cue on the seats of a hall at a rate.
pub(crate) struct Stage {
    pub(crate) rate: Rate,
    pub(crate) seats: usize,
    timeline: Arc<Timeline>,
    timing: Timing,
    config: Config,
    headroom: Headroom,
}

/// Cues of one to three seconds, for one to three seats, at all kinds of rates.
pub(crate) fn all() -> Vec<Stage> {
    let cues =
        [(1, swell(1, 3, 40.0, 0.3)), (2, swell(2, 2, 12.0, 0.9)), (3, effects(&swell(3, 1, 6.0, 1.0)))];
    let rates = [20.0, 50.0, 100.0, 24.0, 100.0, 333.0];
    let of_cue = |(index, (axes, cue)): (usize, &(usize, String))| {
        let kinds =
            rates.into_iter().enumerate().map(move |(kind, hz)| (index + kind, *axes, cue.clone(), hz));
        kinds.collect::<Vec<_>>()
    };
    let kinds = cues.iter().enumerate().flat_map(of_cue);
    kinds.map(|(kind, axes, cue, hz)| Stage::new(kind, axes, &cue, hz)).collect()
}

/// A cue with effects and vibration on its first axis.
fn effects(cue: &str) -> String {
    let mut text = String::new();
    for (row, line) in cue.lines().enumerate() {
        let more = match row {
            0 => ",v1_hz,v1_amp,fx_air,fx_light".to_owned(),
            _ => {
                format!(",{},{},{},{}", 5 + row % 3, 0.01 * f64::from(row % 2 == 1), row / 5 % 2, row / 7 % 2)
            }
        };
        text.extend([line, &more, "\n"]);
    }
    text
}

impl Stage {
    fn new(kind: usize, axes: usize, cue: &str, hz: f64) -> Self {
        let read = cue::read(Path::new("show.csv"), cue.as_bytes(), &Source::Native);
        let timeline = Timeline::new(read.expect("the cue is sound"));
        let seats = 1 + kind % 3;
        let tos: Vec<String> = (0..seats).map(|seat| format!("127.0.0.1:{}", 7408 + seat)).collect();
        let config = from_to_args(&tos, &[], axes).expect("the addresses are sound");
        let timing = if kind.is_multiple_of(2) { Timing::Relative } else { Timing::Absolute };
        let rate = Rate::from_hz(hz);
        let show = Show { rate, timing, start: ShowTime::ZERO, plays: 1 };
        let staged = StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent: false });
        let StagedShow { timeline, headroom, .. } = staged.expect("there is a join");
        Self { rate, seats, timeline, timing, config, headroom }
    }

    /// A show on it, as operators may have set it; and the trim that it was made for.
    pub(crate) fn staged(&self, chance: &mut Chance) -> (StagedShow, i32) {
        let level = |chance: &mut Chance| chance.one_of(&[1.0, 1.0, 1.0, 0.7, 0.3, 0.0]);
        let mut mix = |_| {
            let (motion, vibration) = (level(chance), level(chance));
            Mix { motion, vibration, on: !chance.once_in(9), ..Mix::FULL }
        };
        let mixes: Vec<Mix> = (0..self.seats).map(&mut mix).collect();
        let trim_ms = if chance.once_in(4) { chance.one_of(&[-300, -40, 25, 400]) } else { 0 };
        let start_ms = chance.one_of(&[0, 0, 0, 500, 1_200]) - i64::from(trim_ms);
        let show = Show {
            rate: self.rate,
            timing: self.timing,
            start: ShowTime::from_millis(start_ms),
            plays: chance.one_of(&[1, 1, 2, 0]),
        };
        let staged =
            StagedShow::mixed(&self.config, &self.timeline, self.headroom.clone(), show, &mixes, false);
        (staged.expect("there is a join"), trim_ms)
    }
}
