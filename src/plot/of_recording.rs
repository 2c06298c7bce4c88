//! A recording of one seat as a picture: asked, sent and measured, how far they are apart, lateness and acks, what was on, and the
//! sentence that says what happened.

use super::text::number;
use super::{Band, Flag, Histogram, Lane, Mark, Panel, Picture, Scale, Shade, Table, TimeAxis};
use crate::record::{Contents, Margins, SeatSample, Summary, TickSample, Told, each_chunk, state_word};
use crate::time::{MonoTime, Rate, ShowTime};

/// Asked and sent are apart where they differ by more, mm or degrees: more than pulses and rounding make.
const APART: f64 = 0.02;
/// A tick is late from here on, µs.
const LATE_US: f64 = 1_000.0;
/// Upper ends of a histogram's bins, µs; the last has no end.
const BINS_US: [f64; 12] = [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5, f64::INFINITY];
/// Lateness of a column is kept of so many ticks at the most.
const KEPT: usize = 20_000;

/// What a recording is looked at for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// The seat, by its place.
    pub(crate) lane: usize,
    /// The time axis, in show time.
    pub(crate) time: TimeAxis,
    /// Whether asked positions and percentiles are drawn as well: a terminal has no room for them.
    pub(crate) is_detailed: bool,
}

/// Least and greatest of each column of each axis.
#[derive(Debug, Default)]
struct Traces(Vec<Vec<Option<[f32; 2]>>>);

impl Traces {
    fn of(axes: usize, columns: usize) -> Self {
        Self(vec![vec![None; columns]; axes])
    }

    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn take(&mut self, column: usize, places: impl IntoIterator<Item = f64>) {
        for (trace, place) in self.0.iter_mut().zip(places) {
            let place = place as f32;
            if !place.is_finite() {
                continue;
            }
            let [low, high] = trace[column].unwrap_or([place, place]);
            trace[column] = Some([low.min(place), high.max(place)]);
        }
    }

    fn ends(&self) -> Option<(f64, f64)> {
        let known = self.0.iter().flatten().flatten();
        let ends = known.fold(None, |ends: Option<(f32, f32)>, [low, high]| {
            let (least, most) = ends.unwrap_or((*low, *high));
            Some((least.min(*low), most.max(*high)))
        })?;
        Some((ends.0.into(), ends.1.into()))
    }

    fn bands(self, name: impl Fn(usize) -> String, style: usize) -> Vec<Band> {
        let band = |(axis, columns)| Band { name: name(axis), style: axis + style, columns };
        self.0.into_iter().enumerate().map(band).collect()
    }
}

