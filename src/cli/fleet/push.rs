//! `kinocue fleet push`: cues into the libraries of halls, by a signed wish for each, and what came of it in each.

use std::collections::BTreeMap;
use std::io::{IsTerminal as _, stderr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::jetstream::context::Context;
use async_nats::jetstream::message::PublishMessage;
use futures_util::future::join_all;
use tokio::time::{Instant, sleep};

use super::act::chosen;
use super::have::{CueStands, HallHas, exit_of};
use super::object::CueFile;
use super::settings::DeskSettings;
use super::{DeskArgs, engine, settings};
use crate::cli::client::cue_id_of;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::fleet::{self, HadState, LONGEST_WISH, Letter, Wish};
use crate::sys::clock::wall_now_ns;

/// How often it is looked what halls have.
const LOOK: Duration = Duration::from_secs(1);

/// Puts cues into the libraries of halls that allow it (cues), and says what came of it in each.
///
/// The cues go to the engine, and each hall fetches them while it is parked and unarmed, proves them for its own seats, and takes in those that pass. Nothing
/// is loaded by it, what is loaded stays, and so does what people in the hall have uploaded. A hall that is away or plays takes them later, also when this
/// command has ended.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet push cues/storm.mcap --to 'berlin.*'
  kinocue fleet push cues/bench-ride.csv cues/coaster.csv --to all --within 3600

Exit codes: 0 all halls have all of it, 1 a hall refuses a cue, 66 no such file or hall, 69 the engine does not answer, 75 a hall does not have it yet")]
pub(super) struct Args {
    #[command(flatten)]
    desk: DeskArgs,
    /// The cue files; the id of a cue is the name of its file without its ending.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Halls: SITE.HALL, SITE.*, or all.
    #[arg(long, value_name = "HALL", required = true, num_args = 1..)]
    to: Vec<String>,
    /// Wish for these cues alone, whatever was wished before; what halls have stays there.
    #[arg(long)]
    only: bool,
    /// Do not wait until the halls have them.
    #[arg(long)]
    no_wait: bool,
    /// Wait so many seconds at the most.
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    within: u64,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    let halls = chosen(&settings.halls, &args.to)?;
    let mut files = Vec::new();
    for path in &args.files {
        let file = CueFile::open(path, cue_id_of(path)?)?;
        if files.iter().any(|before: &CueFile| before.id == file.id) {
            return Err(anyhow!("two of the files would be the cue {}", file.id)).or_exit(Exit::Usage);
        }
        files.push(file);
    }
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let kept = engine::kept(&client);
        engine::prepare(&kept).await?;
        for file in &mut files {
            let sent = file.put(&kept).await?;
            let (id, bytes) = (&file.id, file.cue.bytes);
            let s = if sent == 1 { "" } else { "s" };
            print::tell(&format!(
                "{id}: {bytes} bytes, sha256 {}; {sent} message{s} to the engine",
                file.cue.sha256
            ));
        }
        let mut wished = BTreeMap::new();
        for hall in halls {
            let seq = wish(&kept, &settings, &hall, &files, args.only).await?;
            wished.insert(hall, seq);
        }
        if args.no_wait {
            print::tell("the halls fetch them; kinocue fleet have says who has what");
            return Ok(Exit::Done);
        }
        let until = Instant::now() + Duration::from_secs(args.within);
        follow(&kept, &wished, &files, until).await
    })
}

