//! `kinocue fleet pull`: the file of a cue out of a hall's library to the desk, piece by piece, by signed orders as any other.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::Client;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use futures_util::future::join_all;
use hyper::body::Bytes;
use serde_json::json;
use tokio::time::sleep;

use super::act::{Answer, Asked, chosen, request};
use super::desk::said;
use super::part::CuePart;
use super::settings::DeskSettings;
use super::wishing::own_wish;
use super::{DeskArgs, engine, settings};
use crate::cli::{Exit, Failure, OrExit as _, exit, print};
use crate::cue::limits;
use crate::fleet::{self, CuePiece, WishedCue};
use crate::library::Id;

/// Pieces that are asked for at a time.
const BATCH: u64 = 4;
/// How long a hall may take for one.
const PATIENCE: Duration = Duration::from_secs(10);
/// How often one is asked for, where it does not come at once, and the wait between.
const TRIES: u32 = 3;
const AGAIN: Duration = Duration::from_secs(1);

/// Fetches a cue out of the library of a hall that allows it (pull) and is parked.
///
/// All of it is held against the SHA-256 that the hall tells, and that against what this desk wished there, or against --sha256. Nothing of it
/// goes anywhere else: whoever wants it in other halls pushes it, and each proves it. What is fetched in part is fetched on.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet pull berlin.h1 storm
  kinocue fleet pull berlin.h1 storm --out from-berlin.csv --force

Exit codes: 0 it is here, 1 the hall refuses, or what it sent is not the file that it names, 64 usage, also where the file is there,
66 no such hall, 69 the engine does not answer, 75 the hall does not answer")]
pub(super) struct Args {
    #[command(flatten)]
    desk: DeskArgs,
    /// The hall, SITE.HALL.
    #[arg(value_name = "HALL")]
    hall: String,
    /// The id of the cue.
    #[arg(value_name = "CUE")]
    cue: Id,
    /// Where it goes [default: its id with .csv or .mcap, here].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file that is there.
    #[arg(long)]
    force: bool,
    /// Take it only if this is its SHA-256.
    #[arg(long, value_name = "HEX")]
    sha256: Option<String>,
}

/// The way to a cue of a hall.
struct Way<'a> {
    settings: &'a DeskSettings,
    client: Client,
    hall: &'a str,
    cue: &'a Id,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::desk(&args.desk.desk)?;
    let halls = chosen(&settings.halls, std::slice::from_ref(&args.hall))?;
    let [hall] = &halls[..] else {
        return Err(anyhow!("{} is more than one hall; name one", args.hall)).or_exit(Exit::Usage);
    };
    args.out.iter().try_for_each(|out| exit::refuse_to_replace(out, args.force))?;
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let way = Way { settings: &settings, client, hall, cue: &args.cue };
        let first = way.piece(0, None).await?;
        let file = checked(&first, args.sha256.as_deref()).map_err(|why| way.refused(why))?;
        let own = PathBuf::from(format!("{}.{}", args.cue, if first.mcap { "mcap" } else { "csv" }));
        let out = args.out.as_ref().unwrap_or(&own);
        exit::refuse_to_replace(out, args.force)?;
        way.fetch(&file, out, args.force).await?;
        let wished = way.wished(&file).await;
        let (out, WishedCue { bytes, sha256 }) = (out.display(), file);
        print::out(&format!("{out}: {bytes} bytes, sha256 {sha256}; {wished}\n"))?;
        Ok(Exit::Done)
    })
}

/// The file that a hall says that it has. The hall may be anybody who has its key, so its words make no name and no size by themselves.
fn checked(first: &CuePiece, sha256: Option<&str>) -> Result<WishedCue, String> {
    let file = WishedCue { sha256: first.sha256.clone(), bytes: first.bytes };
    if !file.is_named() {
        return Err("what it names is no SHA-256".to_owned());
    }
    if file.bytes == 0 || file.bytes > limits::MAX_FILE {
        return Err(format!("its file of {} bytes is outside 1..={}", file.bytes, limits::MAX_FILE));
    }
    match sha256 {
        Some(wanted) if !wanted.eq_ignore_ascii_case(&file.sha256) => {
            Err(format!("it has another cue of that id, sha256 {}", file.sha256))
        }
        _ => Ok(file),
    }
}

