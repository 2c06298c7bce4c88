//! From a pose to the bytes of one controller's frame: slots to pulses, effects to outputs, the frame number.
//! Tick thread; allocates nothing.

mod lanes;

pub use lanes::{Manner, lanes};

use crate::channel::{ChannelId, SWITCHES, Sample};
use crate::cue;
use crate::engine::{Beat, Mix};
use crate::motion::{MAX_AXES, Pose, Pulses, Window};
use crate::timeline::EffectSet;
use crate::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, Timing, Vibration, VibrationPort};

/// Which outputs a cue's effects switch on one controller, and how far its analogue ones go.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wiring {
    /// Output word of each effect of the cue, by its place among the cue's names.
    pub named: Vec<u16>,
    /// The bits of a raw output word that reach the controller.
    pub raw: u16,
    /// The highest level of each output of the table ([`crate::channel::switches`]), 0 where it has none.
    pub(crate) at_most: [f64; SWITCHES],
}

impl Wiring {
    /// The output word for what the cue switches.
    #[must_use]
    pub fn outputs(&self, switched: EffectSet) -> u16 {
        match switched {
            EffectSet::Word(word) => word & self.raw,
            EffectSet::Named(on) => {
                let lit = self.named.iter().enumerate().filter(|(effect, _)| on >> effect & 1 == 1);
                lit.fold(0, |word, (_, outputs)| word | outputs)
            }
        }
    }

    /// What of a channel of outputs the controller may have.
    fn within(&self, channel: ChannelId, Sample(levels): Sample) -> Sample {
        let most = &self.at_most[channel.row().first_switch()..];
        Sample(std::array::from_fn(|part| levels[part].min(most.get(part).copied().unwrap_or(0.0))))
    }
}

/// Our state for one controller, as far as sending goes.
#[derive(Debug, Clone)]
pub struct Lane {
    /// The axes of its frames.
    pub window: Window,
    /// Object channel of its frames (SMC manual 2.2.2.5).
    pub channel: u16,
    /// Who takes its frames, and who answers those that ask.
    pub code: Code,
    /// True if its frames carry vibration.
    pub vibrates: bool,
    /// How these have Port Out.
    pub vibration_port: VibrationPort,
    /// Which outputs it switches.
    pub wiring: Wiring,
    /// Asks for a reply in each Nth frame; 0 never asks.
    pub ack_every: u32,
    /// The longest Time that its controller executes as it is, ms (PA0b).
    pub longest_ms: u32,
    next_frame: FrameNo,
}

/// A frame that was written: its number, and whether it asks for a reply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamped {
    /// Its number.
    pub frame: FrameNo,
    /// True if it asks for a reply.
    pub asked: bool,
    /// The greatest amplitude of vibration that it asks of any slot, strokes.
    pub shakes: f64,
}

impl Lane {
    /// Writes the frame of this tick to `buf`, and takes a frame number for it.
    pub fn encode<'b>(
        &mut self,
        beat: &Beat,
        pose: &Pose,
        mix: Mix,
        buf: &'b mut [u8; MAX_LEN],
    ) -> (Stamped, &'b [u8]) {
        let mut stamped = self.stamp();
        let slots = self.window.slots();
        let mut positions = [Pulses(0); MAX_AXES];
        let mut vibration = [Vibration::NONE; MAX_AXES];
        for (index, slot) in slots.iter().enumerate() {
            positions[index] = slot.pulses(pose[index]);
            if let Some(axis) = slot.axis.filter(|_| self.vibrates) {
                let shake = beat.samples.of(ChannelId::Vibration.on(axis));
                let cue::Vibration { hz, amplitude } = mix.sample(ChannelId::Vibration, shake).into();
                let strokes = amplitude * slot.to_stroke;
                vibration[index] = Vibration::from_hz(hz, strokes * slot.stroke_pulses);
                stamped.shakes = stamped.shakes.max(strokes);
            }
        }
        let levels = mix.sample(ChannelId::Analogue, beat.samples.of(ChannelId::Analogue.of_hall()));
        let motion = Motion {
            timing: beat.timing,
            channel: self.channel,
            accept: self.code,
            reply: if stamped.asked { self.code } else { Code::NONE },
            frame: stamped.frame,
            time_ms: beat.time_ms,
            positions: &positions[..slots.len()],
            outputs: self.wiring.outputs(mix.effects(beat.effects)),
            analogue: Analogue::from_levels(self.wiring.within(ChannelId::Analogue, levels).0),
            vibration: self.vibrates.then_some(&vibration[..slots.len()]),
        };
        (stamped, motion.emit_as(self.vibration_port, buf))
    }

    /// Writes the one slow frame that brings the lane to its park pose in `time_ms`, effects and outputs off.
    pub fn encode_slow_park<'b>(&mut self, time_ms: u32, buf: &'b mut [u8; MAX_LEN]) -> (Stamped, &'b [u8]) {
        let (park, vibrates) = (self.window.park(), std::mem::take(&mut self.vibrates));
        let beat = Beat::still(Timing::Relative, time_ms);
        let written = self.encode(&beat, &park, Mix::STILL, buf);
        self.vibrates = vibrates;
        written
    }

    /// Makes every frame from now on hold the lane at its park pose, whatever it is asked for, vibration, effects and outputs off.
    pub fn hold(&mut self) {
        self.window.hold();
        self.vibrates = false;
        self.wiring = Wiring::default();
    }

    /// The lane with the number of its next frame.
    #[must_use]
    pub fn starting_at(self, next_frame: FrameNo) -> Self {
        Self { next_frame, ..self }
    }

    /// Goes on counting where another left off: a frame number never comes twice.
    pub const fn go_on_from(&mut self, before: &Self) {
        self.next_frame = before.next_frame;
    }

    /// The number of the frame written last; one less than the first where there was none.
    #[must_use]
    pub const fn last_frame(&self) -> FrameNo {
        FrameNo(self.next_frame.0.wrapping_sub(1))
    }

    fn stamp(&mut self) -> Stamped {
        let frame = self.next_frame;
        self.next_frame = frame.next();
        let asked = frame.asks(self.ack_every);
        Stamped { frame, asked, shakes: 0.0 }
    }
}

#[cfg(test)]
mod tests;
