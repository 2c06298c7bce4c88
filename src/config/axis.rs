//! Reads what the axes of a type of seat are: the keys of the seat, which hold for each of its cylinders, and the tables of
//! single axes, which come before them.

use super::fault::Faults;
use super::section::{Entry, Section};
use crate::motion::{AxisGeometry, AxisUnit, MAX_AXES, PARKS_WITHIN_S};

/// The tables of axes.
pub(super) const TABLES: [&str; MAX_AXES] = [
    "axis1", "axis2", "axis3", "axis4", "axis5", "axis6", "axis7", "axis8", "axis9", "axis10", "axis11",
    "axis12",
];
/// What a seat needs for those of its cylinders that do not have it themselves.
pub(super) const NEEDED: [&str; 6] = [
    "stroke_mm",
    MILLIMETRES.lead,
    "pulses_per_rev",
    MILLIMETRES.velocity,
    MILLIMETRES.acceleration,
    MILLIMETRES.jerk,
];
/// A rotary axis that says nothing of gears is turned by its motor itself.
const TURN_DEG: f64 = 360.0;

/// The keys of what is measured in a unit.
struct UnitKeys {
    lead: &'static str,
    velocity: &'static str,
    acceleration: &'static str,
    jerk: &'static str,
    shaken_velocity: &'static str,
    shaken_acceleration: &'static str,
}

const MILLIMETRES: UnitKeys = UnitKeys {
    lead: "lead_mm",
    velocity: "max_velocity_mm_s",
    acceleration: "max_acceleration_mm_s2",
    jerk: "max_jerk_mm_s3",
    shaken_velocity: "max_shaken_velocity_mm_s",
    shaken_acceleration: "max_shaken_acceleration_mm_s2",
};
const DEGREES: UnitKeys = UnitKeys {
    lead: "lead_deg",
    velocity: "max_velocity_deg_s",
    acceleration: "max_acceleration_deg_s2",
    jerk: "max_jerk_deg_s3",
    shaken_velocity: "max_shaken_velocity_deg_s",
    shaken_acceleration: "max_shaken_acceleration_deg_s2",
};

/// What keys say of an axis, `None` where they say nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AxisKeys {
    /// The ends of the range.
    ends: Option<(f64, f64)>,
    lead: Option<f64>,
    pulses_per_rev: Option<f64>,
    velocity: Option<f64>,
    acceleration: Option<f64>,
    jerk: Option<f64>,
    shaken_velocity: Option<f64>,
    shaken_acceleration: Option<f64>,
    max_rpm: Option<u32>,
}

impl AxisKeys {
    /// What the keys of a seat say of its cylinders.
    pub(super) fn of_seat(section: &mut Section<'_, '_, '_>) -> Self {
        let ends = section.above_zero("stroke_mm").map(|stroke| (0.0, stroke));
        Self { ends, ..Self::default() }.with(section, &MILLIMETRES)
    }

    /// The same where a table says nothing else.
    fn with(self, section: &mut Section<'_, '_, '_>, words: &UnitKeys) -> Self {
        let velocity = section.above_zero(words.velocity).or(self.velocity);
        let acceleration = section.above_zero(words.acceleration).or(self.acceleration);
        let shaken_velocity = shaken(section, words.shaken_velocity, words.velocity, velocity);
        let shaken_acceleration =
            shaken(section, words.shaken_acceleration, words.acceleration, acceleration);
        Self {
            ends: self.ends,
            lead: section.above_zero(words.lead).or(self.lead),
            pulses_per_rev: section.above_zero("pulses_per_rev").or(self.pulses_per_rev),
            velocity,
            acceleration,
            jerk: section.above_zero(words.jerk).or(self.jerk),
            shaken_velocity: shaken_velocity.or(self.shaken_velocity),
            shaken_acceleration: shaken_acceleration.or(self.shaken_acceleration),
            max_rpm: section.whole_in("max_rpm", 1..=65_535).or(self.max_rpm),
        }
    }