/// What is gathered of a stretch of a recording for its picture.
#[derive(Debug)]
pub(crate) struct Gathered {
    look: Look,
    asked: Traces,
    sent: Traces,
    measured: Traces,
    apart: Traces,
    parts: Traces,
    /// The most of each axis and quantity in the stretch: part, show time.
    most: Vec<[(f64, f64); 3]>,
    margins: Option<Margins>,
    late: Vec<Vec<f32>>,
    acks: Traces,
    lateness: Vec<u64>,
    latency: Vec<u64>,
    counts: Counts,
    /// What is on: name, columns, how often.
    lanes: Vec<(&'static str, Vec<Shade>, u64)>,
    state: Option<&'static str>,
    states: Vec<(&'static str, Vec<Shade>)>,
    flags: Vec<Flag>,
    column: usize,
    /// Ticks are taken from whole ones, and not from samples.
    is_whole: bool,
}

/// What the sentence is made of.
#[derive(Debug, Default)]
struct Counts {
    sent: u64,
    acked: u64,
    lost: u64,
    refused: u64,
    unsent: u64,
    clamps: u64,
    missed: u64,
    dropped: u64,
    late_us: f64,
    late_s: f64,
    ack_us: f64,
    /// The greatest distance of asked and sent, and its show time.
    apart: f64,
    apart_s: f64,
    /// How long they were apart in one piece, about the greatest; and the piece that is not over, with its own greatest.
    held: f64,
    piece: Option<(MonoTime, f64)>,
}

impl Gathered {
    /// Nothing yet. `is_whole` where the file has every tick.
    pub(crate) fn new(contents: &Contents, look: Look, is_whole: bool) -> Self {
        let (axes, columns) = (contents.seats[look.lane].axes().len(), look.time.columns);
        let lane = |name| (name, vec![Shade::default(); columns], 0);
        let margins = is_whole.then(|| Margins::new(&contents.seats, Rate::from_hz(contents.rate_hz())));
        Self {
            look,
            asked: Traces::of(axes, columns),
            sent: Traces::of(axes, columns),
            measured: Traces::of(axes, columns),
            apart: Traces::of(axes, columns),
            parts: Traces::of(3, columns),
            most: vec![[(0.0, 0.0); 3]; axes],
            margins,
            late: vec![Vec::new(); columns],
            acks: Traces::of(1, columns),
            lateness: vec![0; BINS_US.len()],
            latency: vec![0; BINS_US.len()],
            counts: Counts::default(),
            lanes: ["held", "missed", "lost", "refused", "untaken", "gaps"].map(lane).into(),
            state: None,
            states: Vec::new(),
            flags: Vec::new(),
            column: 0,
            is_whole,
        }
    }

    /// Takes what a file tells.
    pub(crate) fn take(&mut self, contents: &Contents, at: MonoTime, told: Told<'_>) {
        match told {
            Told::Seat(lane, sample) if lane == self.look.lane => self.seat(at, &sample),
            Told::Tick(sample) => self.tick(&sample),
            Told::State(state) => self.state = Some(state_word(state)),
            Told::Chunks(chunks) => self.chunks(contents, &chunks),
            Told::Other(topic @ ("/mark" | "/event" | "/action"), data) => {
                let at_s = self.at_s();
                let name = format!("{}: {}", &topic[1..], String::from_utf8_lossy(data));
                self.flags.push(Flag { at_s, name });
            }
            _ => {}
        }
    }

    /// The show time of the column that was taken last.
    #[expect(clippy::cast_precision_loss, reason = "some thousand columns")]
    fn at_s(&self) -> f64 {
        let TimeAxis { from_s, until_s, columns } = self.look.time;
        from_s + (until_s - from_s) * self.column as f64 / columns as f64
    }

    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to the number of columns"
    )]
    fn place(&mut self, film_s: f64) -> Option<usize> {
        let time = &self.look.time;
        let part = time.part(film_s)?;
        self.column = ((part * time.columns as f64) as usize).min(time.columns - 1);
        Some(self.column)
    }

    fn seat(&mut self, at: MonoTime, sample: &SeatSample) {
        let Some(column) = self.place(sample.film_s) else { return };
        self.measured.take(column, sample.measured_mm.iter().copied());
        let counts = &mut self.counts;
        counts.acked += u64::from(sample.acked);
        counts.lost += sample.lost;
        counts.refused += u64::from(sample.refused);
        self.on(2, column, sample.lost);
        self.on(3, column, sample.refused.into());
        if let Some(ack) = sample.ack_max_us {
            self.acks.take(column, [ack / 1e3]);
            self.counts.ack_us = self.counts.ack_us.max(ack);
        }
        if let Some(ack) = sample.ack_us {
            self.latency[bin(ack)] += 1;
        }
        if !self.is_whole {
            self.frame(at, sample.film_s, column, &sample.asked_mm, &sample.sent_mm);
            self.counts.sent += u64::from(sample.sent);
            self.counts.unsent += u64::from(sample.unsent);
            self.counts.clamps += sample.clamps;
            self.on(0, column, sample.clamps);
            self.on(4, column, sample.unsent.into());
        }
    }

    fn frame(&mut self, at: MonoTime, film_s: f64, column: usize, asked: &[f64], sent: &[f64]) {
        self.asked.take(column, asked.iter().copied());
        self.sent.take(column, sent.iter().copied());
        let apart = || asked.iter().zip(sent).map(|(asked, sent)| asked - sent);
        self.apart.take(column, apart());
        self.counts.apart(at, film_s, apart().map(f64::abs).fold(0.0, f64::max));
    }

