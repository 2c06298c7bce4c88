//! The serial links of a hall, or of a play, as people are told of them.

use crate::config::drive::DriveFamily;
use crate::config::{Config, Link};
use crate::control::{LinkAxisStatus, LinkStatus};
use crate::drive::link::AxisFigures;
use crate::proof::LinkPlay;
use crate::rt::LinkEnd;

/// All of them, in the order of their lanes; `plays` is what was proved of the cue that is loaded.
pub(super) fn status(config: &Config, links: &[LinkEnd], plays: &[LinkPlay]) -> Vec<LinkStatus> {
    links.iter().map(|link| one(config, link, plays)).collect()
}

/// The ports that cannot be had: sentences that end with what to do.
pub(super) fn troubles(links: &[LinkEnd]) -> impl Iterator<Item = String> {
    links.iter().filter_map(|link| Some(format!("[link.{}]: {}", link.name, link.standing().fault?)))
}

fn one(config: &Config, link: &LinkEnd, plays: &[LinkPlay]) -> LinkStatus {
    let standing = link.standing();
    let (figures, talk) = (standing.figures, standing.figures.talk);
    let axes = plays.iter().filter(|play| play.link == link.name).flat_map(|play| &play.axes);
    let deviations = axes.map(|axis| axis.deviation.value);
    let of_config = |it: &&Link| it.name == link.name;
    let port = config.links.iter().find(of_config).map(|it| it.port.display().to_string());
    let lanes = link.controllers.iter().zip(&standing.lanes);
    LinkStatus {
        name: link.name.clone(),
        port: port.unwrap_or_default(),
        dialect: link.family.word().to_owned(),
        rate_hz: link.terms.period.as_secs_f64().recip(),
        lead_ms: link.terms.lead(link.family).as_secs_f64() * 1e3,
        deviation_mm: deviations.reduce(f64::max),
        fault: standing.fault.as_ref().map(ToString::to_string),
        asked: talk.asked,
        answered: talk.answered,
        late: talk.late,
        stray: talk.doubled + talk.malformed + talk.foreign + talk.echo_differs,
        delay_p99_us: figures.delay_p99.as_secs_f64() * 1e6,
        poses_skipped: figures.poses_skipped,
        axes: lanes
            .flat_map(|(lane, axes)| {
                let name = &config.controllers[*lane].name;
                (1..).zip(axes).map(|(number, axis)| of_axis(name, number, axis, link.family))
            })
            .collect(),
    }
}

fn of_axis(controller: &str, axis: usize, figures: &AxisFigures, family: DriveFamily) -> LinkAxisStatus {
    let account = figures.account;
    let unconfirmed = match family {
        DriveFamily::SilverMax => 0,
        DriveFamily::Sixpack2 => account.sent,
    };
    LinkAxisStatus {
        controller: controller.to_owned(),
        axis,
        made: account.made,
        acked: account.acked,
        unconfirmed,
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
