//! What a recording comes to: counts, the worst instants, what happened.

use std::io::Read;

use serde::Serialize;
use serde_json::Value;

use super::read::{Contents, ReadError, Told, Wanted, WantedFull, WantedSamples};
use super::reading::read_ahead;
use super::{Chunk, Falls, Margin, Margins, TickSample};
use crate::plain::escaped;
use crate::state::State;
use crate::time::{MonoTime, Rate};

/// Happenings that are kept; more are counted.
const KEPT: usize = 10_000;
/// The longest text of one, bytes.
const TEXT: usize = 400;

/// A seat in all of a recording.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct SeatTotals {
    /// Its name.
    pub(crate) name: String,
    /// Frames that the kernel took, and did not take.
    pub(crate) sent: u64,
    /// Frames that it did not take.
    pub(crate) unsent: u64,
    /// How often the limiter held it back.
    pub(crate) clamps: u64,
    /// How far asked and sent differed at most, mm or degrees.
    pub(crate) apart: f64,
    /// The show time of that, s.
    pub(crate) apart_film_s: f64,
    /// When it fell out, and came back.
    #[serde(skip)]
    pub(crate) falls: Falls,
}

/// A stretch of the film that ran without going back, as the samples tell it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FilmPass {
    /// The last sample before it: of the first, where the film stood at its beginning, the last of these.
    pub(crate) begin: MonoTime,
    /// Its last sample.
    pub(crate) end: MonoTime,
    /// Show time of its first sample, s.
    pub(crate) from_s: f64,
    /// Show time of its last sample, s.
    pub(crate) until_s: f64,
    /// Its ticks may be of so much before the first sample, s.
    pub(crate) before_s: f64,
    /// And of so much after the last one, s.
    pub(crate) after_s: f64,
}

impl FilmPass {
    /// What is no seek: a playhead that is led may go back a little.
    pub(crate) const BACK_S: f64 = 0.25;

    /// Adds the show time of a sample that is as long as that, s; where the film has gone back since the one before, that begins the next
    /// pass. The instants are those of both.
    fn take(passes: &mut Vec<Self>, (before, at): (MonoTime, MonoTime), film_s: f64, length_s: f64) {
        if let Some(pass) = passes.last_mut() {
            if film_s > pass.until_s - Self::BACK_S {
                pass.until_s = pass.until_s.max(film_s);
                pass.end = at;
                return;
            }
            // The ticks of the sample in which it went back are of either pass.
            pass.after_s = length_s;
        }
        passes.push(Self {
            begin: before,
            end: at,
            from_s: film_s,
            until_s: film_s,
            before_s: length_s,
            after_s: 0.0,
        });
    }

    /// False of a film that stood.
    pub(crate) fn has_run(&self) -> bool {
        self.until_s > self.from_s
    }
}

/// Passes while they are met.
#[derive(Debug, Default)]
struct PassReader {
    passes: Vec<FilmPass>,
    /// When the film was looked at last, and where it was, s.
    last: (MonoTime, Option<f64>),
}

impl PassReader {
    /// Takes the next show time, s, of a sample or tick that is as long as that, s; true where it is another one.
    fn take(&mut self, at: MonoTime, film_s: f64, length_s: f64) -> bool {
        let (before, last_film) = std::mem::replace(&mut self.last, (at, Some(film_s)));
        if last_film != Some(film_s) && film_s.is_finite() {
            FilmPass::take(&mut self.passes, (before, at), film_s, length_s);
            return true;
        }
        if let [first] = self.passes.as_mut_slice()
            && !first.has_run()
        {
            first.begin = at;
        }
        false
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Happening {
    /// Wall clock, ns since 1970.
    pub(crate) wall_ns: u64,
    /// Show time, s, as the ticks before it had it.
    pub(crate) film_s: f64,
    /// The topic: a state of the hall, or an event of the file.
    pub(crate) topic: String,
    /// What it says.
    pub(crate) text: String,
}

/// What a recording comes to.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct Summary {
    /// The seats, in their order.
    pub(crate) seats: Vec<SeatTotals>,
    /// Ticks, and how many were slept through, and were not recorded.
    pub(crate) ticks: u64,
    /// Ticks that were slept through.
    pub(crate) missed: u64,
    /// Ticks that were not recorded.
    pub(crate) dropped: u64,
    /// The greatest lateness, µs, and the show time of that.
    pub(crate) late_max_us: f64,
    /// The show time of that, s.
    pub(crate) late_film_s: f64,
    /// Show times of the first and the last tick while the film ran, s.
    pub(crate) film: Option<(f64, f64)>,
    /// What the film ran through, pass by pass.
    #[serde(skip)]
    pub(crate) passes: Vec<FilmPass>,
    /// What happened.
    pub(crate) happenings: Vec<Happening>,
    /// How much more did.
    pub(crate) more: u64,
    /// The seat that the last mark names which names one, by its place.
    #[serde(skip)]
    pub(crate) marked: Option<usize>,
    /// The most that each axis was sent to do: measured again where every tick is in the file, else as the recorder did.
    pub(crate) most: Vec<Margin>,
}

impl Summary {
    /// What comes nearest to its limit.
    pub(crate) fn nearest(&self) -> Option<&Margin> {
        self.most.iter().max_by(|one, other| one.part().total_cmp(&other.part()))
    }

