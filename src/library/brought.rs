//! What a fleet brought into the library, and what it wishes.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use serde::{Deserialize, Serialize};

use super::brought_files::{BroughtFiles, LeftThere};
use super::upload::unwritten;
use super::{Awaited, CueId, CueInfo, Library, Proved, Upload, file_name, file_problem, kept};
use crate::control::{Code, Problem};
use crate::sys::folder::{Folder, Stamp};
use crate::sys::lock::lock;

/// Its file; no cue can have that name.
const FILE: &str = ".fleet.json";
/// While it is written.
const NEW_FILE: &str = ".fleet.new";

/// What is kept of a fleet, across starts of the program.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Brought {
    /// What is wished, as it was signed.
    wish: Option<String>,
    /// Files that were brought.
    files: BroughtFiles,
    /// Cues that did not pass.
    refused: BTreeMap<String, RefusedCue>,
    /// What of the wish shall go, and was not there when that was wished.
    absent: BTreeSet<String>,
}

/// A cue that did not pass, so that it is not brought again and again.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct RefusedCue {
    sha256: String,
    /// The hall that it was checked for.
    hall: String,
    detail: String,
    faults: Vec<String>,
}

/// How the library stands to a cue that is wished.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum StandingOfCue {
    /// It has that very file, and that passes.
    Ready,
    /// It has none of that id, or one that was brought: that file may be.
    Missing {
        /// True if it takes the place of another.
        replaces: bool,
    },
    /// A file is there that was not checked yet.
    Unchecked,
    /// People of the hall have another cue of that id.
    Theirs,
    /// It did not pass.
    Refused {
        /// In short.
        detail: String,
        /// Every fault.
        faults: Vec<String>,
    },
}

impl Brought {
    /// What was kept; nothing where that cannot be read: then all that lies there counts as people's.
    pub(super) fn read(folder: &Folder) -> Self {
        kept(folder, FILE)
    }

    /// Has it on the disk.
    fn write(&self, folder: &Folder) -> Result<(), Problem> {
        let write = || {
            folder.replace(FILE, NEW_FILE, &serde_json::to_vec(self)?)?;
            folder.sync()
        };
        write().map_err(|error: io::Error| unwritten(&error))
    }

    /// True if nothing of that id is there but what was brought.
    fn has_no_other(&self, folder: &Folder, id: &CueId) -> io::Result<bool> {
        let has_no_other = |mcap| self.files.has_no_other(folder, &file_name(id, mcap));
        Ok(has_no_other(false)? && has_no_other(true)?)
    }

    /// Notes a file that is about to get its name.
    fn note(&mut self, folder: &Folder, name: String, stamp: Stamp) -> Result<(), Problem> {
        self.files.note(folder, name, stamp);
        self.write(folder)
    }
}

impl Library {
    /// What the fleet wishes, as it was signed; `None` if nothing is kept.
    pub(crate) fn wish(&self) -> Option<String> {
        lock(&self.inner.brought).wish.clone()
    }

    /// True if that of the wish shall go, and was not there when that was wished.
    pub(crate) fn was_absent(&self, what: &str) -> bool {
        lock(&self.inner.brought).absent.contains(what)
    }

    /// Keeps what the fleet wishes, on the disk; `names` says which cues it has, and what of it shall go is not there.
    ///
    /// # Errors
    /// [`Problem`] where the disk does not take it; what was kept before is kept on.
    pub(crate) fn keep_wish(
        &self,
        wish: String,
        names: impl Fn(&str) -> bool,
        absent: BTreeSet<String>,
    ) -> Result<(), Problem> {
        let folder = self.folder()?;
        let mut brought = lock(&self.inner.brought);
        let before = brought.wish.replace(wish);
        brought.refused.retain(|id, _| names(id));
        brought.absent = absent;
        brought.write(&folder).inspect_err(|_| brought.wish = before)
    }

    /// How it stands to wished cues, each by the digest of its file.
    pub(crate) fn standings(&self, wished: &[(CueId, &str)]) -> Result<Vec<StandingOfCue>, Problem> {
        let (folder, print) = (self.folder()?, self.inner.hall.fingerprint());
        let brought = lock(&self.inner.brought);
        wished.iter().map(|(id, sha256)| self.standing(&brought, &folder, &print, id, sha256)).collect()
    }

