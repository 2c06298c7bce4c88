//! Looks at the seats on serial links: all links at once, the units of each one after the other. Reads only.

use std::thread;

use super::super::targets::DrivenTargets;
use crate::config::drive::DriveFamily;
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Link};
use crate::drive::link::{LinkLine, TalkTerms};
use crate::drive::{silvermax, sixpack2};
use crate::preflight::{DriveSubject, LinkSurvey};

/// What was read of the links that somebody is on, in the order of the links; none where nobody is.
pub(super) fn look_at_all(driven: &DrivenTargets) -> Vec<Option<LinkSurvey>> {
    thread::scope(|scope| {
        let look = |link| {
            let motors = motors_on(driven, link);
            motors.map(|motors| scope.spawn(move || look_at(link, &motors)))
        };
        let looks: Vec<_> = driven.links.iter().map(look).collect();
        let join =
            |look: thread::ScopedJoinHandle<'_, LinkSurvey>| look.join().expect("a look does not panic");
        looks.into_iter().map(|look| look.map(join)).collect()
    })
}

/// What is meant on a link; none where nothing is.
fn motors_on<'a>(driven: &'a DrivenTargets, link: &Link) -> Option<Vec<&'a Motors>> {
    let drives = driven.controllers.iter().filter_map(|one| one.drives());
    let on_it: Vec<_> =
        drives.filter(|drives| drives.link == link.name).map(|drives| &drives.motors).collect();
    (!on_it.is_empty()).then_some(on_it)
}

fn look_at(link: &Link, motors: &[&Motors]) -> LinkSurvey {
    let (line, terms) = match LinkLine::open(link) {
        Ok(line) => (line, TalkTerms::of(link)),
        Err(error) => return LinkSurvey::silent(error),
    };
    match link.family {
        Some(DriveFamily::Sixpack2) => LinkSurvey::of_sixpacks(&mut sixpack2::Talk::new(line, terms), motors),
        Some(DriveFamily::SilverMax) | None => {
            LinkSurvey::of_units(&mut silvermax::Talk::new(line, terms), motors)
        }
    }
}

/// What is judged: the controllers with what was read of their links.
pub(super) fn subjects<'a>(
    driven: &'a DrivenTargets,
    looked: &'a [Option<LinkSurvey>],
) -> Vec<DriveSubject<'a>> {
    let subject = |controller: &'a Controller| {
        let name = &controller.drives()?.link;
        let at = driven.links.iter().position(|link| link.name == *name)?;
        let survey = looked[at].as_ref()?;
        Some(DriveSubject { controller, link: &driven.links[at], load: driven.loads[at], survey })
    };
    driven.controllers.iter().filter_map(subject).collect()
}
