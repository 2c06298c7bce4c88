//! `kinocue fleet have`: which hall has what it shall have, which lags, and why.

use std::time::Duration;

use async_nats::jetstream::context::Context;
use futures_util::{StreamExt as _, stream};
use serde::Serialize;

use super::act::{HallsOrAllArgs, chosen};
use super::desk::{age, said};
use super::{engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, print, table};
use crate::fleet::{self, HadState, HaveReport, Letter, Wish};
use crate::json;

/// A hall tells what it has each minute; after so long without a word it is not heard.
const UNHEARD: Duration = Duration::from_secs(150);

/// The longest text that a hall tells of a file, bytes, and the most files.
const TEXT: usize = 2_048;
const NAMED: usize = 1_000;

/// Shows which hall has what was wished for it, which lags, and why.
///
/// A hall has a cue once it is in its library and proved for its seats, and a playlist once it is there and all that it names. With the version of its program and the digest of its configuration.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit codes: 0 all halls have all of it, 1 a hall refuses something, 69 the engine does not answer, 75 a hall lags or is not heard"
)]
pub(super) struct Args {
    #[command(flatten)]
    of: HallsOrAllArgs,
}

/// What the engine knows of a hall's library.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct HallHas {
    /// `SITE.HALL`.
    name: String,
    /// How old what the hall told is, s; null if it told nothing.
    age_s: Option<f64>,
    /// What the hall told.
    report: Option<HaveReport>,
    /// What was wished for it, and by which message of the engine.
    #[serde(skip)]
    wished: Option<(u64, Wish)>,
    /// True if the engine has something as its wish that is none for it.
    is_foreign: bool,
}

/// What is said of a file that is not there any more; another thing is said of one that never was.
const GONE: &str = "gone";

/// What a wish names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileKind {
    Cue,
    Playlist,
    /// One that shall go.
    DroppedCue,
    /// One that shall go.
    DroppedPlaylist,
}

/// A file that is wished.
#[derive(Debug, Clone, Serialize)]
pub(super) struct WishedFile {
    #[serde(skip)]
    pub(super) kind: FileKind,
    pub(super) id: String,
    #[serde(skip)]
    pub(super) sha256: String,
}

/// How a hall stands to one file.
#[derive(Debug, Clone, Serialize)]
pub(super) struct FileStands {
    pub(super) hall: String,
    #[serde(flatten)]
    pub(super) file: WishedFile,
    state: HadState,
    /// It in words.
    text: String,
    /// Every fault that stands against it.
    faults: Vec<String>,
    percent: Option<u8>,
}

/// What is told of a hall with `--json`.
#[derive(Serialize)]
struct HallRow<'h> {
    #[serde(flatten)]
    hall: &'h HallHas,
    wished_rev: Option<u64>,
    cues: Vec<FileStands>,
    playlists: Vec<FileStands>,
    dropped: Vec<FileStands>,
}

pub(super) fn run(Args { of }: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&of.desk.desk)?;
    let halls = chosen(&settings.halls, &of.halls)?;
    let halls = engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let kept = engine::kept(&client);
        engine::prepare(&kept).await?;
        look_up_all(&kept, halls).await
    })?;
    let stand: Vec<_> = halls.iter().flat_map(HallHas::all).collect();
    if of.json {
        let rows: Vec<_> = halls.iter().map(HallHas::row).collect();
        print::json(&rows)?;
    } else {
        print::out(&drawn(&halls, &stand))?;
    }
    Ok(exit_of_halls(&halls, &stand))
}

