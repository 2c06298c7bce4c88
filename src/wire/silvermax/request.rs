//! What a host asks: what may be sent, and whatever a line may hold.

use std::fmt::Write as _;

use super::command::{Command, command};
use super::line::{Cursor, LineWriter};
use super::{LineError, MAX_LINE, register};

/// Parameters of a command at most (command reference, page 10).
const MAX_PARAMETERS: usize = 8;

/// What may be sent to a unit; what drops torque, moves without an end or changes how a unit is reached is not here.
/// Positions are counts, times ticks of 120 µs, velocities and accelerations units of the drive (pages 11, 12).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Request {
    /// POL, page 19: what happened since it was told and cleared; an ack if nothing did.
    Poll,
    /// CPL, page 17: these bits of the polling status word, of those that were read, are 0 again.
    ClearPoll {
        /// The bits.
        mask: u16,
    },
    /// STP, page 29: ends motion with this deceleration, and holds.
    Stop {
        /// 1 to 536,870,911; 0 takes that of the motion.
        deceleration: u32,
    },
    /// STP -1, page 29: ends motion at once.
    StopAtOnce,
    /// RVN, page 23.
    Revision,
    /// WRI, page 172.
    WriteRegister {
        /// 10 to 40.
        register: u8,
        /// The value.
        value: i32,
    },
    /// RRG, page 168.
    ReadRegister {
        /// 0 to 40, 200 to 211.
        register: u8,
    },
    /// RIS, page 21: the internal status word.
    InternalStatus,
    /// RIO, page 20: inputs and conditions.
    IoStates,
    /// IMW, page 95: one segment into the timed queue.
    ImmediateSegment {
        /// How long it lasts; 0 for the last, an ordinary move to its position.
        ticks: u32,
        /// Full scale by the sign of the velocity at its end, or where it comes to rest.
        position: i32,
        /// At least 2.
        acceleration: u32,
        /// The size of the velocity at its end; where it comes to rest the greatest on the way.
        velocity: u32,
    },
    /// MAV, page 99: to a position.
    MoveAbsolute {
        /// Where to.
        position: i32,
        /// At most half the velocity.
        acceleration: u32,
        /// The greatest on the way.
        velocity: u32,
    },
    /// MRV, page 103: by a distance from the target, or until something is sensed.
    MoveRelative {
        /// How far at most, and which way.
        distance: i32,
        /// At most half the velocity.
        acceleration: u32,
        /// The greatest on the way.
        velocity: u32,
        /// What ends it early.
        stop: StopOn,
    },
    /// TTP, page 180: the target becomes the position.
    TargetToPosition,
    /// CME, page 177: the greatest error is 0 again.
    ClearMaxError,
    /// TQL, page 73: torque at most, closed loop; both values of open loop are the same.
    TorqueLimits {
        /// At rest, 0 to 32767.
        hold: u16,
        /// Moving.
        moving: u16,
    },
    /// ERL, page 50: how far beside the target is an error.
    ErrorLimits {
        /// Counts, moving.
        moving: u16,
        /// Counts, at rest.
        holding: u16,
        /// Ticks from the end of a motion to being at rest.
        delay_ticks: u16,
    },
    /// CIS, page 178: latched bits of the internal status word are 0 again.
    ClearInternalStatus,
    /// CLC 1802, page 121: target and position less register 10.
    SubtractAccumulator,
    /// KMC, page 57: what ends motion and drops the driver.
    KillConditions {
        /// Which bits of the internal status word are looked at.
        enable: u16,
        /// What kills, for each.
        state: u16,
    },
    /// ARI 7, page 150: the supply into register 10, in steps of the converter. At rest only.
    ReadSupply,
    /// MTT, page 62: the temperature that is too hot.
    MaxTemperature {
        /// 1 to 70 °C.
        celsius: u8,
    },
    /// SSL, page 72: the target stays between the values of registers 38 and 39.
    SoftLimitsOn,
    /// SSL 0: it goes anywhere.
    SoftLimitsOff,
    /// EMT, page 48: commands are taken during a motion.
    EnableMultiTasking,
    /// EMD, page 47: the driver is switched on, which jumps if the target is elsewhere: [`Request::TargetToPosition`] first.
    EnableDriver,
    /// GOC, page 53: torque against gravity.
    GravityOffset {
        /// -32767 to 32767.
        offset: i16,
    },
    /// IMS, page 92: runs what comes into the timed queue.
    StartQueue,
    /// IMQ, page 94: empties the timed queue.
    ClearQueue,
}

/// What ends a move before its distance is over (pages 103, 132).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopOn {
    /// Nothing.
    Nothing,
    /// An input is high, or low.
    Input {
        /// 1 to 7.
        input: u8,
        /// Which.
        is_high: bool,
    },
    /// The index pulse of the motor's encoder.
    Index,
    /// The moving error (ERL) is there.
    MovingError,
}

impl StopOn {
    /// Stop enable and stop state. Codes of inputs are negative, page 132.
    const fn parameters(self) -> [i64; 2] {
        match self {
            Self::Nothing => [0, 0],
            Self::Input { input, is_high } => [-(input as i64), is_high as i64],
            Self::Index => [-9, 1],
            Self::MovingError => [-11, 1],
        }
    }
}

/// The calculation that takes register 10 from target and position: operation 7 x 256 + 10 (CLC, page 121).
const SUBTRACT_ACCUMULATOR: i64 = 7 * 256 + register::ACCUMULATOR as i64;

/// The channel of the supply (ARI, page 150).
const SUPPLY: i64 = 7;

