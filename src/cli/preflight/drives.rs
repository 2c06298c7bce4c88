//! Looks at the seats on serial links: all links at once, the units of each one after the other. Reads only.

use std::collections::BTreeMap;
use std::thread;

use super::super::targets::Driven;
use crate::config::drive_controller::Motors;
use crate::config::{Controller, Link};
use crate::drive::link::{LinkLine, TalkTerms};
use crate::drive::silvermax::{Talk, TalkFault, look};
use crate::preflight::{DriveSubject, LinkSurvey};

/// What was read of the links that somebody is on, in the order of the links; none where nobody is.
pub(super) fn look_at_all(driven: &Driven) -> Vec<Option<LinkSurvey>> {
    thread::scope(|scope| {
        let look = |link| {
            let units = units_on(driven, link);
            units.map(|units| scope.spawn(move || look_at(link, &units)))
        };
        let looks: Vec<_> = driven.links.iter().map(look).collect();
        let join =
            |look: thread::ScopedJoinHandle<'_, LinkSurvey>| look.join().expect("a look does not panic");
        looks.into_iter().map(|look| look.map(join)).collect()
    })
}

/// The units on a link that are meant, which are none of a SIXpack 2; none where nobody on it is meant.
fn units_on(driven: &Driven, link: &Link) -> Option<Vec<u8>> {
    let drives = driven.controllers.iter().filter_map(|one| one.drives());
    let mut on_it = drives.filter(|drives| drives.link == link.name).peekable();
    on_it.peek()?;
    Some(
        on_it
            .flat_map(|drives| match &drives.motors {
                Motors::SilverMax(units) => units.clone(),
                Motors::Sixpack2 { .. } => Vec::new(),
            })
            .collect(),
    )
}

fn look_at(link: &Link, units: &[u8]) -> LinkSurvey {
    let line = match LinkLine::open(link) {
        Ok(line) => line,
        Err(error) => return LinkSurvey::silent(error),
    };
    let mut talk = Talk::new(line, TalkTerms::of(link));
    let mut told = BTreeMap::new();
    for &unit in units {
        let facts = look(&mut talk, unit);
        let is_gone = matches!(facts, Err(TalkFault::Link(_)));
        told.insert(unit, facts);
        if is_gone {
            break;
        }
    }
    LinkSurvey { opened: Ok(()), delay: talk.usual_delay(), counts: talk.counts(), units: told }
}

/// What is judged: the controllers with what was read of their links.
pub(super) fn subjects<'a>(driven: &'a Driven, looked: &'a [Option<LinkSurvey>]) -> Vec<DriveSubject<'a>> {
    let subject = |controller: &'a Controller| {
        let name = &controller.drives()?.link;
        let at = driven.links.iter().position(|link| link.name == *name)?;
        let survey = looked[at].as_ref()?;
        Some(DriveSubject { controller, link: &driven.links[at], load: driven.loads[at], survey })
    };
    driven.controllers.iter().filter_map(subject).collect()
}
