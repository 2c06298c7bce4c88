//! A desk's wishes for halls: signed, beside what this desk wished before, and followed until the halls have what is wished.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{IsTerminal as _, stderr};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::jetstream::context::Context;
use async_nats::jetstream::message::PublishMessage;
use futures_util::future::join_all;
use tokio::time::{Instant, sleep};

use super::act::chosen;
use super::have::{FileStands, HallHas, WishedFile, exit_of};
use super::settings::DeskSettings;
use super::{DeskArgs, engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::fleet::{self, AHEAD, LONGEST_WISH, Letter, Wish};
use crate::sys::clock::wall_now_ns;

/// How often it is looked what halls have.
const LOOK: Duration = Duration::from_secs(1);

// For whom something is wished, and how long that is waited for. No documentation: clap would show it as the help of commands.
#[derive(Debug, clap::Args)]
pub(super) struct WishArgs {
    #[command(flatten)]
    desk: DeskArgs,
    /// Halls: SITE.HALL, SITE.*, or all.
    #[arg(long, value_name = "HALL", required = true, num_args = 1..)]
    to: Vec<String>,
    /// Wish for these alone, whatever was wished before; what halls have stays there.
    #[arg(long)]
    only: bool,
    /// Do not wait until the halls have them.
    #[arg(long)]
    no_wait: bool,
    /// Wait so many seconds at the most.
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    within: u64,
}

impl WishArgs {
    /// Whose desk it is, and the halls that are meant.
    pub(super) fn read(&self) -> Result<(DeskSettings, Vec<String>), Failure> {
        let settings = settings::desk(&self.desk.desk)?;
        let halls = chosen(&settings.halls, &self.to)?;
        Ok((settings, halls))
    }

    /// Wishes it of all halls, each by `change` of what was wished before, and says what came of these files there.
    pub(super) async fn wish(
        &self,
        kept: &Context,
        settings: &DeskSettings,
        halls: Vec<String>,
        files: &[WishedFile],
        change: impl Fn(&mut Wish),
    ) -> Result<Exit, Failure> {
        let (mut wished, mut failed) = (BTreeMap::new(), None::<Failure>);
        for hall in halls {
            match wish(kept, settings, &hall, self.only, &change).await {
                Ok(seq) => drop(wished.insert(hall, seq)),
                // The others get it all the same, and what comes of it there is told.
                Err(failure) => {
                    if let Some(before) = failed.replace(failure) {
                        print::tell(&before.to_string());
                    }
                }
            }
        }
        let came = if wished.is_empty() {
            Exit::Done
        } else if self.no_wait {
            print::tell("the halls take it when they are parked; kinocue fleet have says who has what");
            Exit::Done
        } else {
            let until = Instant::now() + Duration::from_secs(self.within);
            follow(kept, &wished, files, until).await?
        };
        failed.map_or(Ok(came), Err)
    }
}

/// Wishes for a hall what it shall have beside what was wished before; says which message of the engine that is.
async fn wish(
    kept: &Context,
    settings: &DeskSettings,
    hall: &str,
    only: bool,
    change: impl Fn(&mut Wish),
) -> Result<u64, Failure> {
    let last = engine::last_value(kept, fleet::WANT, hall).await.or_exit(Exit::Unavailable)?;
    let before = last.as_ref().map(|message| own_wish(&message.payload, settings, hall)).transpose();
    let before = match before {
        Err(why) if !only => {
            let why = anyhow!("{hall}: what was wished before {why}; --only wishes for these alone");
            return Err(why).or_exit(Exit::CheckFailed);
        }
        before => before.unwrap_or_default(),
    };
    // What a hall told of itself is looked up as well: it may keep a later one than the engine has.
    let kept_there = HallHas::look_up(kept, hall).await.or_exit(Exit::Unavailable)?.kept_rev();
    let rev = next_rev(before.as_ref().map_or(0, |wish| wish.rev), kept_there, wall_now_ns() / 1_000_000);
    let mut wish = before.filter(|_| !only).unwrap_or_default();
    (wish.to, wish.rev) = (hall.to_owned(), rev);
    change(&mut wish);
    let text = signed(settings, &wish)?;
    let message = PublishMessage::build().payload(text.into());
    let message = message.expected_last_subject_sequence(last.map_or(0, |message| message.sequence));
    let told =
        || format!("{hall}: the engine does not take the wish; if another desk wished meanwhile, try again");
    let sent = kept
        .send_publish(engine::value_to(fleet::WANT, hall), message)
        .await
        .with_context(told)
        .or_exit(Exit::Unavailable)?;
    Ok(sent.await.with_context(told).or_exit(Exit::Unavailable)?.sequence)
}

/// The rev of the next wish, above that of the wish before and of the one that the hall keeps. One that is of more than a day from now
/// no hall takes: where a clock was wrong, the next one is not so as well.
fn next_rev(before: u64, kept: u64, now_ms: u64) -> u64 {
    let most = now_ms.saturating_add(u64::try_from(AHEAD.as_millis()).unwrap_or(u64::MAX));
    let known = [before, kept].into_iter().filter(|rev| *rev < most).max();
    known.map_or(now_ms, |rev| (rev + 1).max(now_ms))
}

/// What this very desk wished before for that hall; why it is none of its wishes. Of others nothing is taken over: it would be signed
/// anew here.
pub(super) fn own_wish(payload: &[u8], settings: &DeskSettings, hall: &str) -> Result<Wish, &'static str> {
    let letter: Letter = serde_json::from_slice(payload).map_err(|_| "is no wish")?;
    if letter.key != settings.letters.public_key() || !letter.is_signed() {
        return Err("was not signed by this desk");
    }
    let wish = Wish::of(&letter).map_err(|_| "is no wish")?;
    if wish.to == hall { Ok(wish) } else { Err("was for another hall") }
}

