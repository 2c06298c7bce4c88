//! The cues that halls play, and the kinds of halls.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use kinocue::app::staged::headroom;
use kinocue::config::{Config, LossPolicy, from_to_args};
use kinocue::cue::{self, Source};
use kinocue::engine::Headroom;
use kinocue::time::Rate;
use kinocue::timeline::Timeline;
use kinocue::wire::Timing;

/// Seats of a hall, how fast it sends, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kind {
    pub(crate) axes: &'static [usize],
    pub(crate) hz: f64,
    pub(crate) timing: Timing,
    pub(crate) policy: LossPolicy,
}

const PLAIN: Kind = Kind { axes: &[3], hz: 100.0, timing: Timing::Relative, policy: LossPolicy::Continue };

/// Every kind that there is.
pub(crate) const KINDS: [Kind; 8] = [
    PLAIN,
    Kind { axes: &[6], ..PLAIN },
    Kind { axes: &[3, 6], hz: 50.0, ..PLAIN },
    Kind { axes: &[8], hz: 50.0, ..PLAIN },
    Kind { axes: &[6], timing: Timing::Absolute, ..PLAIN },
    Kind { axes: &[3], hz: 200.0, ..PLAIN },
    Kind { axes: &[3, 3], hz: 50.0, policy: LossPolicy::Park, ..PLAIN },
    Kind { axes: &[1], hz: 1_000.0, ..PLAIN },
];

/// A cue that is ready to be staged.
pub(crate) type Ready = (Arc<Timeline>, Headroom);

/// A hall's configuration and its cues: of all axes, of three, and one that stands high.
#[derive(Debug)]
pub(crate) struct Book {
    pub(crate) config: Arc<Config>,
    pub(crate) cues: Vec<Ready>,
}

impl Kind {
    pub(crate) fn period_ms(&self) -> f64 {
        1_000.0 / self.hz
    }

    fn config(&self) -> Config {
        let to = |(index, axes): (usize, &usize)| format!("127.0.1.{}:7408,axes={axes}", index + 1);
        let tos: Vec<String> = self.axes.iter().enumerate().map(to).collect();
        let mut config = from_to_args(&tos, &[], self.most()).expect("the addresses are sound");
        config.show.rate_hz = self.hz;
        config.show.timing = self.timing;
        config.show.loss_policy = self.policy;
        config
    }

    fn most(&self) -> usize {
        self.axes.iter().copied().max().unwrap_or(1)
    }

    /// What there is for halls of this kind; made once.
    pub(crate) fn book(&self) -> &'static Book {
        static BOOKS: [OnceLock<Book>; KINDS.len()] = [const { OnceLock::new() }; KINDS.len()];
        let index = KINDS.iter().position(|kind| kind == self).expect("it is one of them");
        BOOKS[index].get_or_init(|| {
            let config = self.config();
            let axes = self.most();
            let texts = [
                swing(axes, 0.8, 40.0, 75.0),
                swing(axes.min(3), 0.5, 50.0, 70.0),
                swing(axes, 0.3, 20.0, 120.0),
            ];
            let ready = |text: &String| {
                let cue = cue::read(Path::new("ride.csv"), text.as_bytes(), &Source::Native);
                let timeline = Timeline::new(cue.expect("the cue is sound"));
                let headroom = headroom(&config, &timeline, Rate::from_hz(self.hz));
                (Arc::new(timeline), headroom)
            };
            let cues = texts.iter().map(ready).collect();
            Book { config: Arc::new(config), cues }
        })
    }
}

/// Six seconds in which all axes swing, each a little after the one before.
pub(crate) fn swing(axes: usize, hz: f64, mm: f64, about_mm: f64) -> String {
    let names: String = (1..=axes).map(|axis| format!(",a{axis}")).collect();
    let mut text = format!("time_ms{names}\n");
    for row in 0..=300 {
        text += &(row * 20).to_string();
        for axis in 0..axes {
            let turn = hz * f64::from(row) * 0.02 + axis as f64 * 0.13;
            text += &format!(",{:.9}", (about_mm + mm * (turn * std::f64::consts::TAU).sin()) / 150.0);
        }
        text.push('\n');
    }
    text
}
