//! `kinocue fleet status` and `watch`: all halls, the one that needs a person most first, each with the age of what is known of it.

use std::collections::BTreeMap;
use std::io::{IsTerminal as _, stdout};
use std::pin::pin;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::jetstream::context::Context;
use async_nats::{Client, Message, Subscriber};
use futures_util::{StreamExt as _, stream};
use serde::Serialize;
use tokio::time::{Instant, sleep_until, timeout_at};

use super::settings::DeskSettings;
use super::{DeskArgs, engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, print, table};
use crate::control::model::Severity;
use crate::fleet::{self, BriefStatus};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};
use crate::{json, plain};

/// How long halls are listened to: each tells its status twice a second.
const LISTEN: Duration = Duration::from_millis(1_200);
/// After so long without a status a hall is silent.
const SILENT: Duration = Duration::from_millis(1_500);
/// How long the engine may take to say what it has kept.
const LOOKED_UP: Duration = Duration::from_secs(8);
/// How often a watched table is drawn.
const DRAW: Duration = Duration::from_millis(500);
/// The longest text in a cell or a line, bytes: a hall may say whatever it likes, and the others are to be seen beside it.
const TEXT: usize = 480;
/// The longest list in a status.
const ITEMS: usize = 64;

/// Shows all halls of a desk, worst first, with the age of what is known of each.
///
/// A hall is silent where it has not been heard for 1.5 s; what is shown of it then is what the engine has kept, and is old. The hall itself
/// plays on.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit codes: 0 every hall was heard, 69 the engine does not answer, 75 a hall is silent"
)]
pub(super) struct StatusArgs {
    #[command(flatten)]
    desk: DeskArgs,
    /// Print JSON: an array with an object for each hall.
    #[arg(long)]
    json: bool,
}

/// Shows all halls of a desk until Ctrl-C.
///
/// On a terminal it is one table; elsewhere a line for each change.
#[derive(Debug, clap::Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    desk: DeskArgs,
    /// Print JSON: an object in a line for each status as it comes.
    #[arg(long)]
    json: bool,
}

/// What the engine has kept of halls.
pub(super) struct KeptHalls {
    of: BTreeMap<String, Kept>,
    /// Why it did not say so of all of them.
    lack: Option<anyhow::Error>,
}

/// What is known of a hall.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct HallSeen {
    /// `SITE.HALL`.
    pub(super) name: String,
    /// How old that is, s; null if nothing is known.
    pub(super) age_s: Option<f64>,
    /// True if nothing was heard of it for 1.5 s.
    pub(super) silent: bool,
    /// Its last status; null if nothing is known.
    pub(super) status: Option<BriefStatus>,
}

/// The halls of a desk, and when each was heard last.
pub(super) struct Halls {
    seen: BTreeMap<String, (BriefStatus, MonoTime)>,
    kept: BTreeMap<String, Kept>,
    names: Vec<String>,
}

/// A status that the engine has kept, with how long ago that was so when it was asked.
pub(super) type Kept = (BriefStatus, Duration, MonoTime);

pub(super) fn status(args: &StatusArgs) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let mut halls = Halls::of(&settings);
        let mut heard = client.subscribe(fleet::status_of("*.*")).await.or_exit(Exit::Unavailable)?;
        let until = Instant::now() + LISTEN;
        // What the engine keeps is for those who are silent; without it the others are shown as well.
        let lack = halls.look_up_kept(&client, &mut heard).await;
        halls.listen(&mut heard, until).await;
        let table = halls.table(Monotonic.now());
        if args.json {
            print::json(&table)?;
        } else {
            print::out(&drawn(&table))?;
        }
        let is_silent = table.iter().any(|hall| hall.silent);
        match lack?.filter(|_| is_silent) {
            Some(why) => Err(why).or_exit(Exit::Unavailable),
            None if is_silent => Ok(Exit::TryAgain),
            None => Ok(Exit::Done),
        }
    })
}

pub(super) fn watch(args: &WatchArgs) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let mut halls = Halls::of(&settings);
        let mut heard = client.subscribe(fleet::status_of("*.*")).await.or_exit(Exit::Unavailable)?;
        let _ = halls.look_up_kept(&client, &mut heard).await;
        tokio::select! {
            shown = show(&mut halls, &mut heard, args.json) => shown,
            _ = tokio::signal::ctrl_c() => Ok(Exit::Done),
        }
    })
}

