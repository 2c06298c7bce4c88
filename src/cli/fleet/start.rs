//! `kinocue fleet start`: the shows of several halls at one instant. It asks each hall whether it is ready, then for the start, and lets it
//! come only where all have taken it; after the instant it asks each what came of it.

use std::time::Duration;

use anyhow::anyhow;
use async_nats::Client;
use futures_util::future::join_all;
use serde_json::json;
use tokio::time::sleep;

use super::act::{self, Answer, Asked};
use super::desk::said;
use super::settings::DeskSettings;
use super::{DeskArgs, engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::control::{StartOrder, StartPhase};
use crate::fleet::BriefStatus;
use crate::sys::clock::wall_now_ns;
use crate::time::parse_duration;

/// How long a hall may take to answer: the commit has to be there before the instant.
const PATIENCE: Duration = Duration::from_secs(1);
/// How far from now a start may be asked: both questions take their time, and a hall holds no start for longer.
const AHEAD: std::ops::RangeInclusive<Duration> = Duration::from_secs(4)..=Duration::from_secs(58);
/// So long after the instant the halls are asked what came of it, so often.
const AFTER: Duration = Duration::from_millis(400);
const TRIES: usize = 5;

/// Starts the shows of several halls at one instant.
///
/// A person in each of them has armed it for the group with `kinocue arm --fleet GROUP`, within the last ten minutes, and its configuration
/// allows it (start = true). Every hall has to take it, or none starts, but for --quorum. No network can promise that all do: a hall that
/// hears of the commit starts at the instant, by its own clock, another stays armed, and a line says what came of it in each. The seats move
/// as by a GO in the hall, and anybody there can call it off until then.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet start --group trio --at +10s
  kinocue fleet start --group trio --at +30s --quorum 2
  kinocue fleet start --group trio --json

The halls of a group are in [groups] of desk.toml:  trio = [\"berlin.h1\", \"berlin.h2\", \"berlin.h3\"]

Exit codes: 0 all have started, or as many as --quorum asks for, 1 none has: one refused, 64 usage, 66 no such group, 69 the engine does
not answer, 75 a hall did not answer, only some have started, or no seat took part in one")]
pub(super) struct Args {
    #[command(flatten)]
    desk: DeskArgs,
    /// The group of halls.
    #[arg(long)]
    group: String,
    /// How long from now the films are at their beginnings, +4s to +58s.
    #[arg(long, value_name = "TIME", default_value = "+10s", value_parser = ahead)]
    at: Duration,
    /// Start where at least so many halls are ready, without the others.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    quorum: Option<u16>,
    /// Print JSON: an object with an array `halls`.
    #[arg(long)]
    json: bool,
}

/// `+10s`.
fn ahead(text: &str) -> Result<Duration, String> {
    let refuse =
        || format!("write +10s: {} to {} s from now", AHEAD.start().as_secs(), AHEAD.end().as_secs());
    let span = text.strip_prefix('+').ok_or_else(refuse)?;
    parse_duration(span).ok().filter(|span| AHEAD.contains(span)).ok_or_else(refuse)
}

/// A start, and how far it is in each hall.
struct Start<'a> {
    settings: &'a DeskSettings,
    client: &'a Client,
    order: StartOrder,
    halls: Vec<Member>,
    /// So many have to take it.
    needed: usize,
}

/// A hall of the group.
struct Member {
    hall: String,
    /// Its brief status, as it was told last.
    status: BriefStatus,
    /// Why it does not take part; none while it does.
    out: Option<Answer>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    let Some(halls) = settings.groups.get(&args.group) else {
        let known: Vec<_> = settings.groups.keys().map(String::as_str).collect();
        let error = anyhow!(
            "[groups] of {} has no {:?}; it has {}",
            args.desk.desk.display(),
            args.group,
            if known.is_empty() { "none".to_owned() } else { known.join(", ") }
        );
        return Err(error).or_exit(Exit::NoInput);
    };
    let needed = args.quorum.map_or(halls.len(), usize::from);
    if needed > halls.len() {
        let error = anyhow!("--quorum {needed} of {} halls", halls.len());
        return Err(error).or_exit(Exit::Usage);
    }
    engine::block_on(async {
        let client = &engine::connect_desk(&settings.access, &settings.name).await?;
        let member = |hall: &String| Member { hall: hall.clone(), status: BriefStatus::default(), out: None };
        let at_ms = i64::try_from((u128::from(wall_now_ns()) + args.at.as_nanos()) / 1_000_000);
        let order = StartOrder {
            ticket: act::id(),
            group: args.group.clone(),
            sha256: String::new(),
            at_ms: at_ms.unwrap_or(i64::MAX),
        };
        let halls = halls.iter().map(member).collect();
        let mut start = Start { settings: &settings, client, order, halls, needed };
        start.go().await;
        start.tell(args.json)
    })
}

impl Start<'_> {
    /// Goes through with it, as far as enough halls do.
    async fn go(&mut self) {
        self.ask_ready().await;
        if self.too_few("not asked: too few halls are ready") {
            return;
        }
        self.ask_each("start", |start, member| {
            let sha256 = member.status.show.as_ref().map(|show| show.sha256.clone()).unwrap_or_default();
            json!(StartOrder { sha256, ..start.order.clone() })
        })
        .await;
        // What is not committed is called off by the halls themselves.
        if self.too_few("called off: too few halls took the start") {
            return;
        }
        self.ask_each("commit", |start, _| json!({ "ticket": start.order.ticket })).await;
        let now_ms = i64::try_from(wall_now_ns() / 1_000_000).unwrap_or(i64::MAX);
        sleep(Duration::from_millis(self.order.at_ms.saturating_sub(now_ms).max(0).unsigned_abs())).await;
        self.ask_what_came_of_it().await;
    }

    /// Asks each hall how it is, and leaves out which cannot take part.
    async fn ask_ready(&mut self) {
        let ready = Asked { word: "ready", args: json!({}), patience: PATIENCE };
        let asked = self.halls.iter().map(|member| self.look(&member.hall, &ready));
        let statuses = join_all(asked).await;
        for (member, status) in self.halls.iter_mut().zip(statuses) {
            match status {
                Ok(status) => {
                    member.out = not_ready(&status, &self.order.group).map(Answer::Refused);
                    member.status = status;
                }
                Err(answer) => member.out = Some(answer),
            }
        }
        let first = self.halls.iter().find(|member| member.out.is_none());
        let Some(alike) = first.map(|member| likeness(&member.status)) else { return };
        for member in self.halls.iter_mut().filter(|member| member.out.is_none()) {
            let own = likeness(&member.status);
            if own != alike {
                let (cue, server) = own;
                let why = format!(
                    "it has {cue} by the time of {server}, the first hall {} by {}",
                    alike.0, alike.1
                );
                member.out = Some(Answer::Refused(why));
            }
        }
    }

    /// Asks each that takes part, and leaves out who does not do it.
    async fn ask_each(&mut self, word: &'static str, args: impl Fn(&Self, &Member) -> serde_json::Value) {
        let this = &*self;
        let asked = this.halls.iter().filter(|member| member.out.is_none()).map(|member| {
            let asked = Asked { word, args: args(this, member), patience: PATIENCE };
            async move { act::request(this.settings, this.client, &member.hall, &asked).await }
        });
        let answers = join_all(asked).await;
        for (member, answer) in self.halls.iter_mut().filter(|member| member.out.is_none()).zip(answers) {
            member.out = answer.err();
        }
    }

    async fn look(&self, hall: &str, ready: &Asked) -> Result<BriefStatus, Answer> {
        let reply = act::request(self.settings, self.client, hall, ready).await?.reply;
        serde_json::from_value(reply)
            .map_err(|_| Answer::Refused("the hall is of another version".to_owned()))
    }

    /// Has all others wait where too few are left; says whether that is so.
    fn too_few(&mut self, why: &str) -> bool {
        let takes_part = self.halls.iter().filter(|member| member.out.is_none()).count();
        let is_so = takes_part < self.needed;
        for member in self.halls.iter_mut().filter(|member| is_so && member.out.is_none()) {
            member.out = Some(Answer::Left(why.to_owned()));
        }
        is_so
    }

    /// Asks all that were asked to start, also those whose commit nobody answered.
    async fn ask_what_came_of_it(&mut self) {
        let ready = Asked { word: "ready", args: json!({}), patience: PATIENCE };
        for _ in 0..TRIES {
            sleep(AFTER).await;
            let statuses = join_all(self.halls.iter().map(|member| self.look(&member.hall, &ready))).await;
            let ticket = &self.order.ticket;
            for (member, status) in self.halls.iter_mut().zip(statuses) {
                match status {
                    Ok(status) => member.hear(status, ticket),
                    Err(answer) if member.out.is_none() => member.out = Some(answer),
                    Err(_) => {}
                }
            }
            if self.halls.iter().all(|member| member.out.is_some()) {
                return;
            }
        }
        for member in self.halls.iter_mut().filter(|member| member.out.is_none()) {
            member.out = Some(Answer::Silent("it does not say what came of it".to_owned()));
        }
    }

    /// Says what came of it, a line for each hall, and how far apart the films can be.
    fn tell(&self, json: bool) -> Result<Exit, Failure> {
        let within_ms = self.within_ms();
        if json {
            let halls: Vec<_> = self.halls.iter().map(Member::json).collect();
            let StartOrder { ticket, group, at_ms, .. } = &self.order;
            print::json(&json!({
                "ticket": ticket, "group": group, "at_ms": at_ms, "within_ms": within_ms, "halls": halls
            }))?;
        } else {
            let line = |member: &Member| format!("{}: {}\n", member.hall, said(&member.line()));
            let mut text: String = self.halls.iter().map(line).collect();
            if let Some(within_ms) = within_ms {
                text += &format!("by their clocks the films began within {within_ms:.2} ms of each other\n");
            }
            print::out(&text)?;
        }
        Ok(self.exit())
    }

    /// How far apart two of the films that began can be: the two widest bounds together. None where less than two began.
    fn within_ms(&self) -> Option<f64> {
        let mut bounds: Vec<f64> =
            self.halls.iter().filter(|one| one.has_started()).filter_map(Member::bound_ms).collect();
        bounds.sort_by(f64::total_cmp);
        let [.., second, first] = bounds[..] else { return None };
        Some(first + second)
    }

    fn exit(&self) -> Exit {
        let moving = self.halls.iter().filter(|member| member.moves()).count();
        if moving >= self.needed {
            return Exit::Done;
        }
        if self.halls.iter().any(Member::has_started) {
            return Exit::TryAgain;
        }
        act::exit(self.halls.iter().filter_map(|member| member.out.as_ref()))
    }
}