    fn standing(
        &self,
        brought: &Brought,
        folder: &Folder,
        print: &str,
        id: &CueId,
        sha256: &str,
    ) -> Result<StandingOfCue, Problem> {
        let info = self.info(id, print);
        let is_same = info.as_ref().and_then(|info| info.sha256.as_deref()) == Some(sha256);
        if let Some(info) = info.filter(|info| is_same || info.sha256.is_none()) {
            let detail = || format!("the cue {id} does not pass any more");
            return Ok(match info.proof {
                Proved::Passed => StandingOfCue::Ready,
                Proved::Failed { faults } => StandingOfCue::Refused { detail: detail(), faults },
                Proved::Unknown => StandingOfCue::Unchecked,
            });
        }
        let no_other = brought.has_no_other(folder, id);
        if !no_other.map_err(|error| file_problem("read the library", &error))? {
            return Ok(StandingOfCue::Theirs);
        }
        let refused = brought.refused.get(&id.to_string());
        Ok(match refused.filter(|refused| refused.sha256 == sha256 && refused.hall == print) {
            Some(RefusedCue { detail, faults, .. }) => {
                StandingOfCue::Refused { detail: detail.clone(), faults: faults.clone() }
            }
            None => StandingOfCue::Missing { replaces: self.cue(id).is_ok() },
        })
    }

    /// What is left of a cue that shall go.
    pub(crate) fn left_there(&self, id: &CueId) -> Result<LeftThere, Problem> {
        let left = lock(&self.inner.brought).files.left_there(&self.folder()?, &names(id));
        left.map_err(|error| file_problem("read the library", &error))
    }

    /// Removes what was brought of a cue, where `may` still lets it.
    ///
    /// # Errors
    /// Where it does not, or the disk does not; files that people put there stay in any case.
    pub(crate) fn drop_brought(
        &self,
        id: &CueId,
        may: impl FnOnce() -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        let folder = self.folder()?;
        let _changing = self.changing();
        let mut brought = lock(&self.inner.brought);
        may()?;
        let removed = brought.files.remove(&folder, &names(id));
        removed.map_err(|error| file_problem("remove the cue", &error))?;
        brought.write(&folder)
    }

    fn folder(&self) -> Result<Folder, Problem> {
        Folder::open(&self.inner.dir).map_err(|error| file_problem("open the library", &error))
    }
}

impl Upload {
    /// The same as [`Upload::finish`] for a file that is wished by its digest: it takes the place of nothing that people put there, and is
    /// asked once more whether it may come when it has passed. One that does not pass is noted.
    ///
    /// # Errors
    /// As [`Upload::finish`]; where it is another file, or people have a cue of that id.
    pub(crate) fn finish_wished(
        self,
        awaited: Option<&Awaited>,
        id: &CueId,
        sha256: &str,
        may: impl FnOnce() -> Result<(), Problem>,
    ) -> Result<CueInfo, Problem> {
        let library = self.library().clone();
        let (own, print) = (self.sha256(), library.inner.hall.fingerprint());
        if own != sha256 {
            let detail =
                format!("what came for {id} is not what is wished: its SHA-256 is {own}, not {sha256}");
            return Err(Problem::new(Code::Value, detail, "fetch it again"));
        }
        let folder = library.folder()?;
        let proved = self.prove(awaited).inspect_err(|problem| {
            if !problem.faults.is_empty() {
                let (detail, faults) = (problem.detail.clone(), problem.faults.clone());
                let refused = RefusedCue { sha256: sha256.to_owned(), hall: print, detail, faults };
                let mut brought = lock(&library.inner.brought);
                brought.refused.insert(id.to_string(), refused);
                let _ = brought.write(&folder); // where it is not kept, it is brought and refused again
            }
        })?;
        let _changing = library.changing();
        let mut brought = lock(&library.inner.brought);
        may()?;
        let no_other = brought.has_no_other(&folder, id);
        if !no_other.map_err(|error| file_problem("read the library", &error))? {
            return Err(theirs(id));
        }
        let (name, stamp) = proved.file()?;
        brought.refused.remove(&id.to_string());
        brought.note(&folder, name, stamp)?;
        proved.put_by(|folder, from, name, other| {
            if !brought.files.put(folder, from, name).map_err(|error| unwritten(&error))? {
                return Err(theirs(id));
            }
            brought.files.remove_one(folder, other).map_err(|error| unwritten(&error))
        })
    }
}

/// The files that a cue may be.
fn names(id: &CueId) -> [String; 2] {
    [false, true].map(|mcap| file_name(id, mcap))
}

