//! Bands and lanes as paths of SVG, in whole numbers: a column is 1 wide, and a panel [`HEIGHT`] high. Steps from point to point
//! keep a point at some five bytes, so that a page of two hours stays small.

use std::fmt::Write as _;

use super::{Band, Lane, Panel, Scale};

/// How high a panel is drawn, units.
pub(super) const HEIGHT: u16 = 400;
/// How dark lanes are drawn, from the lightest on.
pub(super) const TONES: u8 = 4;

/// A band as one closed shape for each stretch in which it is known; what stands on the ground is its upper edge alone.
#[must_use]
pub(super) fn band(panel: &Panel, band: &Band) -> String {
    let mut path = String::new();
    let columns = &band.columns;
    let mut index = 0;
    while index < columns.len() {
        let known = columns[index..].iter().take_while(|column| column.is_some()).count();
        if known > 0 {
            shape(panel, &columns[index..index + known], index, &mut path);
        }
        index += known.max(1);
    }
    path
}

fn shape(panel: &Panel, columns: &[Option<[f32; 2]>], from: usize, path: &mut String) {
    let ends: Vec<[i32; 2]> =
        columns.iter().flatten().map(|ends| ends.map(|end| y(panel, f64::from(end)))).collect();
    let mut at = ends[0][1];
    push(path, format_args!("M{from} {at}l"));
    let mut step = |x: i32, to: i32| {
        push(path, format_args!("{x}{}{}", if to < at { "" } else { " " }, to - at));
        push(path, format_args!(" "));
        at = to;
    };
    step(1, ends[0][1]);
    ends[1..].iter().for_each(|[_, most]| step(1, *most));
    if panel.scale == Scale::Range {
        step(0, ends[ends.len() - 1][0]);
        ends[..ends.len() - 1].iter().rev().for_each(|[least, _]| step(-1, *least));
        step(-1, ends[0][0]);
        path.truncate(path.trim_end().len());
        path.push('z');
    } else {
        path.truncate(path.trim_end().len());
    }
}

#[expect(clippy::cast_possible_truncation, reason = "0 to HEIGHT")]
fn y(panel: &Panel, value: f64) -> i32 {
    (f64::from(HEIGHT) * (1.0 - panel.part(value))).round() as i32
}

/// A lane 16 units high as one path for each tone; runs that look alike are one.
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 16")]
pub(super) fn lane(lane: &Lane) -> Vec<(u8, String)> {
    let looks = |index: usize| {
        let shade = lane.columns[index];
        let tone = ((shade.tone * f32::from(TONES)) as u8).min(TONES - 1);
        ((shade.height.clamp(0.0, 1.0) * 16.0).ceil() as u8, tone)
    };
    let mut paths = vec![String::new(); usize::from(TONES)];
    let mut index = 0;
    while index < lane.columns.len() {
        let (height, tone) = looks(index);
        let run = (index..lane.columns.len()).take_while(|one| looks(*one) == (height, tone)).count();
        if height > 0 {
            push(&mut paths[usize::from(tone)], format_args!("M{index} 16v-{height}h{run}v{height}z"));
        }
        index += run;
    }
    (0..TONES).zip(paths).filter(|(_, path)| !path.is_empty()).collect()
}

fn push(path: &mut String, what: std::fmt::Arguments<'_>) {
    path.write_fmt(what).expect("a String takes all text");
}
