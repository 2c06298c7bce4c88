//! Reads the types of seats.

use std::sync::Arc;

use super::axis::{AxisKeys, NEEDED, OwnAxis, TABLES, leaves_to_seat, own_axis, refuse_far_park};
use super::fault::Faults;
use super::level::level;
use super::section::{Entry, Section};
use crate::motion::{AxisGeometry, AxisUnit, FACTORY_INTERVAL_MS, MAX_AXES, SeatType};

/// The seat types that are sound, and the names of all.
pub(super) fn seats<'t>(entry: Entry<'t>, faults: &mut Faults<'_>) -> (Vec<Arc<SeatType>>, Vec<&'t str>) {
    let Some(table) = entry.table(faults) else { return Default::default() };
    let mut sound = Vec::new();
    for (name, value) in table {
        let entry = Entry::new(name.get_ref(), value);
        sound.extend(seat(entry, faults).map(Arc::new));
    }
    (sound, table.keys().map(|name| name.get_ref().as_ref()).collect())
}

fn seat(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<SeatType> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[seat.{}]", entry.key), entry.at, table, faults);
    let axes = section.whole_in("axes", 1..=MAX_AXES);
    let tables = TABLES.map(|key| section.get(key));
    let own = &tables[..axes.unwrap_or(MAX_AXES)];
    section.require(&["axes"]);
    section.require(&needed(own));
    let said = AxisKeys::of_seat(&mut section);
    let interval = section.whole_in("max_interval_ms", 1..=65_535);
    let vibration = level(&mut section, "vibration");
    let [park, neutral] = ["park", "neutral"].map(|key| SeatPose::read(&mut section, key, axes));
    // The table of drives is read once all seats are known: `drive`.
    let [stroke, _] = ["stroke_mm", "drive"].map(|key| section.get(key));
    section.finish();
    let (axes, cylinder) = (axes?, said.axis(AxisUnit::Millimetre));
    for beyond in tables[axes..].iter().flatten() {
        beyond.fault(faults, &format!("the seat has {axes} axes; raise axes, or omit this"));
    }
    if own.iter().any(Option::is_none) {
        refuse_pulses(stroke, cylinder, faults);
    }
    let mut each = Vec::new();
    for (index, own) in own.iter().enumerate() {
        let read = match own {
            Some(own) => own_axis(entry.key, *own, said, faults),
            None => cylinder.map(OwnAxis::of_seat),
        };
        let Some(OwnAxis { axis, park: own_park, neutral: own_neutral }) = read else { continue };
        refuse_pulses(*own, Some(axis), faults);
        let park = own_park.or_else(|| park.of(index, &axis, faults)).unwrap_or(axis.park);
        let neutral = own_neutral.or_else(|| neutral.of(index, &axis, faults)).unwrap_or(park);
        let axis = AxisGeometry { park, neutral, ..axis };
        refuse_far_park(own.unwrap_or(entry), &axis, faults);
        each.push(axis);
    }
    let padding = each.first().filter(|_| each.len() == axes)?.padding();
    refuse_second_rotary(&each, own, faults);
    each.resize(MAX_AXES, padding);
    Some(SeatType {
        name: entry.key.to_owned(),
        axes,
        each: each.try_into().ok()?,
        max_interval_ms: interval.unwrap_or(FACTORY_INTERVAL_MS),
        vibration: vibration.unwrap_or(1.0),
    })
}

/// The keys that some cylinder leaves to the seat.
fn needed(own: &[Option<Entry<'_>>]) -> Vec<&'static str> {
    let is_left = |key: &&str| own.iter().any(|own| own.is_none_or(|own| leaves_to_seat(&own, key)));
    NEEDED.into_iter().filter(is_left).collect()
}

/// Notes a range that has more pulses than a frame can say, or less than one.
fn refuse_pulses(at: Option<Entry<'_>>, axis: Option<AxisGeometry>, faults: &mut Faults<'_>) {
    let (Some(at), Some(axis)) = (at, axis) else { return };
    let (pulses, range) = (axis.stroke_pulses(), axis.pulse_range());
    let most = f64::from(i32::MAX);
    if !(1.0..=most).contains(&pulses) {
        at.fault(faults, &format!("the stroke is {pulses:.1} pulses, outside 1..={}", i32::MAX));
    } else if range.low < -most || range.high > most {
        at.fault(faults, &format!("the range is {range} pulses, outside what a frame can carry, {most}"));
    }
}

/// Notes a rotary axis beside another: a controller knows of one (PA03).
fn refuse_second_rotary(each: &[AxisGeometry], own: &[Option<Entry<'_>>], faults: &mut Faults<'_>) {
    let turns = each.iter().zip(own).filter(|(axis, _)| axis.unit == AxisUnit::Degree);
    for second in turns.skip(1).filter_map(|(_, own)| own.as_ref()) {
        second.fault(faults, "the seat already has a rotary axis; a controller has only one (PA03)");
    }
}

/// A pose of the seat: one fraction of the stroke for each axis.
struct SeatPose<'t>(Option<(Entry<'t>, [f64; MAX_AXES])>);

impl<'t> SeatPose<'t> {
    fn read(section: &mut Section<'t, '_, '_>, key: &'static str, axes: Option<usize>) -> Self {
        let entry = section.get(key);
        Self(entry.and_then(|entry| Some((entry, fractions(entry, axes, section.faults)?))))
    }

    /// Where it has an axis, fraction of its range.
    fn of(&self, index: usize, axis: &AxisGeometry, faults: &mut Faults<'_>) -> Option<f64> {
        let (entry, pose) = self.0.as_ref()?;
        if axis.low != 0.0 {
            let (axis, low, unit, key) = (index + 1, axis.low, axis.unit.name(), entry.key);
            let message = format!(
                "a fraction of the range of axis {axis}, which begins at {low} {unit}, is easily taken for a position; give \
                 axis{axis} {key} of its own, in {unit}"
            );
            entry.fault(faults, &message);
        }
        Some(pose[index])
    }
}

fn fractions(entry: Entry<'_>, axes: Option<usize>, faults: &mut Faults<'_>) -> Option<[f64; MAX_AXES]> {
    let values = entry.array(faults)?;
    if let Some(axes) = axes.filter(|&axes| axes != values.len()) {
        entry.fault(faults, &format!("{} values for {axes} axes; give one for each", values.len()));
        return None;
    }
    let mut pose = [0.0; MAX_AXES];
    for (axis, value) in pose.iter_mut().zip(&values) {
        *axis = value.number_in(0.0..=1.0, faults).unwrap_or(0.0);
    }
    Some(pose)
}