impl Member {
    /// Takes in what the hall says after the instant.
    fn hear(&mut self, status: BriefStatus, ticket: &str) {
        let start = status.fleet.as_ref().and_then(|fleet| fleet.start.as_ref());
        let Some(start) = start.filter(|start| start.ticket == ticket) else { return };
        self.out = match start.phase {
            StartPhase::Started => Some(Answer::Done("started".to_owned())),
            StartPhase::CalledOff => Some(Answer::Left(format!("called off: {}", start.why))),
            StartPhase::Asked | StartPhase::Committed => return,
        };
        self.status = status;
    }

    fn has_started(&self) -> bool {
        matches!(self.out, Some(Answer::Done(_)))
    }

    /// True if seats follow what has started.
    fn moves(&self) -> bool {
        self.has_started() && self.status.seats.taking_part > 0
    }

    /// How far its clock may have been off when it took over the instant, ms.
    fn bound_ms(&self) -> Option<f64> {
        Some(self.status.fleet.as_ref()?.start.as_ref()?.bound_us? / 1e3)
    }

    fn line(&self) -> String {
        let Some(out) = &self.out else { return "it does not say what came of it".to_owned() };
        let (Answer::Done(_), Some(bound_ms)) = (out, self.bound_ms()) else { return out.line() };
        let (cue, server) = likeness(&self.status);
        let seats = &self.status.seats;
        let moved = match seats.taking_part {
            0 => ", but no seat takes part".to_owned(),
            some if some < seats.total => format!(" with {some} of {} seats", seats.total),
            _ => String::new(),
        };
        format!("started {cue}{moved}, its clock within {bound_ms:.2} ms of {server}")
    }

