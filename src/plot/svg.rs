//! A picture as an SVG of a fixed size that stands alone.

use super::path::{self, HEIGHT};
use super::text::{clock, number, safe};
use super::theme::{Theme, classes};
use super::time_axis::TimeTick;
use super::{Flag, Histogram, Lane, Panel, Picture, Scale, TimeAxis, scale};

/// The whole, px.
const WIDTH: f64 = 1200.0;
/// Where the time axis begins and how long it is, px.
const LEFT: f64 = 56.0;
const LENGTH: f64 = 1084.0;
/// Texts below each other, px.
const LINE: f64 = 20.0;
/// Names at the ends of lines are at least so far apart, px.
pub(super) const APART: f64 = 14.0;

const TEXT: &str = "text{font:13px system-ui,'DejaVu Sans','Noto Sans',sans-serif;fill:var(--text)}.big{font-size:20px;font-weight:650}\
.head{font-weight:650}.quiet{fill:var(--quiet)}.grid{stroke:var(--edge);stroke-width:1}.limit{stroke:var(--text);stroke-width:1.2}\
.flag{stroke:var(--text);stroke-dasharray:1 3}.mark{fill:var(--ground);stroke:var(--line);stroke-width:2}.ground{fill:var(--ground)}\
.hatch{stroke:var(--over);stroke-width:2}.late{text-anchor:end}";

/// The picture as an SVG.
#[must_use]
pub(crate) fn svg(picture: &Picture, theme: Theme) -> String {
    let mut body = String::new();
    let mut y = 2.0 * LINE;
    body += &words(LEFT, 30.0, "big", &safe(&picture.title));
    y += 14.0;
    body += &words(LEFT, y, "", &safe(&picture.sentence));
    y += LINE;
    let (flags, depth) = flags(picture, y);
    let top = y;
    y += depth;
    for panel in &picture.panels {
        body += &drawn(panel, &picture.time, &mut y);
    }
    for one in &picture.lanes {
        body += &lane(one, picture.time.columns, &mut y);
    }
    body += &format!("<path class=\"flag\" d=\"{}\"/>", flag_lines(picture, top, y));
    body += &flags;
    body += &times(&picture.time, y + 6.0);
    y += 2.0 * LINE;
    for one in &picture.histograms {
        body += &histogram(one, &mut y);
    }
    for fact in &picture.facts {
        y += 18.0;
        body += &words(LEFT, y, "quiet", &safe(fact));
    }
    let rows: String = picture.table.rows.iter().map(|row| safe(&row.join(" ")) + "\n").collect();
    let (title, sentence, height) = (safe(&picture.title), safe(&picture.sentence), y + 16.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" role=\"img\" width=\"{WIDTH}\" height=\"{height}\" \
         viewBox=\"0 0 {WIDTH} {height}\"><title>{title}</title><desc>{sentence}\n{rows}</desc><style>{TEXT}{}</style>\
         <defs>{HATCH}</defs><rect class=\"ground\" width=\"100%\" height=\"100%\"/>{body}</svg>\n",
        theme.css(),
    )
}

/// Lines across what is over a limit.
const HATCH: &str = "<pattern id=\"over\" width=\"8\" height=\"8\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">\
<path class=\"hatch\" d=\"M0 0v8\"/></pattern>";

fn words(x: f64, y: f64, class: &str, safe: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{safe}</text>")
}

/// How high a panel is, px: at least so that the names of all its bands have room beside it.
pub(super) fn high(panel: &Panel, least: f64) -> f64 {
    panel.bands.iter().filter(|band| !band.name.is_empty()).fold(0.0, |high, _| high + APART).max(least)
}

/// A panel under its heading; `y` is moved behind it.
fn drawn(panel: &Panel, time: &TimeAxis, y: &mut f64) -> String {
    let high = high(panel, if panel.scale == Scale::Range { 190.0 } else { 110.0 });
    *y += 18.0;
    let note = [&*panel.note, &panel.place]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" · ");
    let mut out = format!(
        "<text x=\"{LEFT}\" y=\"{:.1}\"><tspan class=\"head\">{}, {}</tspan> <tspan class=\"quiet\" dx=\"8\">{}</tspan></text>",
        *y,
        safe(&panel.name),
        panel.unit,
        safe(&note)
    );
    *y += 8.0;
    let top = *y;
    let at = |value: f64| top + high * (1.0 - panel.part(value));
    let ticks = scale::of_values(
        panel.low,
        if panel.scale == Scale::Limit { panel.high.max(100.0) } else { panel.high },
        4.0,
    );
    for tick in &ticks {
        let y = at(*tick);
        out += &format!("<path class=\"grid\" d=\"M{LEFT} {y:.1}h{LENGTH}\"/>");
        out += &format!(
            "<text class=\"quiet\" text-anchor=\"end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            LEFT - 6.0,
            y + 4.0,
            number(*tick)
        );
    }
    if panel.scale == Scale::Limit {
        let limit = at(100.0);
        out += &format!(
            "<rect fill=\"url(#over)\" x=\"{LEFT}\" y=\"{top:.1}\" width=\"{LENGTH}\" height=\"{:.1}\"/>\
             <path class=\"limit\" d=\"M{LEFT} {limit:.1}h{LENGTH}\"/>",
            limit - top
        );
    }
    out += &curves(panel, time, top, high);
    *y += high + 8.0;
    out
}

