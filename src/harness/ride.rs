//! Cues of waves, and a play of a six-axis ride to any number of controllers, ready to run, as `kinocue play` makes it.

use std::fmt::Write as _;
use std::net::SocketAddrV4;
use std::path::Path;

use crate::app::StagedShow;
use crate::config::{Config, from_to_args};
use crate::cue::{Source, read};
use crate::drive::Manner;
use crate::engine::Show;
use crate::observe::Watched;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;
use crate::wire::Timing;

/// Axes of the ride and of every controller.
const AXES: u8 = 6;

/// A ride that many times a second to six axes at each of the addresses, and what has to be known of who is there; `silent` asks
/// for no replies.
pub fn stage(
    timeline: Timeline,
    rate_hz: f64,
    to: &[SocketAddrV4],
    silent: bool,
) -> (StagedShow, Vec<Watched>) {
    let tos: Vec<String> = to.iter().map(|address| format!("{address},axes={AXES}")).collect();
    let config = from_to_args(&tos, &[], timeline.axes()).expect("the addresses differ");
    stage_in(&config, timeline, rate_hz, silent)
}

/// The same in a hall.
pub fn stage_in(
    config: &Config,
    timeline: Timeline,
    rate_hz: f64,
    silent: bool,
) -> (StagedShow, Vec<Watched>) {
    let show =
        Show { rate: Rate::from_hz(rate_hz), timing: Timing::Relative, start: ShowTime::ZERO, plays: 1 };
    let staged = StagedShow::new(config, timeline, show, Manner { level: 1.0, silent });
    let watched = config.stations().iter().map(Watched::of).collect();
    (staged.expect("the ride is gentle"), watched)
}

/// A ride of waves, a row every 10 ms, that begins and ends at rest at `from` (fraction of the stroke) on every axis; from
/// 0, which is the park pose, no join leads onto it. `effects` are columns of effects, which are on throughout.
pub fn ride(seconds: u32, from: f64, effects: &[&str]) -> Timeline {
    let mut text = String::from("time_ms,a1,a2,a3,a4,a5,a6");
    effects.iter().for_each(|effect| text.extend([",fx_", effect]));
    text.push('\n');
    for row in 0..=100 * seconds {
        let t = f64::from(row) / 100.0;
        let swell = (std::f64::consts::PI * t / f64::from(seconds)).sin().powi(2);
        write!(text, "{}", row * 10).expect("a string takes all");
        for axis in 1..=AXES {
            let wave = 1.0 - (std::f64::consts::TAU * f64::from(axis) / 8.0 * t).cos();
            write!(text, ",{:.9}", from + 0.2 * swell * wave).expect("a string takes all");
        }
        text.extend(effects.iter().map(|_| ",1"));
        text.push('\n');
    }
    let cue = read(Path::new("ride.csv"), text.as_bytes(), &Source::Native).expect("the ride is well formed");
    Timeline::new(cue)
}

/// A cue of sines about the middle of the stroke, rows 20 ms apart: `mm` of swing at `hz` on each of `axes` axes.
pub fn swell(axes: u32, seconds: u32, mm: f64, hz: f64) -> String {
    let mut text = "time_ms".to_owned();
    (1..=axes).for_each(|axis| write!(text, ",a{axis}").expect("a String takes what is written to it"));
    for row in 0..=50 * seconds {
        let t = f64::from(row) * 0.02;
        write!(text, "\n{}", row * 20).expect("a String takes what is written to it");
        for axis in 0..axes {
            let turn = t * hz + f64::from(axis) / f64::from(axes);
            write!(text, ",{:.6}", 0.5 + mm / 150.0 * (turn * std::f64::consts::TAU).sin())
                .expect("a String takes what is written to it");
        }
    }
    text.push('\n');
    text
}
