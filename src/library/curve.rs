//! The curves of a cue as a page draws them: for each stretch of time the least and the greatest, exact also between rows.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::config::Config;
use crate::cue::{Marker, Unit};
use crate::motion::{SeatType, Slot};
use crate::timeline::{EffectUse, Stretches, Timeline};

/// The most stretches that a curve is asked in.
pub(crate) const MAX_POINTS: usize = 4000;

/// What comes of drawing a cue; a line of JSON from the process that draws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Drawing {
    /// Its curves.
    Curve(CurveData),
    /// Why it has none: every fault, a line each.
    Faults(Vec<String>),
}

/// The curves of a cue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurveData {
    /// How long the cue is, s.
    pub(crate) length_s: f64,
    /// The middle of each stretch of time, s; all are equally long.
    pub t_s: Vec<f64>,
    /// Each axis, axis 1 first.
    pub axes: Vec<AxisCurve>,
    /// Each effect and output that is used.
    pub(crate) effects: Vec<EffectCurve>,
    /// Named places, in order.
    pub(crate) markers: Vec<CurveMarker>,
}

/// When an effect or an output is on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub(crate) struct EffectCurve {
    /// As its switch is called.
    pub(crate) name: String,
    /// For each stretch whether it is ever on in it.
    pub(crate) on: Vec<bool>,
}

/// A named place in a cue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub(crate) struct CurveMarker {
    /// Where, s.
    pub(crate) at_s: f64,
    /// What it is called.
    pub(crate) name: String,
}

/// The curve of one axis, as parts of the stroke, 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AxisCurve {
    /// `a1` to `a12`.
    pub(crate) name: String,
    /// The least of each stretch.
    pub(crate) min: Vec<f64>,
    /// The greatest of each stretch.
    pub max: Vec<f64>,
}

/// Draws a cue in so many stretches, 1 to [`MAX_POINTS`]. In a cue that is not in fractions, an axis is measured against the
/// stroke of the first seat of `hall` that takes it, else of the bench seat.
#[must_use]
pub(crate) fn draw(timeline: &Timeline, hall: Option<&Config>, points: usize) -> CurveData {
    let bench = SeatType::bench3(timeline.axes());
    let slot = |axis: usize| {
        let taker = hall.and_then(|hall| hall.named().find(|one| one.takes(axis)));
        let (seat, first) = taker.map_or((&bench, 0), |one| (&*one.seat, one.axis_offset));
        timeline.unit(axis).slot(seat, axis - first, Some(axis))
    };
    let length_s = timeline.duration().as_secs_f64();
    let stretches = Stretches { from: 0.0, span: length_s / count(points), count: points };
    CurveData {
        length_s,
        t_s: (0..points).map(|stretch| stretches.start(stretch) + 0.5 * stretches.span).collect(),
        axes: (0..timeline.axes()).map(|axis| axis_curve(timeline, axis, &slot(axis), &stretches)).collect(),
        effects: effects(timeline).map(|usage| effect_curve(usage, &stretches)).collect(),
        markers: timeline.cue().markers().iter().map(CurveMarker::from).collect(),
    }
}

impl From<&Marker> for CurveMarker {
    fn from(marker: &Marker) -> Self {
        Self { at_s: marker.at.as_secs_f64(), name: marker.name.clone() }
    }
}

fn effects(timeline: &Timeline) -> impl Iterator<Item = EffectUse> {
    let levels = timeline.level_uses().into_iter().map(|level| level.usage);
    timeline.effect_uses().into_iter().chain(levels).filter(|usage| !usage.spans.is_empty())
}

fn effect_curve(EffectUse { name, spans }: EffectUse, stretches: &Stretches) -> EffectCurve {
    let mut on = vec![false; stretches.count];
    for (from, until) in spans {
        on[stretches.touched(from.as_secs_f64(), until.as_secs_f64())].fill(true);
    }
    EffectCurve { name, on }
}

/// True if the hall has to be known to draw a cue: some axis is not in fractions.
#[must_use]
pub(crate) fn needs_hall(timeline: &Timeline) -> bool {
    (0..timeline.axes()).any(|axis| timeline.unit(axis) != Unit::Fraction)
}

