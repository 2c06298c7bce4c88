//! The daemon's library: what it holds, and a file into it.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use hyper::Method;
use hyper::body::{Body, Bytes, Frame, SizeHint};
use serde::Deserialize;

use super::server::{ServerArgs, in_path};
use super::{http, reply, view};
use crate::cli::table::table;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::sys;

/// How long an upload and its proof may take.
const PATIENCE: Duration = Duration::from_secs(600);
/// Bytes that are read of the file at a time.
const PIECE: usize = 64 << 10;

/// The commands of the library.
#[derive(Debug, clap::Subcommand)]
pub(in crate::cli) enum CuesCommand {
    /// Lists the cues of the daemon's library.
    #[command(after_help = "Examples:\n  kinocue cues\n  kinocue cues --json")]
    Cues(ServerArgs),
    /// Uploads a cue file to the daemon's library.
    ///
    /// The file is checked and proved first; a bad one is rejected.
    #[command(after_help = "\
Examples:
  kinocue upload cues/bench-ride.csv
  kinocue upload cues/seat-demo.csv --id demo-2

Exit codes: 0 in the library, 1 it breaks limits, 65 it cannot be read or asks for what the hall does not have (every fault is
listed), 66 no such file, 77 not allowed")]
    Upload(UploadArgs),
}

/// A file for the library.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct UploadArgs {
    /// The cue file.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Its id in the library: a to z, 0 to 9, _ and - [default: the file's name without its ending].
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// One cue of the library.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ListedCue {
    id: String,
    title: Option<String>,
    length_s: Option<f64>,
    axes: Option<usize>,
    effects: Vec<String>,
    proof: ProvedCue,
}

/// True if it keeps the limits of the hall.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ProvedCue {
    state: String,
}

pub(super) fn run(command: &CuesCommand) -> Result<Exit, Failure> {
    match command {
        CuesCommand::Cues(server) => list(server),
        CuesCommand::Upload(args) => upload(args),
    }
}

fn list(server: &ServerArgs) -> Result<Exit, Failure> {
    let reply = server.get("/api/v1/cues")?;
    server.show(&reply)?;
    reply::done(&reply)?;
    if !server.json {
        let cues: Vec<ListedCue> =
            serde_json::from_str(&reply.text).context("the reply is not a list").or_exit(Exit::Internal)?;
        let header = ["cue", "title", "length", "axes", "effects", "proved"];
        print::out(&table(header, cues.iter().map(ListedCue::row)))?;
    }
    Ok(Exit::Done)
}

impl ListedCue {
    fn row(&self) -> [String; 6] {
        let or = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        [
            self.id.clone(),
            self.title.clone().unwrap_or_default(),
            or(self.length_s.map(view::time)),
            or(self.axes.map(|axes| axes.to_string())),
            self.effects.join(" "),
            self.proof.state.clone(),
        ]
    }
}

fn upload(args: &UploadArgs) -> Result<Exit, Failure> {
    let UploadArgs { file, id, server } = args;
    let id = id.clone().map_or_else(|| id_of(file), Ok)?;
    let body = FileBody::open(file).map_err(|error| {
        use io::ErrorKind::{InvalidInput, IsADirectory, NotFound};
        let missing = matches!(error.kind(), NotFound | IsADirectory | InvalidInput);
        let exit = if missing { Exit::NoInput } else { Exit::Io };
        Failure { exit, error: anyhow::Error::new(error).context(file.display().to_string()) }
    })?;
    let is_mcap = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    let media = if is_mcap { "application/vnd.mcap" } else { "text/csv" };
    let path = format!("/api/v1/cues/{}", in_path(&id));
    let place = if server.get(&path)?.status == 200 { ", in place of the one that was there" } else { "" };
    let request = http::request(Method::PUT, &path, Some(media), body)?;
    let reply = http::block_on(http::exchange(&server.socket()?, request, PATIENCE))?;
    server.show(&reply)?;
    reply::done(&reply)?;
    print::tell(&format!("kinocue: {id} is in the library{place}; next: kinocue load {id}"));
    Ok(Exit::Done)
}

/// The name of the file without its ending, where that can be an id.
pub(in crate::cli) fn id_of(file: &Path) -> Result<String, Failure> {
    let fits = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_-".contains(&byte);
    let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    if (1..=64).contains(&stem.len()) && stem.bytes().all(fits) {
        return Ok(stem.to_owned());
    }
    let why = "cannot be an id, which is 1 to 64 characters of a to z, 0 to 9, _ and -; give one with --id";
    Err(anyhow!("{stem:?} {why}")).or_exit(Exit::Usage)
}

/// A file as the body of a request, read piece by piece.
#[derive(Debug)]
pub(in crate::cli) struct FileBody {
    file: File,
    left: u64,
}

impl FileBody {
    /// Of that file, whole.
    pub(in crate::cli) fn open(path: &Path) -> io::Result<Self> {
        let file = sys::file::open(path)?;
        let left = file.metadata()?.len();
        Ok(Self { file, left })
    }
}

impl Body for FileBody {
    type Data = Bytes;
    type Error = io::Error;

    /// Waits for the disk, which holds up nothing: there is nothing else to do.
    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Self::Data>, Self::Error>>> {
        if self.left == 0 {
            return Poll::Ready(None);
        }
        let most = usize::try_from(self.left).map_or(PIECE, |left| left.min(PIECE));
        let mut piece = vec![0; most];
        Poll::Ready(Some(match self.file.read(&mut piece) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()), // it has become shorter
            Ok(len) => {
                piece.truncate(len);
                self.left -= len as u64;
                Ok(Frame::data(Bytes::from(piece)))
            }
            Err(error) => Err(error),
        }))
    }

    fn is_end_stream(&self) -> bool {
        self.left == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_called_as_it_is_named_unless_that_is_no_id() {
        assert_eq!(id_of(Path::new("/tmp/new-ride_2.mcap")).unwrap(), "new-ride_2");
        for bad in ["New Ride.csv", "..", "", "/", "é.csv"] {
            assert!(id_of(Path::new(bad)).is_err(), "{bad}");
        }
    }
}
