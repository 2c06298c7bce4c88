//! Networks whose controllers may get one datagram together, as people are told of them.

use crate::config::Controller;
use crate::control::BroadcastStatus;
use crate::rt::Live;

/// All of them, in the order of the configuration; none where it has none.
pub(super) fn status(controllers: &[Controller], live: &Live) -> Vec<BroadcastStatus> {
    let name = |lane: usize| controllers.get(lane).map_or_else(String::new, name);
    let all = live.broadcasts().map_or(&[][..], |broadcasts| broadcasts.all());
    let status = all.iter().map(|one| {
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
    status.collect()
}

/// Those for which somebody has to do something: sentences that end with what.
pub(super) fn troubles(controllers: &[Controller], live: &Live) -> Vec<String> {
    let name = |lane: usize| controllers.get(lane).map_or_else(String::new, name);
    let all = live.broadcasts().map_or(&[][..], |broadcasts| broadcasts.all());
    let trouble = all.iter().filter_map(|one| {
        let permit = one.permit();
        let (words, remedy) = permit.words(name).zip(permit.remedy())?;
        Some(format!("[broadcast.{}]: {words}; {remedy}", one.name))
    });
    trouble.collect()
}

/// What a controller is called, and where it is.
fn name(controller: &Controller) -> String {
    let at = controller.station().map(|station| format!(" ({})", station.address));
    format!("{}{}", controller.name, at.unwrap_or_default())
}