    /// Takes a sample.
    fn tick(&mut self, at: MonoTime, sample: &TickSample, passes: &mut PassReader, rate_hz: f64) {
        let film_s = sample.film_s;
        self.ticks += u64::from(sample.ticks);
        self.missed = self.missed.saturating_add(sample.missed);
        self.dropped = self.dropped.saturating_add(sample.dropped);
        if sample.late_max_us > self.late_max_us {
            (self.late_max_us, self.late_film_s) = (sample.late_max_us, film_s);
        }
        if passes.take(at, film_s, f64::from(sample.ticks) / rate_hz) {
            let (first, last) = self.film.unwrap_or((film_s, film_s));
            self.film = Some((first.min(film_s), last.max(film_s)));
        }
    }

    fn happened(&mut self, contents: &Contents, at: MonoTime, topic: &str, text: &str, film_s: f64) {
        if self.happenings.len() == KEPT {
            self.more += 1;
            return;
        }
        let text = escaped(text, TEXT).into_owned();
        let topic = escaped(topic, 100).into_owned();
        self.happenings.push(Happening { wall_ns: contents.wall(at), film_s, topic, text });
    }
}

/// Reads a recording for what it comes to.
///
/// # Errors
/// Where it is none.
pub(crate) fn summarize(input: impl Read) -> Result<(Contents, Summary), ReadError> {
    let mut summary = Summary::default();
    let mut margins: Option<Margins> = None;
    let [mut sampled, mut whole] = [PassReader::default(), PassReader::default()];
    let wanted = Wanted { samples: WantedSamples::Sums, full: WantedFull::Motions, ..Wanted::ALL };
    let contents = read_ahead(input, wanted, &mut |contents, at, told| {
        if summary.seats.is_empty() {
            let named =
                |seat: &super::RecordedSeat| SeatTotals { name: seat.name.clone(), ..SeatTotals::default() };
            summary.seats = contents.seats.iter().map(named).collect();
        }
        match told {
            Told::Sum(lane, sample) => {
                let seat = &mut summary.seats[lane];
                seat.falls.take(at, &sample);
                seat.sent += u64::from(sample.sent);
                seat.unsent += u64::from(sample.unsent);
                seat.clamps = seat.clamps.saturating_add(sample.clamps);
                if sample.apart > seat.apart {
                    (seat.apart, seat.apart_film_s) = (sample.apart, sample.film_s);
                }
            }
            Told::Tick(sample) => summary.tick(at, &sample, &mut sampled, contents.rate_hz()),
            Told::State(state) => {
                summary.happened(contents, at, "/hall", state_word(state), sampled.last.1.unwrap_or(0.0));
            }
            Told::Motions(block) => {
                let rate = Rate::from_hz(contents.rate_hz());
                for head in block.heads() {
                    whole.take(head.deadline, head.film.as_secs_f64(), 1.0 / rate.hz());
                }
                let margins = margins.get_or_insert_with(|| Margins::new(&contents.seats, rate));
                margins.take_motions(&block, &contents.seats);
            }
            // Positions of the film come all the time.
            Told::Seat(..) | Told::Chunks(_) | Told::Drains(_) | Told::Other("/timecode", _) => {}
            Told::Other(topic, data) => {
                if topic == "/mark" {
                    summary.marked = seat_named(contents, data).or(summary.marked);
                }
                let film_s = sampled.last.1.unwrap_or(0.0);
                summary.happened(contents, at, topic, &String::from_utf8_lossy(data), film_s);
            }
        }
    })?;
    // By every tick where the file has them: a sample may be of two passes.
    summary.passes = if whole.passes.is_empty() { sampled.passes } else { whole.passes };
    summary.most = margins.map_or_else(|| contents.most(), |margins| margins.most(&contents.seats));
    Ok((contents, summary))
}

/// The seat that the text of a mark names, as a word of its own.
fn seat_named(contents: &Contents, mark: &[u8]) -> Option<usize> {
    let mark: Value = serde_json::from_slice(mark).ok()?;
    let text = mark["text"].as_str()?;
    let mut words = text.split(|c: char| !c.is_alphanumeric() && !matches!(c, '-' | '_'));
    words.find_map(|word| contents.seats.iter().position(|seat| seat.name.eq_ignore_ascii_case(word)))
}

/// Hands over chunks that stand one behind the other.
pub(crate) fn each_chunk(octets: &[u8], mut take: impl FnMut(&Chunk<'_>)) {
    let mut rest = octets;
    while let Some((chunk, behind)) = Chunk::parse(rest) {
        rest = behind;
        take(&chunk);
    }
}

/// The word for a state as recordings number it.
pub(crate) fn state_word(number: u64) -> &'static str {
    usize::try_from(number)
        .ok()
        .and_then(|number| State::ALL.get(number))
        .map_or("unknown", |state| state.word())
}
