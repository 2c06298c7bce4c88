//! What a fleet brings among the playlists. What people put there is theirs, and stays.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use super::shelf::{file_name, read_as};
use super::{Playlist, PlaylistId, Shelf};
use crate::control::{Code, Problem};
use crate::library::{BroughtFiles, LeftThere, kept};
use crate::sys::folder::{Folder, Stamp};

/// Notes which files were brought; no playlist can have that name.
const FILE: &str = ".fleet.json";
/// While that is written.
const NEW_FILE: &str = ".fleet.new";
/// A playlist while it is written.
const NEW_LIST: &str = ".fleet-list.new";

/// How the folder stands to the text of a playlist that is wished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WishedText {
    /// It is there, whoever put it there.
    There,
    /// There is none of that id, or one that was brought: it may be put there.
    Absent,
    /// People of the hall have another playlist of that id.
    Theirs,
}

impl Shelf {
    /// How it stands to a text that is wished.
    ///
    /// # Errors
    /// Where the folder cannot be read.
    pub(crate) fn standing(&self, id: &PlaylistId, text: &str) -> Result<WishedText, Problem> {
        let name = file_name(id);
        let stand = || {
            let folder = match Folder::open(&self.dir) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(WishedText::Absent),
                folder => folder?,
            };
            // What cannot be read as text is another one.
            if matches!(self.text(&name), Ok(Some(own)) if own == text) {
                return Ok(WishedText::There);
            }
            let has_no_other = kept::<BroughtFiles>(&folder, FILE).has_no_other(&folder, &name)?;
            Ok(if has_no_other { WishedText::Absent } else { WishedText::Theirs })
        };
        stand().map_err(|error: io::Error| unkept("read the playlists", &error))
    }

    /// Reads a text that is wished as the file of that id.
    ///
    /// # Errors
    /// [`Problem`] with every fault and its place.
    pub(crate) fn read_wished(&self, id: &PlaylistId, text: &str) -> Result<Playlist, Problem> {
        read_as(id, Path::new(&file_name(id)), text)
    }

    /// Puts a text into its place, where people have no other of that id. Not for two threads at a time.
    ///
    /// # Errors
    /// Where people have one, `may` says no at last, or the disk does not take it; what was there stays.
    pub(crate) fn bring(
        &self,
        id: &PlaylistId,
        text: &str,
        may: impl FnOnce() -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        let unwritten = |error: io::Error| unkept("write the playlist", &error);
        fs::create_dir_all(&self.dir).map_err(unwritten)?;
        let folder = Folder::open(&self.dir).map_err(unwritten)?;
        let stamp = write_new(&folder, text).map_err(unwritten)?;
        let put = || {
            may()?;
            if self.standing(id, text)? == WishedText::Theirs {
                return Err(theirs(id));
            }
            let name = file_name(id);
            let mut brought: BroughtFiles = kept(&folder, FILE);
            brought.note(&folder, name.clone(), stamp);
            note(&folder, &brought).map_err(unwritten)?;
            let is_put = brought.put(&folder, NEW_LIST, &name).map_err(unwritten)?;
            folder.sync().map_err(unwritten)?;
            if is_put { Ok(()) } else { Err(theirs(id)) }
        };
        put().inspect_err(|_| drop(folder.remove(NEW_LIST))) // what is left is written over by the next one
    }

    /// What is left of a playlist that shall go.
    ///
    /// # Errors
    /// Where the folder cannot be read.
    pub(crate) fn left_there(&self, id: &PlaylistId) -> Result<LeftThere, Problem> {
        let left = || match Folder::open(&self.dir) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(LeftThere::Nothing),
            folder => {
                let folder = folder?;
                kept::<BroughtFiles>(&folder, FILE).left_there(&folder, &[file_name(id)])
            }
        };
        left().map_err(|error: io::Error| unkept("read the playlists", &error))
    }

    /// Removes a playlist that was brought, where `may` still lets it. Not for two threads at a time.
    ///
    /// # Errors
    /// Where it does not, or the disk does not; one that people put there stays in any case.
    pub(crate) fn drop_brought(
        &self,
        id: &PlaylistId,
        may: impl FnOnce() -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        may()?;
        let remove = || {
            let folder = Folder::open(&self.dir)?;
            let mut brought: BroughtFiles = kept(&folder, FILE);
            brought.remove(&folder, &[file_name(id)])?;
            note(&folder, &brought)
        };
        remove().map_err(|error: io::Error| unkept("remove the playlist", &error))
    }
}

