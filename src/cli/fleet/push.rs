//! `kinocue fleet push`: cues into the libraries of halls, by a signed wish for each, and what came of it in each.

use std::path::PathBuf;

use anyhow::anyhow;

use super::engine;
use super::have::{FileKind, WishedFile};
use super::object::CueFile;
use super::wishing::WishArgs;
use crate::cli::client::cue_id_of;
use crate::cli::{Exit, Failure, OrExit as _, print};

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
    /// The cue files; the id of a cue is the name of its file without its ending.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    of: WishArgs,
}

pub(super) fn run(Args { files: paths, of }: &Args) -> Result<Exit, Failure> {
    let (settings, halls) = of.read()?;
    let mut files = Vec::new();
    for path in paths {
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
        let wished: Vec<_> = files.iter().map(file_of).collect();
        of.wish(&kept, &settings, halls, &wished, |wish| {
            files.iter().for_each(|file| wish.want_cue(&file.id, &file.cue));
        })
        .await
    })
}

fn file_of(file: &CueFile) -> WishedFile {
    WishedFile { kind: FileKind::Cue, id: file.id.clone(), sha256: file.cue.sha256.clone() }
}
