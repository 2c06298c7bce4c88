use std::path::Path;
use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::cue::{self, Source};
use crate::motion::{SeatAxis, SeatType};
use crate::proof::figures;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

const HOSTILE: &str = "</title><script src=//x.test/a.js></script>\"'&\u{1b}[31m\u{202e}";

fn timeline(text: &str) -> Timeline {
    Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap())
}

fn seats(axes: usize) -> Vec<SeatAxis> {
    let seat = Arc::new(SeatType::bench3(axes));
    (0..axes).map(|axis| SeatAxis::new(&seat, axis)).collect()
}

fn drawn(timeline: &Timeline, from: i64, until: i64, most: usize) -> Picture {
    let seats = seats(timeline.axes());
    let subject =
        Subject { timeline, seats: &seats, rate: Rate::from_hz(100.0), facts: vec![HOSTILE.to_owned()] };
    of_cue(subject, Columns::over(ShowTime::from_millis(from), ShowTime::from_millis(until), most))
}

/// Rows 20 ms apart, with these positions of each axis.
fn rows(axes: usize, rows: usize, head: &str, value: impl Fn(usize, usize) -> f64) -> String {
    let names: String = (1..=axes).map(|axis| format!(",a{axis}")).collect();
    let row = |row: usize| {
        let cells: String = (0..axes).map(|axis| format!(",{:.5}", value(row, axis))).collect();
        format!("{}{cells}\n", 20 * row)
    };
    format!("{head}time_ms{names}\n{}", (0..rows).map(row).collect::<String>())
}

/// Anything from 0 to 1, the same for the same arguments.
fn noise(row: usize, axis: usize) -> f64 {
    let mixed = u32::try_from(row * 31 + axis * 7 + 1).unwrap().wrapping_mul(2_654_435_761) >> 8;
    f64::from(mixed % 10_000) / 10_000.0
}

fn most(band: &Band) -> f32 {
    band.columns.iter().flatten().fold(0.0, |most, ends| most.max(ends[1]))
}

/// The highest place of a path, units from the top.
fn highest(path: &str) -> i32 {
    let spaced = path.trim_end_matches('z').replace('-', " -").replace(['M', 'l'], " ");
    let numbers: Vec<i32> = spaced.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let mut y = numbers[1];
    let steps = numbers[2..].chunks(2).map(|step| {
        y += step[1];
        y
    });
    steps.min().unwrap().min(numbers[1])
}

#[test]
fn an_axis_is_drawn_between_the_ends_of_its_stroke_in_its_unit() {
    let picture = drawn(&timeline("# interpolation: linear\ntime_s,a1\n0,0\n1,1\n2,0\n"), 0, 2000, 2);
    let panel = &picture.panels[0];
    assert_eq!((panel.unit, panel.low, panel.high), ("mm", 0.0, 150.0));
    assert_eq!(panel.bands[0].columns, [Some([0.0, 150.0]), Some([0.0, 150.0])]);
}

#[test]
fn a_part_of_a_cue_is_drawn_with_the_worst_of_all_of_it_told_as_outside() {
    let text = rows(1, 200, "", |row, _| if row == 150 { 0.6 } else { 0.5 });
    let timeline = timeline(&text);
    let part = drawn(&timeline, 0, 1000, 100);
    assert!(part.sentence.ends_with("outside of what is shown."), "{}", part.sentence);
    assert!((part.time.from_s, part.time.until_s) == (0.0, 1.0) && part.panels[1].marks.is_empty());
    assert!(part.panels[1].bands[0].columns.iter().flatten().all(|ends| ends[1] < 1.0));
    let other = drawn(&timeline, 2500, 3500, 100);
    assert!(!other.sentence.contains("outside") && other.panels[1].marks.len() == 1);
    assert!((other.time.from_s, other.time.columns) == (2.5, 100));
}

#[test]
fn an_effect_that_is_on_for_a_moment_has_its_column_and_no_other() {
    let cue = timeline("time_s,a1,fx_air\n0,0,0\n4,0,1\n5,0,0\n10,0,0\n");
    let lane = &drawn(&cue, 0, 10_000, 10).lanes[0];
    let on: Vec<_> = (0..10).filter(|column| lane.columns[*column].height > 0.0).collect();
    assert_eq!((lane.name.as_str(), on), ("air", vec![4]));
}

