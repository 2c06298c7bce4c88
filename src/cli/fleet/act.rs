//! `kinocue fleet stop`, `pause`, `park`, `disarm`, `level`, `trim`, `load` and `preflight`: asked of all chosen halls at once, a line for each.

use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::connection::State as EngineState;
use async_nats::{Client, StatusCode};
use futures_util::StreamExt as _;
use futures_util::future::join_all;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::{Instant, sleep, timeout_at};

use super::desk::said;
use super::settings::DeskSettings;
use super::{DeskArgs, engine, settings};
use crate::cli::client::ServiceProblem;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::parse_level;
use crate::control::HallFacts;
use crate::fleet::{self, Letter, Order};
use crate::sys::clock::wall_now_ns;
use crate::time::parse_trim;

/// How long a hall may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);
/// The same where it reads and proves a cue, or asks its controllers.
const LONG: Duration = Duration::from_secs(70);
/// How often it is looked whether the engine is there.
const LOOK: Duration = Duration::from_millis(20);
/// The status by which a link says that nobody behind it has taken what was asked, the one for a hall that had it and came to nothing, and
/// the one for a hall that is still at it, whose answer is yet to come.
pub(super) const AWAY: u16 = 502;
pub(super) const UNANSWERED: u16 = 503;
pub(super) const AT_IT: u16 = 102;
/// A hall that has something is heard to be at it after so long: well before [`PATIENCE`] is over.
pub(super) const AT_IT_AFTER: Duration = Duration::from_secs(1);

/// Brings the seats of halls to rest at once.
///
/// All halls of the desk where none is named. Not a safety device: the emergency stop is hard-wired, and a network may be down. A stop
/// latches until somebody in the hall clears it.
#[derive(Debug, clap::Args)]
pub(super) struct StopArgs {
    #[command(flatten)]
    of: HallsOrAllArgs,
}

// The halls that are asked, all where none is named. No documentation: clap would show it as the help of commands.
#[derive(Debug, clap::Args)]
pub(super) struct HallsOrAllArgs {
    #[command(flatten)]
    pub(super) desk: DeskArgs,
    /// Halls: SITE.HALL, SITE.*, or all.
    #[arg(value_name = "HALL", default_value = "all")]
    pub(super) halls: Vec<String>,
    /// Print JSON: an array with an object for each hall.
    #[arg(long)]
    pub(super) json: bool,
}

// The halls that are asked, each named. No documentation: clap would show it as the help of commands.
#[derive(Debug, clap::Args)]
struct HallArgs {
    #[command(flatten)]
    desk: DeskArgs,
    /// Halls: SITE.HALL, SITE.*, or all.
    #[arg(value_name = "HALL", required = true)]
    halls: Vec<String>,
    /// Print JSON: an array with an object for each hall.
    #[arg(long)]
    json: bool,
}

/// Holds the shows of halls that allow it (pause).
///
/// Somebody in the hall resumes.
#[derive(Debug, clap::Args)]
pub(super) struct PauseArgs {
    #[command(flatten)]
    of: HallArgs,
}

/// Ends the shows of halls that allow it (park).
///
/// The seats park. A hall whose seats nobody there has armed does not: somebody may stand beside one.
#[derive(Debug, clap::Args)]
pub(super) struct ParkArgs {
    #[command(flatten)]
    of: HallArgs,
}

/// Has halls that allow it (disarm) stand down.
#[derive(Debug, clap::Args)]
pub(super) struct DisarmArgs {
    #[command(flatten)]
    of: HallArgs,
}

/// Sets the level of the motion in halls that allow it (levels), no higher than a person there has set.
#[derive(Debug, clap::Args)]
pub(super) struct LevelArgs {
    /// The level, as 60%, 0.6 or -6dB.
    #[arg(value_parser = parse_level, allow_hyphen_values = true)]
    level: f64,
    #[command(flatten)]
    of: HallArgs,
}

/// Has the motion in halls that allow it (trim) be later than the film, or earlier.
#[derive(Debug, clap::Args)]
pub(super) struct HallTrimArgs {
    /// -500ms to 500ms: positive makes the motion later than the film, negative earlier.
    #[arg(value_parser = parse_trim, allow_hyphen_values = true)]
    trim: i32,
    #[command(flatten)]
    of: HallArgs,
}