#[expect(clippy::cast_precision_loss, reason = "some thousand columns")]
fn across(columns: usize) -> f64 {
    LENGTH / columns as f64
}

/// Lines, their marks, and their names at their ends.
fn curves(panel: &Panel, time: &TimeAxis, top: f64, high: f64) -> String {
    let scale = (across(time.columns), high / f64::from(HEIGHT));
    let mut out =
        format!("<g transform=\"translate({LEFT} {top:.1}) scale({:.5} {:.5})\">", scale.0, scale.1);
    let range = if panel.scale == Scale::Range { " range" } else { "" };
    for band in &panel.bands {
        let (class, path) = (classes(band.style), path::band(panel, band));
        out += &format!(
            "<path class=\"curve{range} {class}\" d=\"{path}\"><title>{}</title></path>",
            safe(&band.name)
        );
    }
    out += "</g>";
    for mark in &panel.marks {
        let x = LEFT + LENGTH * time.part(mark.at_s).unwrap_or_default();
        let y = top + high * (1.0 - panel.part(mark.value));
        let class = classes(mark.style);
        out += &format!(
            "<circle class=\"mark {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"><title>{}</title></circle>",
            safe(&mark.words)
        );
    }
    for (style, name, y) in names(panel, high, APART) {
        let (class, y) = (classes(style), top + y);
        out += &format!(
            "<text class=\"name {class}\" x=\"{:.1}\" y=\"{:.1}\">{}</text><path class=\"key curve {class}\" d=\"M{:.1} {y:.1}h22\"/>",
            LEFT + LENGTH + 8.0,
            y + 4.0,
            safe(name),
            WIDTH - 24.0
        );
    }
    out
}

/// The names of bands, each as near to the end of its line as the others leave room: style, name, px from the top.
pub(super) fn names(panel: &Panel, high: f64, apart: f64) -> Vec<(usize, &str, f64)> {
    let mut names: Vec<_> = panel
        .bands
        .iter()
        .filter(|band| !band.name.is_empty())
        .filter_map(|band| {
            let [least, most] = band.last()?.map(f64::from);
            let end = if panel.scale == Scale::Limit { most } else { f64::midpoint(least, most) };
            Some((band.style, band.name.as_str(), high * (1.0 - panel.part(end))))
        })
        .collect();
    names.sort_by(|one, other| one.2.total_cmp(&other.2));
    // Upwards from the ground, then downwards from the top: what is pushed out at one end is pushed back from it.
    let mut room = high;
    for name in names.iter_mut().rev() {
        name.2 = name.2.min(room);
        room = name.2 - apart;
    }
    let mut room = 0.0_f64;
    for name in &mut names {
        name.2 = name.2.max(room);
        room = name.2 + apart;
    }
    names
}

fn lane(lane: &Lane, columns: usize, y: &mut f64) -> String {
    *y += 16.0;
    let mut out = format!(
        "<text x=\"{LEFT}\" y=\"{:.1}\"><tspan class=\"head\">{}</tspan> <tspan class=\"quiet\" dx=\"8\">{}</tspan></text>",
        *y,
        safe(&lane.name),
        safe(&lane.note)
    );
    *y += 5.0;
    out += &format!("<path class=\"grid\" d=\"M{LEFT} {:.1}h{LENGTH}\"/>", *y + 13.0);
    out += &format!(
        "<g class=\"lane\" transform=\"translate({LEFT} {:.1}) scale({:.5} .8)\">",
        *y,
        across(columns)
    );
    for (tone, path) in path::lane(lane) {
        out += &format!("<path class=\"t{tone}\" d=\"{path}\"/>");
    }
    *y += 18.0;
    out + "</g>"
}

