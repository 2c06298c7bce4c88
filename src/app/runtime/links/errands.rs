//! What the control plane has the threads of links do while seats rest: homing, and all that preflight asks.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use crate::config::drive_controller::Motors;
use crate::config::{Config, Controller};
use crate::drive::link::{StreamTerms, lane_number};
use crate::drive::{LinkStream, silvermax};
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
                let homed = home_seat(stream, (own, &config.controllers[lane]), &config, &*goes_on);
                // Whoever asked may be gone.
                drop(tell.send((lane, homed)));
            }
        }));
    }
    told
}

/// Homes the seat of a lane.
fn home_seat(
    stream: &mut LinkStream<Port>,
    (lane, controller): (u16, &Controller),
    config: &Config,
    goes_on: &dyn Fn() -> bool,
) -> Result<(), String> {
    if !goes_on() {
        return Err("not begun: somebody ended the homing".to_owned());
    }
    let name = controller.drives().map(|drives| &drives.link);
    let link = config.links.iter().find(|link| Some(&link.name) == name).ok_or("it is on no link")?;
    let terms = StreamTerms::of(link, config)?.ok_or("no seat is on its link")?;
    stream.home(lane, (controller, terms), goes_on)
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
            let (mut told, mut delay) = (BTreeMap::new(), None);
            if let LinkStream::SilverMax(stream) = stream {
                let talk = stream.talk();
                told.extend(units.iter().map(|unit| (*unit, silvermax::look(talk, *unit))));
                delay = talk.usual_delay();
            }
            let (counts, units) = (stream.figures().talk, told);
            drop(tell.send((end.name.clone(), LinkSurvey { opened, delay, counts, units })));
        }));
    }
    told
}
