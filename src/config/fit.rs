//! Checks that a cue fits the hall: its axes, effects, vibration and stroke against the controllers.

#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use crate::channel::{self, TrackId};
use crate::cue::CueFaults;
use crate::motion::{AxisUnit, SeatAxis, SeatType};
use crate::time::ShowTime;
use crate::timeline::{Held, Timeline};
use crate::wire::{Vibration, motion_channel_and_slots};

use super::section::did_you_mean;
use super::{Config, Controller, Dialect};

/// The most axes of a frame with vibration (SMC manual 2.2.2.9).
pub(super) const MAX_VIBRATING_AXES: usize = 6;

/// One thing of a cue that the hall cannot do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Misfit {
    /// Axes in a row that no controller takes.
    #[error("{}", untaken(*axis, *last, *axes))]
    UntakenAxes {
        /// The first of them, from 1.
        axis: usize,
        /// The last.
        last: usize,
        /// How many the cue has.
        axes: usize,
    },
    /// An effect that is no output here.
    #[error("fx_{name}: unknown effect; wire it to an output in [effects], or with --effect {name}=N{hint}")]
    UnknownEffect {
        /// What the cue calls it.
        name: String,
        /// `; did you mean …?`, or nothing.
        hint: String,
    },
    /// Vibration of an axis whose controller has no message for it.
    #[error(
        "v{axis}_hz: vibration cannot be sent to {controller}, as its dialect, mbox, has none; to leave it out there, write vibration = \"0%\" in [seat.{seat}]"
    )]
    NoVibration {
        /// The axis, from 1.
        axis: usize,
        /// The controller's name.
        controller: String,
        /// The type of its seat.
        seat: String,
    },
    /// Vibration in a frame that has no room for it.
    #[error(
        "v{axis}_hz: vibration cannot be sent to {controller}, as its frames carry {axes} axes, over \
         {MAX_VIBRATING_AXES}"
    )]
    WideVibration {
        /// The axis, from 1.
        axis: usize,
        /// The controller's name.
        controller: String,
        /// Axes of its frames.
        axes: usize,
    },
    /// A swing that no frame can ask for; it would be cut without a word.
    #[error("v{axis}_amp: {amplitude} is over {limit}, the most that a frame can carry; lower the amplitude")]
    UnsaidAmplitude {
        /// The axis, from 1.
        axis: usize,
        /// What the cue asks for.
        amplitude: Amplitude,
        /// What a frame can say.
        limit: VibrationSwing,
    },
    /// A swing that leaves the stroke wherever the axis stands.
    #[error("v{axis}_amp: {amplitude} is over {limit}, half the stroke; lower the amplitude")]
    AmplitudePastStroke {
        /// The axis, from 1.
        axis: usize,
        /// What the cue asks for.
        amplitude: Amplitude,
        /// Half the seat's stroke.
        limit: VibrationSwing,
    },
    /// An analogue output that no controller has.
    #[error(
        "{column}: no controller has this output; say in the [[controller]] that has it how far it may go, as \
         {column} = 1.0"
    )]
    NoOutput {
        /// Its column.
        column: &'static str,
    },
    /// A level over what a controller's output may have.
    #[error(
        "{column}: the level of {level} at {at} is over {most}, the highest that {controller} allows; lower it, or raise \
         {column} of that [[controller]]"
    )]
    LevelTooHigh {
        /// Its column.
        column: &'static str,
        /// What the cue asks for.
        level: f64,
        /// The first show time at which it is asked for.
        at: ShowTime,
        /// The controller's name.
        controller: String,
        /// What it may have.
        most: f64,
    },
    /// An analogue output of a controller whose frames have no place for it.
    #[error(
        "{column}: this output cannot be set at {controller}, as its frames carry the vibration of axis {axis} and have no \
         place for it (SMC manual 2.2.2.9); take the vibration out of the cue, or set {column} = 0 for that [[controller]]"
    )]
    OutputWithVibration {
        /// Its column.
        column: &'static str,
        /// The controller's name.
        controller: String,
        /// The axis that vibrates, from 1.
        axis: usize,
    },
}

/// How far a vibration swings to either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VibrationSwing {
    /// How far, in the unit of the axis.
    pub(crate) far: f64,
    /// That unit.
    pub(crate) unit: AxisUnit,
    /// Pulses.
    pub(crate) pulses: f64,
}

impl fmt::Display for VibrationSwing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} {}, {:.0} pulses", self.far, self.unit.name(), self.pulses)
    }
}