/// Shows halls as they tell of themselves.
async fn show(halls: &mut Halls, heard: &mut Subscriber, json: bool) -> Result<Exit, Failure> {
    let mut lines = BTreeMap::new();
    loop {
        if json {
            let Some(message) = heard.next().await else { return Ok(Exit::Unavailable) };
            if let Some(name) = halls.hear(&message) {
                print::json_text(&serde_json::to_string(&halls.one(&name, Monotonic.now())).expect("text"))?;
            }
            continue;
        }
        halls.listen(heard, Instant::now() + DRAW).await;
        let table = halls.table(Monotonic.now());
        if stdout().is_terminal() {
            print::data("\x1b[H\x1b[2J")?;
            print::out(&drawn(&table))?;
            continue;
        }
        for hall in &table {
            let line = format!("{}: {}", hall.name, hall.line());
            if lines.insert(hall.name.clone(), line.clone()).as_ref() != Some(&line) {
                print::out(&format!("{line}\n"))?;
            }
        }
    }
}

impl Halls {
    pub(super) fn of(settings: &DeskSettings) -> Self {
        Self { seen: BTreeMap::new(), kept: BTreeMap::new(), names: settings.halls.clone() }
    }

    /// Takes in a status; says whose it is. The engine answers to whatever subject it is asked to answer to, so that the key of one hall
    /// could have it speak for another: such an answer has headers, or is no status.
    pub(super) fn hear(&mut self, message: &Message) -> Option<String> {
        let name = message.subject.strip_prefix("kc.status.")?;
        let status = told(&message.payload)?;
        if message.headers.is_some() || status.format == 0 {
            return None;
        }
        self.seen.insert(name.to_owned(), (status, Monotonic.now()));
        Some(name.to_owned())
    }

    async fn listen(&mut self, heard: &mut Subscriber, until: Instant) {
        while let Ok(message) = timeout_at(until, heard.next()).await {
            match message {
                Some(message) => drop(self.hear(&message)),
                None => sleep_until(until).await, // the engine is gone for good
            }
        }
    }

    /// Takes in what the engine has kept; says why it is not all of it.
    pub(super) fn take(&mut self, KeptHalls { of, lack }: KeptHalls) -> Option<anyhow::Error> {
        self.kept.extend(of);
        lack
    }

    /// Asks the engine for the last status of each hall of the desk; says why it did not tell all of them. Halls are heard meanwhile: an
    /// engine may take its time, and what waited would look new.
    async fn look_up_kept(
        &mut self,
        client: &Client,
        heard: &mut Subscriber,
    ) -> Result<Option<anyhow::Error>, Failure> {
        let names = self.names.clone();
        let mut kept = pin!(kept_of(client, &names));
        loop {
            tokio::select! {
                kept = &mut kept => return Ok(self.take(kept?)),
                () = self.listen(heard, Instant::now() + DRAW) => {}
            }
        }
    }

    /// What is known of one.
    fn one(&self, name: &str, now: MonoTime) -> HallSeen {
        let heard = self.seen.get(name).map(|(status, at)| (status, now.since(*at)));
        let kept = || self.kept.get(name).map(|(status, age, at)| (status, *age + now.since(*at)));
        let silent = heard.as_ref().is_none_or(|(_, age)| *age > SILENT);
        let known = heard.or_else(kept);
        HallSeen {
            name: name.to_owned(),
            age_s: known.as_ref().map(|(_, age)| age.as_secs_f64()),
            silent,
            status: known.map(|(status, _)| status.clone()),
        }
    }

    /// All halls of the desk, and others that were heard, worst first.
    pub(super) fn table(&self, now: MonoTime) -> Vec<HallSeen> {
        let others = self.seen.keys().filter(|name| !self.names.contains(name));
        let mut table: Vec<_> = self.names.iter().chain(others).map(|name| self.one(name, now)).collect();
        table.sort_by(|a, b| a.rank().cmp(&b.rank()).then_with(|| a.name.cmp(&b.name)));
        table
    }
}

