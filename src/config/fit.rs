//! Checks that a cue fits the hall: its axes, effects, vibration and stroke against the controllers.

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
        let found = misfits(&["1,axes=3"], "a1,a2,a3,a4,a5,a6", "0,0,0,0,0,0");
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("a4 to a6: no controller takes these axes"), "{found:?}");
        assert!(found[0].ends_with("`kinocue edit axes CUE 1-3 -o OUT` leaves them out"), "{found:?}");
    }

    #[test]
    fn an_effect_without_an_output_is_named_with_its_likeness() {
        let found = misfits(&["1"], "a1,fx_watter,fx_air", "0,1,1");
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("fx_watter: unknown effect"), "{found:?}");
        assert!(found[0].ends_with("did you mean water?"), "{found:?}");
    }

    #[test]
    fn vibration_that_a_seat_type_leaves_out_is_refused_nowhere_on_it() {
        let timeline = cue("a1,a2,v2_hz,v2_amp", "0,0,20,0.9");
        for target in ["1,dialect=mbox", "1,axes=10", "1"] {
            let mut config = from_to_args(&[format!("127.0.0.1:{target}")], &[], 2).unwrap();
            assert!(config.unshaken_seats(&timeline).is_empty());
            assert!(!config.misfits(&timeline).is_empty(), "{target}");
            for controller in &mut config.controllers {
                let seat = SeatType { vibration: 0.0, ..(*controller.seat).clone() };
                controller.seat = Arc::new(seat);
            }
            assert!(config.misfits(&timeline).is_empty(), "{target}");
            assert_eq!(config.unshaken_seats(&timeline), ["bench3"]);
        }
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
    fn a_level_is_held_to_what_a_controller_has_and_what_its_frames_can_carry() {
        let timeline = cue("a1,a2,v2_hz,v2_amp,dac1", "0,0,20,0.01,0.75");
        let targets = ["127.0.0.1:1,axes=1", "127.0.0.1:2,axes=1,offset=1"].map(str::to_owned);
        let hall = |at_most: [[f64; 2]; 2]| {
            let mut config = from_to_args(&targets, &[], 2).unwrap();
            config.controllers.iter_mut().zip(at_most).for_each(|(one, most)| one.at_most = most);
            config
        };
        assert!(hall([[0.75, 0.0], [0.0, 1.0]]).misfits(&timeline).is_empty());
        for (at_most, text) in [
            (
                [[0.5, 0.0], [0.0; 2]],
                "dac1: the level of 0.75 at 00:00.000 is over 0.5, the highest that c1 allows",
            ),
            (
                [[1.0; 2], [1.0; 2]],
                "dac1: this output cannot be set at c2, as its frames carry the vibration of axis 2",
            ),
            ([[0.0, 1.0]; 2], "dac1: no controller has this output"),
        ] {
            let found = hall(at_most).misfits(&timeline);
            let [misfit] = &found[..] else { panic!("told once: {found:?}") };
            assert!(misfit.to_string().starts_with(text) && misfit.column() == "dac1", "{misfit}");
        }
    }

    #[test]
    fn a_swing_that_no_frame_can_say_is_refused_with_its_time_and_the_limit() {
        let shake = |amplitude: &str| {
            let text =
                format!("# units: mm\ntime_s,a1,v1_hz,v1_amp\n0,9,20,1\n1.5,9,20,{amplitude}\n2,9,0,99\n");
            let timeline =
                Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
            let targets = ["127.0.0.1:1".to_owned(), "127.0.0.1:2".to_owned()];
            from_to_args(&targets, &[], 1).unwrap().misfits(&timeline)
        };
        assert!(shake("32.7675").is_empty(), "65,535 pulses, and what has no frequency shakes nothing");
        let found = shake("32.768");
        let [misfit] = &found[..] else { panic!("told once for both seats: {found:?}") };
        assert_eq!(misfit.column(), "v1_amp");
        assert_eq!(
            misfit.to_string(),
            "v1_amp: the amplitude at 00:01.500 (32.768 mm, 65536 pulses, on seat bench3) is over 32.767 mm, 65535 \
             pulses, the most that a frame can carry; lower the amplitude"
        );
    }

    #[test]
    fn a_swing_over_half_the_stroke_of_a_seat_is_refused() {
        let shake = |percent: f64| {
            let timeline = cue("a1,a2,v2_hz,v2_amp", &format!("0,0,20,{}", percent / 100.0));
            let targets = ["127.0.0.1:1,axes=1".to_owned(), "127.0.0.1:2,axes=1,offset=1".to_owned()];
            let mut config = from_to_args(&targets, &[], 2).unwrap();
            let coarse = SeatType::bench3(1).with_each(|axis| axis.pulses_per_rev = 1_000.0);
            config.controllers[1].seat = Arc::new(coarse);
            config.misfits(&timeline)
        };
        assert!(shake(50.0).is_empty());
        let found = shake(51.0);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(matches!(found[0], Misfit::AmplitudePastStroke { axis: 2, .. }), "{found:?}");
        let text = found[0].to_string();
        assert!(text.contains("76.500 mm, 15300 pulses"), "{text}");
        assert!(text.contains("is over 75.000 mm, 15000 pulses, half the stroke"), "{text}");
    }

    #[test]
    fn each_seat_proves_the_stroke_of_its_own_axes() {
        let text = "# units: mm\ntime_s,a1,a2\n0,0,0\n1,100,160\n2,100,160\n3,100,160\n";
        let timeline =
            Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
        let targets = ["127.0.0.1:1,axes=1".to_owned(), "127.0.0.1:2,axes=1,offset=1".to_owned()];
        let mut config = from_to_args(&targets, &[], 2).unwrap();
        assert_eq!(config.fits_stroke(&timeline).faults.len(), 1);
        let longer = SeatType::bench3(1).with_each(|axis| axis.high = 200.0);
        config.controllers[1].seat = Arc::new(longer);
        assert!(config.fits_stroke(&timeline).faults.is_empty());
    }
}
