//! The hall as it opens: the frame port is bound, and an engine rests that knows of no seat where it stands. It can do one
//! thing, bring seats that were found to their park poses.

use super::super::StagedShow;
use super::{Numbers, RuntimeError};
use crate::config::Config;
use crate::cue::{Cue, CueBuilder};
use crate::drive::Manner;
use crate::engine::Show;
use crate::motion::MAX_AXES;
use crate::net::{Ports, Receiver, Sender};
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

/// Binds the frame port.
pub(super) fn bind(config: &Config) -> Result<(Sender, Receiver), RuntimeError> {
    let peers: Vec<_> = config.controllers.iter().map(|one| one.address).collect();
    Ok(Ports::open(config.show.bind, &peers).map_err(RuntimeError::Net)?.split())
}

/// A show of nothing, whose frames go on from these numbers.
pub(super) fn open(config: &Config, numbers: &Numbers, manner: Manner) -> Result<StagedShow, RuntimeError> {
    let show = Show {
        rate: Rate::from_hz(config.show.rate_hz),
        timing: config.show.timing,
        start: ShowTime::ZERO,
        plays: 1,
    };
    let mut staged =
        StagedShow::new(config, Timeline::new(rest(config)), show, manner).map_err(RuntimeError::Plan)?;
    for (lane, controller) in staged.lanes.iter_mut().zip(&config.controllers) {
        if let Some(next) = numbers.get(&controller.address) {
            *lane = lane.clone().starting_at(*next);
        }
    }
    Ok(staged)
}

/// A cue that has every axis of the hall, and asks for nothing.
fn rest(config: &Config) -> Cue {
    let axes = config.controllers.iter().map(|one| one.window().end).max().unwrap_or(1).min(MAX_AXES);
    let mut cue = CueBuilder::new("park", axes);
    for ms in [0, 1_000] {
        cue.row(ShowTime::from_millis(ms), std::iter::repeat_n(0.0, axes), None);
    }
    cue.build().expect("it has no effects")
}
