//! `kinocue fleet playlist`: playlists into halls, by a signed wish for each, and what came of it in each.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};
use jiff::civil::{DateTime, Time};
use jiff::{Timestamp, ToSpan as _, Zoned};

use super::engine;
use super::have::{FileKind, WishedFile};
use super::wishing::WishArgs;
use crate::cli::client::cue_id_of;
use crate::cli::{Exit, Failure, OrExit as _};
use crate::fleet::{LONGEST_WISH, WishedPlaylist};
use crate::playlist::Playlist;
use crate::sys;
use crate::time::is_second_60;

/// Puts playlists into halls that allow it (playlists), and says what came of it in each.
///
/// Each hall checks them as it checks one that is loaded: that its library has the cues, proved for its seats, and its configuration the
/// presets, effects and films. It takes them in while it is parked and unarmed. None is loaded by it, one that is loaded stays, and so does
/// what people in the hall have put there.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet playlist saturday.toml --to 'berlin.*'
  kinocue fleet playlist today.toml --to all --from 04:00
  kinocue fleet playlist today.toml --to all --from 2026-11-22T04:00+01:00 --no-wait

Exit codes: 0 all halls have all of it, or have checked it for its time, 1 a hall refuses one, or it has faults, 66 no such file or hall,
69 the engine does not answer, 75 a hall does not have it yet")]
pub(super) struct Args {
    /// The files; the id of a playlist is the name of its file without its ending.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// From when on the halls shall have them [default: at once]: 04:00, the next one, 2026-11-22T04:00, both by the clock of this desk, or
    /// with an offset, 2026-11-22T04:00+01:00.
    #[arg(long, value_name = "WHEN", value_parser = when)]
    from: Option<u64>,
    #[command(flatten)]
    of: WishArgs,
}

pub(super) fn run(Args { files, from, of }: &Args) -> Result<Exit, Failure> {
    let (settings, halls) = of.read()?;
    let mut playlists: Vec<(String, WishedPlaylist)> = Vec::new();
    for path in files {
        let id = cue_id_of(path)?;
        if playlists.iter().any(|(before, _)| *before == id) {
            return Err(anyhow!("two of the files would be the playlist {id}")).or_exit(Exit::Usage);
        }
        playlists.push((id, WishedPlaylist { text: read(path)?, from_ms: from.unwrap_or(0) }));
    }
    let file = |(id, playlist): &(String, WishedPlaylist)| WishedFile {
        kind: FileKind::Playlist,
        id: id.clone(),
        sha256: playlist.file().sha256,
    };
    let wished: Vec<_> = playlists.iter().map(file).collect();
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let kept = engine::kept(&client);
        engine::prepare(&kept).await?;
        of.wish(&kept, &settings, halls, &wished, |wish| {
            playlists.iter().for_each(|(id, playlist)| wish.want_playlist(id, playlist));
        })
        .await
    })
}

/// The text of a playlist, which has no faults of its own.
fn read(path: &Path) -> Result<String, Failure> {
    let unread = || format!("cannot read {}", path.display());
    let file = sys::file::open(path).with_context(unread).or_exit(Exit::NoInput)?;
    let mut text = String::new();
    file.take(LONGEST_WISH as u64).read_to_string(&mut text).with_context(unread).or_exit(Exit::Io)?;
    Playlist::parse(path, &text).or_exit(Exit::CheckFailed)?;
    Ok(text)
}

/// A time as Unix milliseconds.
fn when(text: &str) -> Result<u64, String> {
    when_from(text, &Zoned::now())
}

/// The same for somebody who types it then and there.
fn when_from(text: &str, now: &Zoned) -> Result<u64, String> {
    let here = |at: DateTime| Some(at.to_zoned(now.time_zone().clone()).ok()?.timestamp());
    let next = |at: Time| {
        let today = here(now.date().to_datetime(at))?;
        if today > now.timestamp() { Some(today) } else { here((now.date() + 1.day()).to_datetime(at)) }
    };
    // A date by itself would be its midnight, and is more likely a slip.
    let at = match text.len() {
        _ if is_second_60(text) => None,
        ..=8 => text.parse::<Time>().ok().and_then(next),
        9..=10 => None,
        _ => text.parse::<Timestamp>().ok().or_else(|| here(text.parse::<DateTime>().ok()?)),
    };
    let ms = at.and_then(|at| u64::try_from(at.as_millisecond()).ok());
    ms.ok_or_else(|| "write 04:00, 2026-11-22T04:00, or 2026-11-22T04:00+01:00".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_the_next_one_of_the_day_one_of_the_desk_or_one_with_its_offset() {
        let now = "2026-11-21T19:05:00+01:00[+01:00]".parse::<Zoned>().unwrap();
        let told = |text: &str| {
            let at = Timestamp::from_millisecond(when_from(text, &now).unwrap().try_into().unwrap()).unwrap();
            at.to_string()
        };
        assert_eq!(told("04:00"), "2026-11-22T03:00:00Z");
        assert_eq!(told("19:06"), "2026-11-21T18:06:00Z");
        assert_eq!(told("19:05"), "2026-11-22T18:05:00Z", "that is now");
        assert_eq!(told("2026-11-22T04:00"), "2026-11-22T03:00:00Z");
        assert_eq!(told("2026-11-22T04:00+02:00"), "2026-11-22T02:00:00Z");
        assert_eq!(told("2026-11-22 04:00:30Z"), "2026-11-22T04:00:30Z");
        for wrong in [
            "",
            "4",
            "25:00",
            "04:00:60",
            "2026-11-22T04:00:60Z",
            "2026-11-22",
            "tomorrow",
            "2026-13-01T04:00",
            "1969-01-01T00:00Z",
            "-5",
        ] {
            assert!(when_from(wrong, &now).is_err(), "{wrong}");
        }
    }
}
