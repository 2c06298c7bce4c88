//! A picture as a page that stands alone: as wide as its window, with figures as text; its script only shows parts larger. It may
//! load nothing, from anywhere.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use super::path::{self, HEIGHT};
use super::svg::{APART, flag_rows, high, names};
use super::text::{clock, number, safe};
use super::theme::{Theme, classes};
use super::time_axis::TimeTick;
use super::{Histogram, Lane, Panel, Picture, Scale, TimeAxis, scale};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The picture as a page.
#[must_use]
pub(crate) fn page(picture: &Picture, theme: Theme) -> String {
    let time = &picture.time;
    let title = safe(&picture.title);
    let facts: String = picture.facts.iter().map(|fact| format!("<p>{}</p>", safe(fact))).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\" class=\"plot\">\n<head><meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{}'\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{}\n{STYLE}</style></head>\n\
         <body><main data-from=\"{}\" data-until=\"{}\" data-columns=\"{}\"{}>\n<h1>{title}</h1>\n<p class=\"sentence\">{}</p>\n{TOOLS}\n\
         {}{}{}{}{}\n{}{}<footer>{facts}</footer></main>\n<script>{SCRIPT}</script></body></html>\n",
        STANDARD.encode(Sha256::digest(SCRIPT)),
        theme.css(),
        time.from_s,
        time.until_s,
        time.columns,
        passes(time),
        safe(&picture.sentence),
        flags(picture),
        picture.panels.iter().map(|panel| section(panel, time)).collect::<String>(),
        // Also here: what is below may be on another sheet.
        if picture.lanes.is_empty() { String::new() } else { times(time) },
        picture.lanes.iter().map(|one| lane(one, time)).collect::<String>(),
        times(time),
        picture.histograms.iter().map(histogram).collect::<String>(),
        table(picture),
    )
}

/// Where each pass begins on the axis, and the show times of its ends; nothing where the axis is show time.
fn passes(time: &TimeAxis) -> String {
    let passes =
        time.passes().iter().map(|one| format!("[{:.6},{:.6},{:.6}]", one.at_s, one.film_s, one.until_s));
    let passes = passes.collect::<Vec<_>>().join(",");
    if passes.is_empty() { passes } else { format!(" data-passes=\"[{passes}]\"") }
}

/// How long the axis is on a sheet of A4, px: shorter than on most screens.
pub(super) const PAPER: f64 = 620.0;

/// Passes whose begin is a line across each panel.
const MOST_PASSES: usize = 40;

const TOOLS: &str = "<div class=\"tools\" hidden><button data-does=\"in\" aria-label=\"Larger\">+</button>\
<button data-does=\"out\" aria-label=\"Smaller\">−</button><button data-does=\"back\" aria-label=\"Earlier\">←</button>\
<button data-does=\"on\" aria-label=\"Later\">→</button><button data-does=\"whole\">Whole</button>\
<span>Drag over a stretch of time to see it larger.</span></div>";

fn at(time: &TimeAxis, at_s: f64) -> String {
    at_part(time.part(at_s).unwrap_or_default())
}

fn at_part(part: f64) -> String {
    format!("data-at=\"{part:.6}\" style=\"left:{:.3}%", 100.0 * part)
}

fn percent(panel: &Panel, value: f64) -> f64 {
    100.0 * (1.0 - panel.part(value))
}

fn head(name: &str, note: &str) -> String {
    format!("<h2>{} <span>{}</span></h2>", safe(name), safe(note))
}

fn section(panel: &Panel, time: &TimeAxis) -> String {
    let high = high(panel, if panel.scale == Scale::Range { 220.0 } else { 130.0 });
    let note = if panel.place.is_empty() {
        panel.note.clone()
    } else {
        format!("{} · {}", panel.note, panel.place)
    };
    let mut out = format!(
        "<section>{}<div class=\"box drag\" style=\"height:{high}px\">",
        head(&format!("{}, {}", panel.name, panel.unit), &note)
    );
    for tick in scale::of_values(panel.low, panel.high, 4.0) {
        out += &format!(
            "<div class=\"y\" style=\"top:{:.2}%\"><span>{}</span></div>",
            percent(panel, tick),
            number(tick)
        );
    }
    if panel.scale == Scale::Limit {
        let limit = percent(panel, 100.0);
        out += &format!(
            "<div class=\"over\" style=\"height:{limit:.2}%\"></div><div class=\"y limit\" style=\"top:{limit:.2}%\"></div>"
        );
    }
    out += "<div class=\"clip ticks\"></div>";
    for pass in time.passes().iter().skip(1).take(MOST_PASSES) {
        out += &format!("<i class=\"pass\" {}\"></i>", at(time, pass.at_s));
    }
    let range = if panel.scale == Scale::Range { " range" } else { "" };
    let paths = panel.bands.iter().map(|band| {
        format!("<path class=\"curve{range} {}\" d=\"{}\"/>", classes(band.style), path::band(panel, band))
    });
    out += &drawn(time, f64::from(HEIGHT), &format!("{}: {note}", panel.name), &paths.collect::<String>());
    for mark in &panel.marks {
        out += &format!(
            "<i class=\"mark {}\" {};top:{:.2}%\" title=\"{}\"></i>",
            classes(mark.style),
            at(time, mark.at_s),
            percent(panel, mark.value),
            safe(&mark.words)
        );
    }
    for (style, name, y) in names(panel, high, APART) {
        let class = classes(style);
        out += &format!(
            "<span class=\"name {class}\" style=\"top:{y:.0}px\">{} {}</span>",
            safe(name),
            format_args!(
                "<svg class=\"key\" width=\"22\" height=\"4\" aria-hidden=\"true\"><path class=\"curve {class}\" d=\"M0 2h22\"/></svg>"
            )
        );
    }
    out + "</div></section>\n"
}

