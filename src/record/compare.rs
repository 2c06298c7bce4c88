//! Two recordings held against each other by show time: what their seats were sent.

use std::collections::BTreeMap;
use std::io::Read;

use serde::Serialize;

use super::read::{Contents, ReadError, Told, Wanted, read};
use super::summary::each_chunk;

/// Samples farther apart are not joined by a line, s.
const GAP_S: f64 = 0.25;

/// How far an axis differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Difference {
    /// The seat.
    pub(crate) seat: String,
    /// Its axis, from 1.
    pub(crate) axis: usize,
    /// The greatest difference, mm or degrees.
    pub(crate) greatest: f64,
    /// Show time of that, s.
    pub(crate) film_s: f64,
    /// The root of the mean square.
    pub(crate) rms: f64,
    /// Instants that both have.
    pub(crate) compared: u64,
}

/// Two recordings against each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Comparison {
    /// Each axis that both have.
    pub(crate) axes: Vec<Difference>,
    /// Seats that only the one or the other has.
    pub(crate) alone: Vec<String>,
    /// Whether both have every tick; else samples are compared, which are some of them.
    pub(crate) whole: bool,
}

/// Where a seat was sent: show time in s, and its axes.
type Track = Vec<(f64, Vec<f32>)>;

/// Which places of a seat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Places {
    /// Where it was sent.
    Sent,
    /// Where it was measured to be.
    Measured,
}

/// Where the seats of a recording were while the film ran, by their names; and whether that is of every tick.
///
/// # Errors
/// Where it is none.
pub(crate) fn tracks(
    input: impl Read,
    places: Places,
) -> Result<(Contents, BTreeMap<String, Track>, bool), ReadError> {
    let (mut whole, mut samples) = (BTreeMap::<usize, Track>::new(), BTreeMap::<usize, Track>::new());
    let contents = read(input, Wanted::ALL, &mut |contents, _, told| match told {
        Told::Seat(lane, sample) => {
            let places = if places == Places::Sent { &sample.sent_mm } else { &sample.measured_mm };
            push(samples.entry(lane).or_default(), sample.film_s, places);
        }
        Told::Chunks(chunks) if places == Places::Sent => each_chunk(&chunks, |chunk| {
            for frame in chunk.frames() {
                if let Some(seat) = contents.seats.get(frame.lane) {
                    push(
                        whole.entry(frame.lane).or_default(),
                        chunk.head.film.as_secs_f64(),
                        &seat.sent(&frame),
                    );
                }
            }
        }),
        _ => {}
    })?;
    let is_whole = !whole.is_empty();
    let tracks = if is_whole { whole } else { samples };
    let named = tracks.into_iter().map(|(lane, track)| (contents.seats[lane].name.clone(), track)).collect();
    Ok((contents, named, is_whole))
}

/// Times only rise: where the film stands or jumps back, what was first counts.
#[expect(clippy::cast_possible_truncation, reason = "finer than a pulse")]
fn push(track: &mut Track, film_s: f64, places: &[f64]) {
    if track.last().is_none_or(|(last, _)| film_s > *last) && !places.is_empty() {
        track.push((film_s, places.iter().map(|place| *place as f32).collect()));
    }
}

/// Holds one recording against another.
///
/// # Errors
/// Where either is none.
pub(crate) fn compare(one: impl Read, other: impl Read) -> Result<Comparison, ReadError> {
    let (_, ours, is_whole) = tracks(one, Places::Sent)?;
    let (_, theirs, are_whole) = tracks(other, Places::Sent)?;
    let mut axes = Vec::new();
    for (seat, track) in &ours {
        if let Some(against) = theirs.get(seat) {
            axes.extend(differences(seat, track, against));
        }
    }
    let missing = |from: &BTreeMap<String, Track>, in_: &BTreeMap<String, Track>| {
        from.keys().filter(|name| !in_.contains_key(*name)).cloned().collect::<Vec<_>>()
    };
    let alone = missing(&ours, &theirs).into_iter().chain(missing(&theirs, &ours)).collect();
    Ok(Comparison { axes, alone, whole: is_whole && are_whole })
}

fn differences(seat: &str, track: &Track, against: &Track) -> Vec<Difference> {
    let axes = track.first().map_or(0, |(_, places)| places.len());
    let difference =
        |axis| Difference { seat: seat.to_owned(), axis, greatest: 0.0, film_s: 0.0, rms: 0.0, compared: 0 };
    let mut all: Vec<Difference> = (1..=axes).map(difference).collect();
    let mut next = 0;
    for (film_s, places) in track {
        while against.get(next).is_some_and(|(at, _)| at < film_s) {
            next += 1;
        }
        let Some(there) = between(against, next, *film_s) else { continue };
        for ((difference, place), there) in all.iter_mut().zip(places).zip(there) {
            let apart = (f64::from(*place) - there).abs();
            difference.rms += apart * apart;
            difference.compared += 1;
            if apart > difference.greatest {
                (difference.greatest, difference.film_s) = (apart, *film_s);
            }
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "some million instants")]
    all.iter_mut().for_each(|one| one.rms = (one.rms / one.compared.max(1) as f64).sqrt());
    all
}

/// Where the other was at a show time, `next` being its first instant that is not before that.
fn between(track: &Track, next: usize, film_s: f64) -> Option<Vec<f64>> {
    let (at, places) = track.get(next)?;
    let whole = |places: &[f32]| places.iter().map(|place| f64::from(*place)).collect();
    if *at <= film_s {
        return Some(whole(places));
    }
    let (before, from) = track.get(next.checked_sub(1)?)?;
    if at - before > GAP_S {
        return None;
    }
    let part = (film_s - before) / (at - before);
    let place = |(from, to): (&f32, &f32)| f64::from(*from) + part * (f64::from(*to) - f64::from(*from));
    Some(from.iter().zip(places).map(place).collect())
}
