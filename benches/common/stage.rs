//! A play of a six-axis ride to any number of controllers, ready to run, as `kinocue play` makes it.

use std::fmt::Write as _;
use std::net::SocketAddrV4;
use std::path::Path;

use kinocue::app::StagedShow;
use kinocue::config::from_to_args;
use kinocue::cue::{Source, read};
use kinocue::engine::Show;
use kinocue::fanout::Manner;
use kinocue::observe::Watched;
use kinocue::time::{Rate, ShowTime};
use kinocue::timeline::Timeline;
use kinocue::wire::Timing;

/// Axes of the ride and of every controller.
const AXES: u8 = 6;

/// A ride that many times a second to six axes at each of the addresses, and what has to be known of who is there; `silent` asks
/// for no replies.
pub(crate) fn stage(
    timeline: Timeline,
    rate_hz: f64,
    to: &[SocketAddrV4],
    silent: bool,
) -> (StagedShow, Vec<Watched>) {
    let tos: Vec<String> = to.iter().map(|address| format!("{address},axes={AXES}")).collect();
    let config = from_to_args(&tos, &[], timeline.axes()).expect("the addresses differ");
    let show =
        Show { rate: Rate::from_hz(rate_hz), timing: Timing::Relative, start: ShowTime::ZERO, plays: 1 };
    let staged = StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent });
    let watched = config.controllers.iter().map(Watched::of).collect();
    (staged.expect("the ride is gentle"), watched)
}

/// A ride of waves, a row every 10 ms, that begins and ends at rest at `from` (fraction of the stroke) on every axis; from
/// 0, which is the park pose, no join leads onto it. `effects` are columns of effects, which are on throughout.
pub(crate) fn ride(seconds: u32, from: f64, effects: &[&str]) -> Timeline {
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
