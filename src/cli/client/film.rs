//! `kinocue sync` and `kinocue sync use`: the film that a running hall follows, and the choice of its source.

use std::io::{self, IsTerminal as _};
use std::time::Duration;

use serde_json::json;

use super::panel::WatchPanel;
use super::reply;
use super::server::ServerArgs;
use super::table::table;
use super::view::time;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::control::{FilmSourceStatus, FilmStatus};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

const PATH: &str = "/api/v1/sync";
/// How often a terminal is drawn anew.
const EVERY: Duration = Duration::from_millis(250);
/// Whoever leaves the choice to the ranking says so by this word.
const BY_RANK: &str = "auto";

/// Selects the source of the film by hand, or by rank again.
///
/// If the new source reports another position, the seats move there, as after any jump of the film.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue sync use artnet
  kinocue sync use ltc:alsa:hw:2,0
  kinocue sync use auto

Exit codes: 0 done, 64 several sources match, 66 no such source, or no film, 69 no daemon, 77 not allowed")]
pub(in crate::cli) struct UseArgs {
    /// A source as `kinocue sync` lists it, or its kind if it is the only one of it; `auto` selects by rank.
    #[arg(value_name = "SOURCE|auto")]
    source: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Has a source followed.
pub(in crate::cli) fn choose(UseArgs { source, server }: &UseArgs) -> Result<Exit, Failure> {
    let source = if source == BY_RANK { None } else { Some(meant(source, &film(server)?)?) };
    let status = server.put("/api/v1/sync/source", &json!({ "source": source }))?;
    Ok(server.tell(&status))
}

/// The source of that name, or the only one of that kind; the name itself where there is neither, which the daemon refuses.
fn meant(name: &str, film: &FilmStatus) -> Result<String, Failure> {
    let all = || film.sources.iter().map(|row| row.source.as_str());
    let of_kind: Vec<&str> = all().filter(|source| source.split(':').next() == Some(name)).collect();
    match of_kind.as_slice() {
        [one] if all().all(|source| source != name) => Ok((*one).to_owned()),
        [_, _, ..] if all().all(|source| source != name) => {
            Err(anyhow::anyhow!("{name} may be {}; write which", of_kind.join(" or "))).or_exit(Exit::Usage)
        }
        _ => Ok(name.to_owned()),
    }
}

/// Shows the film: over and over on a terminal, once elsewhere.
pub(in crate::cli) fn show(server: &ServerArgs) -> Result<Exit, Failure> {
    if server.json {
        let reply = server.get(PATH)?;
        server.show(&reply)?;
        reply::done(&reply)?;
        return Ok(Exit::Done);
    }
    // A daemon that is not there at all is a fault; one that goes is waited for.
    let first = text(&film(server)?);
    if !io::stdout().is_terminal() {
        print::out(&first)?;
        return Ok(Exit::Done);
    }
    let (mut panel, mut at) = (WatchPanel::new(), Monotonic.now());
    panel.draw(&first);
    loop {
        at = Monotonic.now().max(at + EVERY);
        Monotonic.sleep_until(at);
        match film(server) {
            Ok(film) => panel.draw(&text(&film)),
            Err(failure) if failure.exit == Exit::NotAllowed => return Err(failure),
            Err(failure) => panel.gone(&format!("{failure}; waiting for it")),
        }
    }
}

fn film(server: &ServerArgs) -> Result<FilmStatus, Failure> {
    reply::film(&server.get(PATH)?)
}

/// What leads, and a row for each source.
fn text(film: &FilmStatus) -> String {
    let FilmStatus { state, cause, next, source, position_s, error_ms, timecode, .. } = film;
    let by = source.as_ref().map_or_else(|| ", no source leads".to_owned(), |name| format!(" by {name}"));
    let at = position_s.map_or_else(|| "unknown".to_owned(), in_the_cue);
    let label = timecode.as_ref().map_or_else(String::new, |code| format!("{code}, "));
    let error = error_ms.map_or_else(
        || "none: the seats follow no film at the moment".to_owned(),
        |ms| format!("{ms:+.2} ms; positive: the seats are ahead of the film"),
    );
    let mut text =
        format!("film    {state}{by}: {cause}\nnext    {next}\nat      {label}{at}\nerror   {error}\n");
    for (word, line) in [("source", chosen(film)), ("apart", apart(film)), ("show", led(film))] {
        text.extend(line.map(|line| format!("{word:<6}  {line}\n")));
    }
    let rows = film.sources.iter().map(|row| cells(row, film));
    let header = ["", "source", "state", "film", "rate ppm", "sigma ms", "dBFS", "dropouts", ""];
    format!("{text}\n{}", table(header, rows))
}

fn in_the_cue(at_s: f64) -> String {
    format!("{} in the cue", time(at_s))
}

fn chosen(film: &FilmStatus) -> Option<String> {
    let name = film.chosen.as_ref()?;
    Some(format!("{name} by hand; kinocue sync use {BY_RANK} selects by rank again"))
}

fn apart(film: &FilmStatus) -> Option<String> {
    let two = film.disagrees.as_ref()?;
    let how = if two.ahead_s < 0.0 { "earlier" } else { "later" };
    let name = &two.source;
    Some(format!("{name} says {:.3} s {how}; kinocue sync use {name} follows it", two.ahead_s.abs()))
}

fn led(film: &FilmStatus) -> Option<String> {
    (!film.leads).then(|| "the loaded show does not follow the film".to_owned())
}

fn cells(row: &FilmSourceStatus, film: &FilmStatus) -> [String; 9] {
    let figure = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
    };
    let leads = film.source.as_ref() == Some(&row.source);
    [
        if leads { ">" } else { "" }.to_owned(),
        row.source.clone(),
        row.state.clone(),
        row.timecode.clone().unwrap_or_else(|| row.position_s.map_or_else(|| "-".to_owned(), in_the_cue)),
        row.rate_ppm.map_or_else(|| "-".to_owned(), |ppm| format!("{ppm:+.0}")),
        figure(row.sigma_ms, 2),
        figure(row.level_dbfs, 0),
        row.dropouts.to_string(),
        row.cause.clone(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn following() -> FilmStatus {
        serde_json::from_str(
            r#"{"state":"locked","cause":"the film runs","next":"nothing","leads":true,"source":"ltc:alsa:hw:2,0",
                "position_s":5.48,"error_ms":-0.126,"timecode":"01:00:05:12","chosen":"ltc:alsa:hw:2,0",
                "disagrees":{"source":"mpv:/run/mpv.sock","ahead_s":-3.2},
                "sources":[
                    {"source":"mpv:/run/mpv.sock","state":"locked","cause":"the film runs","position_s":2.28,"dropouts":1},
                    {"source":"ltc:alsa:hw:2,0","state":"locked","cause":"the film runs","timecode":"01:00:05:12",
                     "rate_ppm":12.4,"sigma_ms":0.031,"level_dbfs":-18.2},
                    {"source":"ltc:fifo:/run/ltc","state":"absent","cause":"nothing has been heard of the film yet"}]}"#,
        )
        .unwrap()
    }

    #[test]
    fn the_table_says_where_the_film_is_by_each_source_and_how_far_from_it_the_seats_are() {
        let text = text(&following());
        for part in [
            "film    locked by ltc:alsa:hw:2,0: the film runs\n",
            "at      01:00:05:12, 00:05.480 in the cue\n",
            "error   -0.13 ms",
            "source  ltc:alsa:hw:2,0 by hand; kinocue sync use auto",
            "apart   mpv:/run/mpv.sock says 3.200 s earlier",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        let leading = text.lines().find(|line| line.trim_start().starts_with('>')).unwrap();
        let cells: Vec<&str> = leading.split_whitespace().collect();
        assert_eq!(cells[..8], [">", "ltc:alsa:hw:2,0", "locked", "01:00:05:12", "+12", "0.03", "-18", "0"]);
        assert!(
            text.contains("mpv:/run/mpv.sock  ") && text.contains("00:02.280 in the cue"),
            "a place, not a label: {text}"
        );
        assert!(!text.contains("does not follow the film"), "{text}");
    }

    #[test]
    fn a_film_that_nobody_knows_yet_is_said_to_be_unknown() {
        let text = text(&FilmStatus { state: "absent".to_owned(), ..FilmStatus::default() });
        for part in [
            "film    absent, no source leads",
            "at      unknown",
            "error   none",
            "the loaded show does not follow the film",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }

    #[test]
    fn a_kind_is_enough_where_one_source_is_of_it() {
        let film = following();
        assert_eq!(meant("mpv", &film).unwrap(), "mpv:/run/mpv.sock");
        assert_eq!(meant("ltc:fifo:/run/ltc", &film).unwrap(), "ltc:fifo:/run/ltc");
        assert_eq!(meant("artnet", &film).unwrap(), "artnet", "the daemon says what there is");
        let failure = meant("ltc", &film).unwrap_err();
        assert_eq!(failure.exit, Exit::Usage);
        assert!(failure.to_string().contains("ltc:alsa:hw:2,0 or ltc:fifo:/run/ltc"), "{failure}");
    }
}