#[test]
fn each_worst_instant_is_marked_with_the_file_and_the_line_that_it_comes_from_or_the_time_of_its_message() {
    let cue = timeline(&rows(1, 60, "", |row, _| if row >= 30 { 0.6 } else { 0.5 }));
    let picture = drawn(&cue, 0, 1_200, 60);
    // The header is the first line, and row 29 begins the move.
    let speed = picture.panels.iter().find(|panel| panel.name == "Speed").unwrap();
    assert!(speed.marks[0].words.ends_with("t.csv:31"), "{}", speed.marks[0].words);
    assert!(speed.place.ends_with("line 31") && picture.sentence.contains("(t.csv:"), "{}", picture.sentence);
    let mut out = std::io::Cursor::new(Vec::new());
    cue::write_mcap(cue.cue(), &mut out).unwrap();
    let again = cue::read(Path::new("t.mcap"), out.get_ref().as_slice(), &Source::Native).unwrap();
    let picture = drawn(&Timeline::new(again), 0, 1_200, 60);
    let speed = picture.panels.iter().find(|panel| panel.name == "Speed").unwrap();
    assert!(speed.marks[0].words.ends_with("t.mcap, message at 00:00.580"), "{}", speed.marks[0].words);
}

#[test]
fn what_a_file_says_is_text_wherever_it_is_drawn_and_nothing_is_loaded() {
    let picture = drawn(&timeline(&rows(2, 5, &format!("# title: {}\n", &HOSTILE[..48]), noise)), 0, 80, 40);
    let picture =
        Picture { flags: vec![Flag { at_s: 0.04, name: HOSTILE.to_owned(), is_mark: false }], ..picture };
    for text in [svg(&picture, Theme::Auto), page(&picture, Theme::Auto), braille(&picture)] {
        assert!(!text.contains('\u{1b}') && !text.contains('\u{202e}'));
    }
    for text in [svg(&picture, Theme::Auto), page(&picture, Theme::Dark)] {
        assert!(text.contains("&lt;script src=") && !text.contains("<script "), "{text}");
        let loads = ["src=\"", "href", "@import", "http-equiv=\"refresh"];
        assert!(loads.iter().all(|word| !text.contains(word)) && text.matches("//www.w3.org").count() <= 1);
    }
}

#[test]
fn a_file_of_twelve_rough_axes_is_no_larger_than_half_a_megabyte() {
    let timeline = timeline(&rows(12, 8000, "", noise));
    let picture = drawn(&timeline, 0, 160_000, 600);
    for text in [svg(&picture, Theme::Auto), page(&picture, Theme::Auto)] {
        assert!(text.len() <= 500_000, "{}", text.len());
    }
}

#[test]
fn the_seventh_axis_has_the_colour_of_the_first_and_dashes() {
    let picture = drawn(&timeline(&rows(7, 5, "", noise)), 0, 80, 40);
    let text = svg(&picture, Theme::Light);
    assert!(text.contains("class=\"curve range s0\"") && text.contains("class=\"curve range s0 dashed\""));
    assert!(
        (1..=7).all(|axis| text.contains(&format!(">a{axis}</text>"))),
        "each line has its name at its end"
    );
}

#[test]
fn names_at_the_ends_of_lines_stand_apart_and_inside() {
    for axes in [6, 12] {
        let picture = drawn(&timeline(&rows(axes, 5, "", |_, _| 0.0)), 0, 80, 40);
        for panel in &picture.panels {
            let high = super::svg::high(panel, 110.0);
            let names = super::svg::names(panel, high, 14.0);
            assert_eq!(names.len(), axes);
            assert!(names.windows(2).all(|pair| pair[1].2 - pair[0].2 >= 14.0 - 1e-9), "{names:?}");
            assert!(names.iter().all(|(_, _, y)| (0.0..=high).contains(y)));
        }
    }
}