    fn json(&self) -> serde_json::Value {
        let mut json =
            self.out.as_ref().map_or_else(|| json!({ "hall": self.hall }), |out| out.json(&self.hall));
        json["bound_ms"] = json!(self.bound_ms().filter(|_| self.has_started()));
        json["text"] = json!(self.line());
        json
    }
}

/// What has to be the same in all halls: the cue by its name, since seats of another kind have it fitted, and whose time they have.
fn likeness(status: &BriefStatus) -> (String, String) {
    let cue = status.show.as_ref().map_or_else(|| "no cue".to_owned(), |show| show.cue.clone());
    let clock = status.fleet.as_ref().and_then(|fleet| fleet.clock.as_ref());
    (cue, clock.map_or_else(|| "no server".to_owned(), |clock| clock.server.clone()))
}

/// Why a hall cannot take part; none where it can, as far as it says.
fn not_ready(status: &BriefStatus, group: &str) -> Option<String> {
    let fleet = status.fleet.clone().unwrap_or_default();
    let arm = format!("ask somebody there: kinocue arm --fleet {group}");
    match &fleet.armed_for {
        None => return Some(format!("{}, and nobody there has armed it for {group}; {arm}", status.state)),
        Some(armed) if armed.group != group => {
            return Some(format!("armed for {}, not for {group}; {arm}", armed.group));
        }
        Some(_) => {}
    }
    if status.seats.taking_part == 0 {
        return Some("no seat takes part there; enable seats, or see at each why it is out".to_owned());
    }
    let Some(clock) = &fleet.clock else {
        return Some(
            "nobody has measured its clock lately; set time_server in its fleet.toml, and see that it runs"
                .to_owned(),
        );
    };
    (clock.bound_us > clock.start_bound_us).then(|| {
        format!(
            "its clock may be {:.2} ms off {}, more than the {} ms of its start_bound_ms; see to its time service (chrony)",
            clock.bound_us / 1e3,
            clock.server,
            clock.start_bound_us / 1e3
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{ArmedForStatus, ClockStatus, FleetStatus, StartStatus};
    use crate::fleet::SeatCounts;

    fn status(group: Option<&str>, bound_us: Option<f64>) -> BriefStatus {
        let armed_for = group.map(|group| ArmedForStatus { group: group.to_owned(), ..Default::default() });
        let clock = bound_us.map(|bound_us| ClockStatus {
            server: "ntp".to_owned(),
            bound_us,
            start_bound_us: 2_000.0,
            ..ClockStatus::default()
        });
        let seats = SeatCounts { total: 4, taking_part: 4, lost: 0 };
        BriefStatus {
            fleet: Some(FleetStatus { clock, armed_for, start: None }),
            seats,
            ..BriefStatus::default()
        }
    }

    #[test]
    fn an_instant_is_so_far_from_now_that_all_can_hear_of_it() {
        assert_eq!(ahead("+10s"), Ok(Duration::from_secs(10)));
        assert_eq!(ahead("+4500ms"), Ok(Duration::from_millis(4_500)));
        for text in ["10s", "+3s", "+59s", "+2min", "+", "19:00", "-5s"] {
            assert!(ahead(text).unwrap_err().contains("4 to 58 s"), "{text}");
        }
    }

    #[test]
    fn a_hall_that_cannot_take_part_says_why_and_what_to_do() {
        assert_eq!(not_ready(&status(Some("trio"), Some(140.0)), "trio"), None);
        let mut empty = status(Some("trio"), Some(140.0));
        empty.seats.taking_part = 0;
        for (status, says) in [
            (empty, "no seat takes part there"),
            (
                BriefStatus::default(),
                "nobody there has armed it for trio; ask somebody there: kinocue arm --fleet trio",
            ),
            (status(None, Some(140.0)), "nobody there has armed it for trio"),
            (status(Some("duo"), Some(140.0)), "armed for duo, not for trio"),
            (status(Some("trio"), None), "nobody has measured its clock lately; set time_server"),
            (
                status(Some("trio"), Some(3_210.0)),
                "may be 3.21 ms off ntp, more than the 2 ms of its start_bound_ms",
            ),
        ] {
            let why = not_ready(&status, "trio").unwrap();
            assert!(why.contains(says), "{why}");
        }
    }

    #[test]
    fn what_the_hall_says_of_that_very_start_decides_whatever_was_answered_before() {
        let with = |ticket: &str, phase, why: &str| {
            let mut status = status(None, Some(140.0));
            let (ticket, why) = (ticket.to_owned(), why.to_owned());
            let start = StartStatus { ticket, phase, why, bound_us: Some(140.0), ..StartStatus::default() };
            status.fleet.as_mut().unwrap().start = Some(start);
            status
        };
        let silent = || Some(Answer::Silent("no answer".to_owned()));
        let mut member = Member { hall: "a.b".to_owned(), status: BriefStatus::default(), out: silent() };
        member.hear(with("another", StartPhase::Started, ""), "mine");
        assert!(!member.has_started());
        member.hear(with("mine", StartPhase::Committed, ""), "mine");
        assert!(!member.has_started());
        member.hear(with("mine", StartPhase::Started, ""), "mine");
        assert!(member.has_started());
        assert_eq!(member.line(), "started no cue, its clock within 0.14 ms of ntp");
        assert!(member.moves());
        member.status.seats.taking_part = 3;
        assert_eq!(member.line(), "started no cue with 3 of 4 seats, its clock within 0.14 ms of ntp");
        member.status.seats.taking_part = 0;
        assert_eq!(member.line(), "started no cue, but no seat takes part, its clock within 0.14 ms of ntp");
        assert!(member.has_started() && !member.moves());
        member.hear(with("mine", StartPhase::CalledOff, "desk not heard"), "mine");
        assert_eq!(member.line(), "called off: desk not heard");
    }
}