impl Request {
    /// Its number in the command reference.
    pub(crate) const fn number(self) -> u8 {
        match self {
            Self::Poll => 0,
            Self::ClearPoll { .. } => 1,
            Self::Stop { .. } | Self::StopAtOnce => 3,
            Self::Revision => 5,
            Self::WriteRegister { .. } => 11,
            Self::ReadRegister { .. } => 12,
            Self::InternalStatus => 20,
            Self::IoStates => 21,
            Self::ImmediateSegment { .. } => 25,
            Self::MoveAbsolute { .. } => 134,
            Self::MoveRelative { .. } => 135,
            Self::TargetToPosition => 146,
            Self::ClearMaxError => 147,
            Self::TorqueLimits { .. } => 149,
            Self::ErrorLimits { .. } => 151,
            Self::ClearInternalStatus => 163,
            Self::SubtractAccumulator => 165,
            Self::KillConditions { .. } => 167,
            Self::ReadSupply => 193,
            Self::MaxTemperature { .. } => 214,
            Self::SoftLimitsOn | Self::SoftLimitsOff => 221,
            Self::EnableMultiTasking => 225,
            Self::EnableDriver => 227,
            Self::GravityOffset { .. } => 237,
            Self::StartQueue => 253,
            Self::ClearQueue => 254,
        }
    }

    /// Its parameters in the order of the command reference.
    pub(crate) fn parameters(self) -> Parameters {
        let parameters: &[i64] = match self {
            Self::ClearPoll { mask } => &[mask.into()],
            Self::Stop { deceleration } => &[deceleration.into()],
            Self::StopAtOnce => &[-1],
            Self::WriteRegister { register, value } => &[register.into(), value.into()],
            Self::ReadRegister { register } => &[register.into()],
            Self::ImmediateSegment { ticks, position, acceleration, velocity } => {
                &[ticks.into(), position.into(), acceleration.into(), velocity.into()]
            }
            Self::MoveAbsolute { position, acceleration, velocity } => {
                &[position.into(), acceleration.into(), velocity.into(), 0, 0]
            }
            Self::MoveRelative { distance, acceleration, velocity, stop } => {
                let [enable, state] = stop.parameters();
                &[distance.into(), acceleration.into(), velocity.into(), enable, state]
            }
            Self::TorqueLimits { hold, moving } => &[hold.into(), moving.into(), hold.into(), moving.into()],
            Self::ErrorLimits { moving, holding, delay_ticks } => {
                &[moving.into(), holding.into(), delay_ticks.into()]
            }
            Self::SubtractAccumulator => &[SUBTRACT_ACCUMULATOR],
            Self::KillConditions { enable, state } => &[enable.into(), state.into()],
            Self::ReadSupply => &[SUPPLY, register::ACCUMULATOR as i64],
            Self::MaxTemperature { celsius } => &[celsius.into()],
            Self::SoftLimitsOn => &[register::SOFT_LIMIT_LOW as i64],
            Self::SoftLimitsOff => &[0],
            Self::GravityOffset { offset } => &[offset.into()],
            _ => &[],
        };
        Parameters::of(parameters)
    }

    /// Writes the whole line to a unit, with its carriage return, to the front of `buf` and returns it. Units and groups
    /// are 1 to 254; of [`super::ALL_UNITS`] none answers.
    pub(crate) fn emit(self, unit: u8, buf: &mut [u8; MAX_LINE]) -> &[u8] {
        let mut line = LineWriter::new(buf);
        // Writing to a line cannot fail.
        let _ = write!(line, "@{unit} {}", self.number());
        let _ = self.parameters().as_slice().iter().try_for_each(|parameter| write!(line, " {parameter}"));
        line.end()
    }
}

/// Up to eight numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Parameters {
    numbers: [i64; MAX_PARAMETERS],
    count: usize,
}

impl Parameters {
    /// The first eight of these.
    pub(super) fn of(numbers: &[i64]) -> Self {
        let mut kept = Self::default();
        for number in numbers {
            let _ = kept.push(*number); // none of ours has more than eight
        }
        kept
    }

    /// One more, unless there are eight.
    pub(super) fn push(&mut self, number: i64) -> Option<()> {
        *self.numbers.get_mut(self.count)? = number;
        self.count += 1;
        Some(())
    }

    /// All of them.
    pub(crate) fn as_slice(&self) -> &[i64] {
        &self.numbers[..self.count]
    }
}

/// What a host asked, whether we would or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AnyRequest {
    /// The unit or group, 1 to 254, or all.
    pub(crate) unit: u8,
    /// The number of the command; that of a poll where the line ends behind the unit.
    pub(crate) number: u8,
    /// Its parameters as they came: how many and how large they are is not checked.
    pub(crate) parameters: Parameters,
}

impl AnyRequest {
    /// Reads a line without its carriage return.
    ///
    /// # Errors
    /// A [`LineError`] where it is no request.
    pub(crate) fn parse(line: &[u8]) -> Result<Self, LineError> {
        if line.first() != Some(&b'@') {
            return Err(LineError::Opening);
        }
        let mut cursor = Cursor::after_opening(line);
        let unit = cursor.octet("unit", 1)?;
        let mut request = Self { unit, number: 0, parameters: Parameters::default() };
        if cursor.is_done() {
            return Ok(request);
        }
        cursor.blank()?;
        request.number = cursor.octet("command", 0)?;
        while !cursor.is_done() {
            let at = cursor.at;
            cursor.blank()?;
            let number = cursor.decimal("parameter", i32::MIN.into()..=u32::MAX.into())?;
            let many = LineError::Many { at, what: "parameters", most: MAX_PARAMETERS };
            request.parameters.push(number).ok_or(many)?;
        }
        Ok(request)
    }

    /// What the command reference says of the command.
    pub(crate) fn command(&self) -> Option<&'static Command> {
        command(self.number)
    }
}
