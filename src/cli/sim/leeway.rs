//! Options of `kinocue sim` for what the manuals leave open.

use std::time::Duration;

use super::parse;
use crate::cli::vibration_port;
use crate::sim::{Commands, Invented};
use crate::time::parse_duration;
use crate::wire::VibrationPort;

/// What the manuals leave open.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What the manuals leave open")]
pub(super) struct Leeway {
    /// Commands that can be queued; one more is Err21.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    queue_depth: u16,

    /// Duration of homing, ms.
    #[arg(long, value_name = "MS", default_value_t = 500)]
    homing_ms: u32,

    /// Fraction of its Time that a command takes while more than two are queued (PA06 = 1).
    #[arg(long, value_enum, default_value_t = FastForward::Half)]
    fast_forward: FastForward,

    /// The greatest Time of a first absolute frame, ms: a longer one is Err17 if PA0d = 0.
    #[arg(long, value_name = "MS", default_value_t = 30_000)]
    first_time_max_ms: u32,

    /// Datagrams within 100 ms that fill the UDP memory; one more is Err20.
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u32).range(1..))]
    udp_memory: u32,

    /// Unit of the automatic reset's time (PA0d).
    #[arg(long, value_name = "SPAN", default_value = "1ms", value_parser = parse_duration)]
    auto_reset_unit: Duration,

    /// Requests that postpone the automatic reset (PA0d).
    #[arg(long, value_enum, default_value_t = Requests::Motion)]
    auto_reset_counts: Requests,

    /// Reads of registers that the manuals do not name: 0, or refused.
    #[arg(long, value_enum, default_value_t = Unused::Zero)]
    unused_registers: Unused,

    /// Pulses in one turn of a motor, for speeds in rpm.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u16).range(1..))]
    pulses_per_turn: u16,

    /// Speed after an emergency stop if PA94 = 0, rpm [default: no limit]
    #[arg(long, value_name = "RPM", value_parser = clap::value_parser!(u16).range(1..))]
    release_rpm: Option<u16>,

    /// Jog speed if PA70 to PA75 set none, rpm.
    #[arg(long, value_name = "RPM", default_value_t = 60, value_parser = clap::value_parser!(u16).range(1..))]
    jog_rpm: u16,

    /// Error number that a drive with an alarm (Err10 to 15) reports.
    #[arg(long, value_name = "N", default_value_t = 1)]
    servo_alarm: u16,

    /// Number of registers of a servo drive, from 0 on.
    #[arg(long, value_name = "N", default_value_t = 1_000)]
    servo_registers: u16,

    /// Bytes of Port Out in vibration frames, and of the inputs in the answers: 2 or 4.
    #[arg(long, value_name = "N", default_value = "2", value_parser = vibration_port)]
    vibration_port_octets: VibrationPort,

    /// Software version (DPFF and DPFE).
    #[arg(long, value_name = "MAJOR.MINOR", default_value = "1.0", value_parser = parse::version)]
    software_version: [u16; 2],
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum FastForward {
    Half,
    Third,
    Quarter,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Requests {
    Motion,
    Any,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Unused {
    Zero,
    Refused,
}

impl Leeway {
    pub(super) fn invented(&self) -> Invented {
        Invented {
            queue_depth: usize::from(self.queue_depth),
            homing: Duration::from_millis(u64::from(self.homing_ms)),
            fast_forward: match self.fast_forward {
                FastForward::Half => 2,
                FastForward::Third => 3,
                FastForward::Quarter => 4,
            },
            first_time_max_ms: self.first_time_max_ms,
            udp_memory: self.udp_memory,
            auto_reset_unit: self.auto_reset_unit,
            auto_reset: match self.auto_reset_counts {
                Requests::Motion => Commands::Motion,
                Requests::Any => Commands::Any,
            },
            unused_read: self.unused_registers == Unused::Zero,
            pulses_per_turn: self.pulses_per_turn,
            release_rpm: self.release_rpm,
            jog_rpm: self.jog_rpm,
            servo_alarm: self.servo_alarm,
            servo_registers: self.servo_registers,
            vibration_port: self.vibration_port_octets,
            version: self.software_version,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(clap::Parser)]
    struct Alone {
        #[command(flatten)]
        args: Leeway,
    }

    #[test]
    fn without_options_it_is_what_the_library_invents() {
        let alone = <Alone as clap::Parser>::parse_from(["sim"]);
        assert_eq!(alone.args.invented(), Invented::default());
    }
}
