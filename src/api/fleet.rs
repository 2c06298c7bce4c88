//! The fleet socket: how the hall is, what it played, and signed letters in. The process at the other end carries them and has no say:
//! a letter counts for whose key has signed it. That is checked here, where the keys are configured, and not by who carries it: it is
//! what others reach over the network, and may be taken over without a seat more in danger.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use axum::Json as JsonReply;
use axum::extract::State;
use axum::response::{IntoResponse as _, Response};
use jiff::Zoned;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::fleet_pull::{self, PullArgs};
use super::input::{Json, id};
use super::problem::bad_value;
use super::settings::{Trim, check_levels};
use super::shared::{Shared, turn};
use super::show::Load;
use super::status::check_pulse;
use crate::config;
use crate::control::{
    ClockReading, Code, Command, HallFacts, LevelsChange, PreflightStatus, Problem, StartOrder,
};
use crate::fleet::{BriefStatus, Letter, Order};
use crate::journal::{self, JournalPart, TOLD_AT_ONCE, Told, stamp};
use crate::library::CueId;
use crate::sys::clock::{Monotonic, wall_at, wall_now_ns};
use crate::time::Clock as _;

/// The longest ticket of a start.
const LONGEST_TICKET: usize = 64;

/// What a letter asks.
#[derive(Debug, PartialEq)]
enum FleetAsk {
    /// How the hall is, for a start; nothing is done for that.
    Ready,
    /// A piece of a cue, which is not done either.
    Piece(CueId, u64),
    /// Something that is done.
    Of(Command),
}

fn asks(order: &Order) -> Result<FleetAsk, Problem> {
    if order.word == "ready" {
        return args::<Nothing>(order).map(|_| FleetAsk::Ready);
    }
    if order.word == "pull" {
        let PullArgs { cue, n } = args(order)?;
        return Ok(FleetAsk::Piece(id(&cue)?, n));
    }
    command(order).map(FleetAsk::Of)
}

/// A start of several halls.
fn start(order: &Order) -> Result<Command, Problem> {
    let start: StartOrder = args(order)?;
    let is_digest = start.sha256.len() == 64 && start.sha256.bytes().all(|octet| octet.is_ascii_hexdigit());
    if !config::is_fleet_id(&start.group) || !is_digest {
        let detail = format!("{:?} with {:?} is no group and no SHA-256", start.group, start.sha256);
        return Err(bad_value(detail, "docs/fleet.md has what belongs to each word"));
    }
    check_ticket(&start.ticket)?;
    Ok(Command::StartAt(start))
}

fn check_ticket(ticket: &str) -> Result<(), Problem> {
    if ticket.is_empty() || ticket.len() > LONGEST_TICKET || !ticket.bytes().all(|c| c.is_ascii_graphic()) {
        let detail = format!("{ticket:?} is no ticket of 1 to {LONGEST_TICKET} characters of ASCII");
        return Err(bad_value(detail, "give another"));
    }
    Ok(())
}

/// Which start is to come.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Commit {
    ticket: String,
}

/// What an order asks. Of the words of the hall those that the fleet may ever ask are read; which of them it may, is asked where
/// the state is known.
fn command(order: &Order) -> Result<Command, Problem> {
    let none = || args::<Nothing>(order).map(drop);
    Ok(match order.word.as_str() {
        "pause" => none().map(|()| Command::Pause)?,
        "park" => none().map(|()| Command::Park)?,
        "disarm" => none().map(|()| Command::Disarm)?,
        "load" => Command::Load { cue: id(&args::<Load>(order)?.cue)?.to_string() },
        "levels" => {
            let change: LevelsChange = args(order)?;
            check_levels(&change)?;
            Command::Levels(change)
        }
        "trim" => args::<Trim>(order)?.command()?,
        "preflight" => none().map(|()| Command::Preflight)?,
        "start" => start(order)?,
        "commit" => {
            let Commit { ticket } = args(order)?;
            check_ticket(&ticket)?;
            Command::Commit { ticket }
        }
        word => {
            let is_order = |word: &config::FleetWord| {
                *word != config::FleetWord::Pull && !config::FleetWord::OF_WISHES.contains(word)
            };
            let asked = config::FleetWord::ALL.iter().filter(|(_, word)| is_order(word));
            let words = asked.map(|(word, _)| *word).collect::<Vec<_>>().join(", ");
            let detail = format!(
                "the fleet may not {word:?}; it may ask {words}, ready, pull, start and commit, and a stop by its own way"
            );
            return Err(Problem::new(Code::Role, detail, "ask somebody in the hall"));
        }
    })
}

/// No arguments.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Nothing {}

fn args<T: DeserializeOwned>(order: &Order) -> Result<T, Problem> {
    let args = if order.args.is_null() { Value::Object(Default::default()) } else { order.args.clone() };
    serde_json::from_value(args).map_err(|error| {
        bad_value(format!("{}: {error}", order.word), "docs/fleet.md has what belongs to each word")
    })
}

