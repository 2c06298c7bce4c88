//! The hall as it opens: the frame port is bound, and an engine rests that knows of no seat where it stands. It can do one
//! thing, bring seats that were found to their park poses.

use super::super::StagedShow;
use super::{Numbers, RuntimeError};
use crate::config::{BroadcastNetwork, Config, cue_axes};
use crate::cue::CueBuilder;
use crate::drive::Manner;
use crate::engine::Show;
use crate::net::{Ports, Receiver, SendCost, Sender, Whole};
use crate::sys::clock::Monotonic;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

/// Binds the frame port; where `may_come` says so its address, and ways to controllers, may come later. What is broadcast has to leave from
/// where its controllers answer to: there all of it has to be known.
pub(super) fn bind(config: &Config, may_come: bool) -> Result<(Sender, Receiver), RuntimeError> {
    let stations = config.stations();
    let peers: Vec<_> = stations.iter().map(|one| one.connection.address).collect();
    let whole = |one: &BroadcastNetwork| Whole {
        address: one.address(),
        bits: one.network.bits(),
        lanes: (0..peers.len()).filter(|lane| one.network.holds(*peers[*lane].ip())).collect(),
    };
    let whole = config.broadcast.as_ref().map(whole);
    let may_come = may_come && whole.is_none();
    let ports = Ports::open_with(config.show.bind, &peers, whole.as_ref(), may_come);
    Ok(ports.map_err(RuntimeError::Net)?.split())
}

/// What to do where frames to the controllers take too much of the time between ticks. Where that cannot be measured nothing is said.
pub(super) fn crowding(config: &Config) -> Option<String> {
    let (controllers, rate) = (config.stations().len(), Rate::from_hz(config.show.rate_hz));
    let cost = SendCost::measured(&Monotonic).ok()?;
    let remedy = cost.remedy(controllers, rate)?;
    Some(format!("{}: ticks may be missed and seats lost; {remedy}", cost.words(controllers, rate)))
}

/// A show of nothing, whose frames go on from these numbers.
pub(super) fn open(config: &Config, numbers: &Numbers, manner: Manner) -> Result<StagedShow, RuntimeError> {
    let show = Show {
        rate: Rate::from_hz(config.show.rate_hz),
        timing: config.show.timing,
        start: ShowTime::ZERO,
        plays: 1,
    };
    let rest = CueBuilder::flat("park", cue_axes(&config.controllers), ShowTime::from_millis(1_000));
    let mut staged =
        StagedShow::new(config, Timeline::new(rest), show, manner).map_err(RuntimeError::Plan)?;
    for (lane, controller) in staged.lanes.iter_mut().zip(&config.controllers) {
        if let Some(next) = numbers.get(&controller.address()) {
            *lane = lane.clone().starting_at(*next);
        }
    }
    Ok(staged)
}