/// What the engine has of halls. One of which it does not say keeps no other from being shown.
async fn look_up_all(kept: &Context, halls: Vec<String>) -> Result<Vec<HallHas>, Failure> {
    let ask = |hall: String| async move { (HallHas::look_up(kept, &hall).await, hall) };
    let told: Vec<_> = stream::iter(halls).map(ask).buffered(engine::AT_ONCE).collect().await;
    let is_silent = !told.is_empty() && told.iter().all(|(has, _)| has.is_err());
    let mut all = Vec::new();
    for (has, hall) in told {
        match has {
            Err(why) if is_silent => return Err(why).or_exit(Exit::Unavailable),
            Err(why) => {
                print::tell(&said(&format!("{hall}: {why:#}")));
                all.push(HallHas::unknown(&hall));
            }
            Ok(has) => all.push(has),
        }
    }
    Ok(all)
}

/// The same of all that halls have, also of a hall that has all of a wish from before the one that it does not take.
fn exit_of_halls(halls: &[HallHas], stand: &[FileStands]) -> Exit {
    let lags = halls.iter().any(|hall| hall.is_foreign || hall.is_unheard());
    match exit_of(stand) {
        _ if halls.iter().any(HallHas::refuses) => Exit::CheckFailed,
        Exit::Done if lags => Exit::TryAgain,
        exit => exit,
    }
}

/// How it ends: what only waits ends well by itself, and what is refused does not.
pub(super) fn exit_of(stand: &[FileStands]) -> Exit {
    if stand.iter().any(|one| one.state == HadState::Refused) {
        Exit::CheckFailed
    } else if stand.iter().all(|one| matches!(one.state, HadState::Ready | HadState::Due)) {
        Exit::Done
    } else {
        Exit::TryAgain
    }
}

impl HallHas {
    /// Of a hall of which nothing can be looked up now.
    pub(super) fn unknown(hall: &str) -> Self {
        Self { name: hall.to_owned(), ..Self::default() }
    }

    /// What the engine has of it.
    pub(super) async fn look_up(kept: &Context, hall: &str) -> anyhow::Result<Self> {
        let want = engine::last_value(kept, fleet::WANT, hall).await?;
        let have = engine::last_value(kept, fleet::HAVE, hall).await?;
        let have = have.filter(|message| !engine::is_answered(message));
        let is_wished = want.is_some();
        let wished = want.and_then(|message| {
            let letter: Letter = serde_json::from_slice(&message.payload).ok()?;
            let wish = Wish::of(&letter).ok().filter(|wish| wish.to == hall && letter.is_signed())?;
            Some((message.sequence, wish))
        });
        Ok(Self {
            name: hall.to_owned(),
            age_s: have.as_ref().map(|message| engine::age_of(message).as_secs_f64()),
            report: have.and_then(|message| told(&message.payload)),
            is_foreign: is_wished && wished.is_none(),
            wished,
        })
    }

    /// The rev of the wish that it keeps; 0 if it told nothing.
    pub(super) fn kept_rev(&self) -> u64 {
        self.report.as_ref().map_or(0, |report| report.rev)
    }

    /// How it stands to a file that it was wished by that message of the engine.
    pub(super) fn stands(&self, file: &WishedFile, seq: u64) -> FileStands {
        let stands = |state, text: String| {
            let (hall, file) = (self.name.clone(), file.clone());
            FileStands { hall, file, state, text, faults: Vec::new(), percent: None }
        };
        let open = |text: &str| stands(HadState::Waiting, format!("waiting: {text}"));
        let Some(report) = &self.report else {
            return open(
                "the hall told nothing yet; check its link, and that its service is of this version",
            );
        };
        let had = match file.kind {
            FileKind::Cue => report.cues.get(&file.id),
            FileKind::Playlist => report.playlists.get(&file.id),
            FileKind::DroppedCue => report.dropped_cues.get(&file.id),
            FileKind::DroppedPlaylist => report.dropped_playlists.get(&file.id),
        };
        let had = had.filter(|had| had.sha256 == file.sha256);
        if let Some(had) = had.filter(|had| had.state == HadState::Ready || report.seen >= seq) {
            let said = match had.state {
                HadState::Ready if file.is_dropped() => had.why.clone().unwrap_or_else(|| GONE.to_owned()),
                HadState::Missing if file.is_dropped() => "to go".to_owned(),
                _ => had.said(),
            };
            let text = if self.is_unheard() { format!("{said}, as it was heard last") } else { said };
            return FileStands {
                faults: had.faults.clone(),
                percent: had.percent,
                ..stands(had.state, text)
            };
        }
        match &report.refused {
            _ if report.seen < seq && self.is_unheard() => {
                open("the hall is not heard; it fetches it once it is back")
            }
            _ if report.seen < seq => open("the hall has not looked up the wish yet"),
            Some(why) => stands(HadState::Refused, format!("refused: {why}")),
            None => stands(HadState::Refused, "refused: it is wished no more".to_owned()),
        }
    }

