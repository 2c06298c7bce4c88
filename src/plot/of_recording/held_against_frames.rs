//! Pictures held against the frames that were recorded: nothing is drawn that was not sent there, in that pass of the film, and nothing that
//! was sent is missing.

use proptest::prelude::*;

use super::tests::drawn_of;
use crate::health::HealthState;
use crate::record::{Mode, recorded_of, summarize};
use crate::time::ShowTime;

/// What the film does for so many ticks of 10 ms.
#[derive(Debug, Clone, Copy)]
enum Film {
    /// It runs on from where it is.
    Runs(u64),
    /// It stands.
    Holds(u64),
    /// It is elsewhere at once, ms, and runs on from there.
    Seeks(u64, u64),
}

fn film() -> impl Strategy<Value = Vec<Film>> {
    let one = prop_oneof![
        3 => (30..200_u64).prop_map(Film::Runs),
        3 => (6..80_u64).prop_map(Film::Holds),
        4 => (0..6_000_u64, 25..160_u64).prop_map(|(to, ticks)| Film::Seeks(to, ticks)),
    ];
    prop::collection::vec(one, 1..9)
}

/// Where the film is at each tick, ms.
fn ticks(film: &[Film]) -> Vec<u64> {
    let (mut at, mut all) = (0_u64, vec![0; 5]);
    for one in film {
        let (mut now, ticks, step) = match *one {
            Film::Runs(ticks) => (at, ticks, 10),
            Film::Holds(ticks) => (at, ticks, 0),
            Film::Seeks(to, ticks) => (to, ticks, 10),
        };
        for _ in 0..ticks {
            all.push(now);
            now += step;
        }
        at = *all.last().unwrap_or(&0);
    }
    all
}

/// The pass of each tick, by its definition: the film went back by a quarter of a second. Of passes in which it did not run nothing is drawn.
fn passes(films: &[u64]) -> Vec<Option<usize>> {
    let (mut pass, mut greatest, mut first) = (0, films[0], films[0]);
    let (mut of, mut runs) = (Vec::new(), vec![false]);
    let mut last = None;
    for film in films {
        if last.replace(*film).is_some_and(|last| last != *film) && *film + 250 <= greatest {
            pass += 1;
            runs.push(false);
            (greatest, first) = (*film, *film);
        }
        greatest = greatest.max(*film);
        runs[pass] |= greatest > first;
        of.push(pass);
    }
    // Its place among those that are shown.
    let number = |pass: usize| runs[pass].then(|| runs[..pass].iter().filter(|runs| **runs).count());
    of.into_iter().map(number).collect()
}

/// Where the seat is sent at a tick: nowhere twice.
fn place(tick: usize) -> f64 {
    0.1 + 0.0002 * f64::from(u32::try_from(tick).unwrap())
}

fn seconds(ms: u64) -> f64 {
    ShowTime::from_nanos(i64::try_from(ms).unwrap() * 1_000_000).as_secs_f64()
}

/// False where a seek is just as far back as makes a pass: which it is, is a matter of the last bit.
fn is_clear(films: &[u64]) -> bool {
    let mut greatest = 0;
    films.iter().all(|film| {
        greatest = greatest.max(*film);
        greatest - film != 250
    })
}

