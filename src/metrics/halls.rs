//! The halls of a desk as figures.

use std::collections::BTreeMap;

use super::{Labels, MetricFamily, MetricValues, encoded, flag};
use crate::control::model::Word;
use crate::fleet::BriefStatus;
use crate::state::State;

/// What a desk knows.
#[derive(Debug)]
pub(crate) struct FleetFigures {
    /// False while the engine is not reached.
    pub(crate) engine: bool,
    pub(crate) halls: Vec<HallFigures>,
    /// Halls that were asked for a stop, by what came of it.
    pub(crate) stops: BTreeMap<&'static str, u64>,
}

/// What it knows of a hall.
#[derive(Debug)]
pub(crate) struct HallFigures {
    /// `SITE.HALL`.
    pub(crate) name: String,
    /// How old the last status is, s; `None` if there never was one.
    pub(crate) age_s: Option<f64>,
    pub(crate) silent: bool,
    /// How it is; `None` where it is silent.
    pub(crate) status: Option<BriefStatus>,
}

impl FleetFigures {
    /// As `OpenMetrics` text.
    ///
    /// # Panics
    /// Never: a `String` takes whatever is written to it.
    #[must_use]
    pub(crate) fn render(&self) -> String {
        encoded(self.families())
    }

    fn families(&self) -> Vec<MetricFamily> {
        let stops = self.stops.iter().map(|(result, count)| (vec![("result", (*result).to_owned())], *count));
        let heard = || self.halls.iter().filter_map(|hall| Some((hall, hall.status.as_ref()?)));
        // A word that nobody knows is no label: each would be a series more.
        let word = |state: &Word<State>| match state {
            Word::Known(state) => state.to_string(),
            Word::Other(_) => "other".to_owned(),
        };
        let states = heard().map(|(hall, status)| (hall.labels("state", &word(&status.state)), 1.0));
        let seats = heard().flat_map(|(hall, status)| {
            let seats = status.seats;
            [("total", seats.total), ("taking_part", seats.taking_part), ("lost", seats.lost)]
                .map(|(kind, count)| (hall.labels("kind", kind), figure(count)))
        });
        let gauges = |name, help, all: Vec<(Labels, f64)>| MetricFamily {
            name,
            help,
            values: MetricValues::Gauges(all),
        };
        let of_each = |figure: fn(&HallFigures) -> Option<f64>| {
            self.halls.iter().filter_map(|hall| Some((hall.own(), figure(hall)?))).collect()
        };
        vec![
            MetricFamily::gauge(
                "fleet_engine_up",
                "1 if the engine of the fleet is reached",
                flag(self.engine),
            ),
            gauges(
                "fleet_hall_silent",
                "1 if a hall was not heard for 1.5 s",
                of_each(|hall| Some(flag(hall.silent))),
            ),
            gauges("fleet_status_age_seconds", "Age of what is known of a hall", of_each(|hall| hall.age_s)),
            gauges("fleet_hall_state", "1 for the state of each hall that is heard", states.collect()),
            gauges("fleet_seats", "Seats of each hall that is heard, by how they are", seats.collect()),
            gauges(
                "fleet_warnings",
                "Warnings of each hall that is heard",
                of_each(|hall| hall.status.as_ref().map(|status| figure(status.warnings_total))),
            ),
            MetricFamily {
                name: "fleet_stops",
                help: "Halls that were asked for a stop from this desk, by what came of it",
                values: MetricValues::Counters(stops.collect()),
            },
        ]
    }
}

impl HallFigures {
    fn own(&self) -> Labels {
        vec![("hall", self.name.clone())]
    }

    fn labels(&self, name: &'static str, value: &str) -> Labels {
        vec![("hall", self.name.clone()), (name, value.to_owned())]
    }
}

/// A count, of which there are few.
fn figure(count: usize) -> f64 {
    u32::try_from(count).map_or(f64::INFINITY, f64::from)
}

/// Those of a desk that hears a hall, and knows of another.
#[cfg(test)]
pub(super) fn of_two_halls() -> super::tests::strict::Page {
    let status = BriefStatus { state: State::Parked.into(), ..BriefStatus::default() };
    let one = HallFigures { name: "a.h1".to_owned(), age_s: Some(0.25), silent: false, status: Some(status) };
    let two = HallFigures { name: "a.h2".to_owned(), age_s: None, silent: true, status: None };
    let figures = FleetFigures { engine: true, halls: vec![one, two], stops: BTreeMap::from([("done", 1)]) };
    super::tests::strict::check(&figures.render()).expect("it is what the format asks for")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_hall_has_its_age_and_only_one_that_is_heard_has_a_state() {
        let mut status = BriefStatus { state: State::Parked.into(), ..BriefStatus::default() };
        (status.seats.total, status.seats.lost, status.warnings_total) = (8, 1, 3);
        let hall = |name: &str, age_s: Option<f64>, status: Option<BriefStatus>| HallFigures {
            name: name.to_owned(),
            age_s,
            silent: status.is_none(),
            status,
        };
        let halls = vec![
            hall("a.h1", Some(0.25), Some(status)),
            hall("a.h2", Some(60.0), None),
            hall("a.h3", None, None),
        ];
        let page = FleetFigures { engine: true, halls, stops: BTreeMap::from([("done", 2)]) }.render();
        super::super::tests::strict::check(&page).unwrap();
        for line in [
            "kinocue_fleet_engine_up 1.0",
            "kinocue_fleet_hall_silent{hall=\"a.h1\"} 0.0",
            "kinocue_fleet_hall_silent{hall=\"a.h3\"} 1.0",
            "kinocue_fleet_status_age_seconds{hall=\"a.h2\"} 60.0",
            "kinocue_fleet_hall_state{hall=\"a.h1\",state=\"parked\"} 1.0",
            "kinocue_fleet_seats{hall=\"a.h1\",kind=\"lost\"} 1.0",
            "kinocue_fleet_warnings{hall=\"a.h1\"} 3.0",
            "kinocue_fleet_stops_total{result=\"done\"} 2",
        ] {
            assert!(page.lines().any(|one| one == line), "{line}:\n{page}");
        }
        assert!(
            !page.contains("status_age_seconds{hall=\"a.h3\"}") && !page.contains("state{hall=\"a.h2\""),
            "{page}"
        );
    }
}