/// That people have a cue of that id.
pub(crate) fn theirs(id: &CueId) -> Problem {
    let detail = format!("people of the hall have another cue {id}, and what is theirs stays");
    Problem::new(Code::State, detail, "push it under another id, or have them remove theirs")
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    fn id(text: &str) -> CueId {
        text.parse().unwrap()
    }

    /// Notes a file as it is noted before it gets its name.
    fn noted(folder: &Folder, brought: &mut Brought, from: &str, name: &str) {
        let stamp = folder.stamp(from).unwrap().unwrap();
        brought.note(folder, name.to_owned(), stamp).unwrap();
    }

    #[test]
    fn a_file_counts_as_brought_only_for_as_long_as_it_is_the_very_one_that_came() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, path) = (Folder::open(dir.path()).unwrap(), |name: &str| dir.path().join(name));
        let mut brought = Brought::default();
        assert!(brought.has_no_other(&folder, &id("storm")).unwrap(), "there is none");
        fs::write(path("new"), "1").unwrap();
        noted(&folder, &mut brought, "new", "storm.csv");
        folder.rename("new", "storm.csv").unwrap();
        let kept = Brought::read(&folder);
        assert!(kept.has_no_other(&folder, &id("storm")).unwrap(), "across starts");
        fs::write(path("storm.mcap"), "theirs").unwrap();
        assert!(!kept.has_no_other(&folder, &id("storm")).unwrap(), "in another form");
        fs::remove_file(path("storm.mcap")).unwrap();
        fs::write(path("theirs"), "1").unwrap();
        fs::rename(path("theirs"), path("storm.csv")).unwrap();
        assert!(!kept.has_no_other(&folder, &id("storm")).unwrap(), "the same bytes in another file");
        fs::remove_file(path("storm.csv")).unwrap();
        symlink("/dev/null", path("storm.csv")).unwrap();
        assert!(!kept.has_no_other(&folder, &id("storm")).unwrap(), "what is no file");
        fs::write(path(FILE), "{\"files\":[{").unwrap();
        fs::remove_file(path("storm.csv")).unwrap();
        fs::write(path("storm.csv"), "1").unwrap();
        assert!(!Brought::read(&folder).has_no_other(&folder, &id("storm")).unwrap(), "a damaged note");
    }

    #[test]
    fn what_was_brought_goes_and_what_people_put_beside_or_over_it_stays() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, path) = (Folder::open(dir.path()).unwrap(), |name: &str| dir.path().join(name));
        let mut brought = Brought::default();
        let left = |brought: &Brought| brought.files.left_there(&folder, &names(&id("storm"))).unwrap();
        assert_eq!(left(&brought), LeftThere::Nothing);
        fs::write(path("new"), "1").unwrap();
        noted(&folder, &mut brought, "new", "storm.csv");
        folder.rename("new", "storm.csv").unwrap();
        fs::write(path("storm.mcap"), "theirs").unwrap();
        assert_eq!(left(&brought), LeftThere::Brought);
        brought.files.remove(&folder, &names(&id("storm"))).unwrap();
        assert_eq!((left(&brought), brought.files.len()), (LeftThere::Theirs, 0));
        assert!(!path("storm.csv").exists() && path("storm.mcap").exists());
        fs::write(path("storm.csv"), "1").unwrap();
        brought.files.remove(&folder, &names(&id("storm"))).unwrap();
        assert!(path("storm.csv").exists(), "the same name, and not the file that came");
    }

    #[test]
    fn what_people_put_there_after_it_was_noted_that_a_file_comes_stays() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, path) = (Folder::open(dir.path()).unwrap(), |name: &str| dir.path().join(name));
        let mut brought = Brought::default();
        for came in ["1", "2"] {
            fs::write(path("new"), came).unwrap();
            noted(&folder, &mut brought, "new", "storm.csv");
            assert!(brought.files.put(&folder, "new", "storm.csv").unwrap());
            assert_eq!(fs::read_to_string(path("storm.csv")).unwrap(), came);
        }
        fs::write(path("new"), "3").unwrap();
        noted(&folder, &mut brought, "new", "storm.csv");
        fs::write(path("own"), "theirs").unwrap();
        fs::rename(path("own"), path("storm.csv")).unwrap();
        assert!(!brought.files.put(&folder, "new", "storm.csv").unwrap(), "over what was brought");
        fs::write(path("calm.csv"), "theirs").unwrap();
        noted(&folder, &mut brought, "new", "calm.csv");
        assert!(!brought.files.put(&folder, "new", "calm.csv").unwrap(), "where nothing was");
        for name in ["storm.csv", "calm.csv"] {
            assert_eq!(fs::read_to_string(path(name)).unwrap(), "theirs");
        }
    }

    #[test]
    fn a_crash_between_the_note_and_the_name_leaves_what_was_brought_before_as_such() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, path) = (Folder::open(dir.path()).unwrap(), |name: &str| dir.path().join(name));
        let mut brought = Brought::default();
        fs::write(path("first"), "1").unwrap();
        noted(&folder, &mut brought, "first", "storm.csv");
        folder.rename("first", "storm.csv").unwrap();
        fs::write(path("second"), "2").unwrap();
        noted(&folder, &mut brought, "second", "storm.csv");
        let mut after = Brought::read(&folder);
        assert!(after.has_no_other(&folder, &id("storm")).unwrap(), "the first one is there still");
        folder.rename("second", "storm.csv").unwrap();
        assert!(after.has_no_other(&folder, &id("storm")).unwrap(), "and so is the second one, had it come");
        fs::write(path("other"), "3").unwrap();
        noted(&folder, &mut after, "other", "calm.csv");
        assert_eq!(after.files.len(), 2, "what is gone is forgotten");
    }
}
