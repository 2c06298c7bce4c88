//! What is gathered of a stretch of a recording for its picture, column by column.

use std::time::Duration;

use serde_json::Value;

use super::Look;
use super::film_axis::Moment;
use super::flags::{Noted, SeatFlags};
use crate::plot::{Band, Shade, TimeAxis};
use crate::record::{
    Contents, Falls, Margins, SeatFall, SeatSample, TickSample, Told, each_chunk, state_word,
};
use crate::time::{MonoTime, Rate, ShowTime};

/// Asked and sent are apart where they differ by more, mm or degrees: more than pulses and rounding make.
pub(super) const APART: f64 = 0.02;
/// Upper ends of a histogram's bins, µs; the last has no end.
pub(super) const BINS_US: [f64; 12] =
    [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 1e5, f64::INFINITY];
/// The lane of a seat that is out.
const OUT: usize = 6;
/// What is kept of what was said of how the seat stands.
const SAID: usize = 1_000;
/// Lateness of a column is kept of so many ticks at the most.
const KEPT: usize = 20_000;

/// Least and greatest of each column of each axis.
#[derive(Debug, Default)]
pub(super) struct Traces(pub(super) Vec<Vec<Option<[f32; 2]>>>);

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

    /// What is known on an axis of show time alone, on one of passes.
    pub(super) fn on(self, plain: &TimeAxis, axis: &TimeAxis) -> Self {
        let column = |trace: &[Option<[f32; 2]>], column: usize| {
            // Columns of both are as wide, and need not begin alike.
            let ends = [axis.place(column), axis.place(column + 1)].map(|at| plain.column(axis.film_s(at)));
            let known = ends.into_iter().flatten().filter_map(|column| trace[column]);
            known.reduce(|[low, high], [least, most]| [low.min(least), high.max(most)])
        };
        let trace = |trace: Vec<_>| (0..axis.columns).map(|index| column(&trace, index)).collect();
        Self(self.0.into_iter().map(trace).collect())
    }

    pub(super) fn ends(&self) -> Option<(f64, f64)> {
        let known = self.0.iter().flatten().flatten();
        let ends = known.fold(None, |ends: Option<(f32, f32)>, [low, high]| {
            let (least, most) = ends.unwrap_or((*low, *high));
            Some((least.min(*low), most.max(*high)))
        })?;
        Some((ends.0.into(), ends.1.into()))
    }

    pub(super) fn bands(self, name: impl Fn(usize) -> String, style: usize) -> Vec<Band> {
        let band = |(axis, columns)| Band { name: name(axis), style: axis + style, columns };
        self.0.into_iter().enumerate().map(band).collect()
    }
}

