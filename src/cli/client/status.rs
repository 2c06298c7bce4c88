//! `kinocue status`.

use super::reply;
use super::server::ServerArgs;
use super::view::{next_start, percent, time, us};
use crate::cli::table::table;
use crate::cli::{Exit, Failure, print};
use crate::control::{ControllerStatus, FilmStatus, Percentiles, PlaylistStatus, ShowStatus, Status, Times};

/// Shows the hall's status.
///
/// State, its cause and the next action; the loaded cue, levels, controllers and warnings.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue status
  kinocue status --json
  kinocue watch            the same, live

Exit codes: 0 shown, 69 no daemon, 77 not allowed")]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    server: ServerArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let reply = args.server.get("/api/v1/status")?;
    args.server.show(&reply)?;
    let status = reply::status(&reply)?;
    if !args.server.json {
        print::out(&text(&status))?;
    }
    Ok(Exit::Done)
}

/// The whole of it.
fn text(status: &Status) -> String {
    let mut text: String = block(status).iter().map(|(word, line)| format!("{word:<9}  {line}\n")).collect();
    if !status.controllers.is_empty() {
        text.extend(["\n", &controllers(&status.controllers)]);
    }
    for (place, warning) in status.warnings.iter().enumerate() {
        text.extend([if place == 0 { "\n" } else { "" }, &warning.line(), "\n"]);
    }
    text
}

/// A word and a line for each thing there is to say of the hall.
fn block(status: &Status) -> Vec<(&'static str, String)> {
    let mut lines = vec![("hall", format!("{}, kinocue {}", status.hall, status.version))];
    let lapses = status.lapses_s.map_or_else(String::new, |s| format!(", for {s:.0} s more"));
    lines.push(("state", format!("{} for {:.0} s{lapses}: {}", status.state, status.since_s, status.cause)));
    lines.push(("next", status.next.clone()));
    lines.push(("show", status.show.as_ref().map_or_else(|| "nothing is loaded".to_owned(), show)));
    lines.extend(status.film.as_ref().map(|one| ("film", film(one))));
    lines.extend(status.playlist.as_ref().map(|list| ("playlist", playlist(list, status))));
    lines.push(("levels", status.mix()));
    if !status.presets.is_empty() {
        lines.push(("presets", status.presets.join(", ")));
    }
    lines.push(("ticks", ticks(status)));
    let real = &status.realtime;
    let locked = if real.memory_locked { "memory locked" } else { "memory not locked" };
    lines.push(("real time", format!("{} {}, {locked}", real.policy, real.priority)));
    if let Some(found) = &status.preflight {
        let verdict = if found.passed { "passed" } else { "failed" };
        lines.push(("preflight", format!("{verdict}, {} controllers answered", found.answered)));
    }
    lines
}

fn show(show: &ShowStatus) -> String {
    let ShowStatus { cue, title, length_s, position_s, resume_s, .. } = show;
    let title = title.as_ref().map_or_else(String::new, |title| format!(" \"{title}\""));
    let left =
        resume_s.map(time).map(|at| format!("; left at {at}: kinocue go --from {at} goes on from there"));
    format!("{cue}{title}, at {} of {}{}", time(*position_s), time(*length_s), left.unwrap_or_default())
}

fn film(film: &FilmStatus) -> String {
    let FilmStatus { state, cause, next, source, position_s, leads, .. } = film;
    let at = position_s.map_or_else(String::new, |at| format!(", at {}", time(at)));
    let by = source.as_ref().map_or_else(String::new, |source| format!(" by {source}"));
    let leads = if *leads { "" } else { "; no show that is loaded follows it" };
    format!("{state}{at}{by}: {cause}; next: {next}{leads}")
}

fn playlist(list: &PlaylistStatus, status: &Status) -> String {
    let next =
        next_start(status).map_or_else(String::new, |at| format!(", the next starts by itself at {at}"));
    format!("{}, entry {} of {}{next}", list.id, list.current + 1, list.entries.len())
}

fn ticks(status: &Status) -> String {
    let Status { ticks, missed_ticks, rate_hz, .. } = status;
    let told = |times: &Times| {
        let Percentiles { p50_us, p99_us, max_us, .. } = times.percentiles;
        format!("p50 {} p99 {} max {} µs", us(p50_us), us(p99_us), us(max_us))
    };
    let (lateness, acks, on_links) = (&status.lateness, &status.ack_latency, &status.link_ack_latency);
    let on_links = if on_links.is_none() { String::new() } else { format!("; on links {}", told(on_links)) };
    let (lateness, acks) = (told(lateness), told(acks));
    format!("{ticks} at {rate_hz} Hz, {missed_ticks} missed; lateness {lateness}; acks {acks}{on_links}")
}

fn controllers(all: &[ControllerStatus]) -> String {
    let row = |one: &ControllerStatus| {
        let ControllerStatus { name, row, why, ack_rate, ack_p50_us, ack_p99_us, frames, .. } = one;
        [
            name.clone(),
            row.clone().unwrap_or_else(|| "-".to_owned()),
            one.stands(),
            ack_rate.map_or_else(|| "-".to_owned(), percent),
            us(*ack_p50_us),
            us(*ack_p99_us),
            frames.lost.to_string(),
            why.clone(),
        ]
    };
    table(["controller", "row", "health", "acks", "p50 µs", "p99 µs", "lost", ""], all.iter().map(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_matters_stands_above_the_table_and_warnings_below_it() {
        let status: Status = serde_json::from_str(
            r#"{"hall":"Hall 1","version":"0.1.0","state":"armed","cause":"by anna","next":"go","since_s":4.2,
                "lapses_s":595.8,"show":{"cue":"coaster","title":"Coaster","length_s":60.0,"position_s":0.0},
                "levels":{"motion":1.0,"vibration":1.0},"rate_hz":100.0,"realtime":{"policy":"fifo","priority":50},
                "controllers":[{"name":"A1","row":"A","enabled":true,"health":"ok","ack_rate":0.999,"lost":2},
                    {"name":"A2","enabled":false,"health":"lost","why":"no ack for 3 s"}],
                "warnings":[{"id":"controller-lost","severity":"error","controller":"A2","text":"lost","remedy":"look"}]}"#,
        )
        .unwrap();
        let text = text(&status);
        for part in [
            "state      armed for 4 s, for 596 s more: by anna\nnext       go\n",
            "coaster \"Coaster\", at 00:00.000 of 01:00.000",
            " A1           A     ok          100 %",
            "lost, off",
            "\nerror controller-lost: A2: lost; look\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
