//! A recording of one seat as a picture: asked, sent and measured, how far they are apart, lateness and acks, what was on, and the
//! sentence that says what happened.

mod film_axis;
mod flags;
mod gather;
mod panels;
mod words;

use std::mem::take;

pub(crate) use self::film_axis::FilmAxis;
pub(crate) use self::gather::Gathered;
use self::gather::{BINS_US, CountedLane};
use self::panels::panels;
use self::words::{facts, seats, sentence, title};
use super::text::number;
use super::{Flag, Histogram, Lane, Picture, Shade, TimeAxis};
use crate::record::{Contents, Summary};

/// What a recording is looked at for.
#[derive(Debug, Clone)]
pub(crate) struct Look {
    /// The seat, by its place.
    pub(crate) lane: usize,
    /// The time axis.
    pub(crate) axis: FilmAxis,
    /// Whether asked positions and percentiles are drawn as well: a terminal has no room for them.
    pub(crate) is_detailed: bool,
}

/// The picture of what was gathered; with the sent positions of another recording, if one is laid over it.
pub(crate) fn of_recording(
    contents: &Contents,
    summary: &Summary,
    mut gathered: Gathered,
    other: Option<Gathered>,
) -> Picture {
    let seat = &contents.seats[gathered.look.lane];
    let flags = gathered.flags.close(&gathered.look.axis);
    let (lateness, latency) = (take(&mut gathered.lateness), take(&mut gathered.latency));
    // A sample has one ack, and in a file of samples alone the latest of its ticks.
    let of_ticks =
        if gathered.is_whole { "Lateness of all ticks" } else { "Lateness, the latest tick of each sample" };
    let histograms =
        [histogram(of_ticks, lateness), histogram("Ack latency, the last ack of each sample", latency)];
    Picture {
        title: title(contents, &seat.name),
        sentence: sentence(&seat.name, &gathered, contents.rate_hz()),
        facts: facts(contents, summary, &gathered),
        time: gathered.look.axis.time.clone(),
        lanes: strips(take(&mut gathered.lanes), take(&mut gathered.states)),
        flags: flags_of_passes(&gathered.look.axis.time).chain(flags).collect(),
        table: seats(summary),
        histograms: histograms
            .into_iter()
            .filter(|one| one.bins.iter().any(|(_, count)| *count > 0))
            .collect(),
        panels: panels(seat, gathered, other),
    }
}

/// A flag where each pass but the first begins; of many every few.
fn flags_of_passes(time: &TimeAxis) -> impl Iterator<Item = Flag> {
    /// At the most.
    const MOST: usize = 12;
    let passes = time.passes();
    let each = passes.len().div_ceil(MOST).max(1);
    let flag =
        |index: usize| Flag { at_s: passes[index].at_s, name: format!("pass {}", index + 1), is_mark: false };
    (each..passes.len()).step_by(each).map(flag)
}