    fn cues(&self) -> Vec<FileStands> {
        let Some((seq, wish)) = &self.wished else { return Vec::new() };
        let file = |id: &String, sha256: String| WishedFile { kind: FileKind::Cue, id: id.clone(), sha256 };
        wish.cues.iter().map(|(id, cue)| self.stands(&file(id, cue.sha256.clone()), *seq)).collect()
    }

    fn playlists(&self) -> Vec<FileStands> {
        let Some((seq, wish)) = &self.wished else { return Vec::new() };
        let file =
            |id: &String, sha256: String| WishedFile { kind: FileKind::Playlist, id: id.clone(), sha256 };
        wish.playlists.iter().map(|(id, list)| self.stands(&file(id, list.file().sha256), *seq)).collect()
    }

    fn dropped(&self) -> Vec<FileStands> {
        let Some((seq, wish)) = &self.wished else { return Vec::new() };
        let file = |kind, id: &String| WishedFile { kind, id: id.clone(), sha256: String::new() };
        let cues = wish.drops.cues.iter().map(|id| file(FileKind::DroppedCue, id));
        let playlists = wish.drops.playlists.iter().map(|id| file(FileKind::DroppedPlaylist, id));
        cues.chain(playlists).map(|file| self.stands(&file, *seq)).collect()
    }

    fn all(&self) -> Vec<FileStands> {
        [self.cues(), self.playlists(), self.dropped()].concat()
    }

    /// True if what it told is old.
    fn is_unheard(&self) -> bool {
        self.age_s.is_none_or(|age_s| age_s > UNHEARD.as_secs_f64())
    }

    /// True if it has looked up what the engine has as its wish, and does not take that.
    fn refuses(&self) -> bool {
        let (Some(report), Some((seq, _))) = (&self.report, &self.wished) else { return false };
        report.refused.is_some() && report.seen >= *seq
    }

    fn row(&self) -> HallRow<'_> {
        let wished_rev = self.wished.as_ref().map(|(_, wish)| wish.rev);
        HallRow {
            hall: self,
            wished_rev,
            cues: self.cues(),
            playlists: self.playlists(),
            dropped: self.dropped(),
        }
    }
}

impl WishedFile {
    /// As people read it: cues by their ids alone.
    pub(super) fn name(&self) -> String {
        match self.kind {
            FileKind::Cue => self.id.clone(),
            FileKind::Playlist => format!("playlist {}", self.id),
            FileKind::DroppedCue => format!("dropped {}", self.id),
            FileKind::DroppedPlaylist => format!("dropped playlist {}", self.id),
        }
    }

    /// True of what shall go.
    pub(super) fn is_dropped(&self) -> bool {
        matches!(self.kind, FileKind::DroppedCue | FileKind::DroppedPlaylist)
    }
}

impl FileStands {
    /// True if nothing more comes of it by itself, but what comes at its time.
    pub(super) fn is_settled(&self) -> bool {
        matches!(self.state, HadState::Ready | HadState::Refused | HadState::Due)
    }

    /// True of a file that went because it was to go.
    pub(super) fn is_gone(&self) -> bool {
        self.state == HadState::Ready && self.file.is_dropped() && self.text.starts_with(GONE)
    }

    /// True if it is there.
    pub(super) fn is_ready(&self) -> bool {
        self.state == HadState::Ready
    }

