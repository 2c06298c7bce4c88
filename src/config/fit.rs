//! Whether a cue fits the hall: its axes, effects, vibration and stroke against the controllers.

use std::ops::Range;
use std::sync::Arc;

use crate::cue::CueFaults;
use crate::motion::SeatType;
use crate::timeline::{Held, Timeline};
use crate::wire::motion_channel_and_slots;

use super::section::did_you_mean;
use super::{Config, Controller, Dialect, FanOut};

/// The most axes of a frame with vibration (SMC manual 2.2.2.9).
const MAX_VIBRATING_AXES: usize = 6;

/// One thing of a cue that the hall cannot do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Misfit {
    /// An axis that no controller takes.
    #[error("a{axis}: no controller takes this axis; give one an axis_offset and a seat that reach it")]
    UntakenAxis {
        /// The axis, from 1.
        axis: usize,
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
    #[error("v{axis}_hz: vibration cannot be sent to {controller}, as its dialect, mbox, has none")]
    NoVibration {
        /// The axis, from 1.
        axis: usize,
        /// The controller's name.
        controller: String,
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
}

impl Misfit {
    /// The column of a CSV cue that it is about.
    #[must_use]
    pub fn column(&self) -> String {
        match self {
            Self::UntakenAxis { axis } => format!("a{axis}"),
            Self::UnknownEffect { name, .. } => format!("fx_{name}"),
            Self::NoVibration { axis, .. } | Self::WideVibration { axis, .. } => format!("v{axis}_hz"),
        }
    }
}

/// Whether a cue stays within the strokes of the hall.
#[derive(Debug, Default)]
pub struct HallStroke {
    /// Faults for each seat type and window of axes that is left.
    pub faults: Vec<CueFaults>,
    /// Axes whose curve is held at an end of the stroke somewhere.
    pub held: Vec<Held>,
}

impl Config {
    /// What the hall cannot do of a cue, the stroke left aside; nothing where all of it can be played.
    #[must_use]
    pub fn misfits(&self, timeline: &Timeline) -> Vec<Misfit> {
        let untaken = self.untaken_axes(timeline.axes()).into_iter().map(|axis| Misfit::UntakenAxis { axis });
        let unknown = timeline.effect_names().iter().filter(|name| !self.has_effect(name));
        let unknown = unknown.map(|name| {
            let hint = did_you_mean(name, self.effects.iter().map(|effect| effect.name.as_str()));
            Misfit::UnknownEffect { name: name.clone(), hint }
        });
        let shaken = self.controllers.iter().filter_map(|controller| unshakeable(controller, timeline));
        untaken.chain(unknown).chain(shaken).collect()
    }

    /// Holds the cue's axes against the stroke of each seat that takes them.
    #[must_use]
    pub fn fits_stroke(&self, timeline: &Timeline) -> HallStroke {
        let mut proved: Vec<(Range<usize>, &Arc<SeatType>)> = Vec::new();
        let mut result = HallStroke::default();
        for controller in &self.controllers {
            let window = (controller.window(), &controller.seat);
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

/// Why the controller cannot shake as the cue asks, named by the first axis that does.
fn unshakeable(controller: &Controller, timeline: &Timeline) -> Option<Misfit> {
    let seen = match controller.fan_out {
        FanOut::Slice => controller.window(),
        FanOut::Shared => 0..timeline.axes(),
    };
    let (_, axes) = motion_channel_and_slots(controller.frame_axes(timeline.axes()));
    let axis = 1 + seen.into_iter().find(|&axis| timeline.vibrates(axis))?;
    let controller_name = controller.name.clone();
    match controller.dialect {
        Dialect::Mbox => Some(Misfit::NoVibration { axis, controller: controller_name }),
        Dialect::Smc if axes > MAX_VIBRATING_AXES => {
            Some(Misfit::WideVibration { axis, controller: controller_name, axes })
        }
        Dialect::Smc => None,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::from_to_args;
    use crate::cue::{self, Source};

    fn cue(header: &str, row: &str) -> Timeline {
        let text = format!("time_s,{header}\n0,{row}\n1,{row}\n");
        Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    fn misfits(targets: &[&str], header: &str, row: &str) -> Vec<String> {
        let timeline = cue(header, row);
        let targets: Vec<String> = targets.iter().map(|target| format!("127.0.0.1:{target}")).collect();
        let config = from_to_args(&targets, &[], timeline.axes()).unwrap();
        config.misfits(&timeline).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_axis_that_no_controller_takes_is_named() {
        let found = misfits(&["1,axes=1", "2,axes=1,offset=2"], "a1,a2,a3", "0,0,0");
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("a2: no controller takes this axis"), "{found:?}");
    }

    #[test]
    fn an_effect_without_an_output_is_named_with_its_likeness() {
        let found = misfits(&["1"], "a1,fx_watter,fx_air", "0,1,1");
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("fx_watter: unknown effect"), "{found:?}");
        assert!(found[0].ends_with("did you mean water?"), "{found:?}");
    }

    #[test]
    fn vibration_is_refused_where_a_frame_cannot_carry_it() {
        let (header, row) = ("a1,a2,v2_hz,v2_amp", "0,0,20,0.01");
        assert!(misfits(&["1"], header, row).is_empty());
        assert!(
            misfits(&["1,dialect=mbox"], header, row)[0].starts_with("v2_hz: vibration cannot be sent to c1")
        );
        assert!(misfits(&["1,axes=1,dialect=mbox", "2,axes=1,offset=1"], header, row).is_empty());
        assert!(misfits(&["1,axes=10"], header, row)[0].ends_with("carry 10 axes, over 6"));
        assert!(misfits(&["1,axes=6"], header, row).is_empty());
        assert_eq!(misfits(&["1,axes=7"], header, row).len(), 1);
        assert!(misfits(&["1,axes=10"], header, "0,0,0,0").is_empty());
    }

    #[test]
    fn each_seat_proves_the_stroke_of_its_own_axes() {
        let text = "# units: mm\ntime_s,a1,a2\n0,0,0\n1,100,160\n2,100,160\n3,100,160\n";
        let timeline =
            Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
        let targets = ["127.0.0.1:1,axes=1".to_owned(), "127.0.0.1:2,axes=1,offset=1".to_owned()];
        let mut config = from_to_args(&targets, &[], 2).unwrap();
        assert_eq!(config.fits_stroke(&timeline).faults.len(), 1);
        let longer = SeatType { stroke_mm: 200.0, ..SeatType::bench3(1) };
        config.controllers[1].seat = Arc::new(longer);
        assert!(config.fits_stroke(&timeline).faults.is_empty());
    }
}
