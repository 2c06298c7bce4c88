//! What of `[seat.NAME.drive]` only a SIXpack 2 has: its clock, its current, its position loop.

use crate::config::fault::Faults;
use crate::config::section::{Entry, Section};
use crate::motion::{AxisGeometry, SeatType};
use crate::wire::sixpack2::{GREATEST_DIVIDER, MOST_STEPS, greatest_divider};

/// The shares of its peak current that it can be set to, percent (CMD $11).
pub(crate) const SHARES: [u8; 9] = [100, 75, 50, 38, 25, 19, 13, 9, 0];
/// Microsteps that an axis and the search for its zero may make together: the counter of a seat that is home begins at 1,000,000 or more, and none that was
/// restarted, or is not home yet, may look like that.
const MOST_WAY: f64 = 900_000.0;
/// The divider that its manual starts with.
const USUAL_DIVIDER: u8 = 5;

/// Settings of a SIXpack 2.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sixpack2Drive {
    /// Divides its clock (CMD $12): the smaller, the faster it can go.
    pub(crate) clock_divider: u8,
    /// Divides the difference to the target (CMD $19).
    pub(crate) propdiv: PropDiv,
    /// The speed that its motors take in one step, mm/s; `None` for what the seat's own acceleration gives in a segment.
    pub(crate) jump_mm_s: Option<f64>,
    /// Current of its motors.
    pub(crate) current: MotorCurrent,
}

/// How the difference to the target is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PropDiv {
    /// By the least that the seat type's limits allow.
    Auto,
    /// By so much.
    Fixed(u8),
}

/// Current of a stepper motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MotorCurrent {
    /// The greatest, as CMD $10 has it.
    pub(crate) peak: u8,
    /// Its share at rest, percent.
    pub(crate) stand: u8,
    /// At constant speed.
    pub(crate) run: u8,
    /// While it speeds up or slows down.
    pub(crate) ramp: u8,
}

/// What it says of a SIXpack 2, which may be nothing; `None` if that has faults.
pub(super) fn sixpack2(section: &mut Section<'_, '_, '_>) -> Option<Option<Sixpack2Drive>> {
    let clock_divider = section.whole_in("clock_divider", 0..=GREATEST_DIVIDER).unwrap_or(USUAL_DIVIDER);
    let propdiv = propdiv(section);
    let jump_mm_s = section.above_zero("jump_mm_s");
    let Some(entry) = section.get("current") else { return Some(None) };
    let current = current(entry, section.faults)?;
    Some(Some(Sixpack2Drive { clock_divider, propdiv, jump_mm_s, current }))
}

fn propdiv(section: &mut Section<'_, '_, '_>) -> PropDiv {
    let Some(entry) = section.get("propdiv") else { return PropDiv::Auto };
    match entry.value.as_str() {
        Some("auto") => PropDiv::Auto,
        Some(_) => {
            entry.fault(section.faults, "is neither a whole number nor \"auto\"");
            PropDiv::Auto
        }
        None => entry.whole_in(1..=255, section.faults).map_or(PropDiv::Auto, PropDiv::Fixed),
    }
}

fn current(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<MotorCurrent> {
    let mut section = Section::new("current", entry.at, entry.table(faults)?, faults);
    section.require(&["peak"]);
    let peak = section.whole_in("peak", 1..=255);
    let [stand, run, ramp] =
        [("stand", 50), ("run", 75), ("ramp", 100)].map(|(key, usual)| share_of(&mut section, key, usual));
    section.finish();
    Some(MotorCurrent { peak: peak?, stand, run, ramp })
}

/// One of the shares that it has, as `"50%"`.
fn share_of(section: &mut Section<'_, '_, '_>, key: &'static str, usual: u8) -> u8 {
    let Some(entry) = section.get(key) else { return usual };
    let Some(text) = entry.text(section.faults) else { return usual };
    let percent = text.strip_suffix('%').and_then(|number| number.trim_end().parse().ok());
    match percent.filter(|percent| SHARES.contains(percent)) {
        Some(0) => entry.fault(section.faults, "0 holds no load: the seat would drop; give more"),
        Some(percent) => return percent,
        None => {
            let shares = SHARES.map(|share| format!("{share}%")).join(", ");
            entry.fault(section.faults, &format!("{text:?} is not one of {shares}, which a SIXpack 2 has"));
        }
    }
    usual
}

/// Of the axis of a seat that makes the most microsteps: how many a second, and what that is in mm/s; none of a seat without axes.
fn fastest(seat: &SeatType) -> Option<(f64, f64)> {
    let steps = |axis: &AxisGeometry| axis.max_velocity / axis.lead * axis.pulses_per_rev;
    let axes = seat.own().iter().map(|axis| (steps(axis), axis.max_velocity));
    axes.max_by(|(one, _), (other, _)| one.total_cmp(other))
}

impl Sixpack2Drive {
    /// The greatest clock divider that is enough for a seat, where that is another: with it a motor runs no faster than it has to, whatever
    /// it is told.
    pub(crate) fn slower_clock(&self, seat: &SeatType) -> Option<u8> {
        greatest_divider(fastest(seat)?.0).filter(|enough| *enough > self.clock_divider)
    }

    /// Why a counter that is not home could look like one that is.
    pub(crate) fn ambiguous_for(seat: &SeatType, travel_mm: f64) -> Option<String> {
        // A search goes a quarter farther than its travel before it is ended.
        let way = |axis: &AxisGeometry| (axis.stroke() + 1.25 * travel_mm) / axis.lead * axis.pulses_per_rev;
        let most = seat.own().iter().map(way).fold(0.0, f64::max);
        (most > MOST_WAY).then(|| {
            format!(
                "stroke and search of {} are {most:.0} microsteps, over {MOST_WAY:.0}: a unit that was restarted could look as if it were \
                 home; lower pulses_per_rev or travel_mm",
                seat.name
            )
        })
    }

    /// Why the clock divider is too great for the seat's greatest speed.
    pub(crate) fn too_slow_for(&self, seat: &SeatType) -> Option<String> {
        let (needed, speed) = fastest(seat)?;
        Some(match greatest_divider(needed) {
            Some(enough) if self.clock_divider <= enough => return None,
            Some(enough) => {
                format!("{speed} mm/s needs clock_divider {enough} or less, it is {}", self.clock_divider)
            }
            None => format!(
                "{speed} mm/s are {needed:.0} microsteps a second, over {MOST_STEPS:.0}; lower max_velocity_mm_s of {}",
                seat.name
            ),
        })
    }
}
