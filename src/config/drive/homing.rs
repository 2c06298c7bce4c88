//! `home = { … }`: how an axis finds its zero.

use crate::config::fault::Faults;
use crate::config::section::{Entry, Section};
use crate::motion::{AxisGeometry, AxisUnit};

use super::share;

/// Speed of the search unless another is given, mm/s.
const USUAL_SPEED: f64 = 10.0;
/// A search that is faster runs into what it looks for.
const MOST_SPEED: f64 = 50.0;
/// How much longer than needed the travel of a search may be: travel ends the search if a switch has failed.
const LONGEST_TRAVEL: f64 = 1.5;

/// How an axis finds its zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DriveHoming {
    /// What tells that it is there.
    pub(crate) way: HomeWay,
    /// At which end of the stroke that is.
    pub(crate) toward: Side,
    /// How fast it is looked for, mm/s.
    pub(crate) speed_mm_s: f64,
    /// How far at most, mm; 0 if nothing moves.
    pub(crate) travel_mm: f64,
    /// Where the axis is once it was found, mm.
    pub(crate) zero_mm: f64,
    /// Share of torque, or of current, of the search; `None` for that of a move.
    pub(crate) torque: Option<f64>,
    /// All axes of a seat at once; else one by one.
    pub(crate) together: bool,
}

/// What tells an axis where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HomeWay {
    /// The edge of a switch. A SIXpack 2 has one of its own for each motor, and no `input`.
    Switch {
        /// The input, 1 to 7.
        input: Option<u8>,
        /// True if it is high while the switch is on.
        active_high: bool,
    },
    /// The index pulse behind the edge of a switch.
    Index {
        /// The input of the switch, 1 to 7.
        input: Option<u8>,
        /// True if it is high while the switch is on.
        active_high: bool,
    },
    /// It runs into the stop of the mechanics.
    HardStop,
    /// A person says that it stands there.
    Here,
}

/// An end of the stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Where positions are lowest.
    Down,
    /// Where they are highest.
    Up,
}

#[derive(Clone, Copy, PartialEq)]
enum WayWord {
    Switch,
    Index,
    HardStop,
    Here,
}

/// Reads the table, and holds it against the axes of the seat.
pub(super) fn homing(
    entry: Entry<'_>,
    axes: &[AxisGeometry],
    faults: &mut Faults<'_>,
) -> Option<DriveHoming> {
    let mut section = Section::new("home", entry.at, entry.table(faults)?, faults);
    section.require(&["way"]);
    let ways = [
        ("switch", WayWord::Switch),
        ("index", WayWord::Index),
        ("hard-stop", WayWord::HardStop),
        ("here", WayWord::Here),
    ];
    let word = section.choice("way", &ways);
    let needed: &[&str] = match word {
        Some(WayWord::Here) => &["zero_mm"],
        Some(WayWord::HardStop) => &["toward", "travel_mm", "zero_mm", "torque"],
        _ => &["toward", "travel_mm", "zero_mm"],
    };
    section.require(needed);
    let [input_at, active_at] = ["input", "active"].map(|key| section.get(key));
    let input = section.whole_in("input", 1..=7_u8);
    let active_high = section.choice("active", &[("high", true), ("low", false)]).unwrap_or(true);
    let toward = section.choice("toward", &[("down", Side::Down), ("up", Side::Up)]);
    let speed_mm_s = section.number_in("speed_mm_s", 0.1..=MOST_SPEED).unwrap_or(USUAL_SPEED);
    let travel_at = section.get("travel_mm");
    let travel_mm = section.above_zero("travel_mm");
    let zero_at = section.get("zero_mm");
    let zero_mm = zero_at.and_then(|entry| entry.number(section.faults));
    let torque = share(&mut section, "torque");
    let together = section.get("together").and_then(|entry| entry.switch(section.faults)).unwrap_or(false);
    let way = match word? {
        WayWord::Switch => HomeWay::Switch { input, active_high },
        WayWord::Index => HomeWay::Index { input, active_high },
        WayWord::HardStop => HomeWay::HardStop,
        WayWord::Here => HomeWay::Here,
    };
    refuse_unused(&mut section, way, [input_at, active_at, travel_at]);
    section.finish();
    let toward = if way == HomeWay::Here { toward.unwrap_or(Side::Down) } else { toward? };
    let travel_mm = if way == HomeWay::Here { 0.0 } else { travel_mm? };
    let homing = DriveHoming { way, toward, speed_mm_s, travel_mm, zero_mm: zero_mm?, torque, together };
    // An axis that turns is refused for itself.
    let cylinders: Vec<_> = axes.iter().filter(|axis| axis.unit == AxisUnit::Millimetre).copied().collect();
    zero_at.into_iter().for_each(|entry| homing.refuse_zero(entry, &cylinders, faults));
    travel_at.into_iter().for_each(|entry| homing.refuse_travel(entry, &cylinders, faults));
    Some(homing)
}

