//! What a unit can be told or asked, as far as it is known: wider than what we send, so that a log can be read.
//!
//! Numbers are as the unit counts: positions in microsteps, a sixteenth of a full step; velocities in its own units, 511 at most;
//! times in 2 ms; motors from 0.

use super::SixpackFrame;
use super::layout::{Parameter, messages};

messages! {
    /// What a unit is told or asked.
    enum SixpackCommand;

    /// The peak current of a pair of motors.
    0x10 PeakCurrent "peak current" {
        /// Of the pair.
        motor: u8,
        /// In the unit's own units.
        value: u8,
    }
    /// What part of the peak current flows when: 0 to 8 for 100, 75, 50, 38, 25, 19, 13, 9 and 0 %.
    0x11 CurrentSettings "currents" {
        /// Which motor.
        motor: u8,
        /// Switched down.
        power_down: u8,
        /// At rest.
        stand: u8,
        /// At an even speed.
        run: u8,
        /// On a ramp.
        ramp: u8,
        /// How long after a move it counts as at rest, in 2 ms.
        t0: u16,
    }
    /// The divider of the clock that speeds are counted in, of all motors.
    0x12 ClockDivider "clock divider" {
        /// 0 to 31.
        divider: u8,
    }
    /// Where ramps begin.
    0x13 StartSettings "start velocity" {
        /// Which motor.
        motor: u8,
        /// The least velocity.
        vmin: u16,
        /// That of the first step.
        vstart: u16,
        /// Another divider of speeds, as a power of two.
        div: u8,
    }
    /// What ramps keep to.
    0x14 RampSettings "acceleration and velocity" {
        /// Which motor.
        motor: u8,
        /// Units of velocity in 2 ms.
        amax: u16,
        /// The greatest velocity.
        vmax: u16,
    }
    /// What kind of axis it is (motor parameters, page 38).
    0x15 MotorSettings "motor parameters" {
        /// Which motor.
        motor: u8,
        /// The whole travel, or a turn; for searches and rotary axes alone, no limit of what it moves.
        poslimit: u32,
        /// Flags of [`p5`].
        p5: u8,
        /// Flags of [`p6`].
        p6: u8,
    }
    /// How it searches its zero.
    0x16 ReferenceSettings "reference search parameters" {
        /// Which motor.
        motor: u8,
        /// The greatest velocity of a search.
        vrefmax: u16,
        /// The time over which its switch is de-bounced, as a mask.
        debounce: u16,
        /// How it stops once it has found it.
        stop_after: u8,
    }
    /// Where zero is beside the switch.
    0x18 ZeroSettings "zero offset and range" {
        /// Which motor.
        motor: u8,
        /// Microsteps from the switch.
        offset: i32,
        /// How far around zero the switch may be closed.
        range: u16,
    }
    /// How it follows a target.
    0x19 PiSettings "PI parameters" {
        /// Which motor.
        motor: u8,
        /// Velocity is the distance by this.
        propdiv: u8,
        /// The same of the sum of distances; more than 128 for none.
        intdiv: u16,
        /// The greatest that the sum gives.
        intclip: u16,
        /// The greatest that is summed up.
        intinpclip: u8,
    }
    /// Where is it? Reading it clears the stop flag.
    0x20 PositionQuery "position?" {
        /// Which motor.
        motor: u8,
        /// The address of the answer.
        response: u8,
    }
    /// How fast is it?
    0x21 VelocityQuery "velocity?" {
        /// Which motor.
        motor: u8,
        /// The address of the answer.
        response: u8,
    }
    /// Search zero.
    0x22 ReferenceSearch "reference search" {
        /// Which motor.
        motor: u8,
    }
    /// Follow a target, also while it moves.
    0x24 PiTarget "PI target" {
        /// Which motor.
        motor: u8,
        /// Microsteps.
        target: i32,
    }
    /// Turn at a velocity until told otherwise; 0 is a stop by the ramp.
    0x25 Rotation "rotate" {
        /// Which motor.
        motor: u8,
        /// In units, negative downwards.
        velocity: i16,
    }
    /// Where a joint move will lead this motor.
    0x26 JointTarget "joint target" {
        /// Which motor.
        motor: u8,
        /// Microsteps.
        target: i32,
    }
    /// Call the place where it stands so.
    0x27 PositionPreset "set position" {
        /// Which motor.
        motor: u8,
        /// Microsteps.
        position: i32,
    }
    /// What is each motor doing?
    0x28 ActionsQuery "all actions?" {
        /// The address of the answer.
        response: u8,
        /// Motors of which the answer waits until they are idle; 0 for an answer at once.
        delay_mask: u8,
    }
    /// Stop at once; they overshoot and return.
    0x2a StopSeveral "stop" {
        /// A bit a motor.
        mask: u8,
    }
    /// End the search for zero.
    0x2b AbortSearch "abort search" {
        /// Which motor.
        motor: u8,
    }
    /// What is at an input?
    0x30 InputQuery "input?" {
        /// 7 is the supply, 22 a volt.
        channel: u8,
        /// The address of the answer.
        response: u8,
    }
    /// Another baud rate from now on.
    0x40 BaudSwitch "baud rate" {
        /// 1,250,000 by the rate.
        divisor: u16,
        /// How long it waits before it answers and holds the line after it, in 2 ms.
        delay: u16,
    }
    /// How long the line may be silent within a frame.
    0x41 PacketTimeout "packet timeout" {
        /// In 2 ms.
        timeout: u8,
    }
    /// Who is it, how warm, and was it reset since it was asked last?
    0x43 UnitQuery "unit?" {
        /// The address of the answer.
        response: u8,
    }
    /// Begin the joint move.
    0x50 JointStart "start joint move" {
        /// A bit a motor.
        mask: u8,
    }
}

