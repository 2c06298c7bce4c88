//! What happens in a show, for its record: changes of state, and the seats that fall out of it and come back. Seats of one second and one
//! cause are one event.

use std::collections::BTreeMap;
use std::time::Duration;

use jiff::Zoned;

use crate::app::supervisor::hall::HallContext;
use crate::journal::SeatOut;
use crate::rt::Row;
use crate::time::MonoTime;

/// Seats that an event names.
const NAMED: usize = 8;

/// What has happened in a show so far.
#[derive(Debug, Default)]
pub(super) struct ShowEvents {
    lines: Vec<EventLine>,
    /// By lane, those that fell out at least once.
    fallen: BTreeMap<usize, Fallen>,
}

/// One event.
#[derive(Debug)]
struct EventLine {
    /// The time of the day.
    at: String,
    /// The seats that it is about; none where it is about the hall.
    names: Vec<String>,
    text: String,
}

/// A seat that fell out.
#[derive(Debug, Default)]
struct Fallen {
    times: u32,
    /// How long it was out before it came back.
    before: Duration,
    /// Since when it is out.
    since: Option<MonoTime>,
}

impl Fallen {
    /// How long it was out until then.
    fn lasted(&self, until: MonoTime) -> Duration {
        self.before + self.since.map_or(Duration::ZERO, |since| until.since(since))
    }
}

impl ShowEvents {
    /// Notes what happens to the hall.
    pub(super) fn note(&mut self, text: String) {
        self.lines.push(EventLine { at: clock(), names: Vec::new(), text });
    }

    /// Notes which seats that are on fall out and come back.
    pub(super) fn note_seats(&mut self, table: &[Row], hall: &HallContext) {
        for (lane, (row, controller)) in table.iter().zip(&hall.config.controllers).enumerate() {
            let (is_on, Row { standing, why, .. }) = (hall.settings.is_on(lane), row);
            let is_out = is_on && !standing.may_move();
            let was_out = self.fallen.get(&lane).is_some_and(|fallen| fallen.since.is_some());
            if is_out && !was_out {
                let fallen = self.fallen.entry(lane).or_default();
                (fallen.times, fallen.since) = (fallen.times + 1, Some(hall.now));
                self.note_seat(&controller.name, format!("{standing}: {why}"));
            } else if was_out && !is_out {
                let fallen = self.fallen.entry(lane).or_default();
                (fallen.before, fallen.since) = (fallen.lasted(hall.now), None);
                if is_on {
                    self.note_seat(&controller.name, "back".to_owned());
                }
            }
        }
    }

    fn note_seat(&mut self, name: &str, text: String) {
        let at = clock();
        let same = self.lines.iter_mut().rev().take_while(|line| line.at == at);
        match { same }.find(|line| {
            line.text == text && !line.names.is_empty() && !line.names.iter().any(|one| one == name)
        }) {
            Some(line) => line.names.push(name.to_owned()),
            None => self.lines.push(EventLine { at, names: vec![name.to_owned()], text }),
        }
    }

    /// The events in words, and the seats that fell out, of a show that ended then.
    pub(super) fn told(self, end: MonoTime, hall: &HallContext) -> (Vec<String>, Vec<SeatOut>) {
        let all = hall.config.controllers.len();
        let name =
            |lane: usize| hall.config.controllers.get(lane).map_or_else(String::new, |one| one.name.clone());
        let out = self.fallen.into_iter().map(|(lane, fallen)| SeatOut {
            seat: name(lane),
            times: fallen.times,
            out_s: (fallen.lasted(end).as_secs_f64() * 10.0).round() / 10.0,
        });
        (self.lines.iter().map(|line| line.told(all)).collect(), out.collect())
    }
}

impl EventLine {
    /// With its time, and the seats of `all` that it is about.
    fn told(&self, all: usize) -> String {
        let Self { at, names, text } = self;
        let more = names.len().saturating_sub(NAMED);
        match names.len() {
            0 => format!("{at} {text}"),
            1 => format!("{at} {} {text}", names[0]),
            many if many == all => format!("{at} all {all} seats {text}"),
            many if more > 0 => {
                format!("{at} {many} seats ({} and {more} more) {text}", names[..NAMED].join(", "))
            }
            _ => format!("{at} {} {text}", names.join(", ")),
        }
    }
}

fn clock() -> String {
    Zoned::now().strftime("%H:%M:%S").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::testing::{hall, row};
    use crate::health::HealthState;
    use crate::state::State;

    #[test]
    fn a_show_names_the_seats_that_fall_out_of_it_and_come_back_each_with_its_time() {
        let mut hall = hall(State::Armed, "one");
        let mut events = ShowEvents::default();
        for (ms, standing) in [
            (0, HealthState::Ok),
            (1_000, HealthState::Lost),
            (2_000, HealthState::Lost),
            (4_000, HealthState::Rejoining),
            (9_000, HealthState::Lost),
        ] {
            hall.now = MonoTime::from_nanos(ms * 1_000_000);
            events.note_seats(&[row(hall.now), Row { standing, ..row(hall.now) }], &hall);
        }
        let (said, out) = events.told(MonoTime::from_nanos(9_500_000_000), &hall);
        let said: Vec<_> = said.iter().map(|event| event.split_once(' ').unwrap()).collect();
        assert!(said[0].0.parse::<jiff::civil::Time>().is_ok(), "{said:?}");
        assert_eq!((said[0].1, said[1].1), ("B1 lost: it answers", "B1 back"));
        assert_eq!(out, [SeatOut { seat: "B1".to_owned(), times: 2, out_s: 3.5 }]);
    }

    #[test]
    fn seats_that_fall_out_at_one_instant_for_one_cause_are_one_event() {
        let line = |count: usize| EventLine {
            at: "19:00:00".to_owned(),
            names: (1..=count).map(|seat| format!("A{seat}")).collect(),
            text: "lost: no answer".to_owned(),
        };
        assert_eq!(line(2).told(64), "19:00:00 A1, A2 lost: no answer");
        assert_eq!(line(64).told(64), "19:00:00 all 64 seats lost: no answer");
        assert!(
            line(60).told(64).starts_with("19:00:00 60 seats (A1, A2, A3, A4, A5, A6, A7, A8 and 52 more)")
        );
        let mut events = ShowEvents::default();
        for name in ["A1", "A2", "A3"] {
            events.lines.iter_mut().for_each(|line| line.at = clock());
            events.note_seat(name, "lost: no answer".to_owned());
        }
        events.note_seat("A4", "lost: refused".to_owned());
        assert_eq!(events.lines.iter().map(|line| line.names.len()).collect::<Vec<_>>(), [3, 1]);
    }
}
