//! Judges the reported positions of the axes: their word order, and if they are plausible.

use super::{Check, Notes, Subject};
use crate::device::home::DPF0;
use crate::device::{change::dialect_name, position_words_of};
use crate::motion::{PulseRange, Pulses, in_stroke};
use crate::wire::{Dialect, WordOrder, position, word_order};

/// What DPF0 reads once the controller knows its zero; before, no place means anything.
const HOMED: u16 = 2;

pub(super) fn judge(subject: &Subject<'_>, notes: &mut Notes) {
    if subject.register(DPF0) != Some(HOMED) {
        return;
    }
    let Some(survey) = subject.survey else { return };
    let strokes = subject.controller.seat.pulse_ranges();
    let axes = subject.working_axes().min(subject.controller.seat.axes);
    let Some(words) = position_words_of(&survey.values, axes) else { return };
    let again = position_words_of(&survey.again, axes);
    let reported = survey.reported.measured.map(|heard| heard.value);
    let dialect = subject.controller.connection.dialect;
    let stand = Stand { words: &words, dialect, strokes: &strokes, reported: reported.as_deref() };
    let stand = if again.is_some_and(|again| stand.rests(&again)) {
        stand
    } else {
        Stand { reported: None, ..stand }
    };
    match stand.order() {
        WordOrder::Configured | WordOrder::Same => {}
        WordOrder::Other => notes.add(Check::WordOrder, stand.two_readings(), remedy(dialect)),
        WordOrder::Both => notes.add(
            Check::WordOrderOpen,
            stand.two_readings(),
            "set PA1f = 1, so that its reports decide, or home the seat and try again",
        ),
        WordOrder::Neither => notes.add(Check::Position, stand.what_cannot_be(), AFTER_HOMING),
    }
    judge_further_axes(reported.as_deref(), words.len(), &strokes, notes);
}

const AFTER_HOMING: &str =
    "home the seat; if this remains, correct stroke_mm, lead_mm and pulses_per_rev of its type";

fn remedy(dialect: Dialect) -> String {
    format!(
        "write dialect = \"{}\" for this controller, if it is one; otherwise have its firmware checked, and do not play to it",
        dialect_name(other(dialect))
    )
}

/// Axes without position registers, of which only a report tells.
fn judge_further_axes(reported: Option<&[Pulses]>, known: usize, strokes: &[PulseRange], notes: &mut Notes) {
    let further = reported.into_iter().flatten().zip(strokes).enumerate().skip(known);
    for (axis, (place, stroke)) in further.filter(|(_, (place, stroke))| !in_stroke(**place, **stroke)) {
        notes.add(Check::Position, outside(axis, *place, *stroke), AFTER_HOMING);
    }
}

/// What was told of the axes of a seat.
#[derive(Clone, Copy)]
struct Stand<'a> {
    words: &'a [[u16; 2]],
    dialect: Dialect,
    /// Of each axis.
    strokes: &'a [PulseRange],
    reported: Option<&'a [Pulses]>,
}

impl Stand<'_> {
    fn order(&self) -> WordOrder {
        word_order(self.words, self.dialect, self.strokes, self.reported)
    }

    /// True if the seat stood where it stands by a later reading: only then does a report tell of the same place.
    fn rests(&self, again: &[[u16; 2]]) -> bool {
        let near = |(one, two): (&[u16; 2], &[u16; 2])| {
            let [one, two] = [one, two].map(|words| position(*words, self.dialect));
            one.0.abs_diff(two.0) <= 1
        };
        self.words.iter().zip(again).all(near)
    }

    /// The first axis of which the two orders tell different places.
    fn two_readings(&self) -> String {
        let readings = self.words.iter().enumerate().map(|(axis, words)| {
            let [own, other] = [self.dialect, other(self.dialect)].map(|dialect| position(*words, dialect).0);
            (axis + 1, own, other)
        });
        let mut readings = readings.filter(|(_, own, other)| own != other);
        let Some((axis, own, by_other)) = readings.next() else { return String::new() };
        let (dialect, other) = (dialect_name(self.dialect), dialect_name(other(self.dialect)));
        format!(
            "axis {axis} is at {own} pulses in the word order of {dialect}, at {by_other} in that of {other}; its stroke \
             is {}",
            self.strokes[axis - 1]
        )
    }

    /// The first axis that is outside its stroke, or elsewhere than its report says.
    fn what_cannot_be(&self) -> String {
        let places: Vec<_> = self.words.iter().map(|words| position(*words, self.dialect)).collect();
        let outside_of = |(axis, (place, stroke)): (usize, (&Pulses, &PulseRange))| {
            (!in_stroke(*place, *stroke)).then(|| outside(axis, *place, *stroke))
        };
        let elsewhere = || {
            let reported = self.reported.into_iter().flatten();
            let (axis, (place, report)) = places
                .iter()
                .zip(reported)
                .enumerate()
                .max_by_key(|(_, (one, two))| one.0.abs_diff(two.0))?;
            let axis = axis + 1;
            Some(format!(
                "axis {axis} is at {} pulses by its registers, at {} by its reports",
                place.0, report.0
            ))
        };
        places
            .iter()
            .zip(self.strokes)
            .enumerate()
            .find_map(outside_of)
            .or_else(elsewhere)
            .unwrap_or_default()
    }
}

fn outside(axis: usize, place: Pulses, stroke: PulseRange) -> String {
    format!("axis {} is at {} pulses, outside its stroke of {stroke}", axis + 1, place.0)
}

const fn other(dialect: Dialect) -> Dialect {
    match dialect {
        Dialect::Smc => Dialect::Mbox,
        Dialect::Mbox => Dialect::Smc,
    }
}
