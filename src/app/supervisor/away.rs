//! Seats that are not where the state of the hall has them: read away from park while it is parked or armed.

use super::coded::{NextCode, RemedyCode, WarningCode};
use super::hall::HallContext;
use super::seat_places::SeatPlaces;
use crate::control::{Coded, Severity, Warning};
use crate::drive::link::AT_PARK;
use crate::motion::AxisGeometry;
use crate::rt::Row;
use crate::state::{Next, State};

/// Seats that are named one by one.
const FEW: usize = 8;

/// A seat that was read away from park.
#[derive(Debug)]
struct AwaySeat<'h> {
    name: &'h str,
    /// The first axis that is away, from 1.
    axis: usize,
    /// Where that is, with its unit.
    at: String,
    is_on: bool,
}

/// Those of a hall that is parked or armed; also of seats that a person has taken out, on which somebody may sit.
fn away<'h>(hall: &'h HallContext, table: &[Row]) -> Vec<AwaySeat<'h>> {
    let rests = matches!(hall.mirror.state, State::Parked | State::Armed);
    let lanes = if rests { hall.config.controllers.len() } else { 0 };
    (0..lanes).filter_map(|lane| away_seat(hall, table, lane)).collect()
}

fn away_seat<'h>(hall: &'h HallContext, table: &[Row], lane: usize) -> Option<AwaySeat<'h>> {
    let (controller, row) = (&hall.config.controllers[lane], table.get(lane)?);
    let SeatPlaces { positions_mm, measured, .. } = SeatPlaces::of(controller, &row.state);
    let read = positions_mm.filter(|_| measured.is_some() && row.homed == Some(true))?;
    let mut axes = controller.seat.own().iter().zip(read).enumerate();
    let is_off = |axis: &AxisGeometry, at: f64| (at - axis.place(axis.park)).abs() > AT_PARK * axis.stroke();
    let (index, (axis, at)) = axes.find(|(_, (axis, at))| is_off(axis, *at))?;
    let (name, at) = (controller.name.as_str(), format!("{at:.1} {}", axis.unit.name()));
    Some(AwaySeat { name, axis: index + 1, at, is_on: hall.settings.is_on(lane) })
}

/// What a state that says of the seats where they are leaves out; none where it is true of all that take part.
pub(super) fn words(hall: &HallContext, table: &[Row]) -> Option<String> {
    let seats = away(hall, table);
    let named = seats.iter().filter(|seat| seat.is_on);
    let named: Vec<String> =
        named.map(|AwaySeat { name, axis, at, .. }| format!("{name} (axis {axis} at {at})")).collect();
    (!named.is_empty()).then(|| format!("not at park: {}", few(&named)))
}

/// What a person does first, where the hall is parked and a seat is not.
pub(super) fn next_action(hall: &HallContext, table: &[Row]) -> Option<(String, Coded)> {
    // What deals with a seat already goes first.
    let of_a_seat = matches!(hall.mirror.next, Next::Clear | Next::ParkOrStart | Next::ParkOrHome);
    if hall.mirror.state != State::Parked || of_a_seat {
        return None;
    }
    let seats = away(hall, table);
    let names = |is_on: bool| -> Vec<String> {
        seats.iter().filter(|seat| seat.is_on == is_on).map(|seat| seat.name.to_owned()).collect()
    };
    let (on, out) = (names(true), names(false));
    if !on.is_empty() {
        let who = few(&on);
        return Some((format!("park: {who} not at park"), Coded::new(NextCode::ParkFirst.word(), [who])));
    }
    let who = (!out.is_empty()).then(|| few(&out))?;
    Some((format!("enable, then park: {who} not at park"), Coded::new(NextCode::EnableFirst.word(), [who])))
}

/// A warning of each.
pub(super) fn warnings(hall: &HallContext, table: &[Row]) -> Vec<Warning> {
    let warning = |AwaySeat { name, is_on, .. }: AwaySeat<'_>| {
        let (code, remedy) = match is_on {
            true => (RemedyCode::ParkIt, "park it before anybody gets on or off"),
            false => (RemedyCode::EnableIt, "it is disabled: enable it, then park it"),
        };
        Warning {
            id: WarningCode::NotAtPark.to_string(),
            severity: Severity::Error,
            controller: Some(name.to_owned()),
            text: "not at park".to_owned(),
            coded: Some(Coded::new(WarningCode::NotAtPark.word(), [])),
            remedy: remedy.to_owned(),
            remedy_code: Some(code.to_string()),
        }
    };
    away(hall, table).into_iter().map(warning).collect()
}

fn few(names: &[String]) -> String {
    let more = names.len().saturating_sub(FEW);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    names.iter().take(FEW).map(String::as_str).collect::<Vec<_>>().join(", ") + &more
}