    /// The axis that this makes, at rest where its 0 is; `None` if something is missing.
    pub(super) fn axis(self, unit: AxisUnit) -> Option<AxisGeometry> {
        let (low, high) = self.ends?;
        let zero = (0.0 - low) / (high - low);
        Some(AxisGeometry {
            unit,
            low,
            high,
            lead: self.lead?,
            pulses_per_rev: self.pulses_per_rev?,
            max_velocity: self.velocity?,
            max_acceleration: self.acceleration?,
            max_jerk: self.jerk?,
            max_shaken_velocity: self.shaken_velocity,
            max_shaken_acceleration: self.shaken_acceleration,
            max_rpm: self.max_rpm,
            park: zero,
            neutral: zero,
        })
    }
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
            format!("{most} is below {alone}, {least}; motion and vibration together need at least that");
        section.get(key)?.fault(section.faults, &message);
        return None;
    }
    Some(most)
}

/// What the table of an axis makes of it.
pub(super) struct OwnAxis {
    pub(super) axis: AxisGeometry,
    /// Where it rests, and what levels scale about, as far as the table says so: fractions of the range.
    pub(super) park: Option<f64>,
    pub(super) neutral: Option<f64>,
}

impl OwnAxis {
    /// An axis that has all from the keys of its seat.
    pub(super) fn of_seat(axis: AxisGeometry) -> Self {
        Self { axis, park: None, neutral: None }
    }
}

/// True if the table is one of a cylinder that leaves `key` to the seat.
pub(super) fn leaves_to_seat(entry: &Entry<'_>, key: &str) -> bool {
    let Some(table) = entry.value.as_table() else { return false };
    let is_ranged = key == "stroke_mm" && table.contains_key("range");
    let is_cylinder = table.get("unit").is_none_or(|unit| unit.get_ref().as_str() == Some("mm"));
    is_cylinder && !is_ranged && !table.contains_key(key)
}

/// Reads `[seat.NAME.axisN]`; `seat` is what the keys of the seat say of its cylinders.
pub(super) fn own_axis(
    name: &str,
    entry: Entry<'_>,
    seat: AxisKeys,
    faults: &mut Faults<'_>,
) -> Option<OwnAxis> {
    let table = entry.table(faults)?;
    let mut section = Section::new(format!("[seat.{name}.{}]", entry.key), entry.at, table, faults);
    let unit = match section.get("unit") {
        None => AxisUnit::Millimetre,
        Some(unit) => {
            unit.choice(&[("mm", AxisUnit::Millimetre), ("deg", AxisUnit::Degree)], section.faults)?
        }
    };
    let said = match unit {
        AxisUnit::Millimetre => {
            let stroke = section.get("stroke_mm");
            if let Some(stroke) = stroke.filter(|_| table.contains_key("range")) {
                stroke.fault(section.faults, "range says that as well; omit one of them");
            }
            let ends = section.above_zero("stroke_mm").map(|stroke| (0.0, stroke)).or(seat.ends);
            AxisKeys { ends, ..seat }.with(&mut section, &MILLIMETRES)
        }
        AxisUnit::Degree => {
            let UnitKeys { velocity, acceleration, jerk, .. } = DEGREES;
            section.require(&["range", "pulses_per_rev", velocity, acceleration, jerk]);
            AxisKeys { lead: Some(TURN_DEG), ..AxisKeys::default() }.with(&mut section, &DEGREES)
        }
    };
    let ends = range(&mut section, unit);
    let axis = AxisKeys { ends: ends.unwrap_or(said.ends), ..said }.axis(unit);
    let [park, neutral] = ["park", "neutral"].map(|key| place(&mut section, key, axis.as_ref()));
    refuse_turned_park(&mut section, axis.as_ref(), park);
    section.finish();
    Some(OwnAxis { axis: axis?, park, neutral })
}

/// The ends that a table says its axis has, `None` if it says nothing of them.
fn range(section: &mut Section<'_, '_, '_>, unit: AxisUnit) -> Option<Option<(f64, f64)>> {
    let entry = section.get("range")?;
    Some(ends(&entry, unit, section.faults))
}

