//! What a recording comes to: counts, the worst instants, what happened.

use std::io::Read;

use serde::Serialize;

use super::read::{Contents, ReadError, Told, Wanted, read};
use super::{Chunk, Falls, Margin, Margins};
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
    /// What happened.
    pub(crate) happenings: Vec<Happening>,
    /// How much more did.
    pub(crate) more: u64,
    /// The most that each axis was sent to do: measured again where every tick is in the file, else as the recorder did.
    pub(crate) most: Vec<Margin>,
}

impl Summary {
    /// What comes nearest to its limit.
    pub(crate) fn nearest(&self) -> Option<&Margin> {
        self.most.iter().max_by(|one, other| one.part().total_cmp(&other.part()))
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
    let (mut film_s, mut last_film) = (0.0, f64::NAN);
    let contents = read(input, Wanted::ALL, &mut |contents, at, told| {
        if summary.seats.is_empty() {
            let named =
                |seat: &super::RecordedSeat| SeatTotals { name: seat.name.clone(), ..SeatTotals::default() };
            summary.seats = contents.seats.iter().map(named).collect();
        }
        match told {
            Told::Seat(lane, sample) => {
                let seat = &mut summary.seats[lane];
                seat.falls.take(&sample);
                seat.sent += u64::from(sample.sent);
                seat.unsent += u64::from(sample.unsent);
                seat.clamps = seat.clamps.saturating_add(sample.clamps);
                if sample.apart() > seat.apart {
                    (seat.apart, seat.apart_film_s) = (sample.apart(), sample.film_s);
                }
            }
            Told::Tick(sample) => {
                film_s = sample.film_s;
                summary.ticks += u64::from(sample.ticks);
                summary.missed = summary.missed.saturating_add(sample.missed);
                summary.dropped = summary.dropped.saturating_add(sample.dropped);
                if sample.late_max_us > summary.late_max_us {
                    (summary.late_max_us, summary.late_film_s) = (sample.late_max_us, film_s);
                }
                if last_film != film_s && film_s.is_finite() {
                    let (first, last) = summary.film.unwrap_or((film_s, film_s));
                    summary.film = Some((first.min(film_s), last.max(film_s)));
                }
                last_film = film_s;
            }
            Told::State(state) => {
                summary.happened(contents, at, "/hall", state_word(state), film_s);
            }
            Told::Chunks(chunks) => {
                let rate = Rate::from_hz(contents.rate_hz());
                let margins = margins.get_or_insert_with(|| Margins::new(&contents.seats, rate));
                each_chunk(&chunks, |chunk| margins.take(chunk, &contents.seats, &mut |_, _, _| ()));
            }
            Told::Drains(_) => {}
            Told::Other(topic, data) => {
                summary.happened(contents, at, topic, &String::from_utf8_lossy(data), film_s);
            }
        }
    })?;
    summary.most = margins.map_or_else(|| contents.most(), |margins| margins.most(&contents.seats));
    Ok((contents, summary))
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
