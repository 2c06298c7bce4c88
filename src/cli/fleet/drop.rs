//! `kinocue fleet drop`: what the fleet brought goes again, by a signed wish for each hall.

use super::engine;
use super::have::{FileKind, WishedFile};
use super::wishing::WishArgs;
use crate::cli::{Exit, Failure};
use crate::library::Id;

/// Has halls remove cues and playlists that the fleet brought there.
///
/// Each goes while its hall is parked and unarmed. What is loaded stays until something else is, a cue for as long as a playlist of the hall
/// names it, and what people in the hall have put there always. Names are no longer wished by it either.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue fleet drop storm coaster --to 'berlin.*'
  kinocue fleet drop --playlist saturday --to all

Exit codes: 0 all of it is gone, 1 a hall refuses, 66 no such hall, or no hall had such a file, 69 the engine does not answer, 75 a hall has some of it yet")]
pub(super) struct Args {
    /// The ids of cues.
    #[arg(value_name = "CUE", required_unless_present = "playlist")]
    cues: Vec<Id>,
    /// The id of a playlist; may be given several times.
    #[arg(long, value_name = "ID")]
    playlist: Vec<Id>,
    #[command(flatten)]
    of: WishArgs,
}

pub(super) fn run(Args { cues, playlist, of }: &Args) -> Result<Exit, Failure> {
    let (settings, halls) = of.read()?;
    let file = |kind, id: &Id| WishedFile { kind, id: id.to_string(), sha256: String::new() };
    let dropped = cues.iter().map(|id| file(FileKind::DroppedCue, id));
    let dropped = dropped.chain(playlist.iter().map(|id| file(FileKind::DroppedPlaylist, id)));
    let dropped: Vec<_> = dropped.collect();
    engine::block_on(async {
        let client = engine::connect_desk(&settings.access, &settings.name).await?;
        let kept = engine::kept(&client);
        engine::prepare(&kept).await?;
        of.wish(&kept, &settings, halls, &dropped, |wish| {
            cues.iter().for_each(|id| wish.drop_cue(&id.to_string()));
            playlist.iter().for_each(|id| wish.drop_playlist(&id.to_string()));
        })
        .await
    })
}
