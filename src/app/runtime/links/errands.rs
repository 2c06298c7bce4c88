//! What the control plane has the threads of links do while seats rest: homing, and all that preflight asks.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use crate::config::{Config, Controller};
use crate::drive::LinkStream;
use crate::drive::link::{StreamTerms, lane_number};
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
        let lanes = link.controllers.clone();
        let (tell, end, config) = (tell.clone(), link.clone(), Arc::clone(config));
        link.ask(Box::new(move |stream| {
            let drives = lanes.iter().filter_map(|lane| config.controllers[*lane].drives());
            let motors: Vec<_> = drives.map(|drives| &drives.motors).collect();
            let survey = match stream {
                LinkStream::SilverMax(stream) => LinkSurvey::of_units(&mut stream.talk, &motors),
                LinkStream::Sixpack2(stream) => LinkSurvey::of_sixpacks(&mut stream.talk, &motors),
            };
            let fault = end.standing().fault;
            drop(tell.send((end.name.clone(), LinkSurvey { fault, ..survey })));
        }));
    }
    told
}
