//! Reads the types of seats.

use std::sync::Arc;

use super::fault::Faults;
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
    section.require(&[
        "axes",
        "stroke_mm",
        "lead_mm",
        "pulses_per_rev",
        "max_velocity_mm_s",
        "max_acceleration_mm_s2",
        "max_jerk_mm_s3",
    ]);
    let axes = section.whole_in("axes", 1..=MAX_AXES);
    let interval = section.whole_in("max_interval_ms", 1..=65_535);
    let park = fractions(&mut section, "park", axes).unwrap_or_default();
    let neutral = fractions(&mut section, "neutral", axes).unwrap_or(park);
    let cylinder = cylinder(&mut section);
    section.finish();
    let (axes, cylinder) = (axes?, cylinder?);
    let mut each = [cylinder.padding(); MAX_AXES];
    for (axis, (park, neutral)) in each.iter_mut().zip(park.into_iter().zip(neutral)).take(axes) {
        *axis = AxisGeometry { park, neutral, ..cylinder };
    }
    let max_interval_ms = interval.unwrap_or(FACTORY_INTERVAL_MS);
    Some(SeatType { name: entry.key.to_owned(), axes, each, max_interval_ms })
}

/// The geometry that the keys of the seat give each of its axes.
fn cylinder(section: &mut Section<'_, '_, '_>) -> Option<AxisGeometry> {
    let stroke = section.above_zero("stroke_mm");
    let lead = section.above_zero("lead_mm");
    let pulses_per_rev = section.above_zero("pulses_per_rev");
    let velocity = section.above_zero("max_velocity_mm_s");
    let acceleration = section.above_zero("max_acceleration_mm_s2");
    let jerk = section.above_zero("max_jerk_mm_s3");
    let axis = AxisGeometry {
        unit: AxisUnit::Millimetre,
        low: 0.0,
        max_shaken_velocity: shaken(section, "max_shaken_velocity_mm_s", "max_velocity_mm_s", velocity),
        max_shaken_acceleration: shaken(
            section,
            "max_shaken_acceleration_mm_s2",
            "max_acceleration_mm_s2",
            acceleration,
        ),
        max_rpm: section.whole_in("max_rpm", 1..=65_535),
        high: stroke?,
        lead: lead?,
        pulses_per_rev: pulses_per_rev?,
        max_velocity: velocity?,
        max_acceleration: acceleration?,
        max_jerk: jerk?,
        park: 0.0,
        neutral: 0.0,
    };
    let pulses = axis.stroke_pulses();
    if !(1.0..=f64::from(i32::MAX)).contains(&pulses) {
        let message = format!("the stroke is {pulses:.1} pulses, outside 1..={}", i32::MAX);
        section.get("stroke_mm")?.fault(section.faults, &message);
        return None;
    }
    Some(axis)
}

/// What motion and vibration may reach together: no less than motion alone may.
fn shaken(
    section: &mut Section<'_, '_, '_>,
    key: &'static str,
    alone: &str,
    least: Option<f64>,
) -> Option<f64> {
    let most = section.above_zero(key)?;
    if let Some(least) = least.filter(|least| most < *least) {
        let message =
            format!("{most} is below {alone}, {least}; motion and vibration together may do what motion may");
        section.get(key)?.fault(section.faults, &message);
        return None;
    }
    Some(most)
}

/// A pose of the seat: one fraction of the stroke for each axis.
fn fractions(
    section: &mut Section<'_, '_, '_>,
    key: &'static str,
    axes: Option<usize>,
) -> Option<[f64; MAX_AXES]> {
    let entry = section.get(key)?;
    let values = entry.array(section.faults)?;
    if let Some(axes) = axes.filter(|&axes| axes != values.len()) {
        entry.fault(section.faults, &format!("{} values for {axes} axes; give one for each", values.len()));
        return None;
    }
    let mut pose = [0.0; MAX_AXES];
    for (axis, value) in pose.iter_mut().zip(&values) {
        *axis = value.number_in(0.0..=1.0, section.faults).unwrap_or(0.0);
    }
    Some(pose)
}
