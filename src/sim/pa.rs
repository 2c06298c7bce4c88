//! Numbers of the parameters that a virtual controller heeds (SMC manual 2.3.1); what they are and where they begin
//! stands in the table of registers.

/// Work mode.
pub(crate) const MODE: u8 = 0x00;
/// Working axes, 1 to 12.
pub(crate) const AXES: u8 = 0x02;
/// The axis that takes its present position for zero when it homes; 0 for none.
pub(crate) const ROTARY_AXIS: u8 = 0x03;
/// 1: low inputs are active.
pub const INPUT_POLARITY: u8 = 0x04;
/// 1: outputs are inverted.
pub(crate) const OUTPUT_POLARITY: u8 = 0x05;
/// 1: speed up when more than two commands wait.
pub(crate) const FAST_FORWARD: u8 = 0x06;
/// Greatest speed, rpm.
pub(crate) const MAX_RPM: u8 = 0x07;
/// Writing 1 resets; reads 0 when done.
pub(crate) const RESET: u8 = 0x08;
/// Time of commands without one, ms.
pub(crate) const INTERVAL: u8 = 0x09;
/// IMAX: 1 goes by the time between packets, not by the one in them.
pub(crate) const INTERVAL_SOURCE: u8 = 0x0a;
/// Longest time of a command, ms; 0 for none.
pub(crate) const MAX_TIME: u8 = 0x0b;
/// How long after the last command it resets by itself, ms; 0 for never.
pub const AUTO_RESET: u8 = 0x0d;
/// What a reset does: 0 home, 1 go to zero.
pub(crate) const RESET_WAY: u8 = 0x0e;
/// Writing 1 takes back the defaults, 2 keeps what is set over a power cycle.
pub(crate) const KEEP: u8 = 0x0f;
/// The first of four registers with the controller's address.
pub(crate) const ADDRESS: u8 = 0x10;
/// The third byte of the address: the station's column.
pub(crate) const COLUMN: u8 = 0x12;
/// The fourth byte of the address: the station's row.
pub(crate) const ROW: u8 = 0x13;
/// The controller's port.
pub(crate) const PORT: u8 = 0x14;
/// 0: no answers.
pub(crate) const ANSWERS: u8 = 0x15;
/// How often it reports its status, ms; 0: when an error comes.
pub(crate) const REPORT_INTERVAL: u8 = 0x1e;
/// Status reports: 0 none, 1 to PA20.., 2 to PA25...
pub(crate) const REPORTS: u8 = 0x1f;
/// The first of four registers with the host's address.
pub(crate) const HOST: u8 = 0x20;
/// The host's port, from which frames must come; 0 takes any.
pub(crate) const HOST_PORT: u8 = 0x24;
/// The first of four registers with the address of a second host, and one with its port.
pub(crate) const SECOND_HOST: u8 = 0x25;
/// Silence after a start, ms.
pub(crate) const START_DELAY: u8 = 0x3d;
/// IMAX: depth of the filter of positions.
pub(crate) const FILTER_DEPTH: u8 = 0x51;
/// Amplitude: 0 all of it, 1 to 9 tenths.
pub(crate) const AMPLITUDE: u8 = 0x55;
/// The first of six registers with the speed at which an axis jogs, rpm.
pub(crate) const SAFE_RPM: u8 = 0x70;
/// The first of six registers with the greatest speed of an axis, rpm; 0 for none.
pub(crate) const AXIS_RPM: u8 = 0x80;
/// Bit 0: emergency stop by input; 1: jog; 3: emergency reset.
pub(crate) const INPUT_FUNCTIONS: u8 = 0x90;
/// What an emergency stop does: 0 hold and go on, 1 go to zero and go on, 2 hold until a reset.
pub(crate) const ESTOP_WAY: u8 = 0x91;
/// Inputs that must all be active for an emergency stop.
pub(crate) const ESTOP_INPUTS: u8 = 0x92;
/// How long inputs must stand, ms.
pub(crate) const INPUT_FILTER: u8 = 0x93;
/// Speed after the release of an emergency stop, rpm; what 0 means the manuals do not say.
pub(crate) const RELEASE_RPM: u8 = 0x94;
/// Axis offset: the first axis takes this axis + 1 of a command.
pub(crate) const OFFSET: u8 = 0x95;
/// Inputs that must all be active to jog out.
pub(crate) const JOG_OUT_INPUTS: u8 = 0x96;
/// Inputs that must all be active to jog back.
pub(crate) const JOG_BACK_INPUTS: u8 = 0x97;
/// Inputs that must all be active for an emergency reset.
pub(crate) const RESET_INPUTS: u8 = 0x98;
/// 1: outputs of motion frames are ignored.
pub(crate) const KEEP_OUTPUTS: u8 = 0x9d;
/// Writing it switches the outputs.
pub(crate) const MANUAL_OUTPUTS: u8 = 0x9e;
/// Outputs after a start.
pub(crate) const START_OUTPUTS: u8 = 0x9f;
/// The first of six registers with the acceleration factor of an axis.
pub(crate) const ACCELERATION_FACTOR: u8 = 0xa0;
/// The first of six registers with the acceleration of an axis.
pub(crate) const ACCELERATION: u8 = 0xb0;
