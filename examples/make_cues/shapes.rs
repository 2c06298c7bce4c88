//! What a ride is made of: smooth moves and waves of the seat as a whole, and the way from these to its axes.

use std::f64::consts::TAU;
use std::fmt::Write as _;

/// A way in which the seat as a whole moves.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Way {
    Heave,
    Pitch,
    Roll,
    Yaw,
    Surge,
    Sway,
}

/// One thing that happens in a ride; times in seconds, sizes in parts of the stroke.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Beat {
    /// From `at` on, `by` more within `over`.
    Move { way: Way, at: f64, over: f64, by: f64 },
    /// A sine of size `by` that swells up after `from` and is gone at `to`.
    Wave { way: Way, from: f64, to: f64, hz: f64, by: f64 },
}

pub(crate) const fn shift(way: Way, at: f64, over: f64, by: f64) -> Beat {
    Beat::Move { way, at, over, by }
}

pub(crate) const fn wave(way: Way, from: f64, to: f64, hz: f64, by: f64) -> Beat {
    Beat::Wave { way, from, to, hz, by }
}

/// A vibration of all axes, in Hz and parts of the stroke, from `from` to `to`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rumble {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) hz: f64,
    pub(crate) amplitude: f64,
}

/// An effect that is on from `from` to `to`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Burst {
    pub(crate) effect: &'static str,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// How much of each [`Way`] an axis takes, and how many seconds later than the first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    pub(crate) mix: [f64; 6],
    pub(crate) lag: f64,
}

/// A whole cue. It begins and ends at rest, at the lower end of the stroke.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ride {
    /// The file in `cues/`.
    pub(crate) file: &'static str,
    pub(crate) title: &'static str,
    pub(crate) axes: &'static [Axis],
    /// Length, s.
    pub(crate) length: f64,
    /// Time between rows, ms.
    pub(crate) row_ms: u32,
    pub(crate) beats: &'static [Beat],
    pub(crate) rumbles: &'static [Rumble],
    pub(crate) effects: &'static [&'static str],
    pub(crate) bursts: &'static [Burst],
}

impl Ride {
    /// Where an axis stands at `t` seconds, fraction of the stroke.
    pub(crate) fn position(&self, axis: usize, t: f64) -> f64 {
        let Axis { mix, lag } = self.axes[axis];
        self.beats.iter().map(|beat| mix[beat.way() as usize] * beat.at(t - lag)).sum()
    }

    /// The ride as a cue file of kinocue's CSV.
    pub(crate) fn csv(&self) -> String {
        let mut text = format!("# kinocue-csv: 1\n# title: {}\n# units: fraction\n", self.title);
        let count = self.axes.len();
        text += "time_ms";
        (1..=count).for_each(|axis| append(&mut text, format_args!(",a{axis}")));
        if !self.rumbles.is_empty() {
            (1..=count).for_each(|axis| append(&mut text, format_args!(",v{axis}_hz,v{axis}_amp")));
        }
        self.effects.iter().for_each(|effect| append(&mut text, format_args!(",fx_{effect}")));
        text.push('\n');
        let mut ms = 0;
        while f64::from(ms) <= self.length * 1000.0 {
            self.row(ms, &mut text);
            ms += self.row_ms;
        }
        text
    }

    fn row(&self, ms: u32, text: &mut String) {
        let t = f64::from(ms) / 1000.0;
        let on = |from: f64, to: f64| from <= t && t < to;
        append(text, format_args!("{ms}"));
        for axis in 0..self.axes.len() {
            // Half a unit of the last place may stick out below 0; `+ 0.0` turns -0 into 0.
            append(text, format_args!(",{:.5}", self.position(axis, t).max(0.0) + 0.0));
        }
        if !self.rumbles.is_empty() {
            let rumble = self.rumbles.iter().find(|rumble| on(rumble.from, rumble.to));
            let (hz, amplitude) = rumble.map_or((0.0, 0.0), |rumble| (rumble.hz, rumble.amplitude));
            self.axes.iter().for_each(|_| append(text, format_args!(",{hz},{amplitude}")));
        }
        for effect in self.effects {
            let lit = self.bursts.iter().any(|burst| burst.effect == *effect && on(burst.from, burst.to));
            append(text, format_args!(",{}", u8::from(lit)));
        }
        text.push('\n');
    }
}

impl Beat {
    const fn way(&self) -> Way {
        match *self {
            Self::Move { way, .. } | Self::Wave { way, .. } => way,
        }
    }

    fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Move { at, over, by, .. } => by * smooth((t - at) / over),
            Self::Wave { from, to, hz, by, .. } => {
                let fade = ((to - from) / 3.0).min(1.2);
                let swell = smooth((t - from) / fade) * smooth((to - t) / fade);
                by * swell * (TAU * hz * (t - from)).sin()
            }
        }
    }
}

/// From 0 to 1 between 0 and 1, with velocity, acceleration and jerk 0 at both ends.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x.powi(4) * (35.0 - 84.0 * x + 70.0 * x.powi(2) - 20.0 * x.powi(3))
}

fn append(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("a String takes all text");
}
