//! Two recordings held against each other by show time: what their seats were sent, how much later the one was, and what happened in
//! one alone.

use std::collections::BTreeMap;
use std::io::Read;

use serde::Serialize;
use serde_json::Value;

use super::read::{Contents, ReadError, Told, Wanted};
use super::reading::read;
use super::summary::{each_chunk, state_word};
use crate::plain::escaped;

/// Samples farther apart are not joined by a line, s.
const GAP_S: f64 = 0.25;
/// Lags are tried in such steps to either side of the best so far, and so many of them: ms.
const LAGS: [(f64, i32); 3] = [(20.0, 25), (1.0, 20), (0.1, 10)];
/// Instants of a seat at which lags are tried.
const TRIED: usize = 2_000;
/// What happens in both is no farther apart, s.
const SAME_S: f64 = 1.0;
/// Topics of what happens; of others there is something all the time.
const EVENTS: [&str; 3] = ["/event", "/action", "/mark"];
/// Happenings of a recording that are held against those of another, and the longest text of one, bytes.
const MOST_EVENTS: usize = 10_000;
const TEXT: usize = 200;

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
    /// How much later the second was by show time, ms: shifted by so much it is most like the first. `None` where nothing moves in
    /// both.
    pub(crate) lag_ms: Option<f64>,
    /// Seats that only the one or the other has.
    pub(crate) alone: Vec<String>,
    /// What happened in the first alone, and in the second.
    pub(crate) events: [Vec<FilmEvent>; 2],
    /// Whether both have every tick; else samples are compared, which are some of them.
    pub(crate) whole: bool,
    /// What is missing in the first, and in the second: nothing was compared of that.
    pub(crate) flaws: [Vec<String>; 2],
}

/// Where a seat was: show time in s, and its axes.
pub(crate) type Track = Vec<(f64, Vec<f32>)>;

/// Which places of a seat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Places {
    /// Where it was sent.
    Sent,
    /// Where it was measured to be.
    Measured,
}

/// Something that happened, and when by show time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FilmEvent {
    /// Show time, s.
    pub(crate) film_s: f64,
    /// Its topic.
    pub(crate) topic: String,
    /// In words.
    pub(crate) text: String,
}

/// What seats did while the film ran.
#[derive(Debug, Default)]
pub(crate) struct FilmTracks {
    /// What the recording says of itself.
    pub(crate) contents: Contents,
    /// The seats, by their names.
    pub(crate) seats: BTreeMap<String, Track>,
    /// True if that is of every tick.
    pub(crate) is_whole: bool,
    events: Vec<FilmEvent>,
}

/// Where the seats of a recording were while the film ran.
///
/// # Errors
/// Where it is none.
pub(crate) fn tracks(input: impl Read, places: Places) -> Result<FilmTracks, ReadError> {
    let (mut whole, mut samples) = (BTreeMap::<usize, Track>::new(), BTreeMap::<usize, Track>::new());
    let (mut events, mut film_s) = (Vec::new(), 0.0);
    let mut happened = |film_s, topic: &str, text: &str| {
        if events.len() < MOST_EVENTS {
            let [topic, text] = [topic, text].map(|text| escaped(text, TEXT).into_owned());
            events.push(FilmEvent { film_s, topic, text });
        }
    };
    let contents = read(input, Wanted::ALL, &mut |contents, _, told| match told {
        Told::Seat(lane, sample) => {
            let places = if places == Places::Sent { &sample.sent_mm } else { &sample.measured_mm };
            push(samples.entry(lane).or_default(), sample.film_s, places);
        }
        Told::Chunks(chunks) if places == Places::Sent => each_chunk(&chunks, |chunk| {
            for frame in chunk.frames() {
                if let Some(seat) = contents.seats.get(frame.lane) {
                    let film_s = chunk.head.film.as_secs_f64();
                    push(whole.entry(frame.lane).or_default(), film_s, &seat.sent(&frame));
                }
            }
        }),
        Told::Tick(sample) => film_s = sample.film_s,
        Told::State(state) => happened(film_s, "/hall", state_word(state)),
        Told::Other(topic, data) if EVENTS.contains(&topic) => happened(film_s, topic, &in_words(data)),
        _ => {}
    })?;
    let is_whole = !whole.is_empty();
    let tracks = if is_whole { whole } else { samples };
    let named = tracks.into_iter().map(|(lane, track)| (contents.seats[lane].name.clone(), track)).collect();
    Ok(FilmTracks { contents, seats: named, is_whole, events })
}

/// The texts of a message, without when it was.
fn in_words(data: &[u8]) -> String {
    let Ok(Value::Object(entries)) = serde_json::from_slice(data) else { return String::new() };
    let texts = entries.values().filter_map(Value::as_str).filter(|text| !text.is_empty());
    texts.collect::<Vec<_>>().join(" ")
}

/// Times only rise: where the film stands or jumps back, what was first counts.
#[expect(clippy::cast_possible_truncation, reason = "finer than a pulse")]
fn push(track: &mut Track, film_s: f64, places: &[f64]) {
    if track.last().is_none_or(|(last, _)| film_s > *last) && !places.is_empty() {
        track.push((film_s, places.iter().map(|place| *place as f32).collect()));
    }
}