fn axis_curve(timeline: &Timeline, axis: usize, slot: &Slot, stretches: &Stretches) -> AxisCurve {
    let ends = timeline.envelope(axis, stretches);
    let part = |value: f64| slot.place(value);
    AxisCurve {
        name: format!("a{}", axis + 1),
        min: ends.iter().map(|(low, _)| part(*low)).collect(),
        max: ends.iter().map(|(_, high)| part(*high)).collect(),
    }
}

#[expect(clippy::cast_precision_loss, reason = "at most MAX_POINTS")]
fn count(stretches: usize) -> f64 {
    stretches as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;
    use crate::cue::{self, Source};
    use crate::time::ShowTime;
    use crate::timeline::Hint;

    fn timeline(text: &str) -> Timeline {
        Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    #[test]
    fn every_stretch_has_the_ends_of_its_own_time() {
        let cue = timeline("# interpolation: linear\ntime_s,a1,a2\n0,0,0.5\n1,1,0.5\n2,0,0.5\n4,0,0.5\n");
        let curve = draw(&cue, None, 4);
        assert_eq!(curve.t_s, [0.5, 1.5, 2.5, 3.5]);
        assert_eq!(curve.axes[0].max, [1.0, 1.0, 0.0, 0.0]);
        assert_eq!(curve.axes[0].min, [0.0, 0.0, 0.0, 0.0]);
        assert_eq!((&curve.axes[1].min, &curve.axes[1].max), (&vec![0.5; 4], &vec![0.5; 4]));
        assert_eq!(curve.axes[1].name, "a2");
    }

    #[test]
    fn an_effect_is_on_in_each_stretch_in_which_it_ever_is() {
        let cue = timeline("time_s,a1,fx_air,fx_wind\n0,0,0,0\n1.9,0,1,0\n2.1,0,0,0\n8,0,0,0\n");
        let curve = draw(&cue, None, 8);
        let [EffectCurve { name, on }] = &curve.effects[..] else { panic!("{:?}", curve.effects) };
        assert_eq!((name.as_str(), &on[..4]), ("air", &[false, true, true, false][..]));
    }

    #[test]
    fn more_stretches_than_rows_leave_no_gap() {
        let curve = draw(&timeline("time_s,a1\n0,0.2\n10,0.4\n"), None, 1000);
        assert!(curve.axes[0].min.iter().chain(&curve.axes[0].max).all(|v| (0.2..=0.4).contains(v)));
        assert!(curve.axes[0].min.windows(2).all(|pair| pair[0] < pair[1]), "it rises");
    }

    #[test]
    fn millimetres_are_parts_of_the_stroke_of_the_seat() {
        let curve = draw(&timeline("# units: mm\ntime_s,a1\n0,0\n1,75\n"), None, 1);
        assert_eq!((curve.axes[0].min[0], curve.axes[0].max[0]), (0.0, 0.5));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

        #[test]
        fn no_sample_lies_outside_its_stretch(
            rows in prop::collection::vec((1_i64..900, 0.3_f64..0.7), 2..20),
            points in 1_usize..50,
        ) {
            let mut text = "time_ms,a1\n".to_owned();
            let mut time = 0;
            for (span, value) in &rows {
                text += &format!("{time},{value}\n");
                time += span;
            }
            let cue = timeline(&text);
            let curve = draw(&cue, None, points);
            let span = cue.duration().as_secs_f64() / count(points);
            let stretches = Stretches { from: 0.0, span, count: points };
            for step in 0..=500 {
                let at = cue.duration().as_secs_f64() * f64::from(step) / 500.0;
                let value = cue.sample(ShowTime::from_secs_f64(at), &mut Hint::default())[0];
                let stretch = stretches.holding(at);
                prop_assert!(curve.axes[0].min[stretch] - 1e-6 <= value, "{at}");
                prop_assert!(curve.axes[0].max[stretch] + 1e-6 >= value, "{at}");
            }
        }
    }
}