/// Has halls that allow it (preflight) check their controllers; nothing moves.
///
/// A hall whose preflight fails counts as one that refuses; what was found is on its console.
#[derive(Debug, clap::Args)]
pub(super) struct PreflightArgs {
    #[command(flatten)]
    of: HallArgs,
}

/// Loads a cue of their own libraries in halls that allow it (load) and are parked.
#[derive(Debug, clap::Args)]
pub(super) struct LoadArgs {
    /// The id of the cue.
    cue: String,
    #[command(flatten)]
    of: HallArgs,
}

/// What is asked of halls.
pub(super) struct Asked {
    pub(super) word: &'static str,
    pub(super) args: Value,
    pub(super) patience: Duration,
}

/// A stop.
pub(super) const STOP: Asked = Asked { word: "stop", args: Value::Null, patience: PATIENCE };

/// What a hall's link answers.
#[derive(Debug, Deserialize)]
pub(super) struct LinkReply {
    hall: String,
    status: u16,
    pub(super) reply: Value,
}

/// What came of it in a hall.
#[derive(Debug)]
pub(super) enum Answer {
    Done(String),
    Refused(String),
    /// It did not come to that, in words.
    Left(String),
    /// Nobody answered, in words.
    Silent(String),
}

pub(super) fn stop(args: &StopArgs) -> Result<Exit, Failure> {
    let HallsOrAllArgs { desk, halls, json } = &args.of;
    ask_all(&settings::desk(&desk.desk)?, halls, &STOP, *json)
}

pub(super) fn pause(args: &PauseArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "pause", args: json!({}), patience: PATIENCE })
}

pub(super) fn park(args: &ParkArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "park", args: json!({}), patience: PATIENCE })
}

pub(super) fn disarm(args: &DisarmArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "disarm", args: json!({}), patience: PATIENCE })
}

pub(super) fn level(args: &LevelArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "levels", args: json!({ "motion": args.level }), patience: PATIENCE })
}

pub(super) fn trim(args: &HallTrimArgs) -> Result<Exit, Failure> {
    let offset_s = f64::from(args.trim) / 1e3;
    ask(&args.of, Asked { word: "trim", args: json!({ "offset_s": offset_s }), patience: PATIENCE })
}

pub(super) fn preflight(args: &PreflightArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "preflight", args: json!({}), patience: LONG })
}

pub(super) fn load(args: &LoadArgs) -> Result<Exit, Failure> {
    ask(&args.of, Asked { word: "load", args: json!({ "cue": args.cue }), patience: LONG })
}

fn ask(of: &HallArgs, asked: Asked) -> Result<Exit, Failure> {
    ask_all(&settings::desk(&of.desk.desk)?, &of.halls, &asked, of.json)
}

/// Asks all of them at once, and says what came of it in each.
fn ask_all(settings: &DeskSettings, halls: &[String], asked: &Asked, json: bool) -> Result<Exit, Failure> {
    // A name that is spelled wrongly must not keep the others from being stopped.
    let (halls, unknown) = match asked.word {
        "stop" => known(&settings.halls, halls)?,
        _ => (chosen(&settings.halls, halls)?, Vec::new()),
    };
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let answers = join_all(halls.iter().map(|hall| ask_one(settings, &client, hall, asked))).await;
        let answers: Vec<_> = halls.into_iter().zip(answers).collect();
        if json {
            let all: Vec<_> = answers.iter().map(|(hall, answer)| answer.json(hall)).collect();
            print::json(&all)?;
        } else {
            let lines: String =
                answers.iter().map(|(hall, answer)| format!("{hall}: {}\n", said(&answer.line()))).collect();
            print::out(&lines)?;
        }
        chosen(&settings.halls, &unknown)?;
        Ok(exit(answers.iter().map(|(_, answer)| answer)))
    })
}

/// The halls of a desk among those that are meant, and what is none.
///
/// # Errors
/// Where none is one.
pub(super) fn known(all: &[String], meant: &[String]) -> Result<(Vec<String>, Vec<String>), Failure> {
    let is_known = |one: &String| chosen(all, std::slice::from_ref(one)).is_ok();
    let (known, unknown): (Vec<_>, Vec<_>) = meant.iter().cloned().partition(is_known);
    if known.is_empty() {
        return chosen(all, meant).map(|halls| (halls, unknown));
    }
    Ok((chosen(all, &known)?, unknown))
}

