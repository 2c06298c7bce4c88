//! Why a controller stands as it does, in words and by its code.

use super::coded::StandingCode;
use super::hall::HallContext;
use crate::control::Coded;
use crate::health::Why;

/// Of a seat on drives that is not where it was led.
const OFF_COURSE: &str = "its drives are not where they were led: something blocks or pushes them, their load is too much for the motors, \
                          or what was sent to them was damaged on the way";

/// Of one to which no way leads.
const NO_ROUTE: &str = "this machine has no way to it yet: no network of its leads there";

/// Why a controller stands so. Of a rigid seat all controllers stand as one of them does: that one is named.
pub(super) fn standing_words(hall: &HallContext, index: usize, why: Why) -> (String, Coded) {
    let whose = why.controller().unwrap_or(index);
    let of = hall.config.controllers.get(whose);
    let (words, coded) = match why {
        Why::NotSeenYet if hall.reach.is_unreached(whose) => {
            (NO_ROUTE.to_owned(), Coded::new(StandingCode::NoRoute.word(), []))
        }
        // Drives have neither a PA96 nor filters.
        Why::Astray(_) if of.is_some_and(|one| one.drives().is_some()) => {
            (OFF_COURSE.to_owned(), Coded::new(StandingCode::OffCourse.word(), []))
        }
        _ => (why.to_string(), Coded::new(why.code(), why.figures())),
    };
    match of.filter(|_| whose != index) {
        Some(other) => (
            format!("{}: {words}", other.name),
            Coded::new(StandingCode::Beside.word(), [other.name.clone()]),
        ),
        None => (words, coded),
    }
}