/// Asks the engine for what it has kept of halls, so many at a time: all of thousands at once would be late.
pub(super) async fn kept_of(client: &Client, names: &[String]) -> Result<KeptHalls, Failure> {
    let kept = &engine::kept(client);
    engine::prepare(kept).await?;
    let ask = |name: String| async move {
        let seen = kept_of_one(kept, &name).await.with_context(|| name.clone());
        (name, seen)
    };
    let mut told = pin!(stream::iter(names.to_vec()).map(ask).buffer_unordered(engine::AT_ONCE));
    let until = Instant::now() + LOOKED_UP;
    let mut all = KeptHalls { of: BTreeMap::new(), lack: None };
    loop {
        match timeout_at(until, told.next()).await {
            Ok(Some((name, Ok(Some(seen))))) => drop(all.of.insert(name, seen)),
            Ok(Some((_, Ok(None)))) => {}
            Ok(Some((_, Err(why)))) => all.lack = Some(why),
            Ok(None) => return Ok(all),
            Err(_) => {
                let why = anyhow!("the engine did not say within {} s what it has", LOOKED_UP.as_secs());
                return Ok(KeptHalls { lack: Some(why), ..all });
            }
        }
    }
}

async fn kept_of_one(kept: &Context, name: &str) -> anyhow::Result<Option<Kept>> {
    let entry = engine::last_value(kept, fleet::SEEN, name).await?;
    let entry = entry.filter(|entry| !engine::is_answered(entry));
    Ok(entry.and_then(|entry| {
        let status = told(&entry.payload)?;
        Some((status, engine::age_of(&entry), Monotonic.now()))
    }))
}

impl HallSeen {
    /// How much it needs a person: 0 most.
    pub(super) fn rank(&self) -> u8 {
        let Some(status) = self.status.as_ref().filter(|_| !self.silent) else { return 0 };
        let gravest = status.warnings.iter().map(|warning| warning.severity).max();
        match status.state.to_string().as_str() {
            "fault" => 1,
            "stopped" | "stopping" => 2,
            _ if status.seats.lost > 0 || gravest == Some(Severity::Error) => 3,
            "boot" | "recovering" => 4,
            _ if gravest == Some(Severity::Warning) => 5,
            _ => 6,
        }
    }

    /// How it is, in a line without times.
    fn line(&self) -> String {
        let Some(status) = &self.status else { return "never heard".to_owned() };
        let silent = if self.silent { "silent; it was " } else { "" };
        let show = status.show.as_ref().map_or_else(String::new, |show| format!(", {}", show.cue));
        let lost =
            if status.seats.lost > 0 { format!(", {} seats lost", status.seats.lost) } else { String::new() };
        said(&format!("{silent}{}: {}{show}{lost}", status.state, status.cause))
    }
}

/// The table as people read it.
fn drawn(halls: &[HallSeen]) -> String {
    let header = ["hall", "state", "show", "level", "seats", "what to know", "age"];
    table::table(header, halls.iter().map(row))
}

fn row(hall: &HallSeen) -> [String; 7] {
    let age = hall.age_s.map_or_else(|| "-".to_owned(), age);
    let Some(status) = &hall.status else {
        return [&hall.name, "silent", "", "", "", "never heard; check its link and the engine", &age]
            .map(str::to_owned);
    };
    let show = status.show.as_ref().map_or_else(String::new, |show| {
        format!("{} {:.0} of {:.0} s", show.cue, show.position_s, show.length_s)
    });
    let seats = format!("{} of {}", status.seats.taking_part, status.seats.total);
    let state = if hall.silent { format!("silent, was {}", status.state) } else { status.state.to_string() };
    let know = match status.warnings.first() {
        _ if hall.silent => "not heard now; it may play on. Check its link and the network".to_owned(),
        Some(warning) if warning.severity > Severity::Info => {
            let more = status.warnings_total.saturating_sub(1);
            let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
            format!("{}{more}", warning.said())
        }
        _ => format!("{}; next: {}", status.cause, status.next),
    };
    let level = format!("{:.0} %", status.level * 100.0);
    [&hall.name, &state, &show, &level, &seats, &know, &age].map(|text| said(text))
}

/// The status that a hall tells, which may be whoever has its key: what enters here is short and plain wherever it goes on to.
fn told(payload: &[u8]) -> Option<BriefStatus> {
    let status = json::clipped(serde_json::from_slice(payload).ok()?, TEXT, ITEMS);
    serde_json::from_value(status).ok()
}

/// What a hall says, in one line of bearable length, whatever it says.
pub(super) fn said(text: &str) -> String {
    plain::escaped(text, TEXT).into_owned()
}