/// How it ends: what is most to worry about decides.
pub(super) fn exit<'a>(answers: impl Iterator<Item = &'a Answer> + Clone) -> Exit {
    if answers.clone().any(|answer| matches!(answer, Answer::Silent(_))) {
        Exit::TryAgain
    } else if answers.clone().any(|answer| matches!(answer, Answer::Refused(_) | Answer::Left(_))) {
        Exit::CheckFailed
    } else {
        Exit::Done
    }
}

/// The halls of a desk that are meant.
pub(super) fn chosen(all: &[String], meant: &[String]) -> Result<Vec<String>, Failure> {
    let mut halls: Vec<String> = Vec::new();
    for one in meant {
        let site = one.strip_suffix(".*");
        let is_meant = |hall: &&String| match site {
            _ if one == fleet::ALL => true,
            Some(site) => hall.split_once('.').is_some_and(|(of, _)| of == site),
            None => *hall == one,
        };
        let found: Vec<_> = all.iter().filter(is_meant).cloned().collect();
        if found.is_empty() {
            let error = anyhow!("{one:?} is no hall of this desk; it has {}", all.join(", "));
            return Err(error).or_exit(Exit::NoInput);
        }
        halls.extend(found);
    }
    halls.sort_unstable();
    halls.dedup();
    Ok(halls)
}

pub(super) async fn ask_one(settings: &DeskSettings, client: &Client, hall: &str, asked: &Asked) -> Answer {
    match request(settings, client, hall, asked).await {
        Ok(_) if asked.word == "stop" => Answer::Done("stopping".to_owned()),
        Ok(LinkReply { reply, .. }) => {
            let facts: HallFacts = serde_json::from_value(reply).unwrap_or_default();
            Answer::Done(facts.line(None))
        }
        Err(answer) => answer,
    }
}

/// What a hall replies where it does it; else why not.
pub(super) async fn request(
    settings: &DeskSettings,
    client: &Client,
    hall: &str,
    asked: &Asked,
) -> Result<LinkReply, Answer> {
    let (subject, letter) = match asked.word {
        "stop" => (fleet::stop_to(hall, &settings.name), String::new()),
        word => match letter(settings, hall, asked) {
            Some(letter) => (fleet::command_to(hall, &settings.name, word), letter),
            None => return Err(Answer::Refused("the key of this desk cannot sign".to_owned())),
        },
    };
    let until = Instant::now() + asked.patience;
    // What is asked while the engine is away goes out once it is back: long after whoever asked was told that nobody has answered.
    if timeout_at(until, reached(client)).await.is_err() {
        return Err(Answer::Silent("not asked: the engine is away".to_owned()));
    }
    match answer_of(client, hall, subject, letter, until).await {
        Ok(Some(answer)) => Answer::of(answer),
        Ok(None) => Err(Answer::Silent(format!(
            "no answer within {} s; it may still take effect",
            asked.patience.as_secs()
        ))),
        Err(error) => Err(Answer::Silent(format!("{error:#}"))),
    }
}

/// Waits until the engine is there.
async fn reached(client: &Client) {
    while client.connection_state() != EngineState::Connected {
        sleep(LOOK).await;
    }
}

/// What the hall's own link answers; `None` where it does not until then. Others may answer as well, such as an engine that was told to
/// keep what is asked: that says nothing of the hall. The links of both show machines of a hall hear the same: that a service is down is the
/// answer only where no other one is at it. A service that had it and ended says that at once: no other one has it.
async fn answer_of(
    client: &Client,
    hall: &str,
    subject: String,
    letter: String,
    until: Instant,
) -> anyhow::Result<Option<LinkReply>> {
    let inbox = client.new_inbox();
    let asked = async {
        let answers = client.subscribe(inbox.clone()).await?;
        client.publish_with_reply(subject, inbox, letter.into()).await?;
        anyhow::Ok(answers)
    };
    let Ok(answers) = timeout_at(until, asked).await else { return Ok(None) };
    let mut answers = answers.context("not asked")?;
    let (mut away, mut is_at_it, mut wait) = (None, false, until);
    loop {
        let Ok(message) = timeout_at(wait, answers.next()).await else { return Ok(away) };
        let message = message.context("not asked: the engine is away")?;
        if message.status == Some(StatusCode::NO_RESPONDERS) {
            anyhow::bail!("nobody hears it there: its link or its network is down");
        }
        let answer = serde_json::from_slice::<LinkReply>(&message.payload).ok();
        match answer.filter(|answer| answer.hall == hall) {
            Some(answer) if answer.status == AWAY => {
                // If another machine has it, that one is heard by then.
                wait = if is_at_it { until } else { until.min(Instant::now() + PATIENCE) };
                away = Some(answer);
            }
            Some(answer) if answer.status == AT_IT => (is_at_it, wait) = (true, until),
            Some(answer) => return Ok(Some(answer)),
            None => {}
        }
    }
}