/// Has a text on the disk under a name that no playlist has.
fn write_new(folder: &Folder, text: &str) -> io::Result<Stamp> {
    folder.remove_abandoned(NEW_LIST)?;
    let mut file = folder.create(NEW_LIST)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    Stamp::of(&file)
}

/// Has it on the disk which files were brought.
fn note(folder: &Folder, brought: &BroughtFiles) -> io::Result<()> {
    folder.replace(FILE, NEW_FILE, &serde_json::to_vec(brought)?)?;
    folder.sync()
}

/// That people have a playlist of that id.
pub(crate) fn theirs(id: &PlaylistId) -> Problem {
    let detail = format!("people of the hall have another playlist {id}, and what is theirs stays");
    Problem::new(Code::State, detail, "give it another name, or have them remove theirs")
}

fn unkept(what: &str, error: &io::Error) -> Problem {
    Problem::new(
        Code::File,
        format!("cannot {what}: {error}"),
        "check the folder of the playlists, which the service has to write, and its disk",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "title = \"One\"\n[[entry]]\ncue = \"storm\"\n";
    const TWO: &str = "title = \"Two\"\n[[entry]]\ncue = \"storm\"\n";

    #[test]
    fn a_playlist_that_was_brought_is_replaced_and_one_of_people_never() {
        let dir = tempfile::tempdir().unwrap();
        let (own, id) = (dir.path().join("playlists"), "saturday".parse::<PlaylistId>().unwrap());
        let (shelf, path) = (Shelf::new(&own), own.join("saturday.toml"));
        let stands = |text| shelf.standing(&id, text).unwrap();
        assert_eq!(stands(ONE), WishedText::Absent, "there is no folder yet");
        shelf.bring(&id, ONE, || Ok(())).unwrap();
        assert_eq!((stands(ONE), stands(TWO)), (WishedText::There, WishedText::Absent));
        assert_eq!(shelf.read(&id).unwrap().title, "One");
        shelf.bring(&id, TWO, || Err(theirs(&id))).unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), ONE, "the hall said no at last");
        shelf.bring(&id, TWO, || Ok(())).unwrap();
        assert_eq!(shelf.all().unwrap().len(), 1, "what is noted beside it is no playlist");
        fs::write(&path, TWO.replace("Two", "Own")).unwrap();
        assert_eq!(stands(ONE), WishedText::Theirs, "somebody changed it");
        shelf.bring(&id, ONE, || Ok(())).unwrap_err();
        assert_eq!(shelf.read(&id).unwrap().title, "Own");
        fs::write(&path, ONE).unwrap();
        assert_eq!(stands(ONE), WishedText::There, "they have the very same");
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink("/dev/null", &path).unwrap();
        assert_eq!(stands(ONE), WishedText::Theirs, "what is no file");
        fs::remove_file(&path).unwrap();
        shelf.bring(&id, TWO, || Ok(())).unwrap();
        assert_eq!(shelf.left_there(&id).unwrap(), LeftThere::Brought);
        shelf.drop_brought(&id, || Err(theirs(&id))).unwrap_err();
        assert!(path.exists(), "the hall said no at last");
        shelf.drop_brought(&id, || Ok(())).unwrap();
        assert_eq!(shelf.left_there(&id).unwrap(), LeftThere::Nothing);
        fs::write(&path, TWO).unwrap();
        shelf.drop_brought(&id, || Ok(())).unwrap();
        assert_eq!(shelf.left_there(&id).unwrap(), LeftThere::Theirs, "theirs stays, whatever is asked");
        let mut names: Vec<_> = fs::read_dir(&own)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, [".fleet.json", "saturday.toml"], "nothing half written is left");
    }
}
