//! What the manuals leave out, and a virtual controller has to decide all the same.

use std::time::Duration;

use crate::wire::VibrationPort;

/// Answers to what the manuals leave open. The defaults are guesses; each can be played the other way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invented {
    /// Commands that can be queued; one more is Err21.
    pub(crate) queue_depth: usize,
    /// How long a controller homes.
    pub(crate) homing: Duration,
    /// By what the time of a move is divided in fast forward (PA06).
    pub(crate) fast_forward: u32,
    /// The greatest Time of a first absolute frame, ms; a longer one is Err17 where PA0d = 0.
    pub(crate) first_time_max_ms: u32,
    /// Datagrams within 100 ms that fill the UDP memory; one more is Err20, until 100 ms have passed without one too
    /// many.
    pub(crate) udp_memory: u32,
    /// What the automatic reset (PA0d) counts in.
    pub(crate) auto_reset_unit: Duration,
    /// Which commands put off the automatic reset (PA0d).
    pub(crate) auto_reset: Commands,
    /// True if registers that the manuals do not name can be read, as 0.
    pub(crate) unused_read: bool,
    /// Pulses in one turn of a motor.
    pub(crate) pulses_per_turn: u16,
    /// Speed after the release of an emergency stop where PA94 is 0, rpm; no limit where there is none.
    pub(crate) release_rpm: Option<u16>,
    /// Speed of jogging where PA70 to PA75 set none, rpm.
    pub(crate) jog_rpm: u16,
    /// What a drive reports as its error while it has an alarm.
    pub(crate) servo_alarm: u16,
    /// Registers of a drive, from 0 on.
    pub(crate) servo_registers: u16,
    /// How many bytes Port Out takes in vibration frames, and the inputs in the answers.
    pub(crate) vibration_port: VibrationPort,
    /// Major and minor version (DPFF, DPFE).
    pub(crate) version: [u16; 2],
}

/// Commands that put off the automatic reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Commands {
    /// Motion frames alone.
    #[default]
    Motion,
    /// Every request, once a motion frame has come.
    Any,
}

impl Default for Invented {
    fn default() -> Self {
        Self {
            queue_depth: 200,
            homing: Duration::from_millis(500),
            fast_forward: 2,
            first_time_max_ms: 30_000,
            udp_memory: 1_000,
            auto_reset_unit: Duration::from_millis(1),
            auto_reset: Commands::Motion,
            unused_read: true,
            pulses_per_turn: 10_000,
            release_rpm: None,
            jog_rpm: 60,
            servo_alarm: 1,
            servo_registers: 1_000,
            vibration_port: VibrationPort::Two,
            version: [1, 0],
        }
    }
}