/// What was on, and the states of the hall.
fn strips(lanes: Vec<CountedLane>, states: Vec<(&'static str, Vec<Shade>)>) -> Vec<Lane> {
    let strip = |name: &str, note, columns| Lane { name: name.to_owned(), note, columns };
    let used = lanes.into_iter().filter(|(.., count)| *count > 0);
    let used = used.map(|(name, columns, count)| strip(name, format!("{count}×"), columns));
    used.chain(states.into_iter().map(|(word, columns)| strip(word, String::new(), columns))).collect()
}

fn histogram(name: &'static str, counts: Vec<u64>) -> Histogram {
    Histogram { name, bins: BINS_US.iter().map(|end| bin_name(*end)).zip(counts).collect() }
}

fn bin_name(end: f64) -> String {
    match end {
        end if end.is_infinite() => "more".to_owned(),
        end if end >= 1_000.0 => format!("{} ms", number(end / 1_000.0)),
        end => format!("{} µs", number(end)),
    }
}

#[cfg(test)]
mod held_against_frames;
#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Theme, braille, page, svg};
    use super::*;
    use crate::health::HealthState;
    use crate::record::{
        Mode, SeatSample, TickSample, Told, Wanted, read, recorded_as, recorded_falling, recorded_filmed,
        standing_of, summarize,
    };
    use crate::time::MonoTime;

    /// What a seat at rest in the middle, that was asked for a tenth of the stroke more in some ticks, looks like.
    fn drawn(mode: Mode, asked: std::ops::Range<u32>, columns: usize) -> Picture {
        let ticks = (0..300).map(|tick| (if asked.contains(&tick) { 0.6 } else { 0.5 }, 0.5));
        drawn_of(mode, &recorded_as(mode, ticks), columns)
    }

    pub(super) fn drawn_of(mode: Mode, file: &[u8], columns: usize) -> Picture {
        drawn_with(mode, file, columns, |_| Vec::new())
    }

    /// The same of a file that tells more once the ticks have come to so many ms: each with its own, also in ms.
    fn drawn_with(
        mode: Mode,
        file: &[u8],
        columns: usize,
        more: impl Fn(u64) -> Vec<(u64, Told<'static>)>,
    ) -> Picture {
        let (contents, summary) = summarize(file).unwrap();
        let axis = FilmAxis::over(&summary.passes, (f64::NEG_INFINITY, f64::INFINITY), columns).unwrap();
        let mut gathered =
            Gathered::new(&contents, Look { lane: 0, axis, is_detailed: true }, mode == Mode::Full);
        read(file, Wanted::ALL, &mut |contents, at, told| {
            let is_tick = matches!(told, Told::Tick(_));
            gathered.take(contents, at, told);
            for (ms, told) in if is_tick { more(at.as_nanos() / 1_000_000) } else { Vec::new() } {
                gathered.take(contents, MonoTime::from_nanos(ms * 1_000_000), told);
            }
        })
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

    #[test]
    fn a_seat_that_fell_out_is_what_the_sentence_says_first() {
        let stays = |tick| match tick {
            0 => Some(HealthState::Ok),
            150 => Some(HealthState::Lost),
            _ => None,
        };
        let comes_back = |tick| if tick == 200 { Some(HealthState::Rejoining) } else { stays(tick) };
        for mode in [Mode::Full, Mode::Sampled] {
            let ticks = || (0..300).map(|_| (0.5, 0.5));
            let gone = drawn_of(mode, &recorded_falling(mode, ticks(), stays), 300);
            let [still, out] = ["A1 stood still from 00:01.", ": judged lost at 00:01.5"];
            assert!(gone.sentence.starts_with(still) && gone.sentence.contains(out), "{}", gone.sentence);
            assert!(gone.sentence.contains(", not back in what is shown; "), "{}", gone.sentence);
            assert!(gone.facts.contains(&"Fell out: A1.".to_owned()), "{:?}", gone.facts);
            let out = gone.lanes.iter().find(|lane| lane.name == "out").expect("it is drawn");
            assert!(out.columns[299].height > 0.0 && out.columns[100].height == 0.0);
            let back = drawn_of(mode, &recorded_falling(mode, ticks(), comes_back), 300);
            assert!(back.sentence.contains(" to 00:02.0"), "{}", back.sentence);
            assert!(back.sentence.contains(", back in play at 00:02.0"), "{}", back.sentence);
        }
    }

    #[test]
    fn a_flag_stands_at_its_own_instant_however_wide_a_column_is() {
        let action = br#"{"what": "pause", "result": "done"}"#;
        let mark = br#"{"text": "jerk", "film_s": 1.777}"#;
        // Told before the tick after it, while it goes on, half a second late, and with a show time of its own.
        let more = |ms| match ms {
            1_190 => vec![(1_234, Told::Other("/action", &action[..]))],
            2_540 => {
                vec![(2_021, Told::Other("/action", &action[..])), (1_790, Told::Other("/mark", &mark[..]))]
            }
            _ => Vec::new(),
        };
        for mode in [Mode::Full, Mode::Sampled] {
            let ticks = (0..300).map(|_| (0.5, 0.5));
            let picture = drawn_with(mode, &recorded_as(mode, ticks), 3, more);
            let mut at: Vec<f64> = picture.flags.iter().map(|flag| flag.at_s).collect();
            at.sort_by(f64::total_cmp);
            let expected = [1.234, 1.777, 2.021];
            assert_eq!(at.len(), 3, "{at:?}");
            assert!(at.iter().zip(expected).all(|(at, right)| (at - right).abs() < 1e-6), "{at:?}");
        }
    }

    #[test]
    fn what_is_missed_before_the_film_runs_and_once_it_is_over_is_not_told_of_the_seat() {
        let film_ms = |tick: u64| 10 * tick.saturating_sub(100).min(200);
        let file = recorded_filmed(Mode::Sampled, (0..500).map(|_| (0.5, 0.5)), film_ms);
        let missed = |ms: u64, film_s| {
            let sample =
                TickSample { film_s, missed: 6, late_max_us: 7_500.0, ticks: 5, ..TickSample::default() };
            (ms, Told::Tick(sample))
        };
        let idle = drawn_with(Mode::Sampled, &file, 300, |ms| match ms {
            540 => vec![missed(545, 0.0)],
            4_040 => vec![missed(4_045, 2.0)],
            _ => Vec::new(),
        });
        assert!(!idle.sentence.contains("missed"), "{}", idle.sentence);
        let ran = drawn_with(Mode::Sampled, &file, 300, |ms| {
            if ms == 2_040 { vec![missed(2_045, 1.045)] } else { Vec::new() }
        });
        assert!(ran.sentence.contains("6 ticks missed"), "{}", ran.sentence);
    }

    #[test]
    fn why_a_seat_fell_out_is_told_and_in_which_pass() {
        let number = |wanted| (0..=u8::MAX).find(|number| standing_of(*number) == Some(wanted));
        let stood = |film_s, standing| {
            Told::Seat(
                0,
                Box::new(SeatSample { film_s, standing: number(standing), ..SeatSample::default() }),
            )
        };
        let error =
            br#"{"kind": "standing", "seat": "A1", "text": "error: Err12: alarm of the servo of axis 3"}"#;
        let other = br#"{"kind": "standing", "seat": "A2", "text": "error: Err9: another"}"#;
        let more = |ms| match ms {
            40 => vec![(40, stood(0.04, HealthState::Ok))],
            2_540 => vec![
                (2_500, stood(1.5, HealthState::Error)),
                (2_510, Told::Other("/event", &other[..])),
                (2_520, Told::Other("/event", &error[..])),
            ],
            _ => Vec::new(),
        };
        let picture = drawn_with(Mode::Sampled, &thrice(Mode::Sampled), 450, more);
        let said = ": judged error at 00:01.500 in pass 2 (Err12: alarm of the servo of axis 3), not back in what is shown; ";
        assert!(picture.sentence.contains(said), "{}", picture.sentence);
    }

    #[test]
    fn the_greatest_change_of_a_level_is_told_from_where_it_turned() {
        let axis = FilmAxis::of_film(0.0, 10.0, 100);
        let mut ramps = super::gather::LevelRamps::default();
        // Down to a half, up again before it rests, and a little down.
        for (tick, level) in (0_u32..).zip([1.0, 0.8, 0.6, 0.5, 0.7, 0.9, 0.9, 0.85]) {
            let moment = axis.moment(crate::time::MonoTime::default(), f64::from(tick), 0.0).unwrap();
            ramps.take(level, moment);
        }
        let (from, to, at) = ramps.most.unwrap();
        assert_eq!((from, to, at.film_s), (1.0, 0.5, 1.0));
    }

    /// The film ran from 0 to 2 s, from 1 to 2.5 s and from 0.5 to 1.5 s, with the seat at another place each time; after that it stood
    /// at its begin, with the seat high up.
    fn thrice(mode: Mode) -> Vec<u8> {
        let film_ms = |tick: u64| match tick {
            0..200 => 10 * tick,
            200..350 => 1_000 + 10 * (tick - 200),
            350..450 => 500 + 10 * (tick - 350),
            _ => 0,
        };
        let place = |tick| match tick {
            0..200 => 0.5,
            200..350 => 0.7,
            350..450 => 0.3,
            _ => 0.9,
        };
        // For one tick of the second pass it was held back.
        let ticks = (0..500).map(|tick| (place(tick) + if tick == 260 { 0.1 } else { 0.0 }, place(tick)));
        recorded_filmed(mode, ticks, film_ms)
    }

    #[test]
    fn passes_of_the_film_over_the_same_places_stand_beside_each_other() {
        for mode in [Mode::Full, Mode::Sampled] {
            let picture = drawn_of(mode, &thrice(mode), 450);
            let passes = picture.time.passes();
            assert_eq!(passes.len(), 3, "{passes:?}");
            let sent = &picture.panels[0].bands[0].columns;
            for (pass, place) in passes.iter().zip([75.0, 105.0, 45.0]) {
                let ends = [pass.at_s + 0.1, pass.at_s + pass.until_s - pass.film_s - 0.1];
                let [from, until] = ends.map(|at| picture.time.column(at).unwrap());
                let known: Vec<_> = sent[from..until].iter().flatten().collect();
                assert!(
                    known.len() > (until - from) / 8 && known.iter().all(|ends| **ends == [place; 2]),
                    "{known:?}"
                );
            }
            assert!(sent.iter().flatten().all(|[_, most]| *most < 130.0), "what came after is in no pass");
            let held = "A1 at 00:01.600 in pass 2: held back by the limiter";
            assert!(picture.sentence.starts_with(held), "{}", picture.sentence);
            let flags: Vec<_> = picture.flags.iter().map(|flag| flag.name.as_str()).collect();
            assert_eq!(flags, ["pass 2", "pass 3"]);
            assert!(picture.facts.iter().any(|fact| fact.contains("3 times")), "{:?}", picture.facts);
            for drawn in [braille(&picture), svg(&picture, Theme::Auto), page(&picture, Theme::Auto)] {
                assert!(drawn.contains("pass 2") && drawn.contains("in pass 2: held back"), "{drawn}");
            }
        }
    }

    #[test]
    fn a_loop_of_a_thousand_passes_is_no_larger_than_another_picture() {
        let ticks = (0..30_000).map(|tick| (f64::from(tick % 7) / 10.0, f64::from(tick % 7) / 10.0));
        let file = recorded_filmed(Mode::Sampled, ticks, |tick| 10 * (tick % 40));
        let picture = drawn_of(Mode::Sampled, &file, 900);
        assert!((700..=760).contains(&picture.time.passes().len()), "{}", picture.time.passes().len());
        assert!(picture.flags.len() <= 12, "{}", picture.flags.len());
        for drawn in [braille(&picture), svg(&picture, Theme::Auto), page(&picture, Theme::Auto)] {
            assert!(drawn.len() < 200_000, "{}", drawn.len());
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