/// Holds one recording against another.
pub(crate) fn compare(one: &FilmTracks, other: &FilmTracks) -> Comparison {
    let (ours, theirs) = (&one.seats, &other.seats);
    let mut axes = Vec::new();
    for (seat, track) in ours {
        if let Some(against) = theirs.get(seat) {
            axes.extend(differences(seat, track, against));
        }
    }
    let missing = |from: &BTreeMap<String, Track>, in_: &BTreeMap<String, Track>| {
        from.keys().filter(|name| !in_.contains_key(*name)).cloned().collect::<Vec<_>>()
    };
    let alone = missing(ours, theirs).into_iter().chain(missing(theirs, ours)).collect();
    let events = [(one, other), (other, one)].map(|(of, against)| events_alone(&of.events, &against.events));
    let lag_ms = lag_ms(ours, theirs);
    let flaws = [one, other].map(|of| of.contents.flaws());
    Comparison { axes, lag_ms, alone, events, whole: one.is_whole && other.is_whole, flaws }
}

/// Of these, what did not happen in the other at about the same show time, each as often as it did.
fn events_alone(events: &[FilmEvent], against: &[FilmEvent]) -> Vec<FilmEvent> {
    let mut left: Vec<&FilmEvent> = against.iter().collect();
    let is_alone = |event: &&FilmEvent| {
        let same = left.iter().position(|one| {
            (&one.topic, &one.text) == (&event.topic, &event.text)
                && (one.film_s - event.film_s).abs() <= SAME_S
        });
        same.map(|place| left.remove(place)).is_none()
    };
    events.iter().filter(is_alone).cloned().collect()
}

/// By how many ms of show time the second is to be shifted to be most like the first, to a tenth; nearest to 0 where several do.
fn lag_ms(ours: &BTreeMap<String, Track>, theirs: &BTreeMap<String, Track>) -> Option<f64> {
    let (mut best, mut least, mut most) = (0.0, f64::INFINITY, 0.0_f64);
    for (step, steps) in LAGS {
        let middle = best;
        // From the middle outwards.
        for number in (0..=steps).flat_map(|number| [number, -number]) {
            let lag = middle + step * f64::from(number);
            let Some(apart) = apart(ours, theirs, lag / 1e3) else { continue };
            most = most.max(apart);
            if apart < least {
                (best, least) = (lag, apart);
            }
        }
    }
    (most > least).then(|| (best * 10.0).round() / 10.0)
}

/// The mean square of how far seats are apart where the second is shifted by so many seconds; `None` where they have no instant in
/// common.
fn apart(ours: &BTreeMap<String, Track>, theirs: &BTreeMap<String, Track>, lag_s: f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u32);
    for (track, against) in ours.iter().filter_map(|(seat, track)| Some((track, theirs.get(seat)?))) {
        for (film_s, places) in track.iter().step_by(track.len() / TRIED + 1) {
            let at = film_s + lag_s;
            let next = against.partition_point(|(there, _)| *there < at);
            let Some(there) = between(against, next, at) else { continue };
            for (place, there) in places.iter().zip(there) {
                sum += (f64::from(*place) - there).powi(2);
                count += 1;
            }
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// At the instants of the one that has fewer, so that nothing is made up between samples where the other has every tick.
fn differences(seat: &str, track: &Track, against: &Track) -> Vec<Difference> {
    let (track, against) = if against.len() < track.len() { (against, track) } else { (track, against) };
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

#[cfg(test)]
mod tests {
    use super::*;

    fn seat(late_s: f32) -> BTreeMap<String, Track> {
        let place =
            |tick: u16| (f64::from(tick) * 0.01, vec![(3.0 * (f32::from(tick) * 0.01 - late_s)).sin(), 7.0]);
        BTreeMap::from([("F4".to_owned(), (0..500).map(place).collect())])
    }

    #[test]
    fn the_second_is_said_to_lag_by_as_much_as_it_does_and_not_at_all_where_nothing_moves() {
        for late_ms in [0.0, 7.0, -38.5, 260.0] {
            let lag = lag_ms(&seat(0.0), &seat(late_ms / 1e3)).expect("it moves");
            assert!((lag - f64::from(late_ms)).abs() <= 0.2, "{lag} for {late_ms}");
        }
        let still = BTreeMap::from([("F4".to_owned(), vec![(0.0, vec![1.0]), (0.1, vec![1.0])])]);
        assert_eq!(lag_ms(&still, &still), None);
    }

    #[test]
    fn samples_are_held_against_every_tick_at_their_own_instants() {
        let every = seat(0.0).remove("F4").expect("it is there");
        let samples: Track = every.iter().step_by(9).cloned().collect();
        for [one, other] in [[&every, &samples], [&samples, &every]] {
            let axes = differences("F4", one, other);
            assert!(axes.iter().all(|axis| axis.greatest == 0.0 && axis.compared > 50), "{axes:?}");
        }
    }

    #[test]
    fn what_happened_in_one_alone_is_told_and_what_happened_in_both_at_about_the_same_time_is_not() {
        let event =
            |film_s, text: &str| FilmEvent { film_s, topic: "/event".to_owned(), text: text.to_owned() };
        let ours = [event(1.0, "clamp"), event(2.0, "F4 lost"), event(9.0, "clamp")];
        let theirs = [event(1.4, "clamp"), event(2.0, "F5 lost")];
        assert_eq!(events_alone(&ours, &theirs), [ours[1].clone(), ours[2].clone()]);
        assert_eq!(events_alone(&theirs, &ours), [theirs[1].clone()]);
    }
}
