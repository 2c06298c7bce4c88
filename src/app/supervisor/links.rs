//! The serial links of a hall as surfaces show them.

use super::hall::HallContext;
use crate::config::Link;
use crate::config::drive::DriveFamily;
use crate::control::{LinkAxisStatus, LinkStatus};
use crate::drive::link::AxisFigures;
use crate::rt::LinkEnd;

/// All of them, in the order of their lanes.
pub(super) fn status(hall: &HallContext) -> Vec<LinkStatus> {
    hall.links.iter().map(|link| one(hall, link)).collect()
}

/// The ports that cannot be had: sentences that end with what to do.
pub(super) fn troubles(hall: &HallContext) -> impl Iterator<Item = String> {
    hall.links.iter().filter_map(|link| {
        let fault = link.standing().fault?;
        Some(format!("[link.{}]: {fault}", link.name))
    })
}

fn one(hall: &HallContext, link: &LinkEnd) -> LinkStatus {
    let standing = link.standing();
    let (figures, talk) = (standing.figures, standing.figures.talk);
    let of_config = |it: &&Link| it.name == link.name;
    let port = hall.config.links.iter().find(of_config).map(|it| it.port.display().to_string());
    let lanes = link.controllers.iter().zip(&standing.lanes);
    LinkStatus {
        name: link.name.clone(),
        port: port.unwrap_or_default(),
        dialect: link.family.word().to_owned(),
        rate_hz: link.terms.period.as_secs_f64().recip(),
        lead_ms: link.terms.lead(link.family).as_secs_f64() * 1e3,
        deviation_mm: hall.cued.as_ref().and_then(|cued| cued.deviation_on(&link.name)),
        fault: standing.fault.as_ref().map(ToString::to_string),
        asked: talk.asked,
        answered: talk.answered,
        late: talk.late,
        stray: talk.doubled + talk.malformed + talk.foreign + talk.echo_differs,
        delay_p99_us: figures.delay_p99.as_secs_f64() * 1e6,
        poses_skipped: figures.poses_skipped,
        axes: lanes
            .flat_map(|(lane, axes)| {
                let name = &hall.config.controllers[*lane].name;
                (1..).zip(axes).map(|(number, axis)| of_axis(name, number, axis, link.family))
            })
            .collect(),
    }
}

fn of_axis(controller: &str, axis: usize, figures: &AxisFigures, family: DriveFamily) -> LinkAxisStatus {
    let account = figures.account;
    let confirms = family == DriveFamily::SilverMax;
    LinkAxisStatus {
        controller: controller.to_owned(),
        axis,
        made: account.made,
        acked: account.acked,
        unconfirmed: if confirms { 0 } else { account.sent },
        refused: account.refused,
        in_doubt: account.in_doubt,
        skipped: account.skipped,
        queued: figures.queued,
        dry: figures.dry,
        error_mm: figures.error_mm,
        off_course_mm: figures.off_course_mm,
        hot: figures.is_hot,
    }
}