/// The farthest swing that a cue asks of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplitude {
    /// How far.
    pub(crate) swing: VibrationSwing,
    /// The seat type that it means so much on.
    pub(crate) seat: String,
    /// The first show time at which it is asked for.
    pub(crate) at: ShowTime,
}

impl fmt::Display for Amplitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { swing, seat, at } = self;
        write!(f, "the amplitude at {at} ({swing}, on seat {seat})")
    }
}

impl Misfit {
    /// The column of a CSV cue that it is about.
    #[must_use]
    pub(crate) fn column(&self) -> String {
        match self {
            Self::UntakenAxes { axis, .. } => format!("a{axis}"),
            Self::UnknownEffect { name, .. } => format!("fx_{name}"),
            Self::NoVibration { axis, .. } | Self::WideVibration { axis, .. } => format!("v{axis}_hz"),
            Self::UnsaidAmplitude { axis, .. } | Self::AmplitudePastStroke { axis, .. } => {
                format!("v{axis}_amp")
            }
            Self::NoOutput { column, .. }
            | Self::LevelTooHigh { column, .. }
            | Self::OutputWithVibration { column, .. } => (*column).to_owned(),
        }
    }

    /// The show time that it is about; `None` if the column as such is wrong.
    #[must_use]
    pub(crate) const fn at(&self) -> Option<ShowTime> {
        match self {
            Self::LevelTooHigh { at, .. } => Some(*at),
            _ => None,
        }
    }
}

/// True if a cue stays within the strokes of the hall.
#[derive(Debug, Default)]
pub(crate) struct HallStroke {
    /// Faults for each seat type and window of axes that is left.
    pub(crate) faults: Vec<CueFaults>,
    /// Axes whose curve is held at an end of the stroke somewhere.
    pub(crate) held: Vec<Held>,
}

impl Config {
    /// What the hall cannot do of a cue, the stroke left aside; nothing where all of it can be played.
    #[must_use]
    pub(crate) fn misfits(&self, timeline: &Timeline) -> Vec<Misfit> {
        let untaken = rows(&self.untaken_axes(timeline.axes()));
        let untaken =
            untaken.into_iter().map(|(axis, last)| Misfit::UntakenAxes { axis, last, axes: timeline.axes() });
        let unknown = timeline.effect_names().iter().filter(|name| !self.has_effect(name));
        let unknown = unknown.map(|name| {
            let hint = did_you_mean(name, self.effects.iter().map(|effect| effect.name.as_str()));
            Misfit::UnknownEffect { name: name.clone(), hint }
        });
        let shaken = self.shaken_seats().filter_map(|controller| unshakeable(controller, timeline));
        let shaken = shaken.chain(self.overshaken(timeline));
        untaken.chain(unknown).chain(shaken).chain(self.unset_levels(timeline)).collect()
    }

