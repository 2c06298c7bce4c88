//! A folder of playlists. Ids in, playlists out; nothing outside the folder is ever read.

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use serde::Serialize;
use utoipa::ToSchema;

use super::{Playlist, PlaylistId};
use crate::control::{Code, Problem};
use crate::sys::folder::Folder;

/// The largest playlist that is read, bytes.
const MAX_LEN: u64 = 1 << 20;
/// What a playlist's file is called behind its id.
const ENDING: &str = ".toml";

/// A folder of playlists; cheap to make, reads at each question.
#[derive(Debug, Clone)]
pub struct Shelf {
    pub(super) dir: PathBuf,
}

/// One playlist of the folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub(crate) struct PlaylistInfo {
    /// Its id.
    pub(crate) id: String,
    /// Its title; null if it has faults.
    pub(crate) title: Option<String>,
    /// The ids of its cues, in order.
    pub(crate) cues: Vec<String>,
    /// Every fault of its file. What the library and the configuration say of it shows when it is loaded.
    pub(crate) faults: Vec<String>,
}

impl Shelf {
    /// The playlists in `dir`; there are none where there is no such folder.
    #[must_use]
    pub fn new(dir: &Path) -> Self {
        Self { dir: dir.to_owned() }
    }

    /// All playlists by their ids, also those with faults.
    ///
    /// # Errors
    /// Where the folder is there and cannot be read: then nobody knows which there are.
    pub(crate) fn all(&self) -> Result<Vec<PlaylistInfo>, Problem> {
        let ids = self.ids().map_err(|error| {
            let detail = format!("cannot read the playlists in {}: {error}", self.dir.display());
            Problem::new(
                Code::File,
                detail,
                "let the service read that folder, or name another in [library] playlists",
            )
        })?;
        let all = ids.into_iter().filter_map(|id| match self.read(&id) {
            Ok(Playlist { title, entries, .. }) => Some(PlaylistInfo {
                id: id.to_string(),
                title: Some(title),
                cues: entries.iter().map(|entry| entry.cue.to_string()).collect(),
                faults: Vec::new(),
            }),
            Err(problem) if problem.code == Code::Unknown => None, // a folder, a symbolic link, or gone since
            Err(problem) => Some(PlaylistInfo {
                id: id.to_string(),
                title: None,
                cues: Vec::new(),
                faults: if problem.faults.is_empty() { vec![problem.detail] } else { problem.faults },
            }),
        });
        Ok(all.collect())
    }

    /// Reads a playlist.
    ///
    /// # Errors
    /// [`Problem`] where there is none of that name, or it has faults, each with its place.
    pub(crate) fn read(&self, id: &PlaylistId) -> Result<Playlist, Problem> {
        let name = file_name(id);
        let path = self.dir.join(&name);
        let text = match self.text(&name) {
            Ok(Some(text)) => text,
            Ok(None) => return Err(self.unknown(id)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(self.unknown(id)),
            Err(error) => {
                let detail = format!("cannot read {}: {error}", path.display());
                return Err(Problem::new(Code::File, detail, "check the file; it has to be UTF-8 text"));
            }
        };
        read_as(id, &path, &text)
    }

    /// None where there is no such folder.
    fn ids(&self) -> io::Result<Vec<PlaylistId>> {
        let names = match Folder::open(&self.dir).and_then(|folder| folder.names()) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            names => names?,
        };
        Ok(names.iter().filter_map(|name| name.strip_suffix(ENDING)?.parse().ok()).collect())
    }

    fn unknown(&self, id: &PlaylistId) -> Problem {
        // Where they cannot be read, none is near it.
        let ids: Vec<_> = self.ids().unwrap_or_default().iter().map(ToString::to_string).collect();
        Problem::unknown(
            "playlist",
            &id.to_string(),
            ids.iter().map(String::as_str),
            "`kinocue playlist`, the page and GET /api/v1/playlists list them",
        )
    }

    pub(super) fn text(&self, name: &str) -> io::Result<Option<String>> {
        let Some((file, stamp)) = Folder::open(&self.dir)?.file(name)? else { return Ok(None) };
        if stamp.size > MAX_LEN {
            return Err(io::Error::other(format!("it is longer than {MAX_LEN} bytes")));
        }
        let mut text = String::new();
        file.take(MAX_LEN).read_to_string(&mut text)?;
        Ok(Some(text))
    }
}

/// The file of a playlist.
pub(super) fn file_name(id: &PlaylistId) -> String {
    format!("{id}{ENDING}")
}

/// The playlist that a text is.
pub(super) fn read_as(id: &PlaylistId, path: &Path, text: &str) -> Result<Playlist, Problem> {
    Playlist::parse(path, text).map_err(|faults| {
        let lines = faults.to_string().lines().map(str::to_owned).collect();
        Problem::new(Code::Check, format!("the playlist {id} has faults"), "correct these faults").with(lines)
    })
}