fn ends(entry: &Entry<'_>, unit: AxisUnit, faults: &mut Faults<'_>) -> Option<(f64, f64)> {
    let values = entry.array(faults)?;
    let [low, high] = values[..] else {
        entry.fault(faults, &format!("{} values; give the lower end and the upper end", values.len()));
        return None;
    };
    let (low, high) = (low.number(faults)?, high.number(faults)?);
    let unit_name = unit.name();
    if low >= high {
        entry.fault(faults, &format!("{low} to {high} {unit_name} is reversed; put the lower end first"));
        return None;
    }
    if !(low..=high).contains(&0.0) {
        let zero = match unit {
            AxisUnit::Millimetre => "the axis is at 0 once it is homed",
            AxisUnit::Degree => "the 0 of a rotary axis is its position when its controller starts",
        };
        entry.fault(
            faults,
            &format!("0 is outside {low} to {high} {unit_name}; {zero}: give a range with 0 in it"),
        );
        return None;
    }
    Some((low, high))
}

/// A place of an axis in its unit, as a fraction of its range.
fn place(section: &mut Section<'_, '_, '_>, key: &'static str, axis: Option<&AxisGeometry>) -> Option<f64> {
    let entry = section.get(key)?;
    let place = entry.number(section.faults)?;
    let AxisGeometry { low, high, unit, .. } = *axis?;
    if !(low..=high).contains(&place) {
        let unit = unit.name();
        entry.fault(
            section.faults,
            &format!("{place} {unit} is outside the range of the axis, {low} to {high} {unit}"),
        );
        return None;
    }
    Some((place - low) / (high - low))
}

/// Notes a park place of a rotary axis that is not its 0: homed there, as seats are that are parked, it would turn as far again.
fn refuse_turned_park(section: &mut Section<'_, '_, '_>, axis: Option<&AxisGeometry>, park: Option<f64>) {
    let (Some(axis), Some(park), Some(entry)) = (axis, park, section.get("park")) else { return };
    if axis.unit == AxisUnit::Degree && axis.place(park).abs() > 1e-9 {
        let at = axis.place(park);
        let message = format!(
            "{at} deg: a rotary axis parks at 0, as where it stands when it is homed becomes its 0; omit it, and turn the mechanics, so that \
             the seat faces there at 0"
        );
        entry.fault(section.faults, &message);
    }
}

