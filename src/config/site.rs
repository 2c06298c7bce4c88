//! What controllers of all kinds are read with: the seat types and effects that they may name, their inputs.

use std::sync::Arc;

use super::Effect;
use super::section::{Section, did_you_mean};
use crate::motion::SeatType;
use crate::plain;

/// What controllers refer to.
pub(super) struct Site<'a> {
    pub(super) seats: &'a [Arc<SeatType>],
    /// The names of all seat types, also of those with faults.
    pub(super) named: &'a [&'a str],
    pub(super) effects: &'a [Effect],
}

/// A list of inputs, counted from 1, as a word.
pub(super) fn inputs_up_to(section: &mut Section<'_, '_, '_>, key: &'static str, last: u8) -> u16 {
    let Some(entries) = section.get(key).and_then(|entry| entry.array(section.faults)) else { return 0 };
    let inputs = entries.iter().filter_map(|entry| entry.whole_in(1..=last, section.faults));
    inputs.fold(0, |word, input: u8| word | 1 << (input - 1))
}

/// The seat type that a controller names, if that is sound.
pub(super) fn seat_of(section: &mut Section<'_, '_, '_>, site: &Site<'_>) -> Option<Arc<SeatType>> {
    let entry = section.get("seat")?;
    let name = entry.text(section.faults)?;
    if !site.named.contains(&name) {
        let hint = did_you_mean(name, site.named.iter().copied());
        entry.fault(section.faults, &format!("there is no [seat.{}]{hint}", plain::seen(name)));
    }
    site.seats.iter().find(|seat| seat.name == name).cloned()
}