/// Something that is on at times: its name, columns, and how often.
pub(super) type CountedLane = (&'static str, Vec<Shade>, u64);

/// What is gathered of a stretch of a recording for its picture.
#[derive(Debug)]
pub(crate) struct Gathered {
    pub(super) look: Look,
    pub(super) asked: Traces,
    pub(super) sent: Traces,
    pub(super) measured: Traces,
    pub(super) apart: Traces,
    pub(super) parts: Traces,
    /// The most of each axis and quantity in the stretch: part, and when.
    pub(super) most: Vec<[(f64, Moment); 3]>,
    pub(super) margins: Option<Margins>,
    pub(super) late: Vec<Vec<f32>>,
    pub(super) acks: Traces,
    pub(super) lateness: Vec<u64>,
    pub(super) latency: Vec<u64>,
    pub(super) counts: SeatCounts,
    pub(super) falls: Falls,
    /// What is on.
    pub(super) lanes: Vec<CountedLane>,
    pub(super) state: Option<&'static str>,
    pub(super) states: Vec<(&'static str, Vec<Shade>)>,
    pub(super) flags: SeatFlags,
    /// What was said of how the seat stands: when, and in words.
    pub(super) said: Vec<(MonoTime, String)>,
    /// Ticks are taken from whole ones, and not from samples.
    pub(super) is_whole: bool,
    /// How long a sample is at the most, s.
    pub(super) sample_s: f64,
}

/// What the sentence is made of.
#[derive(Debug, Default)]
pub(super) struct SeatCounts {
    pub(super) sent: u64,
    pub(super) acked: u64,
    pub(super) lost: u64,
    pub(super) refused: u64,
    pub(super) unsent: u64,
    pub(super) clamps: u64,
    pub(super) missed: u64,
    pub(super) dropped: u64,
    pub(super) late_us: f64,
    pub(super) late_at: Moment,
    pub(super) ack_us: f64,
    pub(super) level: LevelRamps,
    /// The greatest distance of asked and sent, and when.
    pub(super) apart: f64,
    pub(super) apart_at: Moment,
    /// How long they were apart in one piece, about the greatest; and the piece that is not over, with its own greatest.
    pub(super) held: f64,
    pub(super) piece: Option<(MonoTime, f64)>,
}

/// Changes of a seat's level, each from where it turns to where it turns or rests again.
#[derive(Debug, Default)]
pub(super) struct LevelRamps {
    last: Option<f64>,
    /// The one that goes on: from where, and since when.
    now: Option<(f64, Moment)>,
    /// The greatest, of several the last: from where, to where, and when it began.
    pub(super) most: Option<(f64, f64, Moment)>,
}

impl LevelRamps {
    pub(super) fn take(&mut self, level: f64, moment: Moment) {
        let Some(last) = self.last.replace(level) else { return };
        let step = level - last;
        if step == 0.0 {
            self.now = None;
            return;
        }
        let goes_on = self.now.filter(|(from, _)| (last - from) * step >= 0.0);
        let (from, at) = *self.now.insert(goes_on.unwrap_or((last, moment)));
        if self.most.is_none_or(|(begin, end, _)| (level - from).abs() >= (end - begin).abs()) {
            self.most = Some((from, level, at));
        }
    }
}

impl Gathered {
    /// Nothing yet. `is_whole` where the file has every tick.
    pub(crate) fn new(contents: &Contents, look: Look, is_whole: bool) -> Self {
        let (axes, columns) = (contents.seats[look.lane].axes().len(), look.axis.time.columns);
        let lane = |name| (name, vec![Shade::default(); columns], 0);
        let margins = is_whole.then(|| Margins::new(&contents.seats, Rate::from_hz(contents.rate_hz())));
        Self {
            look,
            asked: Traces::of(axes, columns),
            sent: Traces::of(axes, columns),
            measured: Traces::of(axes, columns),
            apart: Traces::of(axes, columns),
            parts: Traces::of(3, columns),
            most: vec![[(0.0, Moment::default()); 3]; axes],
            margins,
            late: vec![Vec::new(); columns],
            acks: Traces::of(1, columns),
            lateness: vec![0; BINS_US.len()],
            latency: vec![0; BINS_US.len()],
            counts: SeatCounts::default(),
            falls: Falls::default(),
            lanes: ["held", "missed", "lost", "refused", "untaken", "gaps", "out"].map(lane).into(),
            state: None,
            states: Vec::new(),
            flags: SeatFlags::of_samples(contents.sample_s()),
            said: Vec::new(),
            is_whole,
            sample_s: contents.sample_s(),
        }
    }

    /// Takes what a file tells.
    pub(crate) fn take(&mut self, contents: &Contents, at: MonoTime, told: Told<'_>) {
        match told {
            Told::Seat(lane, sample) if lane == self.look.lane => self.seat(at, &sample),
            Told::Tick(sample) => self.tick(at, &sample),
            Told::State(state) => self.state = Some(state_word(state)),
            Told::Chunks(chunks) => self.chunks(contents, &chunks),
            Told::Other(topic @ ("/mark" | "/event" | "/action"), data) => {
                let seat = &contents.seats[self.look.lane].name;
                let note: Value = serde_json::from_slice(data).unwrap_or_default();
                if topic == "/event" && note["kind"] == "standing" && note["seat"] == seat.as_str() {
                    self.stands(at, note["text"].as_str().unwrap_or_default());
                }
                let Some(name) = flag_name(topic, &note, seat) else { return };
                let film_s = note["film_s"].as_f64();
                self.flags.note(Noted { at, film_s, name, is_mark: topic == "/mark" });
            }
            _ => {}
        }
    }

    /// The column of what is told of the last `length_s`.
    fn place(&self, at: MonoTime, film_s: f64, length_s: f64) -> Option<(usize, Moment)> {
        let moment = self.look.axis.moment(at, film_s, length_s)?;
        Some((self.look.axis.time.column(moment.at_s)?, moment))
    }

    fn stands(&mut self, at: MonoTime, text: &str) {
        if self.said.len() < SAID {
            self.said.push((at, text.to_owned()));
        }
    }

    /// What was said about the time of it of why the seat fell out first.
    pub(super) fn why_fallen(&self) -> Option<&str> {
        /// The recorder is told of it a little later than it was found.
        const ABOUT: Duration = Duration::from_secs(1);
        let SeatFall { out: (out, _), standing, .. } = self.falls.first?;
        let why = |text: &'_ str| text.strip_prefix(&format!("{standing}: ")).map(str::len);
        let apart = |at: MonoTime| at.since(out).max(out.since(at));
        let near = self.said.iter().filter(|(at, _)| apart(*at) <= ABOUT);
        let why = near.filter_map(|(at, text)| Some((apart(*at), &text[text.len() - why(text)?..])));
        why.min_by_key(|(apart, _)| *apart).map(|(_, why)| why)
    }

    fn seat(&mut self, at: MonoTime, sample: &SeatSample) {
        let Some((column, moment)) = self.place(at, sample.film_s, self.sample_s) else { return };
        let falls = self.falls.count;
        self.falls.take(at, &sample.sum());
        self.on(OUT, column, self.falls.count - falls);
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
            self.frame(at, moment, column, [&sample.asked_mm, &sample.sent_mm]);
            if !sample.asked_mm.is_empty() {
                self.counts.level.take(sample.level, moment);
            }
            self.counts.sent += u64::from(sample.sent);
            self.counts.unsent += u64::from(sample.unsent);
            self.counts.clamps += sample.clamps;
            self.on(0, column, sample.clamps);
            self.on(4, column, sample.unsent.into());
        }
    }

    fn frame(&mut self, at: MonoTime, moment: Moment, column: usize, [asked, sent]: [&[f64]; 2]) {
        self.asked.take(column, asked.iter().copied());
        self.sent.take(column, sent.iter().copied());
        let apart = || asked.iter().zip(sent).map(|(asked, sent)| asked - sent);
        self.apart.take(column, apart());
        self.counts.apart(at, moment, apart().map(f64::abs).fold(0.0, f64::max));
    }

    fn tick(&mut self, at: MonoTime, sample: &TickSample) {
        self.flags.tick(&self.look.axis, at, sample.film_s);
        let Some((column, moment)) = self.place(at, sample.film_s, self.sample_s) else { return };
        if let Some(word) = self.state {
            let columns = self.look.axis.time.columns;
            let known = self.states.iter().position(|(one, _)| *one == word);
            let index = known.unwrap_or_else(|| {
                self.states.push((word, vec![Shade::default(); columns]));
                self.states.len() - 1
            });
            self.states[index].1[column] = Shade { height: 1.0, tone: 1.0 };
        }
        // While the film stands before it begins, or is over, nobody is led by it.
        let missed = if self.look.axis.runs(at) { sample.missed } else { 0 };
        self.counts.missed += missed;
        self.counts.dropped += sample.dropped;
        self.on(1, column, missed);
        self.on(5, column, sample.dropped);
        if self.falls.is_out() {
            // Nothing more is told of a seat that is out.
            self.lanes[OUT].1[column] = Shade { height: 1.0, tone: 1.0 };
        }
        if !self.is_whole {
            self.late(at, column, moment, sample.late_max_us);
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
    fn late(&mut self, at: MonoTime, column: usize, moment: Moment, late_us: f64) {
        if !self.look.axis.runs(at) {
            return;
        }
        if self.late[column].len() < KEPT {
            self.late[column].push((late_us / 1e3) as f32);
        }
        self.lateness[bin(late_us)] += 1;
        if late_us > self.counts.late_us {
            (self.counts.late_us, self.counts.late_at) = (late_us, moment);
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
                margins.take_lane(chunk, (lane, seat), &mut |_, axis, parts| {
                    self.parts_of((at, film_s), axis, parts);
                });
            }
            let Some((column, moment)) = self.place(at, film_s, 0.0) else { return };
            self.late(at, column, moment, micros(chunk.head.late_ns));
            for frame in chunk.frames().filter(|frame| frame.lane == lane) {
                let is_taken = frame.handed.is_taken();
                self.counts.sent += u64::from(is_taken);
                self.counts.unsent += u64::from(!is_taken);
                self.on(4, column, (!is_taken).into());
                let (asked, sent) = (seat.asked(&frame.asked), seat.sent(&frame));
                self.frame(at, moment, column, [&asked, &sent]);
                if !asked.is_empty() {
                    self.counts.level.take(frame.asked.level, moment);
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

    /// What a tick showed of an axis, each as a part of its limit and of a show time a little before: where the film went back meanwhile
    /// that of the tick itself.
    fn parts_of(&mut self, (at, film_s): (MonoTime, f64), axis: usize, parts: [(ShowTime, f64); 3]) {
        for (order, (film, part)) in parts.into_iter().enumerate() {
            let before = self.place(at, film.as_secs_f64(), 0.0);
            if let Some((column, moment)) = before.or_else(|| self.place(at, film_s, 0.0)) {
                let place = |index| if index == order { 100.0 * part } else { f64::NAN };
                self.parts.take(column, (0..3).map(place));
                if part > self.most[axis][order].0 {
                    self.most[axis][order] = (part, moment);
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

impl SeatCounts {
    /// Notes how far asked and sent are apart, and for how long in one piece.
    fn apart(&mut self, at: MonoTime, moment: Moment, apart: f64) {
        if apart <= APART {
            self.piece = None;
            return;
        }
        let (since, most) = self.piece.unwrap_or((at, 0.0));
        let most = most.max(apart);
        self.piece = Some((since, most));
        if apart > self.apart {
            (self.apart, self.apart_at) = (apart, moment);
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

/// What a note is called in the picture of a seat; none where it is of another seat.
fn flag_name(topic: &str, note: &Value, seat: &str) -> Option<String> {
    let text = |key: &str| note[key].as_str().unwrap_or_default();
    let of = text("seat");
    match topic {
        // A mark has a flag of its own, whoever else tells of it.
        "/event" if (text("kind"), text("text")) == ("incident", "mark") => None,
        "/action" if text("what").split(' ').next() == Some("mark") => None,
        "/event" if of == seat || of.is_empty() => Some(text("text").to_owned()),
        "/event" => None,
        "/action" if text("result") == "done" => Some(text("what").to_owned()),
        "/action" => Some(format!("{}: {}", text("what"), text("result"))),
        _ if text("text").is_empty() => Some("marked".to_owned()),
        _ => Some(text("text").to_owned()),
    }
}