#[test]
fn names_of_flags_do_not_run_into_each_other_and_what_has_no_room_keeps_its_line() {
    let picture = drawn(&timeline(&rows(1, 500, "", noise)), 0, 9_980, 600);
    let flag = |at_s: f64| Flag { at_s, name: format!("what happened at {at_s:.2}"), is_mark: false };
    let mut flags: Vec<Flag> = (0..60).map(|n| flag(f64::from(n) / 7.0)).collect();
    flags[6].is_mark = true;
    let marked = flags[6].name.clone();
    let picture = Picture { flags, ..picture };
    let text = page(&picture, Theme::Auto);
    assert_eq!(text.matches("<i class=\"flag").count(), 60);
    let shown: Vec<(f64, f64, &str)> = text
        .split("<i class=\"flag")
        .skip(1)
        .filter_map(|flag| {
            let number =
                |before: &str| flag.split(before).nth(1)?.split(['%', 'p']).next()?.parse::<f64>().ok();
            let (part, row) = (number("left:")?, number("<span style=\"top:")?);
            let x = super::page::PAPER / 100.0 * part;
            let begin = if flag.starts_with(" late") { x - 178.0 } else { x };
            Some((begin, row, flag))
        })
        .collect();
    assert!((8..40).contains(&shown.len()), "{}", shown.len());
    assert!(shown.iter().any(|(_, _, flag)| flag.contains(&marked)), "what a person has marked has a name");
    for (index, (begin, row, flag)) in shown.iter().enumerate() {
        let before = shown[..index].iter().rev().find(|(_, other, _)| other == row);
        assert!(before.is_none_or(|(other, ..)| begin - other >= 177.9), "{flag}");
    }
}

#[test]
fn lines_of_a_picture_for_eighty_columns_are_no_wider_whatever_stands_beside_the_curves() {
    let mcap = |text: &str| {
        let mut out = std::io::Cursor::new(Vec::new());
        cue::write_mcap(timeline(text).cue(), &mut out).unwrap();
        Timeline::new(cue::read(Path::new("t.mcap"), out.get_ref().as_slice(), &Source::Native).unwrap())
    };
    let text = rows(1, 1_500, "", |row, _| if row >= 1_200 { 0.6 } else { 0.5 });
    for cue in [timeline(&text), mcap(&text)] {
        let drawn = braille(&drawn(&cue, 0, 29_980, 2 * cells(80) - 1));
        let curves =
            drawn.lines().filter(|line| line.contains(|c: char| ('\u{2800}'..='\u{28ff}').contains(&c)));
        assert!(
            curves.clone().count() >= 8 && curves.into_iter().all(|line| line.chars().count() <= 80),
            "{drawn}"
        );
        assert!(drawn.contains("line 12") || drawn.contains("message 12"), "{drawn}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_greatest_of_a_picture_and_its_mark_are_that_of_info(
        seed in 0_usize..1000,
        swing in 0.001_f64..1.0,
        columns in 1_usize..300,
    ) {
        let timeline = timeline(&rows(2, 120, "", |row, axis| swing * noise(row + seed, axis)));
        let picture = drawn(&timeline, 0, 2380, columns);
        let figures = figures(&timeline, Rate::from_hz(100.0), &seats(2));
        for (axis, figures) in figures.iter().enumerate() {
            let limits = figures.on.geometry();
            let told = [
                (figures.velocity.value, limits.max_velocity),
                (figures.acceleration.value, limits.max_acceleration),
                (figures.jerk.value, limits.max_jerk),
            ];
            for (panel, (value, limit)) in picture.panels[1..].iter().zip(told) {
                let told = f64::from(most(&panel.bands[axis])) / 100.0;
                prop_assert!((told * limit / value - 1.0).abs() < 2e-7, "single precision: {told}");
                let mark = panel.marks.iter().find(|mark| mark.style == axis).unwrap();
                prop_assert_eq!(mark.value, 100.0 * value / limit);
            }
        }
    }

    #[test]
    fn a_spike_of_one_row_shows_however_narrow_the_picture(at in 1_usize..999, columns in 1_usize..200) {
        let cue = timeline(&rows(1, 1000, "# interpolation: linear\n", |row, _| f64::from(u8::from(row == at))));
        let picture = drawn(&cue, 0, 19_980, columns);
        prop_assert_eq!(most(&picture.panels[0].bands[0]), 150.0);
        let path = super::path::band(&picture.panels[0], &picture.panels[0].bands[0]);
        prop_assert_eq!(highest(&path), 0, "{}", path);
        let top = braille(&picture).lines().nth(2).unwrap().chars().skip(9).any(|c| ('\u{2801}'..='\u{28ff}').contains(&c));
        prop_assert!(top, "the upper line of braille has a dot");
    }
}
