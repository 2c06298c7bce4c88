//! Registers of a drive by name (command reference, RRG, pages 162 and 163).

/// The target, counts.
pub(crate) const TARGET: u8 = 0;
/// The position, counts.
pub(crate) const POSITION: u8 = 1;
/// The position when an input ended the last move.
pub(crate) const INPUT_POSITION: u8 = 4;
/// Ticks until the delay is over.
pub(crate) const DELAY: u8 = 5;
/// The greatest position error, and that of now: a word each.
pub(crate) const ERRORS: u8 = 6;
/// What calculations work on.
pub(crate) const ACCUMULATOR: u8 = 10;
/// Where segments are taken from: 0 for the timed queue (IMS, page 92).
pub(crate) const QUEUE_SOURCE: u8 = 17;
/// Ticks left in the running segment.
pub(crate) const TICKS_LEFT: u8 = 18;
/// With what the timed queue brakes when it runs dry.
pub(crate) const DRY_BRAKE: u8 = 19;
/// The position of the running segment.
pub(crate) const SEGMENT_POSITION: u8 = 20;
/// Its acceleration.
pub(crate) const SEGMENT_ACCELERATION: u8 = 21;
/// Its velocity.
pub(crate) const SEGMENT_VELOCITY: u8 = 22;
/// The deceleration of a profile move.
pub(crate) const SEGMENT_DECELERATION: u8 = 23;
/// A number that a unit is given when its homing begins, gone after a restart; our choice.
pub(crate) const MARK: u8 = 37;
/// The least target while soft limits are on; our choice.
pub(crate) const SOFT_LIMIT_LOW: u8 = 38;
/// The greatest.
pub(crate) const SOFT_LIMIT_HIGH: u8 = 39;
/// A number that is 0 after each restart; our choice.
pub(crate) const CANARY: u8 = 40;
/// Torque limits of the closed loop, hold and moving: a word each.
pub(crate) const TORQUE_CLOSED: u8 = 206;
/// Those of the open loop.
pub(crate) const TORQUE_OPEN: u8 = 207;
/// Error limits, moving and holding: a word each.
pub(crate) const ERROR_LIMITS: u8 = 208;
/// What killed: the bits in the upper word, their state in the lower one.
pub(crate) const KILL_CAUSE: u8 = 211;

/// What is in a register, in words; nothing where the number is free for any use.
pub(crate) const fn name(register: u8) -> Option<&'static str> {
    Some(match register {
        TARGET => "target",
        POSITION => "position",
        2 => "index position",
        3 => "internal status",
        INPUT_POSITION => "position at input",
        DELAY => "delay",
        ERRORS => "position errors",
        7 => "speeds",
        8 => "integrator",
        9 => "torque",
        ACCUMULATOR => "accumulator",
        QUEUE_SOURCE => "queue source",
        TICKS_LEFT => "ticks left",
        DRY_BRAKE => "brake of a dry queue",
        SEGMENT_POSITION => "segment position",
        SEGMENT_ACCELERATION => "segment acceleration",
        SEGMENT_VELOCITY => "segment velocity",
        SEGMENT_DECELERATION => "segment deceleration",
        24 => "segment offset",
        MARK => "mark of a homing",
        SOFT_LIMIT_LOW => "lower soft limit",
        SOFT_LIMIT_HIGH => "upper soft limit",
        CANARY => "canary",
        200 | 201 => "external encoder",
        204 | 205 => "trajectory",
        TORQUE_CLOSED => "torque limits, closed loop",
        TORQUE_OPEN => "torque limits, open loop",
        ERROR_LIMITS => "error limits",
        KILL_CAUSE => "kill cause",
        _ => return None,
    })
}