    /// It in a line.
    pub(super) fn said(&self) -> String {
        said(&format!("{}: {}: {}", self.hall, self.file.name(), self.text))
    }

    /// The same without what changes all the time.
    pub(super) fn said_coarsely(&self) -> String {
        match self.percent {
            Some(..100) => said(&format!("{}: {}: fetching", self.hall, self.file.name())),
            _ => self.said(),
        }
    }

    /// The same with every fault, a line each.
    pub(super) fn whole(&self) -> String {
        let mut text = self.said() + "\n";
        for fault in &self.faults {
            text.push_str(&format!("  {}\n", said(fault)));
        }
        text
    }
}

/// What a hall tells that it has, short and plain.
fn told(payload: &[u8]) -> Option<HaveReport> {
    let report = json::clipped(serde_json::from_slice(payload).ok()?, TEXT, NAMED);
    serde_json::from_value(report).ok()
}

/// The table as people read it, and below it what is not there.
fn drawn(halls: &[HallHas], stand: &[FileStands]) -> String {
    let header = ["hall", "has", "version", "configuration", "told", "what to know"];
    let mut text = table::table(header, halls.iter().map(|hall| line(hall, stand)));
    for one in stand.iter().filter(|one| !one.is_ready()) {
        text.push_str(&one.whole());
    }
    for hall in halls.iter().filter(|hall| hall.refuses()) {
        let why = hall.report.as_ref().and_then(|report| report.refused.as_deref()).unwrap_or_default();
        text.push_str(&(said(&format!("{}: its wish: refused: {why}", hall.name)) + "\n"));
    }
    text
}

fn line(hall: &HallHas, stand: &[FileStands]) -> [String; 6] {
    let own = || stand.iter().filter(|one| one.hall == hall.name);
    let ready = own().filter(|one| one.is_ready()).count();
    let know = match (&hall.report, &hall.wished) {
        _ if hall.is_foreign => "what the engine has as its wish is none; push again with --only",
        (None, _) => "it told nothing yet",
        _ if hall.is_unheard() => "it is not heard now",
        (Some(report), _) if report.refused.is_some() => "it does not take what the engine has as its wish",
        (_, None) => "nothing was wished for it",
        _ if ready < own().count() => "see below",
        _ => "",
    };
    let (version, config) = hall
        .report
        .as_ref()
        .map_or(("-", ""), |report| (report.version.as_str(), report.config.get(..8).unwrap_or_default()));
    let told = hall.age_s.map_or_else(|| "-".to_owned(), |age_s| age(age_s) + " ago");
    let has = format!("{ready} of {}", own().count());
    [&hall.name, &has, version, config, &told, know].map(said)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::WishHad;

    fn hall(refused: Option<&str>, seen: u64) -> HallHas {
        let mut wish = Wish::default();
        wish.drop_cue("strom");
        let had = WishHad { state: HadState::Ready, ..WishHad::default() };
        let report = HaveReport {
            seen,
            refused: refused.map(str::to_owned),
            dropped_cues: [("strom".to_owned(), had)].into(),
            ..HaveReport::default()
        };
        HallHas {
            name: "berlin.h1".to_owned(),
            age_s: Some(1.0),
            report: Some(report),
            wished: Some((7, wish)),
            is_foreign: false,
        }
    }

    #[test]
    fn a_hall_that_has_all_of_it_and_does_not_take_its_wish_is_not_well() {
        for (hall, exit) in [
            (hall(None, 7), Exit::Done),
            (hall(Some("allow of [fleet] does not name cues"), 7), Exit::CheckFailed),
            (hall(Some("of the one before"), 6), Exit::Done),
        ] {
            let stand = hall.all();
            assert_eq!(exit_of_halls(std::slice::from_ref(&hall), &stand), exit, "{hall:?}");
            let says =
                drawn(std::slice::from_ref(&hall), &stand).contains("its wish: refused: allow of [fleet]");
            assert_eq!(says, exit == Exit::CheckFailed);
        }
    }
}
