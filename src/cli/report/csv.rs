//! A report as CSV (RFC 4180).

use crate::control::model::{FrameCounts, Percentiles};
use crate::journal::{JournalReport, ReportShown};
use crate::plain::escaped;

const SHOWS: &str = "start,end,took_s,result,hall,cue,sha256,title,playlist,entry,level,vibration,trim_ms,effects_off,\
    seats_total,seats_available,operator,scheduled,out_of_hours,ticks,missed_ticks,sent,asked,acked,refused,lost,\
    send_failed,lateness_p50_us,lateness_p99_us,lateness_max_us,ack_p50_us,ack_p99_us,ack_max_us,events,\
    film_sources,film_switches,film_error_max_ms,withdrawn,\
    seats_out,seats_out_max_s";

/// One record a show; what is not known is empty.
pub(super) fn shows(report: &JournalReport) -> String {
    let head = SHOWS.split(',').map(str::to_owned).collect();
    [head].into_iter().chain(report.shows.iter().map(show)).map(|cells| record(&cells)).collect()
}

/// One record for each thing that was asked.
pub(super) fn actions(report: &JournalReport) -> String {
    let head = ["at", "who", "what", "result", "state", "times"].map(str::to_owned);
    let rows = report.actions.iter();
    let rows = rows.map(|one| {
        let times = one.times.to_string();
        [&one.at, &one.who, &one.what, &one.result, &one.state, &times].map(|text| plain(text))
    });
    [head].into_iter().chain(rows).map(|cells| record(&cells)).collect()
}

fn show(show: &ReportShown) -> Vec<String> {
    let (record, outcome) = (&show.record, show.record.outcome.as_ref());
    let place = record.playlist.as_ref();
    let mut cells = vec![
        record.start.clone(),
        outcome.map_or_else(String::new, |outcome| outcome.end.clone()),
        number(show.took_s),
        show.result.word().to_owned(),
        plain(&record.hall),
        plain(&record.cue),
        record.sha256.clone(),
        plain(record.title.as_deref().unwrap_or_default()),
        plain(place.map_or("", |place| &place.id)),
        place.map_or_else(String::new, |place| (place.entry + 1).to_string()),
        record.level.to_string(),
        record.vibration.to_string(),
        record.trim_ms.to_string(),
        plain(&record.effects_off.join(" ")),
        record.seats_total.to_string(),
        record.seats_available.to_string(),
        plain(&record.operator),
        record.scheduled.to_string(),
        record.out_of_hours.to_string(),
    ];
    let counts = outcome.map(|one| {
        let FrameCounts { sent, asked, acked, refused, lost, .. } = one.frames;
        [one.ticks, one.missed_ticks, sent, asked, acked, refused, lost, one.send_failed]
    });
    cells.extend((0..8).map(|index| counts.map_or_else(String::new, |counts| counts[index].to_string())));
    for Percentiles { p50_us, p99_us, max_us, .. } in
        [outcome.map(|one| one.lateness), outcome.map(|one| one.ack)].map(Option::unwrap_or_default)
    {
        cells.extend([p50_us, p99_us, max_us].map(number));
    }
    cells.push(plain(&outcome.map_or_else(String::new, |outcome| outcome.events.join("; "))));
    let film = outcome.and_then(|outcome| outcome.film.as_ref());
    cells.push(plain(&film.map_or_else(String::new, |film| film.sources.join(" "))));
    cells.push(film.map_or_else(String::new, |film| film.switches.to_string()));
    cells.push(number(film.and_then(|film| film.greatest_error_ms)));
    cells.push(outcome.map_or_else(String::new, |outcome| outcome.frames.withdrawn.to_string()));
    let out = outcome.map(|outcome| &outcome.seats_out);
    cells.push(out.map_or_else(String::new, |out| out.len().to_string()));
    cells.push(number(out.map(|out| out.iter().map(|seat| seat.out_s).fold(0.0, f64::max))));
    cells
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// A text that does nothing to a terminal, and that no spreadsheet takes for a formula: titles come from whoever made the cue.
fn plain(text: &str) -> String {
    let text = escaped(text, usize::MAX);
    if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.into_owned() }
}

/// One record with its end.
fn record(cells: &[String]) -> String {
    let quoted = |cell: &String| {
        if cell.contains([',', '"', '\r', '\n']) {
            format!("\"{}\"", cell.replace('"', "\"\""))
        } else {
            cell.clone()
        }
    };
    cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\r\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_have_to_be() {
        let cells = ["plain", "a,b", "say \"hi\"", "two\nlines", ""].map(str::to_owned);
        assert_eq!(record(&cells), "plain,\"a,b\",\"say \"\"hi\"\"\",\"two\nlines\",\r\n");
    }

    #[test]
    fn a_title_is_no_formula() {
        assert_eq!(plain("=HYPERLINK(1)"), "'=HYPERLINK(1)");
        assert_eq!(plain("\t=1\x1b"), "\\t=1\\u{1b}");
        assert_eq!(plain("Storm"), "Storm");
    }
}
