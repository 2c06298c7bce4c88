//! A cue on its seats as a picture: positions in the stroke, what they come to of the limits, vibration, outputs and markers.

use super::text::number;
use super::{Band, Flag, Lane, Mark, Panel, Picture, Scale, Shade, Table, TimeAxis};
use crate::channel;
use crate::cue::{Place, Vibration};
use crate::motion::{AxisGeometry, SeatAxis};
use crate::proof::{AxisStrain, Quantity, SLACK, strains};
use crate::time::{Rate, ShowTime};
use crate::timeline::{Figure, Stretches, Timeline};

/// The shortest column, ns: frames are whole milliseconds apart.
const LEAST_SPAN: i64 = 1_000_000;
/// What is measured, in the order of [`AxisStrain::parts`].
const MEASURED: [Quantity; 3] = [Quantity::Velocity, Quantity::Acceleration, Quantity::Jerk];

/// What is drawn of a cue.
#[derive(Debug)]
pub(crate) struct Subject<'a> {
    /// The cue.
    pub(crate) timeline: &'a Timeline,
    /// What each axis is on.
    pub(crate) seats: &'a [SeatAxis],
    /// Frames a second.
    pub(crate) rate: Rate,
    /// What it holds for, as the foot of the picture.
    pub(crate) facts: Vec<String>,
}

/// The columns of a picture: a grid from show time 0 on, so that measures of the whole cue serve for any part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Columns {
    /// How long each is, ns; above 0.
    span: i64,
    /// The first that is drawn.
    first: usize,
    /// How many are drawn, at least one.
    count: usize,
}

impl Columns {
    /// At most `most` columns, and one at each end, over what lies between two show times.
    #[must_use]
    pub(crate) fn over(from: ShowTime, until: ShowTime, most: usize) -> Self {
        let (from, until) = (from.as_nanos().max(0), until.as_nanos());
        let most = i64::try_from(most.max(1)).unwrap_or(i64::MAX);
        let span = (((until - from).max(1) - 1) / most + 1).max(LEAST_SPAN);
        let first = from / span;
        let count = ((until - first * span).max(1) - 1) / span + 1;
        let whole = |columns: i64| usize::try_from(columns).unwrap_or(0);
        Self { span, first: whole(first), count: whole(count).max(1) }
    }

    fn stretches(self) -> Stretches {
        let span = ShowTime::from_nanos(self.span).as_secs_f64();
        let all = Stretches { from: 0.0, span, count: self.first + self.count };
        Stretches { from: all.start(self.first), span, count: self.count }
    }

    fn of<T: Copy>(self, all: &[T]) -> impl Iterator<Item = Option<T>> + '_ {
        (self.first..self.first + self.count).map(|column| all.get(column).copied())
    }
}

/// The picture of a cue.
#[must_use]
pub(crate) fn of_cue(subject: Subject<'_>, columns: Columns) -> Picture {
    let Subject { timeline, seats, rate, .. } = subject;
    let strains = strains(timeline, rate, seats, columns.span);
    let stretches = columns.stretches();
    let time = TimeAxis::of_film(stretches.from, stretches.end(), stretches.count);
    let view = View { timeline, strains: &strains, columns, stretches, time: time.clone() };
    let cue = timeline.cue();
    let title = cue.title().map_or_else(|| cue.path().display().to_string(), str::to_owned);
    let flags = cue.markers().iter().map(|marker| Flag {
        at_s: marker.at.as_secs_f64(),
        name: marker.name.clone(),
        is_mark: false,
    });
    let flags = flags.filter(|flag| time.part(flag.at_s).is_some()).collect();
    Picture {
        title,
        sentence: view.sentence(),
        facts: subject.facts,
        time,
        panels: view.positions().into_iter().chain((0..3).map(|order| view.measured(order))).collect(),
        lanes: view.vibration().into_iter().chain(view.outputs()).collect(),
        flags,
        histograms: Vec::new(),
        table: Table {
            name: "Most of each axis",
            head: ["axis", "what", "most", "of limit", "at", "in the file"],
            rows: view.table(),
        },
    }
}

/// What a picture is made from.
struct View<'a> {
    timeline: &'a Timeline,
    strains: &'a [AxisStrain],
    columns: Columns,
    stretches: Stretches,
    time: TimeAxis,
}