/// Takes a letter apart, whoever has signed it.
#[cfg(feature = "harness")]
pub(crate) fn try_letter(text: &str) {
    if let Ok(letter) = serde_json::from_str::<Letter>(text) {
        let order = Order::of(&letter);
        drop(std::hint::black_box((letter.is_signed(), order.map(|order| asks(&order)))));
    }
}

/// What comes of letters in a hall, one after the other.
#[cfg(test)]
pub(crate) struct Letterbox(super::fleet_access::FleetAccess);

#[cfg(test)]
impl Letterbox {
    /// Of that fleet.
    pub(crate) fn of(fleet: &config::Fleet) -> Self {
        Self(super::fleet_access::FleetAccess::of(Some(fleet)))
    }

    /// Who asks what by it; nothing by one that only looks.
    pub(crate) fn open(
        &self,
        letter: &Letter,
        now: &crate::time::WallAt,
    ) -> Result<(crate::control::Who, Option<Command>), Problem> {
        let (who, ask, _) = self.0.open(letter, asks, now.wall_ns, now.at)?;
        Ok((who, if let FleetAsk::Of(ask) = ask { Some(ask) } else { None }))
    }
}

/// Opens a letter of a key that the hall has, with any text: what is taken is one of the few words of the fleet, and is so once.
#[cfg(feature = "harness")]
pub(crate) fn try_order(text: &str) {
    use nkeys::{KeyPair, KeyPairType};
    let pair = KeyPair::new_from_raw(KeyPairType::Service, [7; 32]).expect("any 32 octets are a key");
    let key = config::FleetKey {
        name: "office".to_owned(),
        role: config::Role::Operate,
        public: pair.public_key(),
    };
    let fleet = config::Fleet {
        name: "berlin.h3".to_owned(),
        allow: Vec::new(),
        start: false,
        start_bound: std::time::Duration::from_millis(2),
        keys: vec![key],
    };
    let access = super::FleetAccess::of(Some(&fleet));
    let letter = Letter::sign(&pair, text.to_owned()).expect("the key has both halves");
    assert!(letter.is_signed());
    let now = Monotonic.now();
    let open = |letter: &Letter| access.open(letter, command, 2_000_000_000, now);
    let Ok((who, ask, _)) = open(&letter) else { return };
    assert!(ask.fleet_word().is_some() && ask.least_role() <= who.role, "{ask:?}");
    assert!(open(&letter).is_err(), "it came before");
    let other = config::Fleet { keys: Vec::new(), ..fleet };
    access.set(Some(&other));
    assert!(open(&letter).is_err(), "its key was taken away");
}

/// How the hall is, in short; 503 where nothing new of it was heard for two seconds.
pub(super) async fn status(State(shared): State<Arc<Shared>>) -> Result<JsonReply<BriefStatus>, Problem> {
    check_pulse(&shared)?;
    Ok(JsonReply(BriefStatus::of(&shared.handle.status(), stamp(&Zoned::now()))))
}

/// Takes a signed order, and replies with the state that it led to; `ready` with the brief status, `pull` with a piece of a cue.
pub(super) async fn order(
    State(shared): State<Arc<Shared>>,
    Json(letter): Json<Letter>,
) -> Result<Response, Problem> {
    let (who, ask, asked_at) = shared.fleet.open(&letter, asks, wall_now_ns(), Monotonic.now())?;
    let ask = match ask {
        FleetAsk::Ready => return status(State(shared)).await.map(JsonReply::into_response),
        FleetAsk::Piece(id, n) => {
            return fleet_pull::piece(&shared, &who, id, n)
                .await
                .map(|piece| JsonReply(piece).into_response());
        }
        FleetAsk::Of(ask) => ask,
    };
    let is_preflight = ask == Command::Preflight;
    let status = shared.handle.post_asked(who, ask, asked_at)?.answer().await?;
    match &status.preflight {
        Some(found) if is_preflight && !found.passed => Err(unfit(found)),
        _ => Ok(JsonReply(HallFacts::from(&*status)).into_response()),
    }
}

/// What came of a preflight that failed, for whoever does not see the findings: the gravest of them.
fn unfit(found: &PreflightStatus) -> Problem {
    let PreflightStatus { answered, findings, .. } = found;
    let mut detail = format!("the hall does not pass preflight, {answered} controllers answered");
    let mut remedy = "ask somebody in the hall to look at its preflight";
    if let Some(gravest) = findings.first() {
        let who = gravest.controller.as_deref().unwrap_or("the hall");
        let _ = write!(detail, ": {who}: {} ({} findings)", gravest.text, findings.len()); // a String takes it
        remedy = &gravest.remedy;
    }
    Problem::new(Code::Check, detail, remedy)
}

/// How far the wall clock of this machine was found ahead of a time server's.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Clock {
    server: String,
    offset_ns: i64,
    trip_ns: u64,
    /// How long ago.
    age_ms: u64,
}

