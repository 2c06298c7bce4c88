//! The network whose controllers may get one datagram together, as people are told of it.

use crate::config::Controller;
use crate::control::BroadcastStatus;
use crate::rt::Live;

/// How it does; nothing where there is none.
pub(super) fn status(controllers: &[Controller], live: &Live) -> Vec<BroadcastStatus> {
    let name = |lane: usize| controllers.get(lane).map_or_else(String::new, name);
    let status = live.broadcast().map(|one| {
        let [together, apart] = one.ticks();
        BroadcastStatus {
            name: one.name.clone(),
            controllers: one.lanes.len(),
            together,
            apart,
            not_now: one.permit().words(name),
            last_apart: one.last_apart(name),
        }
    });
    status.into_iter().collect()
}

/// What somebody has to do for it: sentences that end with that.
pub(super) fn troubles(controllers: &[Controller], live: &Live) -> Vec<String> {
    let name = |lane: usize| controllers.get(lane).map_or_else(String::new, name);
    let trouble = live.broadcast().and_then(|one| {
        let permit = one.permit();
        let (words, remedy) = permit.words(name).zip(permit.remedy())?;
        Some(format!("[broadcast.{}]: {words}; {remedy}", one.name))
    });
    trouble.into_iter().collect()
}

/// What a controller is called, and where it is.
fn name(controller: &Controller) -> String {
    let at = controller.station().map(|station| format!(" ({})", station.address));
    format!("{}{}", controller.name, at.unwrap_or_default())
}