/// Notes an axis that takes longer to park than the hall waits for.
pub(super) fn refuse_far_park(at: Entry<'_>, axis: &AxisGeometry, faults: &mut Faults<'_>) {
    let seconds = axis.longest_park();
    // One of more pulses than there are is told of that.
    if seconds > PARKS_WITHIN_S && axis.stroke_pulses() < f64::from(i32::MAX) {
        let (AxisGeometry { low, high, max_velocity, .. }, unit) = (*axis, axis.unit.name());
        let speed = max_velocity.min(axis.unit.park_velocity());
        let message = format!(
            "from the farther end of {low} to {high} {unit} it parks in {seconds:.0} s, at {speed} {unit}/s, over {PARKS_WITHIN_S}; narrow \
             its range, or raise its greatest speed where that is lower"
        );
        at.fault(faults, &message);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{faults_of, hall_with};
    use super::*;
    use crate::motion::Pulses;

    const TURNS: &str = "max_velocity_deg_s = 60\nmax_acceleration_deg_s2 = 120\nmax_jerk_deg_s3 = 600\n\
        pulses_per_rev = 36000\n";

    fn turntable(more: &str) -> String {
        format!("[seat.s.axis4]\nunit = \"deg\"\n{TURNS}{more}")
    }

    fn the_fault(more: &str) -> String {
        let faults = faults_of(more);
        let [fault] = &faults[..] else { panic!("{faults:?}") };
        fault.clone()
    }

    #[test]
    fn a_turntable_stands_beside_cylinders_with_a_range_and_limits_of_its_own() {
        let seat = hall_with(&turntable("range = [-180, 90]\npark = 0\nneutral = -90\n")).seats.remove(0);
        let [three @ .., turns] = &seat.own()[..4] else { panic!("six axes") };
        assert!(three.iter().all(|axis| *axis == AxisGeometry::BENCH));
        assert_eq!((turns.unit, turns.low, turns.high), (AxisUnit::Degree, -180.0, 90.0));
        assert_eq!((turns.max_velocity, turns.max_acceleration, turns.max_jerk), (60.0, 120.0, 600.0));
        assert_eq!((turns.pulses(0.0), turns.pulses(turns.park)), (Pulses(-18_000), Pulses(0)));
        assert_eq!((turns.place(turns.neutral), turns.max_rpm), (-90.0, None));
        assert_eq!(seat.each[6].pulses(seat.each[6].park), Pulses(0), "what pads a frame");
    }

    #[test]
    fn a_rotary_axis_rests_where_its_zero_is_and_gears_say_how_far_a_turn_takes_it() {
        let turns = hall_with(&turntable("range = [-180, 180]\nlead_deg = 36\n")).seats[0].each[3];
        assert_eq!((turns.place(turns.park), turns.pulses(turns.park)), (0.0, Pulses(0)));
        assert_eq!(turns.pulses(1.0), Pulses(180_000), "five turns of the motor");
        assert_eq!(turns.speed_ceiling(), 1_800.0, "deg/s at 3,000 turns a minute");
    }

    #[test]
    fn a_cylinder_overrides_what_its_seat_says() {
        let seat = hall_with("[seat.s.axis2]\nrange = [-50, 100]\nlead_mm = 10\npark = 25\n").seats.remove(0);
        let [first, second, ..] = seat.own() else { panic!("six axes") };
        assert_eq!(*first, AxisGeometry::BENCH);
        assert_eq!((second.pulses(0.0), second.pulses(1.0)), (Pulses(-50_000), Pulses(100_000)));
        assert_eq!((second.park, second.max_velocity), (0.5, 240.0));
    }

    #[test]
    fn what_an_axis_cannot_be_is_named_with_its_line_and_what_to_do() {
        for (more, line, text) in [
            ("range = [180, -180]\n", 19, "range: 180 to -180 deg is reversed; put the lower end first"),
            (
                "range = [10, 90]\n",
                19,
                "range: 0 is outside 10 to 90 deg; the 0 of a rotary axis is its position",
            ),
            ("range = [-180]\n", 19, "range: 1 values; give the lower end and the upper end"),
            (
                "range = [-90, 90]\npark = 91\n",
                20,
                "park: 91 deg is outside the range of the axis, -90 to 90 deg",
            ),
            (
                "range = [-90, 90]\npark = 45\n",
                20,
                "park: 45 deg: a rotary axis parks at 0, as where it stands when it is homed becomes its 0",
            ),
            (
                "range = [-3600, 3600]\n",
                13,
                "axis4: from the farther end of -3600 to 3600 deg it parks in 360 s, at 10 deg/s, over 100; narrow its range",
            ),
            (
                "range = [-90, 90]\nlead_mm = 5\n",
                20,
                "lead_mm: unknown key in [seat.s.axis4]; did you mean lead_deg?",
            ),
            ("", 13, "[seat.s.axis4] has no range, which is needed"),
            ("range = [-1e9, 1e9]\n", 13, "axis4: the stroke is 200000000000.0 pulses, outside 1..="),
        ] {
            let fault = the_fault(&turntable(more));
            assert!(fault.starts_with(&format!("hall.toml:{line}:")) && fault.contains(text), "{fault}");
        }
        for (more, text) in [
            ("[seat.s.axis7]\nlead_mm = 2\n", "axis7: the seat has 6 axes; raise axes, or omit this"),
            ("[seat.s.axis1]\nunit = \"grad\"\n", "unit: \"grad\" is not one of mm, deg"),
            ("[seat.s.axis1]\nrange = [5, 9]\n", "the axis is at 0 once it is homed"),
            ("[seat.s.axis1]\nrange = [0, 9]\nstroke_mm = 9\n", "stroke_mm: range says that as well"),
        ] {
            let fault = the_fault(more);
            assert!(fault.contains(text), "{fault}");
        }
    }

    #[test]
    fn a_controller_has_one_rotary_axis() {
        let range = "range = [-90, 90]\n";
        let second = turntable(range).replace("axis4", "axis5");
        let fault = the_fault(&format!("{}{second}", turntable(range)));
        assert!(fault.contains("axis5: the seat already has a rotary axis"), "{fault}");
    }
}