    fn tick(&mut self, sample: &TickSample) {
        let Some(column) = self.place(sample.film_s) else { return };
        if let Some(word) = self.state {
            let columns = self.look.time.columns;
            let known = self.states.iter().position(|(one, _)| *one == word);
            let index = known.unwrap_or_else(|| {
                self.states.push((word, vec![Shade::default(); columns]));
                self.states.len() - 1
            });
            self.states[index].1[column] = Shade { height: 1.0, tone: 1.0 };
        }
        self.counts.missed += sample.missed;
        self.counts.dropped += sample.dropped;
        self.on(1, column, sample.missed);
        self.on(5, column, sample.dropped);
        if !self.is_whole {
            self.late(column, sample.film_s, sample.late_max_us);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn late(&mut self, column: usize, film_s: f64, late_us: f64) {
        if self.late[column].len() < KEPT {
            self.late[column].push((late_us / 1e3) as f32);
        }
        self.lateness[bin(late_us)] += 1;
        if late_us > self.counts.late_us {
            (self.counts.late_us, self.counts.late_s) = (late_us, film_s);
        }
    }

    fn chunks(&mut self, contents: &Contents, chunks: &[u8]) {
        let mut margins = self.margins.take();
        let (lane, seat) = (self.look.lane, &contents.seats[self.look.lane]);
        let mut clamps = None;
        each_chunk(chunks, |chunk| {
            let film_s = chunk.head.film.as_secs_f64();
            let at = chunk.head.deadline;
            if let Some(margins) = &mut margins {
                margins.take(chunk, &contents.seats, &mut |of, axis, parts| {
                    if of == lane {
                        self.parts_of(axis, parts);
                    }
                });
            }
            let Some(column) = self.place(film_s) else { return };
            self.late(column, film_s, micros(chunk.head.late_ns));
            for frame in chunk.frames().filter(|frame| frame.lane == lane) {
                let is_taken = frame.handed.is_taken();
                self.counts.sent += u64::from(is_taken);
                self.counts.unsent += u64::from(!is_taken);
                self.on(4, column, (!is_taken).into());
                let (asked, sent) = (seat.asked(&frame.asked), seat.sent(&frame));
                self.frame(at, film_s, column, &asked, &sent);
                if !asked.is_empty() {
                    let more = frame
                        .asked
                        .clamps
                        .saturating_sub(clamps.replace(frame.asked.clamps).unwrap_or(frame.asked.clamps));
                    self.counts.clamps += more;
                    self.on(0, column, more);
                }
            }
        });
        self.margins = margins;
    }

    fn parts_of(&mut self, axis: usize, parts: [(ShowTime, f64); 3]) {
        for (order, (at, part)) in parts.into_iter().enumerate() {
            let at_s = at.as_secs_f64();
            if let Some(column) = self.place(at_s) {
                let place = |index| if index == order { 100.0 * part } else { f64::NAN };
                self.parts.take(column, (0..3).map(place));
                if part > self.most[axis][order].0 {
                    self.most[axis][order] = (part, at_s);
                }
            }
        }
    }

    fn on(&mut self, lane: usize, column: usize, count: u64) {
        if count > 0 {
            self.lanes[lane].1[column] = Shade { height: 1.0, tone: 1.0 };
            self.lanes[lane].2 += count;
        }
    }
}

impl Counts {
    /// Notes how far asked and sent are apart, and for how long in one piece.
    fn apart(&mut self, at: MonoTime, film_s: f64, apart: f64) {
        if apart <= APART {
            self.piece = None;
            return;
        }
        let (since, most) = self.piece.unwrap_or((at, 0.0));
        let most = most.max(apart);
        self.piece = Some((since, most));
        if apart > self.apart {
            (self.apart, self.apart_s) = (apart, film_s);
        }
        if most >= self.apart {
            self.held = at.since(since).as_secs_f64();
        }
    }
}

fn bin(us: f64) -> usize {
    BINS_US.iter().position(|end| us <= *end).unwrap_or(BINS_US.len() - 1)
}

#[expect(clippy::cast_precision_loss, reason = "less than an hour")]
fn micros(ns: u64) -> f64 {
    ns as f64 / 1e3
}

/// The picture of what was gathered; with the sent positions of another recording, if one is laid over it.
pub(crate) fn of_recording(
    contents: &Contents,
    summary: &Summary,
    gathered: Gathered,
    other: Option<Gathered>,
) -> Picture {
    let seat = &contents.seats[gathered.look.lane];
    let sentence = sentence(&seat.name, &gathered, contents.rate_hz());
    let Gathered {
        look,
        asked,
        sent,
        measured,
        apart,
        parts,
        most,
        late,
        acks,
        lateness,
        latency,
        counts,
        lanes,
        states,
        flags,
        ..
    } = gathered;
    let unit = seat.axes().first().map_or("mm", |axis| axis.unit.name());
    let named = |name: &'static str| move |axis: usize| format!("a{}{name}", axis + 1);
    let (low, high) = range(seat, &asked, &sent);
    let mut bands = sent.bands(named(""), 0);
    let mut note = "";
    // Dashed in the colour of the axis, whose name stands at the end of what was sent.
    if let Some(other) = other {
        note = "dashed: the other recording";
        bands.extend(other.sent.bands(|_| String::new(), 6));
    } else if look.is_detailed && counts.apart > APART {
        note = "dashed: where it was asked to be";
        bands.extend(asked.bands(|_| String::new(), 6));
    }
    let mut panels = vec![Panel { note: note.to_owned(), ..panel("Sent", unit, (low, high), bands) }];
    if counts.apart > APART {
        let ends = apart.ends().unwrap_or((0.0, 1.0));
        let mut panel =
            panel("Asked less sent", unit, (ends.0.min(0.0), ends.1.max(0.0)), apart.bands(named("Δ"), 0));
        panel.note = format!("{} {unit} apart at most", places(counts.apart));
        panel.place = ShowTime::from_secs_f64(counts.apart_s).to_string();
        panels.push(panel);
    }
    if look.is_detailed && measured.ends().is_some() {
        panels.push(panel("Measured", unit, (low, high), measured.bands(named("m"), 0)));
    }
    if parts.ends().is_some() {
        panels.extend(limits(parts, &most));
    }
    panels.extend(lateness_panel(&late, look.is_detailed, &counts));
    if let Some((_, high)) = acks.ends() {
        let mut panel =
            panel("Ack latency", "ms", (0.0, high.max(0.001)), acks.bands(|_| "ack".to_owned(), 3));
        panel.note = format!("{:.3} ms at most", counts.ack_us / 1e3);
        panels.push(panel);
    }
    let used = lanes.into_iter().filter(|(.., count)| *count > 0);
    let used =
        used.map(|(name, columns, count)| Lane {
            name: name.to_owned(), note: format!("{count}×"), columns
        });
    let strips = states.into_iter().map(|(word, columns)| Lane {
        name: word.to_owned(),
        note: String::new(),
        columns,
    });
    let histogram = |name, counts: Vec<u64>| Histogram {
        name,
        bins: BINS_US.iter().map(|end| bin_name(*end)).zip(counts).collect(),
    };
    let histograms = [histogram("Lateness", lateness), histogram("Ack latency", latency)];
    Picture {
        title: title(contents, &seat.name),
        sentence,
        facts: facts(contents, summary),
        time: look.time,
        panels,
        lanes: used.chain(strips).collect(),
        flags,
        table: seats(summary),
        histograms: histograms
            .into_iter()
            .filter(|one| one.bins.iter().any(|(_, count)| *count > 0))
            .collect(),
    }
}

fn bin_name(end: f64) -> String {
    match end {
        end if end.is_infinite() => "more".to_owned(),
        end if end >= 1_000.0 => format!("{} ms", number(end / 1_000.0)),
        end => format!("{} µs", number(end)),
    }
}

/// To two places where that is little.
fn places(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { number(value) }
}

fn title(contents: &Contents, seat: &str) -> String {
    let title = contents.entry("title");
    format!("{}, {seat}", if title.is_empty() { contents.entry("cue") } else { title })
}

/// The stroke of all axes, and what lies outside of it.
fn range(seat: &crate::record::RecordedSeat, asked: &Traces, sent: &Traces) -> (f64, f64) {
    let axes = seat.axes().iter().map(|axis| (axis.low, axis.low + axis.stroke));
    let all = axes.chain(asked.ends()).chain(sent.ends());
    let (low, high) =
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, one| (ends.0.min(one.0), ends.1.max(one.1)));
    if low < high { (low, high) } else { (0.0, 1.0) }
}

fn panel(name: &str, unit: &'static str, (low, high): (f64, f64), bands: Vec<Band>) -> Panel {
    let high = if high > low { high } else { low + 1.0 };
    Panel {
        name: name.to_owned(),
        note: String::new(),
        place: String::new(),
        unit,
        scale: Scale::Range,
        low,
        high,
        bands,
        marks: Vec::new(),
    }
}

/// Speed, acceleration and jerk as parts of their limits, the most of all axes.
fn limits(parts: Traces, most: &[[(f64, f64); 3]]) -> Vec<Panel> {
    let of = |(order, columns): (usize, Vec<Option<[f32; 2]>>)| {
        let of_axis = |(axis, most): (usize, &[(f64, f64); 3])| (axis, most[order]);
        let worst = most.iter().enumerate().map(of_axis).max_by(|one, other| one.1.0.total_cmp(&other.1.0));
        let (axis, (part, at_s)) = worst.unwrap_or_default();
        let (value, at) = (100.0 * part, ShowTime::from_secs_f64(at_s));
        let columns = columns.into_iter().map(|column| column.map(|[_, most]| [0.0, most])).collect();
        let words = format!("a{}: {value:.0} % at {at}", axis + 1);
        Panel {
            note: format!("{value:.0} % of its limit"),
            place: format!("a{} {at}", axis + 1),
            scale: Scale::Limit,
            high: if part > 1.0 { (108.0 * part).ceil() } else { 108.0 },
            marks: vec![Mark { at_s, value, style: order, words }],
            ..panel(
                ["Speed", "Acceleration", "Jerk"][order],
                "%",
                (0.0, 108.0),
                vec![Band { name: "most".to_owned(), style: order, columns }],
            )
        }
    };
    parts.0.into_iter().enumerate().map(of).collect()
}

fn lateness_panel(late: &[Vec<f32>], is_detailed: bool, counts: &Counts) -> Option<Panel> {
    let sorted: Vec<Vec<f32>> = late
        .iter()
        .map(|column| {
            let mut column = column.clone();
            column.sort_by(f32::total_cmp);
            column
        })
        .collect();
    let at = |percent: usize| {
        let of = |column: &Vec<f32>| {
            column.get((column.len().saturating_sub(1) * percent).div_ceil(100)).map(|ms| [*ms, *ms])
        };
        sorted.iter().map(of).collect::<Vec<_>>()
    };
    let band = |name: &str, style, percent| Band { name: name.to_owned(), style, columns: at(percent) };
    let mut bands = vec![band("late", 4, 100)];
    if is_detailed {
        bands.extend([band("p99", 1, 99), band("p50", 0, 50)]);
    }
    bands[0].last()?;
    let mut panel = panel("Lateness", "ms", (0.0, (counts.late_us / 1e3).max(0.001)), bands);
    panel.note = format!("{:.3} ms at most", counts.late_us / 1e3);
    panel.place = ShowTime::from_secs_f64(counts.late_s).to_string();
    Some(panel)
}

/// What happened to a seat, for whoever asks why it jerked.
fn sentence(name: &str, gathered: &Gathered, rate_hz: f64) -> String {
    let counts = &gathered.counts;
    if counts.sent + counts.unsent == 0 {
        return format!("{name}: nothing was sent in what is shown.");
    }
    let held = counts.apart > APART || counts.clamps > 0;
    let mut words = if held {
        let at = ShowTime::from_secs_f64(counts.apart_s);
        // From tick to tick it is one period longer than from the first instant to the last.
        let ms = 1_000.0 * (counts.held + if gathered.is_whole { 1.0 / rate_hz } else { 0.05 });
        let about = if gathered.is_whole { "" } else { "about " };
        let how_far = places(counts.apart);
        format!("{name} at {at}: held back by the limiter for {about}{ms:.0} ms, by up to {how_far} mm")
    } else {
        format!("{name}: sent as it was asked for")
    };
    let late = if counts.missed > 0 {
        format!("{} ticks missed", counts.missed)
    } else if counts.late_us > LATE_US {
        format!("latest {:.1} ms at {}", counts.late_us / 1e3, ShowTime::from_secs_f64(counts.late_s))
    } else {
        "nothing late".to_owned()
    };
    let acks = match (counts.lost, counts.refused, counts.acked) {
        (0, 0, 0) => "no acks recorded".to_owned(),
        (0, 0, _) => "all acked".to_owned(),
        (lost, 0, _) => format!("{lost} lost"),
        (lost, refused, _) => format!("{lost} lost, {refused} refused"),
    };
    words += &format!("; {late}, {acks}");
    if counts.unsent > 0 {
        words += &format!(", {} not taken by the kernel", counts.unsent);
    }
    if counts.dropped > 0 {
        words += &format!(", {} ticks not recorded", counts.dropped);
    }
    words + "."
}

fn facts(contents: &Contents, summary: &Summary) -> Vec<String> {
    let entry = |key| contents.entry(key);
    let nearest =
        summary.nearest().map(|margin| format!("Nearest to its limit in all of it: {}.", margin.in_words()));
    let mut facts = vec![
        format!(
            "{} recording of {}, hall {}, {} Hz",
            entry("mode"),
            entry("cue"),
            entry("hall"),
            entry("rate_hz")
        ),
        format!(
            "digest {}, recorded by {}, drawn by kinocue {}",
            entry("cue_sha256"),
            entry("program"),
            env!("CARGO_PKG_VERSION")
        ),
    ];
    facts.extend(nearest);
    if summary.dropped > 0 {
        facts.push(format!("{} ticks were not recorded.", summary.dropped));
    }
    if let Some(trouble) = &contents.trouble {
        facts.push(format!("The file {trouble}."));
    }
    facts
}

/// A row for each seat.
fn seats(summary: &Summary) -> Table {
    let row = |seat: &crate::record::SeatTotals| {
        let of_seat = summary.most.iter().filter(|one| one.seat == seat.name);
        let nearest = of_seat.max_by(|one, other| one.part().total_cmp(&other.part()));
        let word = |margin: &crate::record::Margin| {
            format!("a{} {} {:.0} %", margin.axis, margin.quantity.word(), 100.0 * margin.part())
        };
        [
            seat.name.clone(),
            seat.sent.to_string(),
            seat.unsent.to_string(),
            seat.clamps.to_string(),
            format!("{} at {}", places(seat.apart), ShowTime::from_secs_f64(seat.apart_film_s)),
            nearest.map(word).unwrap_or_default(),
        ]
    };
    Table {
        name: "Seats",
        head: ["seat", "sent", "not taken", "held back", "farthest apart", "nearest to a limit"],
        rows: summary.seats.iter().map(row).collect(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Theme, braille, page, svg};
    use super::*;
    use crate::record::{Mode, Wanted, read, recorded_as, summarize};

    /// What a seat at rest in the middle, that was asked for a tenth of the stroke more in some ticks, looks like.
    fn drawn(mode: Mode, asked: std::ops::Range<u32>, columns: usize) -> Picture {
        let ticks = (0..300).map(|tick| (if asked.contains(&tick) { 0.6 } else { 0.5 }, 0.5));
        let file = recorded_as(mode, ticks);
        let (contents, summary) = summarize(file.as_slice()).unwrap();
        let time = TimeAxis { from_s: 0.0, until_s: 2.99, columns };
        let mut gathered =
            Gathered::new(&contents, Look { lane: 0, time, is_detailed: true }, mode == Mode::Full);
        read(file.as_slice(), Wanted::ALL, &mut |contents, at, told| gathered.take(contents, at, told))
            .unwrap();
        of_recording(&contents, &summary, gathered, None)
    }

    #[test]
    fn the_sentence_says_when_a_seat_was_held_back_and_for_how_long() {
        let picture = drawn(Mode::Full, 114..122, 300);
        let expected = "A1 at 00:01.140: held back by the limiter for 80 ms, by up to 15 mm; ";
        assert!(picture.sentence.starts_with(expected), "{}", picture.sentence);
        let sampled = drawn(Mode::Sampled, 114..122, 300);
        let expected = "held back by the limiter for about 120 ms, by up to 15 mm; ";
        assert!(sampled.sentence.contains(expected), "{}", sampled.sentence);
        let quiet = drawn(Mode::Full, 0..0, 300);
        assert!(quiet.sentence.starts_with("A1: sent as it was asked for; "), "{}", quiet.sentence);
        for drawn in [braille(&picture), svg(&picture, Theme::Auto), page(&picture, Theme::Auto)] {
            assert!(drawn.contains("held back by the limiter for 80 ms") && drawn.len() < 500_000);
        }
    }

    proptest! {
        #[test]
        fn one_tick_that_was_held_back_shows_however_narrow_the_picture(at in 1_u32..299, columns in 1_usize..200, whole in any::<bool>()) {
            let mode = if whole { Mode::Full } else { Mode::Sampled };
            let picture = drawn(mode, at..at + 1, columns);
            let panel = picture.panels.iter().find(|panel| panel.name == "Asked less sent").expect("they differ");
            let most = panel.bands[0].columns.iter().flatten().map(|[_, most]| *most).fold(0.0, f32::max);
            prop_assert!((most - 15.0).abs() < 0.01, "{most}");
        }
    }
}
