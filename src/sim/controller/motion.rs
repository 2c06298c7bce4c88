//! Motion frames: what they make the motors do, and the answers to them.

use std::time::Duration;

use super::{Controller, OUTPUTS};
use crate::motion::Pulses;
use crate::sim::errors;
use crate::sim::pa;
use crate::sim::player::{MotorPositions, PlayedLeg};
use crate::time::MonoTime;
use crate::wire::{Dialect, MotionReply, MotionRequest, ReplyCode, Timing};

impl Controller {
    pub(super) fn on_motion(&mut self, motion: &MotionRequest, at: MonoTime) -> MotionReply {
        self.put_off_auto_reset(at);
        let (mut code, mut error) = self.state();
        match code {
            ReplyCode::Running if motion.vibration.is_some() && self.dialect == Dialect::Mbox => {
                self.counts.refused.command += 1;
                code = self.command_error();
            }
            ReplyCode::Running if at < self.homing_until => self.counts.refused.homing += 1,
            ReplyCode::Running => {
                self.move_to(motion, at);
                (code, error) = self.state();
            }
            ReplyCode::EmergencyStop => self.counts.refused.emergency_stop += 1,
            ReplyCode::Fault | ReplyCode::Command => self.counts.refused.fault += 1,
        }
        let running = code == ReplyCode::Running;
        MotionReply {
            timing: motion.timing,
            code,
            channel: if running { motion.channel } else { 0 },
            error: self.error_slot(motion.channel, error),
            frame: motion.frame,
            time_ms: motion.time_ms,
            positions: motion.positions,
            inputs: self.inputs.active(),
            extend: motion.extend,
            vibration: motion.vibration,
        }
    }

    /// Obeys a motion frame, unless it is the one that makes an error.
    fn move_to(&mut self, motion: &MotionRequest, at: MonoTime) {
        if self.begins_too_long(motion) {
            self.counts.refused.fault += 1;
            return self.fail(errors::FIRST_TIME, at);
        }
        self.end_jog(at);
        let duration = self.duration(motion);
        let leg = PlayedLeg {
            to: self.target(&motion.positions),
            duration,
            vibration: motion.vibration.unwrap_or_default(),
        };
        let pace = *self.pace();
        if self.player.push(leg, at, &pace).is_err() {
            self.counts.queue_overflows += 1;
            self.counts.refused.fault += 1;
            return self.fail(errors::QUEUE, at);
        }
        self.last_absolute = (motion.timing == Timing::Absolute).then_some(motion.time_ms);
        if self.registers.get(pa::KEEP_OUTPUTS) != 1 {
            self.outputs = motion.outputs & OUTPUTS;
        }
        // A frame with vibration has no Extend: the outputs stay as they are.
        if motion.vibration.is_none() {
            self.extend = motion.extend;
        }
        self.seen.command(motion, duration);
        self.counts.accepted += 1;
        self.counts.motion += 1;
    }

    /// True if the play would begin with too long a time, which only a controller without automatic reset minds
    /// (chapter 6: Err17).
    fn begins_too_long(&self, motion: &MotionRequest) -> bool {
        let first = motion.timing == Timing::Absolute && self.last_absolute.is_none();
        first && self.registers.get(pa::AUTO_RESET) == 0 && motion.time_ms > self.invented.first_time_max_ms
    }

    /// The longest time of a command, ms.
    fn longest_ms(&self) -> u32 {
        match u32::from(self.registers.get(pa::MAX_TIME)) {
            0 => u32::MAX,
            longest => longest,
        }
    }

    /// How long a frame's move takes: on an IMAX with PA0a = 1, as long as it came after the datagram before; else its Time, or what absolute time has gone on since the frame before; the fixed
    /// interval where that is none; cut to the longest there may be.
    fn duration(&self, motion: &MotionRequest) -> Duration {
        let longest = Duration::from_millis(u64::from(self.longest_ms()));
        let interval = self.registers.interval_ms();
        if self.dialect == Dialect::Mbox && self.registers.get(pa::INTERVAL_SOURCE) == 1 {
            let since = self.seen.interval();
            let first = Duration::from_millis(u64::from(interval));
            return if since.is_zero() { first } else { since }.min(longest);
        }
        let asked = match (motion.timing, self.last_absolute) {
            (Timing::Relative, _) => motion.time_ms,
            (Timing::Absolute, Some(before)) => motion.time_ms.saturating_sub(before),
            (Timing::Absolute, None) => motion.time_ms.min(interval),
        };
        let ms = if asked == 0 { interval } else { asked };
        Duration::from_millis(u64::from(ms)).min(longest)
    }

    /// Where the axes go: each takes its own axis of the command, past the axis offset; those that the command does
    /// not reach, and those that do not work, stay.
    fn target(&self, commanded: &[Pulses]) -> MotorPositions {
        let mut to = *self.player.target();
        let offset = usize::from(self.registers.get(pa::OFFSET));
        let window = commanded.get(offset..).unwrap_or_default();
        for (own, position) in to.iter_mut().zip(window).take(self.registers.axes()) {
            *own = self.scaled(*position);
        }
        to
    }

    /// A position at the amplitude of PA55.
    #[expect(clippy::cast_possible_truncation, reason = "at most nine tenths of an i32")]
    fn scaled(&self, position: Pulses) -> Pulses {
        match self.registers.get(pa::AMPLITUDE) {
            tenths @ 1..=9 => Pulses((i64::from(position.0) * i64::from(tenths) / 10) as i32),
            _ => position,
        }
    }
}