/// Bars of equal width, each over the end of its bin.
#[expect(clippy::cast_precision_loss, reason = "some bins")]
fn histogram(histogram: &Histogram, y: &mut f64) -> String {
    const HIGH: f64 = 80.0;
    *y += 26.0;
    let mut out = format!(
        "<text x=\"{LEFT}\" y=\"{:.1}\"><tspan class=\"head\">{}</tspan> <tspan class=\"quiet\" dx=\"8\">how often, up to; heights by the \
         logarithm</tspan></text><g class=\"lane\">",
        *y, histogram.name
    );
    let wide = LENGTH / histogram.bins.len().max(1) as f64;
    let ground = *y + 24.0 + HIGH;
    let mut words_ = String::new();
    for (index, (end, count)) in histogram.bins.iter().enumerate() {
        let (x, high) = (LEFT + wide * index as f64, HIGH * histogram.height(*count));
        out += &format!("<path d=\"M{:.1} {ground:.1}v-{high:.1}h{:.1}v{high:.1}z\"/>", x + 2.0, wide - 4.0);
        words_ += &words(x + 4.0, ground + 15.0, "quiet", &safe(end));
        if *count > 0 {
            words_ += &words(x + 4.0, ground - high - 4.0, "", &count.to_string());
        }
    }
    *y = ground + 22.0;
    format!("{out}</g>{words_}<path class=\"grid\" d=\"M{LEFT} {ground:.1}h{LENGTH}\"/>")
}

/// The names of flags in rows, and how deep they are.
fn flags(picture: &Picture, y: f64) -> (String, f64) {
    let mut out = String::new();
    let mut depth = 0.0_f64;
    let rows = flag_rows(picture, LENGTH, |x, width| LEFT + x + width > WIDTH);
    for (flag, row) in picture.flags.iter().zip(rows) {
        // One that no row has room for is told by its line alone.
        let Some((row, is_before)) = row else { continue };
        let x = LEFT + LENGTH * picture.time.part(flag.at_s).unwrap_or_default();
        let down = LINE * f64::from(row + 1);
        depth = depth.max(down);
        let (class, x) = if is_before { ("late", x - 4.0) } else { ("", x + 4.0) };
        out += &words(x, y + down - 6.0, class, &safe(&flag_name(&flag.name)));
    }
    (out, depth)
}

/// As much of a flag's name as there is room for.
fn flag_name(name: &str) -> String {
    name.chars().take(40).collect()
}

/// Rows in which the names of flags do not run into each other, over an axis so many px long, and whether each stands before its flag,
/// as `is_before` has it of where that is and how wide the name is; `None` for one that no row has room for. What a person has marked
/// comes first: it is what the picture is looked at for, and a show begins with many flags.
pub(super) fn flag_rows(
    picture: &Picture,
    length: f64,
    is_before: impl Fn(f64, f64) -> bool,
) -> Vec<Option<(u8, bool)>> {
    let mut rows: [Vec<(f64, f64)>; 4] = Default::default();
    let mut row = |flag: &Flag| {
        let x = length * picture.time.part(flag.at_s).unwrap_or_default();
        let chars = flag_name(&flag.name).chars().count();
        let width = 8.0 * f64::from(u8::try_from(chars).unwrap_or(u8::MAX)) + 10.0;
        let is_before = is_before(x, width);
        let begin = if is_before { x - width } else { x };
        let is_free =
            |row: &[(f64, f64)]| row.iter().all(|(from, to)| *to <= begin || begin + width <= *from);
        let (number, row) = (0_u8..).zip(&mut rows).find(|(_, row)| is_free(row))?;
        row.push((begin, begin + width));
        Some((number, is_before))
    };
    let mut placed = vec![None; picture.flags.len()];
    for marked in [true, false] {
        let flags = picture.flags.iter().zip(&mut placed).filter(|(flag, _)| flag.is_mark == marked);
        flags.for_each(|(flag, place)| *place = row(flag));
    }
    placed
}

fn flag_lines(picture: &Picture, top: f64, bottom: f64) -> String {
    let x = |at_s: f64| LEFT + LENGTH * picture.time.part(at_s).unwrap_or_default();
    picture.flags.iter().map(|flag| format!("M{:.1} {top:.1}V{bottom:.1}", x(flag.at_s))).collect()
}

fn times(time: &TimeAxis, y: f64) -> String {
    let (step, ticks) = time.ticks(12.0);
    let tick = |tick: &TimeTick| {
        let x = LEFT + LENGTH * tick.part;
        format!(
            "<path class=\"grid\" d=\"M{x:.1} {y:.1}v6\"/><text class=\"quiet\" text-anchor=\"middle\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>",
            y + 20.0,
            clock(tick.film_s, step)
        )
    };
    ticks.iter().map(tick).collect()
}
