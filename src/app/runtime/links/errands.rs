//! What the control plane has the threads of links do while seats rest: homing, and all that preflight asks.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use super::unit_of;
use crate::config::drive_controller::Motors;
use crate::config::{Config, Controller};
use crate::drive::link::{canary, lane_number};
use crate::drive::silvermax::{self, Homing, Stream};
use crate::preflight::LinkSurvey;
use crate::rt::{LinkEnd, Port};

/// What became of controllers, each told as it is home or not; it ends once all have told, or their threads are gone.
pub(in super::super) type Homed = Receiver<(usize, Result<(), String>)>;

/// Has those of the controllers that are on links homed, all links at once, the seats of each one after the other, as long as it
/// `goes_on`.
pub(in super::super) fn home(
    links: &[LinkEnd],
    config: &Arc<Config>,
    lanes: &[usize],
    goes_on: &Arc<dyn Fn() -> bool + Send + Sync>,
) -> Homed {
    let (tell, told) = channel();
    for link in links {
        let on_it = (0..).map(lane_number).zip(&link.controllers);
        let meant: Vec<_> =
            on_it.filter(|(_, lane)| lanes.contains(lane)).map(|(own, lane)| (own, *lane)).collect();
        let (tell, config, goes_on) = (tell.clone(), Arc::clone(config), Arc::clone(goes_on));
        link.ask(Box::new(move |stream| {
            for (own, lane) in meant {
                let homed = home_seat(stream, own, &config.controllers[lane], &*goes_on);
                // Whoever asked may be gone.
                drop(tell.send((lane, homed)));
            }
        }));
    }
    told
}

/// Homes the seat of a lane. Whatever came of it, the lane looks anew at its units.
fn home_seat(
    stream: &mut Stream<Port>,
    lane: u16,
    controller: &Controller,
    goes_on: &dyn Fn() -> bool,
) -> Result<(), String> {
    if !goes_on() {
        return Err("not begun: somebody ended the homing".to_owned());
    }
    let drives = controller.drives().ok_or("it is on no link")?;
    let seat = unit_of(controller, drives)?.seat;
    let canary = canary().map_err(|error| format!("the system gives no chance: {error}"))?;
    let homed = silvermax::home(stream.talk(), seat, Homing { canary, goes_on, told: &mut |_| {} });
    if homed.is_ok() {
        stream.rejoin(lane, canary);
    }
    stream.look(lane);
    homed.map_err(|error| error.to_string())
}

/// What all units of links tell, by the links' names; it ends once all have told, or their threads are gone.
pub(in super::super) fn survey(links: &[LinkEnd], config: &Arc<Config>) -> Receiver<(String, LinkSurvey)> {
    let (tell, told) = channel();
    for link in links {
        let units = link.controllers.iter().filter_map(|lane| config.controllers[*lane].drives());
        let units: Vec<u8> = units
            .flat_map(|drives| match &drives.motors {
                Motors::SilverMax(units) => units.clone(),
                Motors::Sixpack2 { .. } => Vec::new(),
            })
            .collect();
        let (tell, end) = (tell.clone(), link.clone());
        link.ask(Box::new(move |stream| {
            let opened = end.standing().fault.map_or(Ok(()), Err);
            let talk = stream.talk();
            let look = |unit: &u8| (*unit, silvermax::look(talk, *unit));
            let units: BTreeMap<_, _> = units.iter().map(look).collect();
            let talk = stream.talk();
            let (delay, counts) = (talk.usual_delay(), talk.counts());
            drop(tell.send((end.name.clone(), LinkSurvey { opened, delay, counts, units })));
        }));
    }
    told
}
