//! What controllers on one link cannot be together.

use super::{Drives, Motors, Placed};
use crate::config::drive::DriveFamily;
use crate::config::fault::Faults;
use crate::config::link::{Link, LinkEntry, LinkWiring};
use crate::config::{Connection, Controller};

/// Settles the links for the drives that are on them, and notes what these cannot be together.
pub(in crate::config) fn settle(
    links: Vec<LinkEntry<'_>>,
    placed: &[Placed],
    faults: &mut Faults<'_>,
) -> Vec<Link> {
    let mut settled = Vec::new();
    for entry in links {
        let on_it: Vec<_> = placed.iter().filter(|one| one.link == entry.name).collect();
        let family = on_it.first().map(|one| one.motors.family());
        refuse_two_families(&on_it, family, faults);
        refuse_twins(&on_it, faults);
        refuse_two_clocks(&on_it, faults);
        let link = entry.settle(family, faults);
        if let Some(link) = link {
            refuse_units_of_rs232(&link, &on_it, faults);
            settled.push(link);
        }
    }
    settled
}

fn refuse_two_families(on_it: &[&Placed], family: Option<DriveFamily>, faults: &mut Faults<'_>) {
    let is_other = |one: &&&Placed| Some(one.motors.family()) != family;
    for other in on_it.iter().filter(is_other) {
        let Placed { link, motors, .. } = other;
        let (word, first) = (motors.family().word(), &on_it[0].controller.name);
        let message = format!(
            "dialect: link {link} has {} already, by {first}, and one line carries one dialect; put {word} on a link of its \
             own",
            family.map_or("another", DriveFamily::word)
        );
        faults.note(other.unit_at, message);
    }
}

/// Notes motors that move two axes.
fn refuse_twins(on_it: &[&Placed], faults: &mut Faults<'_>) {
    let mut taken: Vec<(u8, Option<u8>, usize)> = Vec::new();
    for one in on_it {
        let named: Vec<(u8, Option<u8>)> = match &one.motors {
            Motors::SilverMax(units) => units.iter().map(|unit| (*unit, None)).collect(),
            Motors::Sixpack2 { unit, motors } => motors.iter().map(|motor| (*unit, Some(*motor))).collect(),
        };
        for ((unit, motor), at) in named.into_iter().zip(one.motors_at.iter().copied()) {
            let Some((.., first)) = taken.iter().find(|(u, m, _)| (*u, *m) == (unit, motor)) else {
                taken.push((unit, motor, at));
                continue;
            };
            let line = faults.line(*first);
            let (link, what) = (&one.link, motor.map_or(String::new(), |m| format!("motor {m} of ")));
            let key = if motor.is_some() { "motors" } else { "units" };
            let message = format!(
                "{key}: {what}unit {unit} of link {link} moves another axis already, on line {line}; one motor moves one axis"
            );
            faults.note(at, message);
        }
    }
}

/// Notes a SIXpack 2 whose seats want what it has once for all of its motors, or once for two: whichever was homed last would have it.
fn refuse_two_clocks(on_it: &[&Placed], faults: &mut Faults<'_>) {
    let wants = |one: &Placed| {
        let Drives { drive, motors: Motors::Sixpack2 { unit, .. }, .. } = one.controller.drives()? else {
            return None;
        };
        drive.sixpack2.as_ref().map(|six| (*unit, (six.clock_divider, six.current.peak)))
    };
    for (index, one) in on_it.iter().enumerate() {
        let Some((unit, own)) = wants(one) else { continue };
        let differs = |other: &&&Placed| wants(other).is_some_and(|(its, set)| its == unit && set != own);
        if let Some(other) = on_it[..index].iter().find(differs) {
            let name = &other.controller.name;
            let message = format!(
                "unit: unit {unit} moves {name}, too, with another clock_divider or current.peak; it has one clock, and two motors share \
                 a peak, so give both seats the same"
            );
            faults.note(one.unit_at, message);
        }
    }
}

/// A SIXpack 2 by RS-232 is alone on its line.
fn refuse_units_of_rs232(link: &Link, on_it: &[&Placed], faults: &mut Faults<'_>) {
    if (link.wiring, link.family) != (LinkWiring::Rs232, Some(DriveFamily::Sixpack2)) {
        return;
    }
    let unit = |one: &Placed| match one.motors {
        Motors::Sixpack2 { unit, .. } => Some(unit),
        Motors::SilverMax(_) => None,
    };
    let first = on_it.first().and_then(|one| unit(one));
    for other in on_it.iter().filter(|one| unit(one) != first) {
        let message = format!(
            "unit: link {} is RS-232, which has one SIXpack 2; use wiring = \"rs485\", or a link for each",
            link.name
        );
        faults.note(other.unit_at, message);
    }
}

/// Tells each seat which others it may be taken for.
pub(in crate::config) fn find_twins(placed: &mut [Placed]) {
    let all: Vec<_> = placed
        .iter()
        .map(|one| (one.controller.name.clone(), one.link.clone(), one.motors.clone()))
        .collect();
    for one in placed {
        let is_twin = |(_, link, motors): &&(_, String, Motors)| *link != one.link && *motors == one.motors;
        let twins = all.iter().filter(is_twin).map(|(name, ..)| name.clone()).collect();
        if let Connection::Link(drives) = &mut one.controller.connection {
            drives.twins = twins;
        }
    }
}

/// Notes groups whose controllers cannot keep together: a rigid seat would be bent.
pub(in crate::config) fn refuse_parted_groups(
    placed: &[Placed],
    others: &[&Controller],
    faults: &mut Faults<'_>,
) {
    for (index, one) in placed.iter().enumerate() {
        let group = &one.controller.group;
        let parts = |other: &&Placed| other.link != one.link || other.enabled != one.enabled;
        let apart = placed[..index].iter().find(|other| other.controller.group == *group && parts(other));
        let by_udp = others.iter().find(|other| other.group == *group);
        let (name, why) = match (apart, by_udp) {
            (Some(other), _) if other.link != one.link => (&other.controller.name, "is on another link"),
            (Some(other), _) => (&other.controller.name, "and this are not both enabled"),
            (None, Some(other)) => (&other.name, "is on the network"),
            (None, None) => continue,
        };
        let message = format!(
            "group: {name} of the group {group} {why}, and a rigid seat moves by all of its controllers at one instant; put \
             them on one link, with the same enabled"
        );
        faults.note(one.group_at, message);
    }
}