/// An age as a person reads it.
pub(super) fn age(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Warning;
    use crate::state::State;

    fn seen(name: &str, state: State, lost: usize, age_s: f64) -> HallSeen {
        let mut status = BriefStatus { state: state.into(), ..BriefStatus::default() };
        status.seats.lost = lost;
        HallSeen { name: name.to_owned(), age_s: Some(age_s), silent: age_s > 1.5, status: Some(status) }
    }

    #[test]
    fn the_hall_that_needs_a_person_most_is_first_and_a_silent_one_before_all() {
        let halls = [
            seen("a", State::Parked, 0, 0.2),
            seen("b", State::Stopped, 0, 0.2),
            seen("c", State::Parked, 2, 0.2),
            seen("d", State::Fault, 0, 0.2),
            seen("e", State::Parked, 0, 60.0),
            seen("f", State::Recovering, 0, 0.2),
            HallSeen { name: "g".to_owned(), silent: true, ..HallSeen::default() },
        ];
        let ranks = halls.each_ref().map(HallSeen::rank);
        assert_eq!(ranks, [6, 2, 3, 1, 0, 4, 0]);
        let text = drawn(&halls);
        assert!(text.contains("silent, was parked") && text.contains("never heard"), "{text}");
        assert!(halls[4].line().starts_with("silent; it was parked"));
    }

    #[test]
    fn a_hall_that_is_not_heard_meanwhile_falls_silent() {
        let (status, at) = (seen("a", State::Parked, 0, 0.0).status.unwrap(), MonoTime::from_nanos(1_000));
        let seen = BTreeMap::from([("a".to_owned(), (status, at))]);
        let halls = Halls { seen, kept: BTreeMap::new(), names: vec!["a".to_owned()] };
        let hall = |age_ms| halls.table(at + Duration::from_millis(age_ms)).remove(0);
        assert!(!hall(1_400).silent);
        let later = hall(2_200);
        assert!(
            later.silent && later.rank() == 0 && later.age_s.is_some_and(|age_s| age_s > 2.1),
            "{later:?}"
        );
    }

    #[test]
    fn the_gravest_warning_is_told_and_how_many_there_are_beside_it() {
        let mut hall = seen("a", State::Parked, 0, 0.2);
        let warning = Warning { severity: Severity::Error, text: "no room".to_owned(), ..Warning::default() };
        let status = hall.status.as_mut().unwrap();
        (status.warnings, status.warnings_total) = (vec![warning], 4);
        assert_eq!(hall.rank(), 3);
        assert!(row(&hall)[5].ends_with("no room (and 3 more)"), "{:?}", row(&hall));
    }

    #[test]
    fn whatever_a_hall_says_is_one_short_line_and_speaks_for_no_other_hall() {
        let mut hall = seen("a", State::Parked, 0, 0.2);
        let long = "x".repeat(100_000);
        hall.status.as_mut().unwrap().cause = format!("ok\nb: parked: ok\x1b[2J{long}");
        assert_eq!(hall.line().lines().count(), 1);
        let text = drawn(std::slice::from_ref(&hall));
        assert!(text.lines().count() == 3 && text.len() < 10 * TEXT && !text.contains('\x1b'), "{text}");
    }

    #[test]
    fn whatever_the_key_of_a_hall_tells_as_its_status_is_short_and_plain_in_json_and_figures_as_well() {
        let long = "x".repeat(500_000);
        let warning = serde_json::json!({ "text": long, "id": "a\nb", "remedy": "\x1b[2J" });
        let status = serde_json::json!({ "format": 1, "state": long, "cause": "ok\nb: parked", "hall": "\u{202e}h", "version": long,
            "show": { "cue": long }, "warnings": vec![warning; 1_000], "seats": { "lost": 1 } });
        let status = told(status.to_string().as_bytes()).expect("it is a status");
        let json = serde_json::to_string(&status).unwrap();
        assert!(json.len() < 200_000 && !json.contains('\u{202e}'), "{} bytes", json.len());
        assert_eq!((status.seats.lost, status.cause.as_str()), (1, "ok\\nb: parked"));
        let hall = crate::metrics::halls::HallFigures {
            name: "a.h1".to_owned(),
            age_s: Some(0.1),
            silent: false,
            status: Some(status),
        };
        let figures =
            crate::metrics::halls::FleetFigures { engine: true, halls: vec![hall], stops: BTreeMap::new() };
        let page = figures.render();
        assert!(page.contains("state=\"other\"") && page.len() < 4_000, "{} bytes", page.len());
    }

    #[test]
    fn an_age_is_as_coarse_as_it_is_old() {
        assert_eq!([0.24, 59.6, 600.0, 86_400.0].map(age), ["0.2 s", "60 s", "10 min", "24 h"]);
    }
}