/// Notes keys that say nothing where an axis finds its zero in this way.
fn refuse_unused(section: &mut Section<'_, '_, '_>, way: HomeWay, keys: [Option<Entry<'_>>; 3]) {
    let [input, active, travel] = keys;
    let (unused, why): (&[_], _) = match way {
        HomeWay::Switch { .. } | HomeWay::Index { .. } => return,
        HomeWay::HardStop => (&[input, active], "a hard stop has no switch; omit it"),
        HomeWay::Here => (&[input, active, travel], "nothing moves if a person confirms its position"),
    };
    unused.iter().flatten().for_each(|entry| entry.fault(section.faults, why));
}

impl DriveHoming {
    /// Notes a zero on the wrong side of the stroke: seats would stop at it in mid-air, or never reach it.
    fn refuse_zero(&self, entry: Entry<'_>, axes: &[AxisGeometry], faults: &mut Faults<'_>) {
        let zero = self.zero_mm;
        let is_wrong = |axis: &&AxisGeometry| match (self.way, self.toward) {
            (HomeWay::Here, _) => !(axis.low..=axis.high).contains(&zero),
            (_, Side::Down) => zero > axis.low,
            (_, Side::Up) => zero < axis.high,
        };
        let Some(axis) = axes.iter().find(is_wrong) else { return };
        let (low, high) = (axis.low, axis.high);
        let message = match (self.way, self.toward) {
            (HomeWay::Here, _) => format!("{zero} mm is outside the stroke, {low} to {high} mm"),
            (_, Side::Down) => format!(
                "{zero} mm is above {low} mm, the lower end of the stroke; the homing point of an axis is at it or below"
            ),
            (_, Side::Up) => format!(
                "{zero} mm is below {high} mm, the upper end of the stroke; the homing point of an axis is at it or above"
            ),
        };
        entry.fault(faults, &message);
    }

    /// Notes a travel that does not reach from the far end of the stroke, or goes on long after it should have.
    fn refuse_travel(&self, entry: Entry<'_>, axes: &[AxisGeometry], faults: &mut Faults<'_>) {
        if self.way == HomeWay::Here {
            return;
        }
        let need = |axis: &AxisGeometry| match self.toward {
            Side::Down => axis.high - self.zero_mm,
            Side::Up => self.zero_mm - axis.low,
        };
        let needed = axes.iter().map(need).fold(0.0, f64::max);
        // A zero on the wrong side is told itself, and no travel mends that.
        if needed <= 0.0 {
            return;
        }
        let (travel, most) = (self.travel_mm, LONGEST_TRAVEL * needed);
        if travel < needed {
            let message =
                format!("{travel} mm do not reach {} mm from the far end; {needed} do", self.zero_mm);
            entry.fault(faults, &message);
        } else if travel > most {
            let message = format!(
                "{travel} mm are over {most:.0}, one and a half times what is needed; it ends the search where a switch \
                 has failed"
            );
            entry.fault(faults, &message);
        }
    }
}