fn drawn(time: &TimeAxis, high: f64, label: &str, paths: &str) -> String {
    format!(
        "<div class=\"clip\"><svg role=\"img\" aria-label=\"{}\" preserveAspectRatio=\"none\" viewBox=\"0 0 {} {high}\" \
         data-high=\"{high}\">{paths}</svg></div>",
        safe(label),
        time.columns
    )
}

fn lane(lane: &Lane, time: &TimeAxis) -> String {
    let paths = path::lane(lane)
        .into_iter()
        .map(|(tone, path)| format!("<path class=\"lane t{tone}\" d=\"{path}\"/>"));
    let drawn = drawn(time, 16.0, &format!("{}: {}", lane.name, lane.note), &paths.collect::<String>());
    format!(
        "<section>{}<div class=\"box drag strip\">{drawn}</div></section>\n",
        head(&lane.name, &lane.note)
    )
}

fn flags(picture: &Picture) -> String {
    if picture.flags.is_empty() {
        return String::new();
    }
    // As on paper; on a screen the script puts names where its width has room for them. Each is a title besides.
    let rows = flag_rows(picture, PAPER, |x, _| x > 0.6 * PAPER);
    let flag = |(flag, row): (&super::Flag, Option<(u8, bool)>)| {
        let late = if row.is_some_and(|(_, is_before)| is_before) { " late" } else { "" };
        let marked = if flag.is_mark { " marked" } else { "" };
        let name = safe(&flag.name);
        let place = row.map_or("hidden".to_owned(), |(row, _)| format!("style=\"top:{}px\"", 20 * row));
        format!(
            "<i class=\"flag{late}{marked}\" {}\" title=\"{name}, {}\"><span {place}>{name}</span></i>",
            at(&picture.time, flag.at_s),
            clock(picture.time.film_s(flag.at_s), 0.0),
        )
    };
    let flags: String = picture.flags.iter().zip(rows).map(flag).collect();
    format!("<section><h2>Markers</h2><div class=\"box flags\">{flags}</div></section>\n")
}

/// Ticks as they are without the script.
fn times(time: &TimeAxis) -> String {
    let (step, ticks) = time.ticks(10.0);
    let tick = |tick: &TimeTick| {
        let place = at_part(tick.part);
        format!("<i class=\"tick\" {place}\"><span>{}</span></i>", clock(tick.film_s, step))
    };
    format!("<div class=\"box times ticks\">{}</div>", ticks.iter().map(tick).collect::<String>())
}

/// Bars of equal width, each over the end of its bin.
fn histogram(histogram: &Histogram) -> String {
    let bar = |(end, count): &(String, u64)| {
        let high = 100.0 * histogram.height(*count);
        let (end, count) = (safe(end), if *count > 0 { count.to_string() } else { String::new() });
        format!("<li><b>{count}</b><i style=\"height:{high:.1}%\"></i><span>{end}</span></li>")
    };
    let bars: String = histogram.bins.iter().map(bar).collect();
    format!(
        "<section>{}<ul class=\"bars\">{bars}</ul></section>\n",
        head(histogram.name, "how often, up to; heights by the logarithm")
    )
}

fn table(picture: &Picture) -> String {
    let super::Table { name, head, rows } = &picture.table;
    if rows.is_empty() {
        return String::new();
    }
    let row = |row: &[String; 6]| {
        let cells: String = row.iter().map(|cell| format!("<td>{}</td>", safe(cell))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let head: String = head.iter().map(|cell| format!("<th>{cell}")).collect();
    let rows: String = rows.iter().map(row).collect();
    format!("<section class=\"scrolls\"><h2>{name}</h2><table><tr>{head}</tr>\n{rows}</table></section>\n")
}
