//! From a pose to the bytes of a motion frame: slots to pulses, effects to outputs. Tick thread; allocates nothing.

use crate::channel::{ChannelId, SWITCHES, Sample};
use crate::cue;
use crate::drive::Stamped;
use crate::engine::{Beat, Mix};
use crate::motion::{MAX_AXES, Pose, Pulses, Window};
use crate::timeline::EffectSet;
use crate::wire::{Analogue, Code, MAX_LEN, Motion, Vibration, VibrationPort};

/// Which outputs a cue's effects switch on one controller, and how far its analogue ones go.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Wiring {
    /// Output word of each effect of the cue, by its place among the cue's names.
    pub(crate) named: Vec<u16>,
    /// The bits of a raw output word that reach the controller.
    pub(crate) raw: u16,
    /// The highest level of each output of the table ([`crate::channel::switches`]), 0 where it has none.
    pub(crate) at_most: [f64; SWITCHES],
}

impl Wiring {
    /// The output word for what the cue switches.
    #[must_use]
    pub(crate) fn outputs(&self, switched: EffectSet) -> u16 {
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

/// How the frames to one controller are written.
#[derive(Debug, Clone)]
pub(crate) struct MotionCodec {
    /// Object channel of its frames (SMC manual 2.2.2.5).
    pub(crate) channel: u16,
    /// Who takes its frames, and who answers those that ask.
    pub(crate) code: Code,
    /// True if its frames carry vibration.
    pub(crate) vibrates: bool,
    /// Level of vibration on its seat, 0 to 1, on top of the mix.
    pub(crate) shake: f64,
    /// How these have Port Out.
    pub(crate) vibration_port: VibrationPort,
    /// Which outputs it switches.
    pub(crate) wiring: Wiring,
}

impl MotionCodec {
    /// Writes a frame that is numbered already, for whoever that code means.
    pub(crate) fn write<'b>(
        &self,
        window: &Window,
        (beat, pose): (&Beat, &Pose),
        mix: Mix,
        code: Code,
        stamped: &mut Stamped,
        buf: &'b mut [u8; MAX_LEN],
    ) -> &'b [u8] {
        let mix = Mix { vibration: self.shake * mix.vibration, ..mix };
        let slots = window.slots();
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
        let outputs = self.wiring.outputs(mix.effects(beat.effects));
        stamped.lights = outputs != 0;
        let motion = Motion {
            timing: beat.timing,
            channel: self.channel,
            accept: code,
            reply: if stamped.asked { code } else { Code::NONE },
            frame: stamped.frame,
            time_ms: beat.time_ms,
            positions: &positions[..slots.len()],
            outputs,
            analogue: Analogue::from_levels(self.wiring.within(ChannelId::Analogue, levels).0),
            vibration: self.vibrates.then_some(&vibration[..slots.len()]),
        };
        motion.emit_as(self.vibration_port, buf)
    }

    /// Its frames carry neither vibration nor outputs from now on.
    pub(crate) fn hold(&mut self) {
        self.vibrates = false;
        self.wiring = Wiring::default();
    }
}