    /// The levels that outputs cannot have, once for each column: of no controller, or the first that cannot.
    fn unset_levels(&self, timeline: &Timeline) -> Vec<Misfit> {
        let switches = channel::switches().enumerate();
        let misfit = |(place, (track, part, column)): (usize, (TrackId, usize, &'static str))| {
            let (at, level) = timeline.greatest_level(track, part)?;
            if !self.named().any(|controller| controller.at_most[place] > 0.0) {
                return Some(Misfit::NoOutput { column });
            }
            self.controllers.iter().find_map(|one| {
                let most = Some(one.at_most[place]).filter(|most| *most > 0.0)?;
                let controller = one.name.clone();
                let mut seen = one.sees(timeline.axes()).filter(|_| one.seat.vibration > 0.0);
                let vibrating = seen.find(|axis| timeline.vibrates(*axis));
                if let Some(axis) = vibrating.filter(|_| !track.channel.row().beside_vibration) {
                    return Some(Misfit::OutputWithVibration { column, controller, axis: axis + 1 });
                }
                (level > most).then_some(Misfit::LevelTooHigh { column, level, at, controller, most })
            })
        };
        switches.filter_map(misfit).collect()
    }

    /// Those on whose seats vibration is not left out.
    fn shaken_seats(&self) -> impl Iterator<Item = &Controller> {
        self.controllers.iter().filter(|one| one.seat.vibration > 0.0)
    }

    /// The seat types on which vibration of a cue is left out.
    #[must_use]
    pub(crate) fn unshaken_seats(&self, timeline: &Timeline) -> Vec<&str> {
        let is_left_out = |one: &&Controller| {
            one.seat.vibration == 0.0
                && one.window().any(|axis| axis < timeline.axes() && timeline.vibrates(axis))
        };
        let mut names: Vec<_> =
            self.controllers.iter().filter(is_left_out).map(|one| one.seat.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The axes that swing too far, once for each seat type.
    fn overshaken(&self, timeline: &Timeline) -> Vec<Misfit> {
        let mut judged: Vec<(usize, SeatAxis)> = Vec::new();
        let mut misfits = Vec::new();
        for controller in self.shaken_seats().filter(|one| unshakeable(one, timeline).is_none()) {
            for (index, axis) in controller.window().enumerate() {
                let on = SeatAxis::new(&controller.seat, index);
                if !judged.iter().any(|(before, seat)| *before == axis && seat.is_as(&on)) {
                    misfits.extend(overshake(axis, &on, timeline));
                    judged.push((axis, on));
                }
            }
        }
        misfits
    }

    /// Holds the cue's axes against the stroke of each seat that takes them.
    #[must_use]
    pub(crate) fn fits_stroke(&self, timeline: &Timeline) -> HallStroke {
        let mut proved: Vec<(Range<usize>, &Arc<SeatType>)> = Vec::new();
        let mut result = HallStroke::default();
        for window in self.controllers.iter().map(|one| (one.window(), &one.seat)) {
            if proved.contains(&window) {
                continue;
            }
            let fit = timeline.fits_stroke(window.0.clone(), Some(window.1));
            result.faults.extend(fit.faults);
            result.held.extend(fit.held);
            proved.push(window);
        }
        result
    }

    fn has_effect(&self, name: &str) -> bool {
        self.effects.iter().any(|effect| effect.name == name)
    }
}

/// Rising numbers as rows of neighbours: the first and the last of each.
fn rows(numbers: &[usize]) -> Vec<(usize, usize)> {
    numbers.chunk_by(|one, next| one + 1 == *next).map(|row| (row[0], row[row.len() - 1])).collect()
}

fn untaken(axis: usize, last: usize, axes: usize) -> String {
    let (which, what, them) = if axis == last {
        (format!("a{axis}"), "this axis", "it")
    } else {
        (format!("a{axis} to a{last}"), "these axes", "them")
    };
    let without = match axis {
        2.. if last == axes => format!("; `kinocue edit axes CUE 1-{} -o OUT` leaves {them} out", axis - 1),
        _ => String::new(),
    };
    format!(
        "{which}: no controller takes {what}; give one an axis_offset and a seat that include {them}{without}"
    )
}

/// Why the controller cannot shake as the cue asks, named by the first axis that does.
fn unshakeable(controller: &Controller, timeline: &Timeline) -> Option<Misfit> {
    let (_, axes) = motion_channel_and_slots(controller.frame_axes(timeline.axes()));
    let axis = 1 + controller.sees(timeline.axes()).find(|&axis| timeline.vibrates(axis))?;
    let controller_name = controller.name.clone();
    match controller.station()?.dialect {
        Dialect::Mbox => Some(Misfit::NoVibration {
            axis,
            controller: controller_name,
            seat: controller.seat.name.clone(),
        }),
        Dialect::Smc if axes > MAX_VIBRATING_AXES => {
            Some(Misfit::WideVibration { axis, controller: controller_name, axes })
        }
        Dialect::Smc => None,
    }
}

/// Why an axis, counted from 0, swings too far on a seat: past the lower of what a frame can say and half the stroke.
fn overshake(axis: usize, on: &SeatAxis, timeline: &Timeline) -> Option<Misfit> {
    let (at, strongest) = timeline.strongest_vibration(axis)?;
    let (seat, geometry) = (&on.seat, on.geometry());
    let stroke_pulses = geometry.stroke_pulses();
    let far = |pulses: f64| pulses / stroke_pulses * geometry.stroke();
    let swing = |pulses: f64| VibrationSwing { far: far(pulses), unit: geometry.unit, pulses };
    // Whole pulses, as the wire has them.
    let pulses = (strongest.amplitude * timeline.unit(axis).to_stroke(geometry) * stroke_pulses).round();
    let half = (stroke_pulses / 2.0).round();
    let most = f64::from(Vibration::MAX_AMPLITUDE);
    if pulses <= half.min(most) {
        return None;
    }
    let amplitude = Amplitude { swing: swing(pulses), seat: seat.name.clone(), at };
    let axis = axis + 1;
    Some(if half < most {
        Misfit::AmplitudePastStroke { axis, amplitude, limit: swing(half) }
    } else {
        Misfit::UnsaidAmplitude { axis, amplitude, limit: swing(most) }
    })
}