/// Motors of a unit, and the longest travel that it takes (motor parameters, page 38).
const MOTORS: i64 = 6;
const MOST_POSLIMIT: i64 = 0x7fff_ffff;

impl SixpackCommand {
    /// Why no unit takes it; `None` where one does.
    #[must_use]
    pub(crate) fn fault(self) -> Option<&'static str> {
        let mut fault = None;
        self.tell(|name, value| match name {
            "motor" if value >= MOTORS => fault = Some("no such motor: a unit has 0 to 5"),
            "poslimit" if value > MOST_POSLIMIT => fault = Some("Poslimit goes up to 0x7fffffff"),
            _ => {}
        });
        fault
    }
}

/// Flags of `P5` of `$15` that matter here.
pub(crate) mod p5 {
    /// Begin to search zero, now.
    pub(crate) const AUTONULL_CMD: u8 = 1 << 2;
    /// Stop, and maybe search, if it stands at zero and its switch is not closed.
    pub(crate) const TEST_NULL: u8 = 1 << 3;
    /// Zero is at the lower end.
    pub(crate) const NULL_LEFT: u8 = 1 << 4;
    /// Stop, and maybe search, if the switch closes away from zero.
    pub(crate) const STOP_NULL: u8 = 1 << 6;
    /// The switch is de-bounced.
    pub(crate) const FILTER_SWITCH: u8 = 1 << 7;
    /// Those with which it may begin to search by itself.
    pub(crate) const SEARCHES: u8 = AUTONULL_CMD | TEST_NULL | STOP_NULL;
}

/// Flags of `P6` of `$15` that matter here.
pub(crate) mod p6 {
    /// Search at the greatest velocity.
    pub(crate) const FAST_REF: u8 = 1 << 1;
    /// Zero is a mechanical stop, into which it is driven.
    pub(crate) const MECH_REF: u8 = 1 << 2;
    /// Stop by the ramp.
    pub(crate) const STOP_SOFT: u8 = 1 << 4;
    /// Never search because of what made it stop.
    pub(crate) const STOP_NO_REF: u8 = 1 << 5;
    /// The switch is active high.
    pub(crate) const NULL_POSITIVE: u8 = 1 << 6;
}
