//! A cue on its way into the library: into a file that no cue can be, then checked, then put in its place at once. Where
//! anything goes wrong nothing of it stays.

use std::fs::File;
use std::io::{self, Write as _};
use std::sync::atomic::Ordering;

use sha2::{Digest as _, Sha256};

use super::{Awaited, CueId, CueInfo, Library, Verdict, child, file_name, file_problem, hex};
use crate::control::{Code, Problem};
use crate::sys::folder::{Folder, Stamp};
use crate::sys::lock::lock;

/// What the names of unfinished files begin with; no id does.
pub(super) const UNFINISHED: &str = ".upload-";
/// Uploads at a time.
const MOST: usize = 2;

/// A cue that is being uploaded. Dropped, it leaves nothing.
#[derive(Debug)]
pub struct Upload {
    place: UploadPlace,
    id: CueId,
    file: File,
    size: u64,
    hash: Sha256,
}

/// Where it is written to, and its turn among the uploads; both are given back when it is dropped.
#[derive(Debug)]
struct UploadPlace {
    library: Library,
    folder: Folder,
    name: String,
}

impl Drop for UploadPlace {
    fn drop(&mut self) {
        // Where it cannot be removed now, it is at the next start.
        let _ = self.folder.remove(&self.name);
        self.library.inner.uploads.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Upload {
    pub(super) fn begin(library: &Library, id: &CueId) -> Result<Self, Problem> {
        let inner = &library.inner;
        let folder = Folder::open(&inner.dir).map_err(|error| file_problem("open the library", &error))?;
        let taken = inner.uploads.fetch_update(Ordering::AcqRel, Ordering::Acquire, |uploads| {
            (uploads < MOST).then_some(uploads + 1)
        });
        if taken.is_err() {
            let detail = format!("{MOST} cues are being uploaded already");
            return Err(Problem::new(Code::Busy, detail, "try again when they are done"));
        }
        let serial = inner.serial.fetch_add(1, Ordering::Relaxed);
        let name = format!("{UNFINISHED}{}-{serial}", std::process::id());
        let place = UploadPlace { library: library.clone(), folder, name };
        let file = place.folder.create(&place.name).map_err(|error| unwritten(&error))?;
        Ok(Self { place, id: id.clone(), file, size: 0, hash: Sha256::new() })
    }

    /// Takes the next bytes of the file. Blocks while they are written.
    ///
    /// # Errors
    /// [`Problem`] where the file grows over the limit of the library, or the disk does not take it.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Problem> {
        let most = self.place.library.inner.hall.bounds.max_bytes;
        self.size = self.size.saturating_add(bytes.len() as u64);
        if self.size > most {
            let detail = format!("the cue is longer than {} MiB", most >> 20);
            let remedy = "make it smaller, for example as MCAP, or raise max_cue_mib in [library]";
            return Err(Problem::new(Code::Size, detail, remedy));
        }
        self.hash.update(bytes);
        self.file.write_all(bytes).map_err(|error| unwritten(&error))
    }

    /// Has the file checked and proved by a process of the lowest priority, one at a time, and puts it into the library.
    /// Blocks until that is done, minutes for a long cue beside a show, or is awaited no more; not for a thread that others wait for.
    ///
    /// # Errors
    /// [`Problem`] with every fault where the cue is refused; where the check cannot be done, or the disk fails.
    pub fn finish(self, awaited: Option<&Awaited>) -> Result<CueInfo, Problem> {
        let library = self.library().clone();
        let proved = self.prove(awaited)?;
        let _placing = lock(&library.inner.brought);
        proved.put()
    }

    /// Where it goes.
    pub(super) fn library(&self) -> &Library {
        &self.place.library
    }

    /// SHA-256 of what was written so far, hexadecimal.
    pub(super) fn sha256(&self) -> String {
        hex(&self.hash.clone().finalize())
    }

    /// Has it checked and proved.
    pub(super) fn prove(self, awaited: Option<&Awaited>) -> Result<ProvedUpload, Problem> {
        let Self { place, id, file, hash, .. } = self;
        let inner = &place.library.inner;
        file.sync_all().map_err(|error| unwritten(&error))?;
        let print = inner.hall.fingerprint();
        let verdict = {
            let _turn = lock(&inner.proving);
            child::examine(&inner.hall, &place.folder.path(&place.name), awaited)?
        };
        if verdict.sha256 != hex(&hash.finalize()) {
            let detail = "the file changed while it was being checked";
            return Err(Problem::new(Code::File, detail, "upload it again"));
        }
        if !verdict.passed {
            let faults = verdict.lines();
            let detail = format!("the cue {id} is refused: it does not pass");
            let remedy = "correct these faults, or fit it with kinocue fit";
            let code = if verdict.playable { Code::Check } else { Code::Cue };
            return Err(Problem::new(code, detail, remedy).with(faults));
        }
        Ok(ProvedUpload { place, id, print, verdict })
    }
}

/// A cue that has passed, and is not in the library yet. Dropped, it leaves nothing.
pub(super) struct ProvedUpload {
    place: UploadPlace,
    id: CueId,
    print: String,
    verdict: Verdict,
}

impl ProvedUpload {
    /// The name that it gets, and what tells its file from any other, also once it has that name.
    pub(super) fn file(&self) -> Result<(String, Stamp), Problem> {
        let stamp = self.place.folder.stamp(&self.place.name);
        let stamp = stamp.map_err(|error| file_problem("read the cue", &error))?.ok_or_else(gone)?;
        Ok((file_name(&self.id, self.verdict.mcap), stamp))
    }

    /// Puts it into its place, while nobody else does: whoever calls this holds what was brought.
    pub(super) fn put(self) -> Result<CueInfo, Problem> {
        // From the old whole to the new whole: never a name with half a file.
        self.put_by(|folder, from, name, other| {
            folder.rename(from, name).and_then(|()| folder.remove(other)).map_err(|error| unwritten(&error))
        })
    }

    /// The same by what gives it its name, and removes the one of the same cue in the other form.
    pub(super) fn put_by(
        self,
        place_it: impl FnOnce(&Folder, &str, &str, &str) -> Result<(), Problem>,
    ) -> Result<CueInfo, Problem> {
        let Self { place, id, print, verdict } = self;
        let name = file_name(&id, verdict.mcap);
        place_it(&place.folder, &place.name, &name, &file_name(&id, !verdict.mcap))?;
        place.folder.sync().map_err(|error| unwritten(&error))?;
        let stamp = place.folder.stamp(&name).map_err(|error| file_problem("read the cue", &error))?;
        let stamp = stamp.ok_or_else(gone)?;
        let info = CueInfo::new(&id, stamp.size, Some((&verdict, true)));
        lock(&place.library.inner.index).put(&place.folder, &name, stamp, &print, verdict);
        Ok(info)
    }
}

fn gone() -> Problem {
    Problem::new(Code::File, "the cue has disappeared", "upload it again")
}

pub(super) fn unwritten(error: &io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Problem::new(
            Code::File,
            "the disk with the library is full; nothing of the cue is kept",
            "free space, and upload it again",
        ),
        _ => file_problem("write the cue", error),
    }
}
