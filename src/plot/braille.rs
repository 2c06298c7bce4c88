//! A picture as lines of braille, for a terminal: two columns and four rows of dots a character.

use std::iter;

use super::text::{clock, number};
use super::{Lane, Panel, Picture, Scale};
use crate::plain;

/// Dots a character.
const ACROSS: usize = 2;
const DOWN: usize = 4;
/// Characters that stand before the curves, and behind them.
const BEFORE: usize = 9;
const BEHIND: usize = 24;
/// The narrowest that a picture is drawn, characters of its curves.
const LEAST: usize = 16;

/// How many characters of a line that wide are curves.
#[must_use]
pub(crate) const fn cells(width: usize) -> usize {
    let cells = width.saturating_sub(BEFORE + BEHIND);
    if cells < LEAST { LEAST } else { cells }
}

/// The picture in lines. Its columns are what two to a character make: [`cells`].
#[must_use]
pub(crate) fn braille(picture: &Picture) -> String {
    let cells = picture.time.columns.div_ceil(ACROSS);
    let mut lines = vec![plain::escaped(&picture.title, 200).into_owned(), picture.sentence.clone()];
    for panel in &picture.panels {
        match panel.scale {
            Scale::Range => (0..panel.bands.len())
                .filter(|band| !panel.bands[*band].name.is_empty())
                .for_each(|band| lines.extend(position(panel, band, cells))),
            Scale::Limit => lines.extend(measured(panel, cells)),
        }
    }
    lines.extend(picture.lanes.iter().flat_map(|one| lane(one, cells)));
    lines.push(times(picture, cells));
    for flag in &picture.flags {
        lines.push(format!(
            "{:BEFORE$}{} {}",
            "",
            clock(picture.time.film_s(flag.at_s), 0.0),
            plain::escaped(&flag.name, 200)
        ));
    }
    for one in &picture.histograms {
        let bar = |(end, count): &(String, u64)| (*count > 0).then(|| format!("to {end}: {count}"));
        let bars: Vec<String> = one.bins.iter().filter_map(bar).collect();
        lines.push(format!("{}  {}", one.name, bars.join("  ")));
    }
    lines.extend(picture.facts.iter().map(|fact| plain::escaped(fact, 400).into_owned()));
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// The same in half blocks, two dots high, for a terminal that has no braille.
#[must_use]
pub(crate) fn in_blocks(drawn: &str) -> String {
    let block = |c| match u32::from(c).checked_sub(0x2800) {
        Some(dots) if dots < 0x100 => match (dots & 0b0001_1011 > 0, dots & 0b1110_0100 > 0) {
            (true, true) => '█',
            (true, false) => '▀',
            (false, true) => '▄',
            (false, false) => ' ',
        },
        _ => c,
    };
    drawn.chars().map(block).collect()
}

/// An axis of its own: two lines, as six axes have to fit on a screen.
fn position(panel: &Panel, band: usize, cells: usize) -> Vec<String> {
    let band = &panel.bands[band];
    let mut dots = Dots::new(cells, 2);
    for (column, ends) in band.columns.iter().enumerate() {
        if let Some(ends) = ends {
            let [low, high] = ends.map(|end| panel.part(f64::from(end)));
            dots.fill(column, low, high);
        }
    }
    let ends = [(band.name.as_str(), panel.high), (panel.unit, panel.low)];
    let label = |(name, end): (&str, f64)| format!("{name:<4}{:>4} ", number(end));
    ends.into_iter().zip(dots.lines()).map(|(end, dots)| label(end) + &dots).collect()
}

/// The most of all axes, from the ground up.
fn measured(panel: &Panel, cells: usize) -> Vec<String> {
    let mut dots = Dots::new(cells, 2);
    for band in &panel.bands {
        for (column, ends) in band.columns.iter().enumerate() {
            if let Some([_, most]) = ends {
                dots.fill(column, 0.0, f64::from(*most) / 100.0);
            }
        }
    }
    let name = if panel.name.len() > BEFORE { &panel.name[..5] } else { &panel.name };
    // What does not fit beside the dots goes on below.
    let place = match panel.place.split_once(", ") {
        Some((at, line)) if panel.place.chars().count() >= BEHIND => vec![at, line],
        _ => vec![panel.place.as_str()],
    };
    let behind = iter::once(panel.note.as_str()).chain(place);
    let dots = dots.lines().into_iter().chain(iter::repeat(" ".repeat(cells)));
    let names = iter::once(name).chain(iter::repeat(""));
    names
        .zip(dots)
        .zip(behind)
        .map(|((name, dots), words)| format!("{name:<BEFORE$}{dots} {words}"))
        .collect()
}

/// A line, and one more for a name that has no place before it.
fn lane(lane: &Lane, cells: usize) -> Vec<String> {
    let name = plain::escaped(&lane.name, 80);
    let fits = name.chars().count() < BEFORE;
    let (before, note) = if fits { (name.as_ref(), lane.note.as_str()) } else { ("", "") };
    let mut line = format!("{before:<BEFORE$}");
    for cell in 0..cells {
        let shades = lane.columns.iter().skip(ACROSS * cell).take(ACROSS);
        let height = shades.fold(0.0_f32, |most, shade| most.max(shade.height));
        line.push(if height <= 0.0 { '·' } else { '▬' });
    }
    let own = (!fits).then(|| format!("{name}: {}", lane.note));
    own.into_iter().chain([format!("{line} {note}")]).collect()
}

/// The times under the curves, each where it is.
fn times(picture: &Picture, cells: usize) -> String {
    let time = &picture.time;
    let most = f64::from(u16::try_from(cells / 12).unwrap_or(u16::MAX).max(2));
    let (step, ticks) = time.ticks(most);
    let mut line = " ".repeat(BEFORE);
    for tick in ticks {
        let cell = dot(tick.part, cells) + BEFORE;
        if line.chars().count() <= cell {
            line.extend(std::iter::repeat_n(' ', cell - line.chars().count()));
            line += &clock(tick.film_s, step);
            line.push(' ');
        }
    }
    line
}

/// Dots over characters in so many lines.
struct Dots {
    across: usize,
    lines: usize,
    set: Vec<bool>,
}

impl Dots {
    fn new(cells: usize, lines: usize) -> Self {
        let across = cells * ACROSS;
        Self { across, lines, set: vec![false; across * lines * DOWN] }
    }

    /// Sets what lies between two parts of the height, at least one dot.
    fn fill(&mut self, column: usize, low: f64, high: f64) {
        let down = self.lines * DOWN;
        for row in dot(low.min(1.0), down)..=dot(high.min(1.0), down) {
            self.set[(down - 1 - row) * self.across + column] = true;
        }
    }

    fn lines(&self) -> Vec<String> {
        let cell = |line: usize, cell: usize| {
            // The bits of a braille pattern (Unicode Standard, block U+2800): down the left column, then the right, the
            // fourth row last.
            const BITS: [[u32; ACROSS]; DOWN] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
            let mut pattern = 0x2800;
            for (down, bits) in BITS.iter().enumerate() {
                for (across, bit) in bits.iter().enumerate() {
                    if self.set[(line * DOWN + down) * self.across + cell * ACROSS + across] {
                        pattern |= bit;
                    }
                }
            }
            char::from_u32(pattern).unwrap_or(' ')
        };
        (0..self.lines).map(|line| (0..self.across / ACROSS).map(|at| cell(line, at)).collect()).collect()
    }
}

/// The place of a part among so many.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "0 to 1"
)]
fn dot(part: f64, count: usize) -> usize {
    ((part * (count - 1) as f64).round() as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_stand_where_dots_do_and_words_stay() {
        assert_eq!(in_blocks("a1 ⠁⠒⡀⢸⠀⣀ 50 %"), "a1 ▀▀▄█ ▄ 50 %");
    }
}