impl Way<'_> {
    /// A piece of the cue; of that very file, where it is known which.
    async fn piece(&self, n: u64, of: Option<&WishedCue>) -> Result<CuePiece, Failure> {
        let asked =
            Asked { word: "pull", args: json!({ "cue": self.cue.to_string(), "n": n }), patience: PATIENCE };
        // One that is refused at first is so for good; later a piece may have been too long on its way.
        let tries = if of.is_some() { TRIES } else { 1 };
        let mut answer = request(self.settings, &self.client, self.hall, &asked).await;
        for _ in 1..tries {
            if answer.is_ok() {
                break;
            }
            sleep(AGAIN).await;
            answer = request(self.settings, &self.client, self.hall, &asked).await;
        }
        let reply = answer.map_err(|answer| {
            let exit = if matches!(answer, Answer::Silent(_)) { Exit::TryAgain } else { Exit::CheckFailed };
            Failure { exit, error: anyhow!("{}: {}", self.hall, said(&answer.line())) }
        })?;
        let piece = serde_json::from_value::<CuePiece>(reply.reply);
        let piece = piece.map_err(|_| self.refused("what it sent is no piece of a cue".to_owned()))?;
        match of {
            Some(file) if piece.sha256 != file.sha256 || piece.bytes != file.bytes => {
                Err(self.refused("the cue changed while it was fetched; pull it again".to_owned()))
            }
            _ => Ok(piece),
        }
    }

    /// Fetches what is missing of a file, and puts it into its place.
    async fn fetch(&self, file: &WishedCue, out: &Path, force: bool) -> Result<(), Failure> {
        let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let unwritten = || format!("cannot write {}", out.display());
        let mut part = CuePart::open(folder, file).with_context(unwritten).or_exit(Exit::Io)?;
        while !part.next(BATCH).is_empty() {
            let pieces = join_all(part.next(BATCH).map(|n| self.piece(n, Some(file)))).await;
            let mut all = Vec::new();
            for piece in pieces {
                let bytes = STANDARD.decode(piece?.data);
                let bytes = bytes.map_err(|_| self.refused("what it sent is no base64".to_owned()))?;
                all.push(Bytes::from(bytes));
            }
            let short =
                |_| self.refused("a piece that it sent does not fit, or cannot be written".to_owned());
            part.add(&all).map_err(short)?;
        }
        if !part.is_right().with_context(unwritten).or_exit(Exit::Io)? {
            let _ = part.remove(); // nobody takes it for the file
            return Err(self.refused("what it sent is not the file that it names".to_owned()));
        }
        let name = out.file_name().and_then(|name| name.to_str());
        let name =
            name.with_context(|| format!("{} is no name of a file", out.display())).or_exit(Exit::Usage)?;
        if part.put(name, force).with_context(unwritten).or_exit(Exit::Io)? {
            return Ok(());
        }
        let _ = part.remove();
        exit::refuse_to_replace(out, force) // somebody put it there meanwhile
    }

    /// What this desk knows of that file.
    async fn wished(&self, file: &WishedCue) -> &'static str {
        let kept = engine::kept(&self.client);
        let last = engine::last_value(&kept, fleet::WANT, self.hall).await.ok().flatten();
        let wish = last.and_then(|message| own_wish(&message.payload, self.settings, self.hall).ok());
        match wish.and_then(|mut wish| wish.cues.remove(&self.cue.to_string())) {
            Some(wished) if wished == *file => "the very file that this desk wished there",
            Some(_) => "another file than this desk wished there",
            None => "as the hall has it; this desk wished none of that id there",
        }
    }

    fn refused(&self, why: String) -> Failure {
        Failure { exit: Exit::CheckFailed, error: anyhow!("{}: {why}", self.hall) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_hall_says_of_a_file_makes_no_name_and_no_size_by_itself() {
        let sha256 = "0123456789abcdef".repeat(4);
        let of = |sha256: &str, bytes: u64, wanted: Option<&str>| {
            let piece = CuePiece { sha256: sha256.to_owned(), bytes, mcap: false, data: String::new() };
            checked(&piece, wanted)
        };
        assert_eq!(of(&sha256, 5, None).unwrap().bytes, 5);
        assert!(of(&sha256, 5, Some(&sha256.to_uppercase())).is_ok());
        assert!(of(&sha256, 5, Some(&"0".repeat(64))).unwrap_err().contains("another cue"));
        for name in ["../../etc/passwd", "", &sha256.to_uppercase(), &sha256[1..]] {
            assert!(of(name, 5, None).unwrap_err().contains("no SHA-256"), "{name}");
        }
        for bytes in [0, limits::MAX_FILE + 1, u64::MAX] {
            assert!(of(&sha256, bytes, None).unwrap_err().contains("outside"), "{bytes}");
        }
    }
}