/// What is asked, signed now for that hall.
fn letter(settings: &DeskSettings, hall: &str, asked: &Asked) -> Option<String> {
    let order = Order {
        id: id(),
        to: hall.to_owned(),
        word: asked.word.to_owned(),
        args: asked.args.clone(),
        sent_ms: i64::try_from(wall_now_ns() / 1_000_000).unwrap_or(i64::MAX),
    };
    let letter = Letter::sign(&settings.letters, serde_json::to_string(&order).ok()?)?;
    serde_json::to_string(&letter).ok()
}

/// Like no other: a key that nobody has.
pub(super) fn id() -> String {
    nkeys::KeyPair::new_user().public_key()
}

impl Answer {
    /// What came of it, in a word of figures.
    pub(super) const fn result(&self) -> &'static str {
        match self {
            Self::Done(_) => "done",
            Self::Refused(_) => "refused",
            Self::Left(_) => "left",
            Self::Silent(_) => "silent",
        }
    }

    /// What a link's answer says, where the hall did it.
    fn of(answer: LinkReply) -> Result<LinkReply, Self> {
        if answer.status == 200 {
            return Ok(answer);
        }
        let text = serde_json::from_value::<ServiceProblem>(answer.reply).unwrap_or_default().line();
        // The link is there, and the hall behind it did not answer.
        Err(if matches!(answer.status, AWAY | UNANSWERED) { Self::Silent(text) } else { Self::Refused(text) })
    }

    pub(super) fn line(&self) -> String {
        match self {
            Self::Done(line) | Self::Left(line) | Self::Silent(line) => said(line),
            Self::Refused(why) => said(&format!("refused: {why}")),
        }
    }

    pub(super) fn json(&self, hall: &str) -> Value {
        let (answered, done) = (!matches!(self, Self::Silent(_)), matches!(self, Self::Done(_)));
        json!({ "hall": hall, "answered": answered, "done": done, "text": self.line() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halls_are_named_one_by_one_by_their_site_or_all_and_each_is_asked_once() {
        let all = ["berlin.h1", "berlin.h2", "bern.h1"].map(str::to_owned);
        let of = |meant: &[&str]| {
            let meant: Vec<_> = meant.iter().map(|&one| one.to_owned()).collect();
            chosen(&all, &meant).map_err(|failure| failure.exit)
        };
        assert_eq!(of(&["all"]).unwrap(), all);
        assert_eq!(of(&["berlin.*"]).unwrap(), all[..2]);
        assert_eq!(of(&["bern.h1", "bern.*"]).unwrap(), all[2..]);
        for nobody in ["ber.*", "berlin", "h1", "berlin.h3", "*"] {
            assert_eq!(of(&[nobody]), Err(Exit::NoInput), "{nobody}");
        }
        let meant = ["bern.h1", "berlin.h9"].map(str::to_owned);
        let (halls, unknown) = known(&all, &meant).unwrap();
        assert_eq!((&halls[..], &unknown[..]), (&all[2..], &meant[1..]));
        assert_eq!(known(&all, &meant[1..]).unwrap_err().exit, Exit::NoInput);
    }

    #[test]
    fn who_did_not_answer_decides_how_it_ends() {
        let answer = |status: u16| {
            let reply = json!({ "detail": "x", "remedy": "y" });
            let done = |_| Answer::Done("parked".to_owned());
            Answer::of(LinkReply { hall: "a.b".to_owned(), status, reply }).map_or_else(|answer| answer, done)
        };
        let of = |all: &[u16]| exit(all.iter().map(|&status| answer(status)).collect::<Vec<_>>().iter());
        assert_eq!(of(&[200, 200]), Exit::Done);
        assert_eq!(of(&[200, 403]), Exit::CheckFailed);
        assert_eq!(of(&[403, 503, 200]), Exit::TryAgain);
        assert_eq!(of(&[502, 403]), Exit::TryAgain);
        assert_eq!(answer(403).line(), "refused: x; y");
        assert_eq!(answer(200).line(), "parked");
    }
}