/// Wishes for a hall what it shall have beside what was wished before; says which message of the engine that is.
async fn wish(
    kept: &Context,
    settings: &DeskSettings,
    hall: &str,
    files: &[CueFile],
    only: bool,
) -> Result<u64, Failure> {
    let last = engine::last_value(kept, fleet::WANT, hall).await.or_exit(Exit::Unavailable)?;
    let before = last.as_ref().map(|message| own_wish(&message.payload, settings, hall)).transpose();
    let before = match before {
        Err(why) if !only => {
            let why = anyhow!("{hall}: what was wished before {why}; --only wishes for these cues alone");
            return Err(why).or_exit(Exit::CheckFailed);
        }
        before => before.unwrap_or_default(),
    };
    let rev = before.as_ref().map_or(0, |wish| wish.rev).saturating_add(1).max(wall_now_ns() / 1_000_000);
    let mut cues = before.filter(|_| !only).map(|wish| wish.cues).unwrap_or_default();
    cues.extend(files.iter().map(|file| (file.id.clone(), file.cue.clone())));
    let text = signed(settings, &Wish { to: hall.to_owned(), rev, cues })?;
    let message = PublishMessage::build().payload(text.into());
    let message = message.expected_last_subject_sequence(last.map_or(0, |message| message.sequence));
    let told =
        || format!("{hall}: the engine does not take the wish; if another desk wished meanwhile, push again");
    let sent = kept
        .send_publish(engine::value_to(fleet::WANT, hall), message)
        .await
        .with_context(told)
        .or_exit(Exit::Unavailable)?;
    Ok(sent.await.with_context(told).or_exit(Exit::Unavailable)?.sequence)
}

/// What this very desk wished before for that hall; why it is none of its wishes. Of others nothing is taken over: it would be signed
/// anew here.
fn own_wish(payload: &[u8], settings: &DeskSettings, hall: &str) -> Result<Wish, &'static str> {
    let letter: Letter = serde_json::from_slice(payload).map_err(|_| "is no wish")?;
    if letter.key != settings.access.pair.public_key() || !letter.is_signed() {
        return Err("was not signed by this desk");
    }
    let wish = Wish::of(&letter).map_err(|_| "is no wish")?;
    if wish.to == hall { Ok(wish) } else { Err("was for another hall") }
}

fn signed(settings: &DeskSettings, wish: &Wish) -> Result<String, Failure> {
    let body = serde_json::to_string(wish).expect("text and numbers are written");
    let letter = Letter::sign(&settings.access.pair, body);
    let letter = letter.context("the key of this desk cannot sign").or_exit(Exit::Config)?;
    let text = serde_json::to_string(&letter).expect("text is written");
    if text.len() <= LONGEST_WISH {
        return Ok(text);
    }
    let why = anyhow!(
        "{}: a wish has at most {LONGEST_WISH} bytes, and this one {}; wish for fewer cues with --only",
        wish.to,
        text.len()
    );
    Err(why).or_exit(Exit::Usage)
}

/// Tells how far the halls are until each has all of it or refuses some; says then who has what.
async fn follow(
    kept: &Context,
    wished: &BTreeMap<String, u64>,
    files: &[CueFile],
    until: Instant,
) -> Result<Exit, Failure> {
    let mut told = BTreeMap::new();
    let each_step = stderr().is_terminal();
    loop {
        // An engine that is away meanwhile is waited for: the wishes are there.
        let look_up = |(hall, seq): (&'_ String, &'_ u64)| {
            let (hall, seq) = (hall.clone(), *seq);
            async move {
                let has = HallHas::look_up(kept, &hall).await.unwrap_or_else(|_| HallHas::unknown(&hall));
                files.iter().map(|file| has.stands(&file.id, &file.cue, seq)).collect::<Vec<_>>()
            }
        };
        let all = join_all(wished.iter().map(look_up)).await.concat();
        for one in &all {
            let text = if each_step { one.said() } else { one.said_coarsely() };
            if told.insert((one.hall.clone(), one.id.clone()), text.clone()).as_ref() != Some(&text) {
                print::tell(&text);
            }
        }
        if all.iter().all(CueStands::is_settled) || Instant::now() >= until {
            return conclude(&all);
        }
        tokio::select! {
            () = sleep(LOOK) => {}
            _ = tokio::signal::ctrl_c() => return conclude(&all),
        }
    }
}

fn conclude(all: &[CueStands]) -> Result<Exit, Failure> {
    let ready = all.iter().filter(|one| one.state == HadState::Ready).count();
    let mut text = if ready == all.len() {
        "all halls have all of it\n".to_owned()
    } else {
        format!("{ready} of {} are there; not there:\n", all.len())
    };
    for one in all.iter().filter(|one| one.state != HadState::Ready) {
        text.push_str(&one.whole());
    }
    print::out(&text)?;
    Ok(exit_of(all))
}
