//! Which source leads: the highest of a ranking that can, without flapping between two, and never a mean of them. A told stop is
//! obeyed, whatever another source says.

#[cfg(test)]
mod tests;

use std::time::Duration;

use super::point::{FILM_FRAME, FilmPoint, FilmState};
use crate::time::{MonoTime, ShowTime};

/// The sources of a ranking at the most.
pub(crate) const MOST_SOURCES: usize = 8;
/// A source that ranks higher has to be locked for so long before it takes over: one that comes and goes would have the seats slew
/// for ever.
const UP_AFTER: Duration = Duration::from_secs(10);

/// What is known of the film by one source, at the instant of the choice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SourceView {
    pub(crate) point: FilmPoint,
    /// Whether it is good enough, or was allowed all the same.
    pub(crate) may_lead: bool,
}

impl SourceView {
    const fn leads(&self) -> bool {
        self.may_lead && self.point.state.may_lead()
    }

    /// How far another film is ahead.
    const fn behind(&self, other: &Self) -> ShowTime {
        other.point.media.since(self.point.media)
    }

    /// Whether another says the same, so that the change is slewed: from one that is further off seats would have to join.
    fn agrees(&self, other: &Self) -> bool {
        u128::from(self.behind(other).as_nanos().unsigned_abs()) <= FILM_FRAME.as_nanos()
    }
}

/// The film as the chosen source has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChosenFilm {
    /// Its place in the ranking; `None` while nothing was good enough yet.
    pub(crate) source: Option<usize>,
    pub(crate) point: FilmPoint,
    /// A source that ranks higher, or any other than the one that a person chose, and says something else, and by how much it is
    /// ahead: a person has to decide.
    pub(crate) disagrees: Option<(usize, ShowTime)>,
}

/// Chooses among the sources of a ranking, the first of which goes before the others.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chooser {
    present: Option<usize>,
    /// Since when each can lead.
    leads_since: [Option<MonoTime>; MOST_SOURCES],
    /// The epoch that is told, and the one of the source that it stands for.
    epoch: u32,
    of_source: u32,
    switches: u64,
}

impl Chooser {
    /// How often the source has changed.
    pub(crate) const fn switches(&self) -> u64 {
        self.switches
    }

    /// The film at an instant, by the views of all sources, in their ranking. The one that a person chose leads whatever becomes of
    /// it: where it stops or is lost seats rest, and none takes over until the person says so.
    pub(crate) fn choose(
        &mut self,
        views: &[SourceView],
        by_hand: Option<usize>,
        now: MonoTime,
    ) -> ChosenFilm {
        let views = &views[..views.len().min(MOST_SOURCES)];
        for (since, view) in self.leads_since.iter_mut().zip(views) {
            // From the start at each break: ten seconds in all are no ten seconds on end.
            *since = if view.leads() { since.or(Some(now)) } else { None };
        }
        let disagrees = if let Some(by_hand) = by_hand.filter(|place| *place < views.len()) {
            self.switch(by_hand, views);
            self.apart_from_choice(by_hand, views, now)
        } else {
            self.go_down(views);
            self.go_up(views, now)
        };
        let view = self.present.and_then(|present| views.get(present));
        let Some(view) = view else {
            return ChosenFilm { source: None, point: best_of_none(views, now), disagrees: None };
        };
        let mut point = view.point;
        if point.epoch != self.of_source {
            self.of_source = point.epoch;
            self.epoch = self.epoch.wrapping_add(1);
        }
        point.epoch = self.epoch;
        if point.state.may_lead() && !view.may_lead {
            point.state = FilmState::Unusable;
        }
        ChosenFilm { source: self.present, point, disagrees }
    }

    /// Leaves a source of which nobody knows the film any more for the highest that does.
    fn go_down(&mut self, views: &[SourceView]) {
        let view = self.present.and_then(|present| views.get(present));
        if view.is_none_or(is_given_up)
            && let Some(next) = views.iter().position(SourceView::leads)
        {
            self.switch(next, views);
        }
    }

    /// Takes a source that ranks higher, if it has been good for long enough and says the same.
    fn go_up(&mut self, views: &[SourceView], now: MonoTime) -> Option<(usize, ShowTime)> {
        let present = self.present?;
        // Only those that rank higher: between lower ones nobody has to choose.
        let higher = (0..present).find(|place| self.has_led(*place, now))?;
        // One that is stopped says no place to agree with, and is obeyed: a higher one is not taken past it.
        if !views[present].leads() || !views[present].agrees(&views[higher]) {
            return Some((higher, views[present].behind(&views[higher])));
        }
        self.switch(higher, views);
        None
    }

    /// The highest of the other sources that says something else than the one that a person chose.
    fn apart_from_choice(
        &self,
        chosen: usize,
        views: &[SourceView],
        now: MonoTime,
    ) -> Option<(usize, ShowTime)> {
        let present = &views[chosen];
        let is_apart = |place: &usize| self.has_led(*place, now) && !present.agrees(&views[*place]);
        let other = (0..views.len()).find(is_apart).filter(|_| present.leads())?;
        Some((other, present.behind(&views[other])))
    }

    /// Whether a source has been able to lead for long enough.
    fn has_led(&self, place: usize, now: MonoTime) -> bool {
        self.leads_since[place].is_some_and(|since| now.since(since) >= UP_AFTER)
    }

    fn switch(&mut self, to: usize, views: &[SourceView]) {
        if self.present == Some(to) {
            return;
        }
        let before = self.present.and_then(|present| views.get(present));
        // Two that agree are one film: the change is slewed, and nobody is told of a jump.
        let jumps = before.is_none_or(|before| !before.agrees(&views[to]));
        self.epoch = self.epoch.wrapping_add(u32::from(jumps && self.present.is_some()));
        self.switches += u64::from(self.present.is_some());
        self.of_source = views[to].point.epoch;
        self.present = Some(to);
    }
}

/// Whether nobody knows by a source where the film is, nor will in a moment. Stopped and wound are answers.
const fn is_given_up(view: &SourceView) -> bool {
    match view.point.state {
        FilmState::Absent | FilmState::Unusable | FilmState::Lost => true,
        FilmState::Locked | FilmState::Freewheeling => !view.may_lead,
        FilmState::FreeRunning
        | FilmState::Acquiring
        | FilmState::Stopped
        | FilmState::Ended
        | FilmState::Jumped
        | FilmState::Reverse
        | FilmState::Shuttle => false,
    }
}

/// What to show while no source is good enough: the highest that says anything.
fn best_of_none(views: &[SourceView], now: MonoTime) -> FilmPoint {
    let nobody = FilmPoint { at: now, media: ShowTime::ZERO, rate: 1.0, epoch: 0, state: FilmState::Absent };
    let mut best =
        views.iter().map(|view| view.point).find(|point| point.state != FilmState::Absent).unwrap_or(nobody);
    if best.state.may_lead() {
        best.state = FilmState::Unusable; // coarse, and nobody allowed that
    }
    best
}
