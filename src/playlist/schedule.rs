//! Start times of the entries. Pure: the wall clock is an argument.
//!
//! A time that the clock skips (in spring) is moved on by as much as it skips; of a time that comes twice (in autumn) the
//! first counts. So each entry has one start on each of its days.

use std::time::Duration;

use jiff::civil::Date;
use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp, ToSpan as _, Zoned};

use super::{At, Playlist};

/// A start that is longer past is let go: after a sleep, a step of the clock or a restart nothing is caught up.
pub(crate) const LATEST: Duration = Duration::from_secs(2);

/// A clock is set back by less than that where it comes by the same times again; one that was further ahead was wrong.
const WRONG: SignedDuration = SignedDuration::from_hours(24);

/// Which starts have been seen, so that none comes twice, however the clock is set.
#[derive(Debug, Clone, Default)]
pub(crate) struct Schedule {
    /// When it was last asked.
    asked: Option<Zoned>,
    /// The last start that was due.
    started: Option<Timestamp>,
}

impl Schedule {
    /// The entry, counted from 0, that is due now, at most once for each of its starts. To be asked at least once a second,
    /// also while nothing may start, so that what became due meanwhile is let go. The first time nothing is due.
    pub(crate) fn due(&mut self, playlist: &Playlist, now: &Zoned) -> Option<usize> {
        let asked = self.asked.replace(now.clone())?;
        let (entry, start) = find_due(playlist, &asked, now)?;
        // A clock that was set back comes by the same start again.
        let again = |started: Timestamp| start <= started && started.duration_since(start) < WRONG;
        if self.started.is_some_and(again) {
            return None;
        }
        self.started = Some(start);
        Some(entry)
    }
}

/// The entry, counted from 0, that starts next after `now`, and when. Of two at once the first of the list.
#[must_use]
pub(crate) fn next_start(playlist: &Playlist, now: &Zoned) -> Option<(usize, Zoned)> {
    let starts =
        (0..playlist.entries.len()).filter_map(|entry| Some((entry, start_after(playlist, entry, now)?)));
    starts.min_by(|(_, a), (_, b)| a.timestamp().cmp(&b.timestamp()))
}

/// When an entry starts next after `now`; `None` if a person starts it.
#[must_use]
pub(crate) fn start_after(playlist: &Playlist, entry: usize, now: &Zoned) -> Option<Zoned> {
    let at = playlist.entries.get(entry)?.at.as_ref()?;
    let now = local(playlist, now);
    let today = now.date();
    // Today's may be past, and a date may have none: the last of the calendar.
    let mut days =
        (0_i32..=7).filter_map(|ahead| start_on(at, today.checked_add(ahead.days()).ok()?, now.time_zone()));
    days.find(|start| *start > now)
}

/// The entry, counted from 0, whose start came after `previous` and at or before `now`, no longer than [`LATEST`] before it.
/// Of several the last; `None` if the clock went back.
#[must_use]
#[cfg(test)]
pub(crate) fn due(playlist: &Playlist, previous: &Zoned, now: &Zoned) -> Option<usize> {
    find_due(playlist, previous, now).map(|(entry, _)| entry)
}

fn find_due(playlist: &Playlist, previous: &Zoned, now: &Zoned) -> Option<(usize, Timestamp)> {
    let now = local(playlist, now);
    let (previous, until) = (previous.timestamp(), now.timestamp());
    let passed = |start: Timestamp| {
        start > previous && start <= until && until.duration_since(start).unsigned_abs() <= LATEST
    };
    // A start on the day before may have been moved past midnight.
    let days = [now.date().yesterday().ok(), Some(now.date())];
    let starts = timed(playlist).flat_map(|(index, at)| {
        let of_days = days.iter().flatten().filter_map(|day| start_on(at, *day, now.time_zone()));
        of_days.map(|start| (index, start.timestamp())).collect::<Vec<_>>()
    });
    let due = starts.filter(|(_, start)| passed(*start));
    due.reduce(|best, one| if one.1 > best.1 { one } else { best })
}

/// The entries with a time.
fn timed(playlist: &Playlist) -> impl Iterator<Item = (usize, &At)> {
    playlist.entries.iter().enumerate().filter_map(|(index, entry)| Some((index, entry.at.as_ref()?)))
}

/// `now` in the zone of the playlist.
pub(crate) fn local(playlist: &Playlist, now: &Zoned) -> Zoned {
    playlist.timezone.as_ref().map_or_else(|| now.clone(), |zone| now.with_time_zone(zone.clone()))
}

/// When an entry starts on a day, if it does.
fn start_on(at: &At, day: Date, zone: &TimeZone) -> Option<Zoned> {
    at.is_on(day.weekday()).then(|| zone.to_ambiguous_zoned(day.to_datetime(at.time)).compatible().ok())?
}