/// Takes what the link has measured. It is believed as the link is: who has taken that over can only have films begin apart.
pub(super) async fn clock(
    State(shared): State<Arc<Shared>>,
    Json(Clock { server, offset_ns, trip_ns, age_ms }): Json<Clock>,
) -> Result<JsonReply<Value>, Problem> {
    let age = Duration::from_millis(age_ms);
    let reading = ClockReading::of(server, offset_ns, trip_ns, age, &wall_at());
    let reading = reading.map_err(|why| bad_value(why, "measure it anew"))?;
    shared.handle.clock().set(reading);
    Ok(JsonReply(Value::Object(Default::default())))
}

/// What the journal says of shows beyond that.
pub(super) async fn journal(
    State(shared): State<Arc<Shared>>,
    Json(told): Json<Told>,
) -> Result<JsonReply<Vec<JournalPart>>, Problem> {
    let turn = turn(&shared.reports, "a report").await?;
    let dir = shared.journal.clone();
    let parts = shared.blocking(move || {
        let _turn = turn;
        Ok(journal::tail(&dir, &told, TOLD_AT_ONCE)?)
    });
    parts.await.map(JsonReply)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Warning;

    #[test]
    fn words_are_read_with_what_belongs_to_them_and_no_others_at_all() {
        let ask = |word: &str, args: &str| {
            let (id, to) = ("1".to_owned(), "berlin.h3".to_owned());
            let args = serde_json::from_str(args).unwrap();
            command(&Order { id, to, word: word.to_owned(), args, sent_ms: 0 })
                .map_err(|problem| problem.code)
        };
        assert_eq!(ask("load", "{\"cue\":\"storm\"}"), Ok(Command::Load { cue: "storm".to_owned() }));
        assert_eq!(ask("trim", "{\"offset_s\":0.08}"), Ok(Command::Trim(80)));
        assert_eq!(ask("preflight", "{}"), Ok(Command::Preflight));
        let half = LevelsChange { motion: Some(0.5), ..LevelsChange::default() };
        assert_eq!(ask("levels", "{\"motion\":0.5}"), Ok(Command::Levels(half)));
        assert_eq!(ask("park", "null"), Ok(Command::Park));
        let digest = "0f".repeat(32);
        let start = |group: &str, sha256: &str, ticket: &str| {
            format!("{{\"ticket\":\"{ticket}\",\"group\":\"{group}\",\"sha256\":\"{sha256}\",\"at_ms\":5}}")
        };
        let (group, sha256, ticket) = ("trio".to_owned(), digest.clone(), "t1".to_owned());
        let order = StartOrder { ticket, group, sha256, at_ms: 5 };
        assert_eq!(ask("start", &start("trio", &digest, "t1")), Ok(Command::StartAt(order)));
        assert_eq!(ask("commit", "{\"ticket\":\"t1\"}"), Ok(Command::Commit { ticket: "t1".to_owned() }));
        for args in [
            start("Trio", &digest, "t1"),
            start("trio", &digest[1..], "t1"),
            start("trio", &digest.replace('f', "g"), "t1"),
            start("trio", &digest, ""),
            start("trio", &digest, "a b"),
            "{}".to_owned(),
        ] {
            assert_eq!(ask("start", &args), Err(Code::Value), "{args}");
        }
        assert_eq!(ask("commit", "{\"ticket\":\"\"}"), Err(Code::Value));
        for (word, args) in [
            ("load", "{}"),
            ("load", "{\"cue\":\"../x\"}"),
            ("levels", "{\"motion\":1.5}"),
            ("levels", "{\"motion\":0.5,\"seat\":1}"),
            ("trim", "{\"offset_s\":9}"),
            ("pause", "{\"position_s\":1}"),
            ("pause", "[1]"),
        ] {
            assert_eq!(ask(word, args), Err(Code::Value), "{word} {args}");
        }
        for word in [
            "arm", "home", "clear", "go", "resume", "seek", "enable", "disable", "test", "reload",
            "playlist", "", "Pause",
        ] {
            assert_eq!(ask(word, "{}"), Err(Code::Role), "{word}");
        }
    }

    #[test]
    fn a_preflight_that_fails_is_told_by_the_gravest_of_its_findings() {
        let one = |who: &str, text: &str| Warning {
            controller: Some(who.to_owned()),
            text: text.to_owned(),
            remedy: format!("look at {who}"),
            ..Warning::default()
        };
        let findings = vec![one("A2", "it does not answer"), one("A1", "it is warm")];
        let found = PreflightStatus { passed: false, age_s: 0.0, answered: 1, findings };
        let told = unfit(&found).to_string();
        let detail =
            "the hall does not pass preflight, 1 controllers answered: A2: it does not answer (2 findings)";
        assert_eq!(told, format!("{detail}; look at A2"));
    }
}