fn file(mode: Mode, films: &[u64]) -> Vec<u8> {
    let sent = (0..films.len()).map(|tick| (place(tick), place(tick), None));
    recorded_of(mode, sent, |_| None, |tick| films[usize::try_from(tick).unwrap()])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn each_column_of_a_picture_shows_all_that_was_sent_there_in_that_pass_and_nothing_else(
        film in film(), columns in 20_usize..400,
    ) {
        let films = ticks(&film);
        let of = passes(&films);
        prop_assume!(is_clear(&films) && of.iter().any(Option::is_some));
        let picture = drawn_of(Mode::Full, &file(Mode::Full, &films), columns);
        let time = &picture.time;
        let mut expected = vec![None; columns];
        for (tick, (film, pass)) in films.iter().zip(&of).enumerate() {
            let Some(pass) = pass else { continue };
            let (begin_s, from_s) =
                time.passes().get(*pass).map_or((time.from_s, time.from_s), |pass| (pass.at_s, pass.film_s));
            let at_s = (begin_s + seconds(*film) - from_s).clamp(time.from_s, time.until_s);
            let column: &mut Option<[f64; 2]> = &mut expected[time.column(at_s).unwrap()];
            let mm = 150.0 * place(tick);
            let [low, high] = column.unwrap_or([mm, mm]);
            *column = Some([low.min(mm), high.max(mm)]);
        }
        let drawn = &picture.panels[0].bands[0].columns;
        for (column, (drawn, expected)) in drawn.iter().zip(&expected).enumerate() {
            let is_like = match (drawn, expected) {
                (Some(drawn), Some(expected)) => {
                    drawn.iter().zip(expected).all(|(one, other)| (f64::from(*one) - other).abs() < 0.01)
                }
                (None, None) => true,
                _ => false,
            };
            prop_assert!(is_like, "column {column}: {drawn:?} where {expected:?} was sent, {films:?}");
        }
    }

    #[test]
    fn each_sample_in_a_picture_stands_in_the_pass_in_which_it_was_sent(film in film(), columns in 20_usize..400) {
        let films = ticks(&film);
        let of = passes(&films);
        prop_assume!(is_clear(&films) && of.iter().any(Option::is_some));
        let file = file(Mode::Sampled, &films);
        let shown = summarize(file.as_slice()).unwrap().1.passes.iter().filter(|pass| pass.has_run()).count();
        // One that is shorter than a sample is in none.
        prop_assume!(of.iter().flatten().max().is_some_and(|last| last + 1 == shown));
        let picture = drawn_of(Mode::Sampled, &file, columns);
        let width_s = picture.time.place(1) - picture.time.from_s;
        for (column, drawn) in picture.panels[0].bands[0].columns.iter().enumerate() {
            for mm in drawn.iter().flatten() {
                let is_near = (0..films.len()).any(|tick| {
                    let is_sent = (150.0 * place(tick) - f64::from(*mm)).abs() < 0.01;
                    let (film_s, Some(pass)) = (seconds(films[tick]), of[tick]) else { return false };
                    let at_s = match picture.time.passes().get(pass) {
                        Some(pass) => pass.at_s + film_s - pass.film_s,
                        None => film_s,
                    };
                    is_sent && (at_s - picture.time.place(column)).abs() < width_s + 0.07
                });
                prop_assert!(is_near, "column {column}: {mm} was not sent there, {films:?}");
            }
        }
    }
}

#[test]
fn what_is_held_at_the_end_of_one_pass_is_none_of_the_next_and_the_sentence_says_which_pass_each_was() {
    // To 3.04 s, where it holds, and from 0 on again past that.
    let films: Vec<u64> =
        (0..=304).map(|tick| 10 * tick).chain([3_040; 60]).chain((0..500).map(|tick| 10 * tick)).collect();
    let is_low = |tick: usize| (300..365).contains(&tick);
    let standing = |tick| match tick {
        0 => Some(HealthState::Ok),
        330 => Some(HealthState::Lost),
        366 => Some(HealthState::Rejoining),
        _ => None,
    };
    for mode in [Mode::Full, Mode::Sampled] {
        let sent =
            (0..films.len()).map(|tick| if is_low(tick) { (0.0, 0.0, None) } else { (0.5, 0.5, None) });
        let file = recorded_of(mode, sent, standing, |tick| films[usize::try_from(tick).unwrap()]);
        let picture = drawn_of(mode, &file, 800);
        let [_, second] = picture.time.passes() else { panic!("{:?}", picture.time) };
        let from = picture.time.column(second.at_s).unwrap();
        let low = |columns: &[Option<[f32; 2]>]| columns.iter().flatten().any(|[low, _]| *low < 1.0);
        let sent = &picture.panels[0].bands[0].columns;
        assert!(low(&sent[..from]) && !low(&sent[from..]), "the drop was of the first pass");
        let words = &picture.sentence;
        assert!(words.starts_with("A1 stood still from 00:03.040 in pass 1 to 00:00.0"), "{words}");
        assert!(
            words.contains(" in pass 2: judged lost at 00:03.040 in pass 1, back in play at 00:00.0"),
            "{words}"
        );
    }
}

#[test]
fn a_film_that_stands_at_its_begin_once_it_is_over_draws_nothing_into_the_pass_before() {
    // What is sent once it is wound back, and stands, is the way to park.
    let films: Vec<u64> = (0..300).map(|tick| 10 * tick).chain([0; 100]).collect();
    let place = |tick: usize| if tick < 300 { 0.5 } else { 0.0 };
    for mode in [Mode::Full, Mode::Sampled] {
        let sent = (0..films.len()).map(|tick| (place(tick), place(tick), None));
        let file = recorded_of(mode, sent, |_| None, |tick| films[usize::try_from(tick).unwrap()]);
        let picture = drawn_of(mode, &file, 300);
        let sent = picture.panels[0].bands[0].columns.iter().flatten();
        assert!(sent.clone().count() > 30 && sent.clone().all(|[low, _]| *low > 70.0), "{mode:?}");
    }
}