impl View<'_> {
    /// The most of a measure over all axes, as a part of the limit: its axis, what it is.
    fn greatest(&self, order: usize) -> (usize, f64) {
        let part = |strain: &AxisStrain| {
            let (figure, limit) = strain.worst()[order];
            figure.value / limit
        };
        let parts = self.strains.iter().map(part).enumerate();
        parts.reduce(|most, one| if one.1 > most.1 { one } else { most }).unwrap_or_default()
    }

    fn sentence(&self) -> String {
        let all = (0..3).map(|order| (order, self.greatest(order)));
        let most = all.reduce(|most, one| if one.1.1 > most.1.1 { one } else { most });
        let (order, (axis, part)) = most.unwrap_or_default();
        if part <= 0.0 {
            return "Nothing moves.".to_owned();
        }
        let (figure, limit) = self.strains[axis].worst()[order];
        let unit = self.unit(axis, order);
        let name = name_of(order);
        let (comes, left) = if part > SLACK {
            ("is over its limit", format!("{:.0} % over", 100.0 * (part - 1.0)))
        } else {
            ("comes nearest to its limit", format!("{:.0} % left", 100.0 * (1.0 - part)))
        };
        let (value, limit) = (number(figure.value), number(limit));
        let outside = self.time.part(figure.at.as_secs_f64()).map_or(", outside of what is shown", |_| "");
        let (axis, at, place) = (axis + 1, figure.at, self.place(figure));
        format!("{name} {comes}: a{axis} at {at} ({place}), {value} of {limit} {unit}, {left}{outside}.")
    }

    fn unit(&self, axis: usize, order: usize) -> &'static str {
        MEASURED[order].unit(self.strains[axis].figures.on.geometry().unit)
    }

    /// A panel for each range that there is.
    fn positions(&self) -> Vec<Panel> {
        let mut panels: Vec<Panel> = Vec::new();
        for (axis, strain) in self.strains.iter().enumerate() {
            let AxisGeometry { low, high, unit, .. } = *strain.figures.on.geometry();
            let is_its = |panel: &Panel| (panel.unit, panel.low, panel.high) == (unit.name(), low, high);
            let band = self.position(axis, &strain.figures.on);
            match panels.iter_mut().find(|panel| is_its(panel)) {
                Some(panel) => panel.bands.push(band),
                None => panels.push(Panel {
                    name: "Position".to_owned(),
                    note: format!("stroke {} to {} {}", number(low), number(high), unit.name()),
                    place: String::new(),
                    unit: unit.name(),
                    scale: Scale::Range,
                    low,
                    high,
                    bands: vec![band],
                    marks: Vec::new(),
                }),
            }
        }
        panels
    }

    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn position(&self, axis: usize, on: &SeatAxis) -> Band {
        let slot = self.timeline.unit(axis).slot(&on.seat, on.index, Some(axis));
        let place = |value: f64| on.geometry().place(slot.place(value)) as f32;
        let ends = self.timeline.envelope(axis, &self.stretches).into_iter();
        let columns = ends.map(|(low, high)| (low <= high).then(|| [place(low), place(high)])).collect();
        Band { name: format!("a{}", axis + 1), style: axis, columns }
    }

    fn measured(&self, order: usize) -> Panel {
        let (worst, part) = self.greatest(order);
        let band = |(axis, strain): (usize, &AxisStrain)| Band {
            name: format!("a{}", axis + 1),
            style: axis,
            columns: self
                .columns
                .of(&strain.parts[order])
                .map(|part| part.map(|part| [0.0, 100.0 * part]))
                .collect(),
        };
        let (figure, limit) = self.strains[worst].worst()[order];
        Panel {
            name: name_of(order).to_owned(),
            note: format!("{:.0} % of {} {}", 100.0 * part, number(limit), self.unit(worst, order)),
            place: format!("a{} {}, {}", worst + 1, figure.at, self.line(figure)),
            unit: "%",
            scale: Scale::Limit,
            low: 0.0,
            high: if part > 1.0 { (100.0 * part * 1.08).ceil() } else { 108.0 },
            bands: self.strains.iter().enumerate().map(band).collect(),
            marks: (0..self.strains.len()).filter_map(|axis| self.mark(axis, order)).collect(),
        }
    }

    fn mark(&self, axis: usize, order: usize) -> Option<Mark> {
        let (figure, limit) = self.strains[axis].worst()[order];
        let at_s = figure.at.as_secs_f64();
        self.time.part(at_s).filter(|_| figure.value > 0.0)?;
        let (value, place) = (100.0 * figure.value / limit, self.place(figure));
        let words = format!("a{}: {value:.0} % at {}, {place}", axis + 1, figure.at);
        Some(Mark { at_s, value, style: axis, words })
    }

    /// The file and the line that a figure comes from, or the time of the message where that has no lines.
    fn place(&self, figure: Figure) -> String {
        let cue = self.timeline.cue();
        let file = cue.path().file_name().unwrap_or_default().to_string_lossy();
        if !self.has_messages() {
            return format!("{file}:{}", figure.line);
        }
        let at = cue.times().get(self.timeline.row_before(figure.at)).copied().unwrap_or_default();
        format!("{file}, message at {at}")
    }

    /// The same where there is little room.
    fn line(&self, figure: Figure) -> String {
        format!("{} {}", if self.has_messages() { "message" } else { "line" }, figure.line)
    }

    fn has_messages(&self) -> bool {
        matches!(self.timeline.cue().place(0, 0), Place::Message { .. })
    }

    /// Each kind of vibration, with the axes that have it.
    fn vibration(&self) -> Vec<Lane> {
        let tracks = self.timeline.cue().tracks();
        let mut alike: Vec<(usize, Vec<String>)> = Vec::new();
        for axis in (0..self.strains.len()).filter(|axis| self.timeline.vibrates(*axis)) {
            let same = |(first, _): &&mut (usize, _)| tracks.vibration(*first) == tracks.vibration(axis);
            match alike.iter_mut().find(same) {
                Some((_, names)) => names.push(format!("a{}", axis + 1)),
                None => alike.push((axis, vec![format!("a{}", axis + 1)])),
            }
        }
        alike.into_iter().map(|(axis, names)| self.shaken(axis, &names.join(", "))).collect()
    }

    /// Height is amplitude, tone is frequency.
    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn shaken(&self, axis: usize, names: &str) -> Lane {
        let steps = self.timeline.cue().tracks().vibration(axis).as_slice();
        let shakes: Vec<_> = steps.iter().map(|step| (step.at, Vibration::from(step.value))).collect();
        let most = |part: fn(&Vibration) -> f64| shakes.iter().map(|(_, v)| part(v)).fold(0.0, f64::max);
        let (hz, amplitude) = (most(|v| v.hz), most(|v| v.amplitude));
        let geometry = self.strains[axis].figures.on.geometry();
        let swing = amplitude * self.timeline.unit(axis).to_stroke(geometry) * geometry.stroke();
        let shade = |v: &Vibration| {
            let height = if v.hz > 0.0 { v.amplitude / amplitude } else { 0.0 };
            Shade { height: height as f32, tone: (v.hz / hz) as f32 }
        };
        let runs = shakes.iter().map(|(at, vibration)| (*at, shade(vibration)));
        Lane {
            name: format!("vibration {names}"),
            note: format!("up to {swing:.2} {}, {} Hz; fuller is faster", geometry.unit.name(), number(hz)),
            columns: self.filled(runs),
        }
    }

    /// Effects and outputs that are ever on.
    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn outputs(&self) -> Vec<Lane> {
        let timeline = self.timeline;
        let full = |is_on: bool| Shade { height: f32::from(u8::from(is_on)), tone: 1.0 };
        let used = timeline.effect_uses().into_iter().filter(|usage| !usage.spans.is_empty());
        let effects = used.map(|usage| {
            let note = format!("{}×, {:.1} s", usage.spans.len(), usage.on().as_secs_f64());
            let runs =
                usage.spans.iter().flat_map(|(from, until)| [(*from, full(true)), (*until, full(false))]);
            Lane { columns: self.filled(runs), name: usage.name, note }
        });
        let levels = channel::switches().filter_map(|(track, part, name)| {
            let (_, most) = timeline.greatest_level(track, part)?;
            let steps = timeline.cue().tracks().of(track).as_slice().iter();
            let shade = |level: f64| Shade { height: level as f32, tone: 1.0 };
            let columns = self.filled(steps.map(|step| (step.at, shade(step.value.0[part]))));
            Some(Lane { name: name.to_owned(), note: format!("up to {}", number(most)), columns })
        });
        effects.chain(levels).collect()
    }

    /// The most of each column of what holds until it changes.
    fn filled(&self, runs: impl Iterator<Item = (ShowTime, Shade)>) -> Vec<Shade> {
        let mut columns = vec![Shade::default(); self.stretches.count];
        let mut runs = runs.peekable();
        while let Some((at, shade)) = runs.next() {
            let until = runs.peek().map_or(self.timeline.duration(), |(next, _)| *next).as_secs_f64();
            let from = at.as_secs_f64();
            if until <= self.stretches.from || from >= self.stretches.end() || shade.height <= 0.0 {
                continue;
            }
            for column in &mut columns[self.stretches.touched(from, until)] {
                if shade.height > column.height {
                    *column = shade;
                }
            }
        }
        columns
    }

    fn table(&self) -> Vec<[String; 6]> {
        let row = |axis: usize, order: usize| {
            let (figure, limit) = self.strains[axis].worst()[order];
            [
                format!("a{}", axis + 1),
                name_of(order).to_owned(),
                format!("{} of {} {}", number(figure.value), number(limit), self.unit(axis, order)),
                format!("{:.0} %", 100.0 * figure.value / limit),
                figure.at.to_string(),
                self.place(figure),
            ]
        };
        (0..self.strains.len())
            .flat_map(|axis| (0..3).map(move |order| (axis, order)))
            .map(|(a, o)| row(a, o))
            .collect()
    }
}

const fn name_of(order: usize) -> &'static str {
    ["Speed", "Acceleration", "Jerk"][order]
}