fn signed(settings: &DeskSettings, wish: &Wish) -> Result<String, Failure> {
    let too_many = |why: String| anyhow!("{}: {why}; wish for less with --only", wish.to);
    wish.check_count().map_err(too_many).or_exit(Exit::Usage)?;
    let body = serde_json::to_string(wish).expect("text and numbers are written");
    let letter = Letter::sign(&settings.letters, body);
    let letter = letter.context("the key of this desk cannot sign").or_exit(Exit::Config)?;
    let text = serde_json::to_string(&letter).expect("text is written");
    if text.len() <= LONGEST_WISH {
        return Ok(text);
    }
    let why = anyhow!(
        "{}: a wish has at most {LONGEST_WISH} bytes, and this one {}; wish for less with --only",
        wish.to,
        text.len()
    );
    Err(why).or_exit(Exit::Usage)
}

/// Tells how far the halls are until each has all of it or refuses some; says then who has what.
async fn follow(
    kept: &Context,
    wished: &BTreeMap<String, u64>,
    files: &[WishedFile],
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
                files.iter().map(|file| has.stands(file, seq)).collect::<Vec<_>>()
            }
        };
        let all = join_all(wished.iter().map(look_up)).await.concat();
        for one in &all {
            let text = if each_step { one.said() } else { one.said_coarsely() };
            if told.insert((one.hall.clone(), one.file.name()), text.clone()).as_ref() != Some(&text) {
                print::tell(&text);
            }
        }
        if all.iter().all(FileStands::is_settled) || Instant::now() >= until {
            return conclude(&all);
        }
        tokio::select! {
            () = sleep(LOOK) => {}
            _ = tokio::signal::ctrl_c() => return conclude(&all),
        }
    }
}

fn conclude(all: &[FileStands]) -> Result<Exit, Failure> {
    let ready = all.iter().filter(|one| one.is_ready()).count();
    let never = never_there(all);
    if !never.is_empty() {
        print::out(&format!("no hall had it: {}\n", never.join(", ")))?;
        return Ok(Exit::NoInput);
    }
    let mut text = if ready == all.len() && all.iter().all(|one| one.file.is_dropped()) {
        "all halls are without it\n".to_owned()
    } else if ready == all.len() {
        "all halls have all of it\n".to_owned()
    } else {
        format!("{ready} of {} are there; not there:\n", all.len())
    };
    for one in all.iter().filter(|one| !one.is_ready()) {
        text.push_str(&one.whole());
    }
    print::out(&text)?;
    Ok(exit_of(all))
}

/// What was to go, and was in none of the halls: the name may be a slip.
fn never_there(all: &[FileStands]) -> Vec<String> {
    let was_never = |one: &FileStands| one.file.is_dropped() && one.is_ready() && !one.is_gone();
    let is_nowhere = |name: &String| all.iter().all(|one| one.file.name() != *name || was_never(one));
    let names: BTreeSet<_> = all.iter().map(|one| one.file.name()).collect();
    names.into_iter().filter(is_nowhere).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wish_is_later_than_all_that_a_hall_may_keep_and_a_wrong_clock_is_not_kept_for_ever() {
        let (now, day) = (1_795_306_800_123, 86_400_000);
        assert_eq!(next_rev(0, 0, now), now);
        assert_eq!(next_rev(now + 5, 0, now), now + 6);
        assert_eq!(next_rev(5, now + 7_000, now), now + 7_001, "the hall keeps a later one");
        assert_eq!(next_rev(now + 2 * day, now + day, now), now, "no hall has taken these");
        assert_eq!(next_rev(u64::MAX, u64::MAX, now), now);
        assert_eq!(next_rev(now + day - 1, 0, now), now + day);
    }
}
