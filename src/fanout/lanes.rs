//! Builds the lanes of a play from configuration and cue, and says everything that keeps them from fitting.

use super::{Lane, Wiring};
use crate::config::{Config, Controller, Dialect, FanOut};
use crate::cue::{Cue, Effects};
use crate::motion::{MAX_AXES, SeatType, Slot, Window};
use crate::wire::{Code, FrameNo, motion_channel_and_slots};

/// Why a cue cannot be sent to these controllers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FanOutFault {
    /// An axis of the cue that moves nothing.
    #[error("a{0} is taken by no controller; add one with that axis in its window, or leave the column out")]
    AxisUntaken(usize),
    /// Vibration asked of a controller that has none.
    #[error(
        "v{axis}: controller {controller} speaks mbox, which has no vibration; leave the column out or set dialect = \"smc\""
    )]
    NoVibration {
        /// Axis of the cue, counted from 1.
        axis: usize,
        /// The controller's name.
        controller: String,
    },
    /// Vibration in a frame too long for it.
    #[error(
        "v{axis}: the frames of controller {controller} carry {slots} axes, and vibration fits into at most 6; use fan_out = \"slice\" with at most 6 axes"
    )]
    VibrationTooWide {
        /// Axis of the cue, counted from 1.
        axis: usize,
        /// The controller's name.
        controller: String,
        /// Positions in a frame.
        slots: usize,
    },
    /// An effect without an output.
    #[error("fx_{0} has no output; name one in [effects], or with --effect {0}=N")]
    EffectUnknown(String),
}

/// How a play is sent, whatever the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manner {
    /// Intensity of motion and vibration, 0 to 1, about the seats' neutral poses.
    pub level: f64,
    /// Whether no frame asks for a reply.
    pub silent: bool,
}

/// The lanes of every controller, in the configuration's order.
///
/// # Errors
/// Every [`FanOutFault`] there is.
pub fn lanes(config: &Config, cue: &Cue, manner: Manner) -> Result<Vec<Lane>, Vec<FanOutFault>> {
    let untaken = config.untaken_axes(cue.axes()).into_iter().map(FanOutFault::AxisUntaken);
    let mut faults: Vec<FanOutFault> = untaken.collect();
    if let Effects::Named { names, .. } = cue.effects() {
        let unknown = names.iter().filter(|name| !knows(config, name));
        faults.extend(unknown.map(|name| FanOutFault::EffectUnknown(name.clone())));
    }
    let lanes = config
        .controllers
        .iter()
        .map(|controller| lane(config, controller, cue, manner, &mut faults))
        .collect();
    if faults.is_empty() { Ok(lanes) } else { Err(faults) }
}

fn lane(
    config: &Config,
    controller: &Controller,
    cue: &Cue,
    manner: Manner,
    faults: &mut Vec<FanOutFault>,
) -> Lane {
    let (channel, window) = match controller.fan_out {
        FanOut::Slice => slice(controller, cue, manner.level),
        FanOut::Shared => shared(config, controller, cue, manner.level),
    };
    let slots = window.slots().len();
    let vibrating: Vec<usize> = window
        .moving()
        .filter_map(|(_, slot)| slot.axis)
        .filter(|axis| cue.vibration().get(*axis).is_some_and(|steps| !steps.as_slice().is_empty()))
        .collect();
    for axis in vibrating.iter().map(|axis| axis + 1) {
        let name = || controller.name.clone();
        if controller.dialect == Dialect::Mbox {
            faults.push(FanOutFault::NoVibration { axis, controller: name() });
        } else if slots > 6 {
            faults.push(FanOutFault::VibrationTooWide { axis, controller: name(), slots });
        }
    }
    Lane {
        window,
        channel,
        code: Code(controller.accept.code(controller.address)),
        vibrates: !vibrating.is_empty(),
        wiring: wiring(config, controller, cue),
        ack_every: if manner.silent { 0 } else { config.show.ack_every },
        next_frame: FrameNo::FIRST,
    }
}

/// Just the controller's own axes, the first of them in the first slot; padding rests.
fn slice(controller: &Controller, cue: &Cue, level: f64) -> (u16, Window) {
    let (channel, slots) = motion_channel_and_slots(controller.seat.axes);
    let own_slot = |index: usize| {
        let axis = controller.axis_offset + index;
        let own = (index < controller.seat.axes && axis < cue.axes()).then_some(axis);
        slot(&controller.seat, index, own, cue, level)
    };
    (channel, Window::new((0..slots).map(own_slot).collect()))
}

/// The whole cue's axes, as every controller that shares the frame sees them; each takes its own window by PA95.
fn shared(config: &Config, controller: &Controller, cue: &Cue, level: f64) -> (u16, Window) {
    let reach = (controller.axis_offset + controller.seat.axes).min(MAX_AXES);
    let (channel, slots) = motion_channel_and_slots(cue.axes().max(reach));
    let any_slot = |axis: usize| {
        let takes = |other: &&Controller| other.fan_out == FanOut::Shared && other.takes(axis);
        let taker =
            if controller.takes(axis) { Some(controller) } else { config.controllers.iter().find(takes) };
        let taker = taker.unwrap_or(controller);
        let own = (axis < cue.axes()).then_some(axis);
        slot(&taker.seat, axis.saturating_sub(taker.axis_offset), own, cue, level)
    };
    (channel, Window::new((0..slots).map(any_slot).collect()))
}

fn slot(seat: &SeatType, seat_axis: usize, axis: Option<usize>, cue: &Cue, level: f64) -> Slot {
    let neutral = seat.neutral.get(seat_axis).copied().unwrap_or(0.0);
    Slot::new(seat, seat_axis, axis, cue.unit().to_stroke(seat)).at_level(level, neutral)
}

fn wiring(config: &Config, controller: &Controller, cue: &Cue) -> Wiring {
    let named = match cue.effects() {
        Effects::Named { names, .. } => {
            names.iter().map(|name| config.effect_outputs(controller, name).unwrap_or(0)).collect()
        }
        Effects::Words(_) => Vec::new(),
    };
    Wiring { named, raw: config.allowed_outputs(controller) }
}

fn knows(config: &Config, name: &str) -> bool {
    config.effects.iter().any(|effect| effect.name == name)
}
