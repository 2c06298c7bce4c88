//! What a virtual unit is before it is switched on.

/// A unit and its axis; places are counts from the lower mechanical stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UnitSetup {
    /// Its number, 1 to 254.
    pub(crate) unit: u8,
    /// Its group.
    pub(crate) group: u8,
    /// How much faster its crystal runs than ours, millionths.
    pub(crate) ppm: i32,
    /// Ticks from a request to its answer (ADL).
    pub(crate) adl: u16,
    /// Velocity units of a count a tick are 2 to the power of this: 26 at 4,000 counts a turn.
    pub(crate) bits: u32,
    /// Where the axis stands.
    pub(crate) place: i32,
    /// The upper mechanical stop.
    pub(crate) top: i32,
    /// The switch by which homing finds the axis.
    pub(crate) switch: Option<Switch>,
    /// How far the rotor moves where it is aligned, after each reset.
    pub(crate) align: i32,
    /// Ticks from a reset until it listens.
    pub(crate) boot_ticks: u32,
}

/// A switch at the lower end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Switch {
    /// The input, 1 to 7.
    pub(crate) input: u8,
    /// The axis is on it from here down.
    pub(crate) place: i32,
    /// The input is high then, else low.
    pub(crate) is_high: bool,
}

impl UnitSetup {
    /// A unit at 4,000 counts a turn and a lead of 5 mm, its stroke of 150 mm from 4 mm above the lower stop to 4 mm below
    /// the upper one, a switch on input 1 that is high from 2 mm below the stroke down, standing in the middle.
    pub(crate) const fn new(unit: u8) -> Self {
        Self {
            unit,
            group: 253,
            ppm: 0,
            adl: 4,
            bits: 26,
            place: 63_200,
            top: 126_400,
            switch: Some(Switch { input: 1, place: 1_600, is_high: true }),
            align: 37,
            boot_ticks: 4_000,
        }
    }
}
